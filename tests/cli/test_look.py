"""`--look` and `--turntable-turns`."""

from __future__ import annotations

from pathlib import Path

import pytest

import clrt as package

from .test_commands import clrt


@pytest.fixture
def wedge(tmp_path: Path) -> Path:
    (tmp_path / "wedge.obj").write_text("v 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    return tmp_path / "wedge.obj"


def test_looks(wedge: Path) -> None:
    assert "look          none" in clrt("info", wedge, "--look", "none", cwd=wedge.parent).stdout
    clrt("render", wedge, "--look", "sky", "--size", "8x6", "--spp", "1", "-q", "-o", "sky.exr", cwd=wedge.parent)
    expected = package.render(package.load(wedge, look="sky", size=(8, 6)), spp=1).pixels
    assert (package.read_image(wedge.with_name("sky.exr")) == expected).all()


def test_the_object_of_a_turntable_turns(wedge: Path) -> None:
    turning = "render", wedge, "--turntable-turns", "object", "--size", "8x8", "--spp", "1", "-q", "-o", "t_#.exr"
    clrt(*turning, "--turntable", "2", cwd=wedge.parent)
    around = package.turntable(package.load(wedge, size=(8, 8)), 2, turns="object")
    still = dict(package.frames(around))[1]
    assert (package.read_image(wedge.with_name("t_1.exr")) == package.render(still, spp=1).pixels).all()
    refused = clrt(*turning, cwd=wedge.parent)
    assert refused.returncode == 2
    assert "--turntable-turns is what a turntable turns; add --turntable N" in refused.stderr
