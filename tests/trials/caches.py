"""Starts eight processes on a cold cache, and uses damaged, read-only and missing caches: the image must not change."""

from __future__ import annotations

import hashlib
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from clrt.output.images import read_image

from ..device.test_shared_cache import no_rights, surroundings
from .renders import CORNELL

ROUNDS, PROCESSES, GARBAGE = 5, 8, 10


def trial() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        same: set[str] = set()
        for number in range(ROUNDS):
            same |= pictures(folder, f"cold{number}", PROCESSES)
        yield f"{ROUNDS} times {PROCESSES} processes on a cold cache: {len(same)} picture"
        rng, cache = random.Random(1), folder / "cold0"
        files = [file for file in sorted(cache.rglob("*")) if file.is_file() and "pocl" not in file.parts]
        for _ in range(GARBAGE):
            for file in files:
                file.write_bytes(rng.randbytes(rng.choice((0, 7, 1000))))
            same |= pictures(folder, "cold0", 1)
        yield f"{GARBAGE} times with {len(files)} files of garbage: {len(same)} picture"
        for place in (cache, *cache.rglob("*")):
            os.chmod(place, 0o555 if place.is_dir() else 0o444)
        same |= pictures(folder, "cold0", 1)
        yield f"read-only: {len(same)} picture"
        same |= pictures(folder, None, 1)
        yield f"no home and no cache folder: {len(same)} picture"


def pictures(folder: Path, cache: str | None, count: int) -> set[str]:
    """Return the digests of the images of `count` processes that start together."""
    named = (
        {}
        if cache is None
        else {
            "HOME": str(folder),
            "CLRT_CACHE_DIR": str(folder / cache),
            "POCL_CACHE_DIR": str(folder / cache / "pocl"),
        }
    )
    command = (sys.executable, "-P", "-m", "clrt", "render", str(CORNELL), "--size", "64x64", "--spp", "4", "-q", "-o")
    started = [
        subprocess.Popen(
            [*command, f"{number}.exr"],
            cwd=folder,
            stderr=subprocess.PIPE,
            text=True,
            env=surroundings(TMPDIR=str(folder), **named),
            stdout=subprocess.DEVNULL,
            preexec_fn=no_rights,
        )
        for number in range(count)
    ]
    for process in started:
        _, messages = process.communicate(timeout=600)
        assert process.returncode == 0, messages
    return {hashlib.sha256(read_image(folder / f"{number}.exr").tobytes()).hexdigest() for number in range(count)}
