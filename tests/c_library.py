"""Shared libraries that tests compile from C. Such tests are marked as needing gcc."""

from __future__ import annotations

import subprocess
from pathlib import Path


def compile_library(source: Path, library: Path, *options: str) -> Path:
    """The library, compiled."""
    subprocess.run(["gcc", "-shared", "-fPIC", "-w", "-o", library, source, *options], check=True)
    return library
