"""Shared libraries that tests compile from C."""

from __future__ import annotations

import subprocess
from pathlib import Path
from shutil import which

import pytest


def compile_library(source: Path, library: Path, *options: str) -> Path:
    """The library, compiled; the test is skipped where there is no compiler."""
    if which("gcc") is None:
        pytest.skip("these tests need a C compiler (Debian's packages gcc and libc6-dev)")
    subprocess.run(["gcc", "-shared", "-fPIC", "-w", "-o", library, source, *options], check=True)
    return library
