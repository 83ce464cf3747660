"""The least recently used programs kept between test runs are deleted."""

from __future__ import annotations

import os
from pathlib import Path

from .program_cache import remove_oldest


def test_least_recently_used_programs_are_deleted(tmp_path: Path) -> None:
    """Programs, and the kernels stored next to them, are deleted with all their files."""
    for age, name in enumerate(("AB/NEWEST", "path_1f", "AB/OLD", "BC/OLDEST")):
        for file in ("program.bc", "kernel/8-1-1/kernel.so"):
            path = tmp_path / name / file
            path.parent.mkdir(parents=True)
            path.write_bytes(bytes(100))
            os.utime(path, (1e9 - age, 1e9))
    left = {800: 4, 799: 3, 600: 3, 599: 2, 200: 1, 199: 0}
    for most, count in left.items():
        remove_oldest(tmp_path, most)
        assert [
            (tmp_path / name / "program.bc").exists() for name in ("AB/NEWEST", "path_1f", "AB/OLD", "BC/OLDEST")
        ] == [True] * count + [False] * (4 - count)
    remove_oldest(tmp_path / "absent", 0)
