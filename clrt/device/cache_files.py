"""Files cached between runs: program binaries, facts about devices and drivers, reference images, the last logs.

If the folder is missing, read-only or damaged, files are treated as absent and their contents are made again. Files are
put in place by a rename, so readers never see a partial one; a binary is preceded by its SHA-256.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

#: File names of scenes' reference images (bench/convergence/reference.py).
REFERENCES = "reference-*.npz"
#: File name patterns by kind of content.
KINDS = {
    "programs": "*.bin",
    "reference pictures": REFERENCES,
    "probes of drivers": "*.driver.json",
    "checks of devices": "*.check.json",
    "speeds of devices": "*.bench.json",
    "tunings of devices": "*.tuning.json",
    "loop limits": "*.loops.json",
    "code for GPUs": "*.gpu.json",
    "logs": "last-*.log",
    "unfinished files": "unfinished-*",
}


def cache_folder() -> Path:
    """Return the cache folder: $CLRT_CACHE_DIR, or the user's."""
    if folder := os.environ.get("CLRT_CACHE_DIR"):
        return Path(folder)
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("clrt"))


def can_keep() -> bool:
    """Return whether files can be written to the cache folder."""
    with suppress(OSError, RuntimeError):
        cache_folder().mkdir(parents=True, exist_ok=True)
        return os.access(cache_folder(), os.W_OK)
    return False


def read_file(name: str) -> bytes | None:
    """Return the contents of the file `name`, or None."""
    try:
        return (cache_folder() / name).read_bytes()
    except (OSError, RuntimeError):
        return None


def write_file(name: str, content: bytes, mode: int = 0o600) -> bool:
    """Store `content` as the file `name`; return False if that is not possible."""
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
    """Return the binary stored under `key`, or None."""
    stored = read_file(f"{key}.bin") or b""
    digest, binary = stored[:32], stored[32:]
    return binary if hashlib.sha256(binary).digest() == digest else None


def write_binary(key: str, binary: bytes) -> None:
    """Store `binary` under `key` if possible."""
    write_file(f"{key}.bin", hashlib.sha256(binary).digest() + binary)


def keep_log(kind: str, text: str) -> None:
    """Store the last log of its kind ("build" or "error") for `clrt doctor`, if possible."""
    when = datetime.now(UTC).isoformat(timespec="seconds")
    write_file(f"last-{kind}.log", f"{when}\n{text}\n".encode(errors="replace"))


def kept_logs() -> dict[str, str]:
    """Return the stored logs by kind."""
    logs = {kind: read_file(f"last-{kind}.log") for kind in ("build", "error")}
    return {kind: log.decode(errors="replace") for kind, log in logs.items() if log}


def sizes() -> dict[str, tuple[int, int]]:
    """Return the number of files and their total bytes for each of KINDS."""
    found = {}
    for kind, pattern in KINDS.items():
        bytes_each = []
        with suppress(OSError):
            bytes_each = [file.stat().st_size for file in cache_folder().glob(pattern)]
        found[kind] = len(bytes_each), sum(bytes_each)
    return found


def clear(pattern: str = "*.bin") -> int:
    """Delete the files that match `pattern`, by default all binaries; return how many were deleted."""
    deleted = 0
    for file in cache_folder().glob(pattern):
        try:
            file.unlink(missing_ok=True)
            deleted += 1
        except OSError:
            continue  # it is a folder, or may not be deleted
    return deleted
