"""Compiles shared libraries from C for tests, which are marked as needing gcc."""

from __future__ import annotations

import subprocess
from pathlib import Path


def compile_library(source: Path, library: Path, *options: str) -> Path:
    """Compile `source` into the shared library and return its path."""
    subprocess.run(["gcc", "-shared", "-fPIC", "-w", "-o", library, source, *options], check=True)
    return library
