"""Fixtures for the tests of the scene package."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with models/triangle.obj and a material library for it."""
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "triangle.obj").write_text(
        "mtllib a.mtl\nusemtl green\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    )
    (tmp_path / "models" / "a.mtl").write_text("newmtl green\nKd 0 0.5 0\n")
    return tmp_path
