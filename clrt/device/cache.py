"""Files kept between runs: program binaries, what is known of devices and drivers, and reference pictures.

Whatever is wrong with the folder (absent, read-only, damaged), a file is not there, and what it held is made anew.
Files are put in place by a rename, so readers never see half of one; a binary follows its SHA-256.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

#: The names of scenes' reference pictures (study/reference.py).
REFERENCES = "reference-*.npz"


def cache_folder() -> Path:
    """Where files are kept: $CLRT_CACHE_DIR, or the user's cache folder."""
    if folder := os.environ.get("CLRT_CACHE_DIR"):
        return Path(folder)
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("clrt"))


def read_file(name: str) -> bytes | None:
    """What is kept under `name`, or None."""
    try:
        return (cache_folder() / name).read_bytes()
    except (OSError, RuntimeError):
        return None


def write_file(name: str, content: bytes) -> bool:
    """Keeps `content` under `name`; False where that is not possible."""
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(temporary, folder / name)
        return True
    except (OSError, RuntimeError):
        return False


def read_binary(key: str) -> bytes | None:
    """The binary stored under `key`, or None."""
    stored = read_file(f"{key}.bin") or b""
    digest, binary = stored[:32], stored[32:]
    return binary if hashlib.sha256(binary).digest() == digest else None


def write_binary(key: str, binary: bytes) -> None:
    """Stores `binary` under `key` if that is possible."""
    write_file(f"{key}.bin", hashlib.sha256(binary).digest() + binary)


def clear(pattern: str = "*.bin") -> int:
    """Deletes every stored binary, or what else `pattern` names; returns how many files there were."""
    deleted = 0
    for file in cache_folder().glob(pattern):
        try:
            file.unlink(missing_ok=True)
            deleted += 1
        except OSError:
            continue  # a folder in its place, or not ours to delete
    return deleted
