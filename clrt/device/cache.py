"""Files kept between runs: program binaries, what is known of devices and drivers, reference pictures, the last logs.

Whatever is wrong with the folder (absent, read-only, damaged), a file is not there, and what it held is made anew.
Files are put in place by a rename, so readers never see half of one; a binary follows its SHA-256.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path

#: The names of scenes' reference pictures (study/reference.py).
REFERENCES = "reference-*.npz"
#: What is kept, and the names of its files.
KINDS = {"programs": "*.bin", "reference pictures": REFERENCES, "probes of drivers": "*.driver.json",
         "checks of devices": "*.check.json", "speeds of devices": "*.bench.json", "loop limits": "*.loops.json",
         "logs": "last-*.log", "unfinished files": "unfinished-*"}


def cache_folder() -> Path:
    """Where files are kept: $CLRT_CACHE_DIR, or the user's cache folder."""
    if folder := os.environ.get("CLRT_CACHE_DIR"):
        return Path(folder)
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("clrt"))


def can_keep() -> bool:
    """Whether files can be written there."""
    with suppress(OSError, RuntimeError):
        cache_folder().mkdir(parents=True, exist_ok=True)
        return os.access(cache_folder(), os.W_OK)
    return False


def read_file(name: str) -> bytes | None:
    """What is kept under `name`, or None."""
    try:
        return (cache_folder() / name).read_bytes()
    except (OSError, RuntimeError):
        return None


def write_file(name: str, content: bytes, mode: int = 0o600) -> bool:
    """Keeps `content` under `name`; False where that is not possible."""
    try:
        folder = (cache_folder() / name).parent
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder, prefix="unfinished-")
    except (OSError, RuntimeError):
        return False
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, mode)
        os.replace(temporary, cache_folder() / name)
        return True
    except OSError:
        with suppress(OSError):
            os.unlink(temporary)
        return False


def read_binary(key: str) -> bytes | None:
    """The binary stored under `key`, or None."""
    stored = read_file(f"{key}.bin") or b""
    digest, binary = stored[:32], stored[32:]
    return binary if hashlib.sha256(binary).digest() == digest else None


def write_binary(key: str, binary: bytes) -> None:
    """Stores `binary` under `key` if that is possible."""
    write_file(f"{key}.bin", hashlib.sha256(binary).digest() + binary)


def keep_log(kind: str, text: str) -> None:
    """Keeps the last log of its kind, "build" or "error", if that is possible, for `clrt doctor`."""
    when = datetime.now(timezone.utc).isoformat(timespec="seconds")
    write_file(f"last-{kind}.log", f"{when}\n{text}\n".encode(errors="replace"))


def kept_logs() -> dict[str, str]:
    """The logs that are kept, by their kind."""
    logs = {kind: read_file(f"last-{kind}.log") for kind in ("build", "error")}
    return {kind: log.decode(errors="replace") for kind, log in logs.items() if log}


def sizes() -> dict[str, tuple[int, int]]:
    """How many files of each of KINDS there are, and their bytes."""
    found = {}
    for kind, pattern in KINDS.items():
        bytes_each = []
        with suppress(OSError):
            bytes_each = [file.stat().st_size for file in cache_folder().glob(pattern)]
        found[kind] = len(bytes_each), sum(bytes_each)
    return found


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
