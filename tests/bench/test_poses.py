"""`clrt bench poses`: its measures by a known displacement, without other programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.bench.renderers.pose_agreement import judge
from clrt.bench.renderers.pose_peers import POSERS, Doubles, peers
from clrt.cli.bench_poses import poses_command
from clrt.errors import UsageError
from clrt.formats.model_choice import ModelChoice
from clrt.formats.models import read_model

from ..formats.glb import ball
from ..formats.test_gltf_animations import animated


def ours(path: Path, animation: int, times: Sequence[float]) -> Iterator[Doubles]:
    for time in times:
        (mesh,) = read_model(path, choice=ModelChoice(animation=animation, time=time)).meshes
        yield mesh.vertices.astype(np.float64)


def test_measures_are_those_of_a_displacement(tmp_path: Path) -> None:
    """One vertex of a right triangle of diagonal √2 moves by .1 out of its box, or into it."""
    path = animated().write(tmp_path / "a.glb")

    def displaced(path: Path, animation: int, times: Sequence[float]) -> Iterator[Doubles]:
        for vertices in ours(path, animation, times):
            yield vertices + np.outer(vertices[:, 1] == vertices[:, 1].max(), [0, 0.1 if animation else -0.1, 0])

    found = list(judge(path, 4, {"same": ours, "displaced": displaced}))
    assert [(each.animation, each.peer) for each in found] == [
        (name, peer) for name in ("walk", "animation 1") for peer in ("same", "displaced")
    ]
    assert all(each.points == each.box == 0 for each in found[::2])
    assert found[1].points == pytest.approx(0.1 / 2**0.5, rel=1e-5) and found[1].poses == 2
    assert found[1].box == pytest.approx(found[1].points)


def test_programs_that_are_missing_or_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = animated().write(tmp_path / "a.glb")

    def refuses(*_: object) -> Iterator[Doubles]:
        raise UsageError("no triangles")

    assert [each.problem for each in judge(path, 2, {"x": refuses})] == ["no triangles"] * 2
    (tmp_path / "b.gltf").write_text("{}")
    assert "asset" in next(judge(tmp_path / "b.gltf", 2, {})).problem
    for module, _ in POSERS.values():
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UsageError, match="run pip install scipy, and bpy"):
        peers()


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path: Path = animated().write(tmp_path / "a.glb")
    monkeypatch.setattr("clrt.bench.renderers.pose_peers.POSERS", {"Python": ("numpy", ours)})
    done = CliRunner().invoke(poses_command, [str(path), "--json", str(tmp_path / "a.json")])
    assert done.exit_code == 0, done.exception
    rows = json.loads((tmp_path / "a.json").read_text())["rows"]
    assert [row["points"] for row in rows] == [0, 0] and "walk" in done.output and "0.0e+00" in done.output


def test_files_without_animation(tmp_path: Path) -> None:
    assert list(judge(ball().write(tmp_path / "a.glb"), 2, {"x": ours})) == []
