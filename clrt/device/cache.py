"""Program binaries on disk. Whatever is wrong with the cache (absent, read-only, damaged), the answer is a rebuild.

The file of a key holds the SHA-256 of the binary, then the binary, and is put in place by a rename, so readers never
see half of one.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path


def cache_folder() -> Path:
    """Where binaries are kept: $CLRT_CACHE_DIR, or the user's cache folder."""
    if folder := os.environ.get("CLRT_CACHE_DIR"):
        return Path(folder)
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("clrt"))


def read_binary(key: str) -> bytes | None:
    """The binary stored under `key`, or None."""
    try:
        stored = (cache_folder() / f"{key}.bin").read_bytes()
    except (OSError, RuntimeError):
        return None
    digest, binary = stored[:32], stored[32:]
    return binary if hashlib.sha256(binary).digest() == digest else None


def write_binary(key: str, binary: bytes) -> None:
    """Stores `binary` under `key` if that is possible."""
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.sha256(binary).digest() + binary)
        os.replace(temporary, folder / f"{key}.bin")
    except (OSError, RuntimeError):
        return


def clear() -> int:
    """Deletes every stored binary; returns how many there were."""
    stored = list(cache_folder().glob("*.bin"))
    for file in stored:
        file.unlink(missing_ok=True)
    return len(stored)
