"""`clrt bench`: the JSON fields that other programs read, and the printed tables."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.bench.combinations import combinations, identities
from clrt.bench.rays.ray_speed import load_rays
from clrt.cli import bench_combinations
from clrt.errors import SceneError

pytestmark = pytest.mark.study

CORNER = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def bench(*arguments: str, cwd: Path) -> tuple[dict[str, Any], str]:
    """Return the figures and the printed output."""
    (cwd / "corner.obj").write_text(CORNER)
    done = subprocess.run(
        [sys.executable, "-m", "clrt", "bench", *arguments, "--quick", "--json", "out.json"],
        cwd=cwd,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads((cwd / "out.json").read_text()), done.stdout


def test_rays_of_a_file(tmp_path: Path) -> None:
    """Rays from (9, 9, 9) toward the corner of a tetrahedron hit, those away from it miss."""
    origins = np.full((2000, 3), 9, np.float32)
    directions = np.where(np.arange(2000)[:, None] % 4 == 0, -1, 1) * np.array([1, 0.99, 0.98], np.float32)
    np.savez(tmp_path / "rays.npz", origins=origins, directions=directions, t_max=np.full(2000, np.inf, np.float32))
    figures, printed = bench("rays", "--mesh", "corner.obj", "--rays", "rays.npz", "--layout", "bvh2", cwd=tmp_path)
    assert {
        "build_seconds",
        "mrays_closest",
        "mrays_any",
        "mrays_closest_call",
        "mrays_any_call",
        "hits",
        "bytes_per_triangle",
    } <= set(figures)
    assert figures["hits"] == 500 and (figures["layout"], figures["triangles"]) == ("bvh2", 4)
    assert figures["mrays_closest"] >= figures["mrays_closest_call"] > 0 and "mrays_any_call" in printed


def test_rays_of_four_kinds(tmp_path: Path) -> None:
    figures, printed = bench("rays", "--mesh", "corner.obj", cwd=tmp_path)
    assert figures["triangles"] == 16
    assert list(figures["kinds"]) == ["primary", "bounce", "shadow", "occluded"]
    for kind, rows in figures["kinds"].items():
        assert set(rows) == set(figures["trees"]) >= {"bvh2", "cwbvh", "packs", "list"}
        assert all(
            {"mrays", "mrays_call", "ratio", "cpu_ratio", "differ", "hits", "rays"} <= set(row) for row in rows.values()
        )
        assert not any(row["differ"] for row in rows.values()) and f"{kind}: " in printed
    assert all(
        {"build_seconds", "tree_seconds", "bytes_per_triangle", "sah_cost", "builder"} <= set(tree)
        for tree in figures["trees"].values()
    )
    assert "time, CPU time (processor time): per ray, over the first line's" in printed


def test_trees_by_size(tmp_path: Path) -> None:
    figures, printed = bench("build", "--mesh", "corner.obj", cwd=tmp_path)
    sizes = [size["triangles"] for size in figures["sizes"]]
    assert sizes == [4 * 4**k + 12 for k in (4, 5, 6)], "the tetrahedron, subdivided, in its room"
    for size in figures["sizes"]:
        assert {"sah", "midpoint"} <= set(size["builders"])
        assert all(
            {"seconds", "first_seconds", "mtriangles", "bytes_per_triangle"} <= set(row)
            for row in size["builders"].values()
        )
    assert list(figures["rays"]["kinds"]) == list(figures["rays"]["fits"]) == ["primary", "bounce", "shadow"]
    assert all(set(fit) == {"a", "b", "r2"} for fit in figures["rays"]["fits"].values())
    assert list(figures["fresh"]) == ["compiled", "cached", "largest"]
    assert all(
        {"tree_seconds", "build_seconds", "answer_seconds", "peak_bytes"} <= set(row)
        for row in figures["fresh"].values()
    )
    assert f"{sizes[-1]} triangles" in printed and "R² = " in printed


def test_hits_that_must_be_the_same(tmp_path: Path) -> None:
    figures, printed = bench("hits", "--device", "cpu", cwd=tmp_path)
    assert [mesh["mesh"] for mesh in figures["meshes"]] == ["icosphere", "bumpy ball", "soup"]
    for mesh in figures["meshes"]:
        assert {way["layout"] for way in mesh["ways"]} >= {"bvh8", "bvh2", "cwbvh", "packs", "list"}
        assert all(list(way["differ"]) == mesh["kinds"] for way in mesh["ways"]) and mesh["rays"] == 4 * 4096
        assert f"float64: {mesh['exact']['wrong']} of {mesh['exact']['rays']} hits impossible" in printed
    assert [mesh["escaped"] for mesh in figures["meshes"]] == [0, 0, None]
    assert {"index", "platform", "driver"} <= set(figures["devices"][0])


def test_random_scenes_obey_a_property(tmp_path: Path) -> None:
    figures, printed = bench("combinations", "--property", "brightness", "--scenes", "1", "--seed", "5", cwd=tmp_path)
    assert (figures["seed"], figures["first"], figures["scenes"]) == (5, 0, 1)
    (found,) = figures["verdicts"]
    assert {
        "property",
        "scene",
        "number",
        "side",
        "rounds",
        "p",
        "difference",
        "mean",
        "noise",
        "dropped",
        "off",
    } == set(found)
    assert (found["property"], found["scene"], found["off"]) == ("brightness", "combination-5-0", False)
    assert re.search(r"^brightness +1 +0", printed, re.M)


def test_all_properties_can_be_chosen() -> None:
    assert bench_combinations.PROPERTIES == tuple(identities.PROPERTIES)


def test_a_violated_property_is_reported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The report names the scene and sets the exit code; the other scene is correct."""
    wrong = combinations.Verdict(
        "brightness", "combination-5-0", 0, "2 times the light", len(combinations.ROUNDS), 1e-12, 0.03, 1.02, 0.001, 0
    )
    monkeypatch.setattr(combinations, "verdicts", lambda *_: iter([wrong, replace(wrong, number=1, p=0.5)]))
    options = ["--property", "brightness", "--scenes", "2", "--seed", "5", "--keep", str(tmp_path)]
    done = CliRunner().invoke(bench_combinations.combinations_command, options)
    assert done.exit_code == 1
    assert "off: brightness, scene 0: 2 times the light: image +2.00% ± 0.10%, one block +3.00%" in done.output
    assert re.search(r"^brightness +2 +1 ", done.output, re.M) and "scene 1" not in done.output
    assert [path.name for path in tmp_path.glob("*.toml")] == ["combination-5-0-brightness-as-it-is-0.toml"]


def stored(path: Path, **arrays: Any) -> Path:
    """Write a file of four rays, with these arrays in place of those that `RayQuery` accepts."""
    np.savez(path, **{"origins": np.zeros((4, 3)), "directions": np.ones((4, 3)), "t_max": np.ones(4)} | arrays)
    return path


def test_rays_are_stored_as_queries_take_them(tmp_path: Path) -> None:
    file = stored(tmp_path / "rays.npz", directions=[0, 0, 1], t_max=1e300)
    for array, expected in zip(load_rays(file), (np.zeros((4, 3)), [[0, 0, 1]] * 4, [np.inf] * 4), strict=True):
        assert array.dtype == np.float32
        np.testing.assert_array_equal(array, expected)


def test_files_without_rays_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "one.npy", np.zeros((4, 3)))
    (tmp_path / "text.npz").write_text("0 0 0 1 1 1\n")
    (tmp_path / "cut.npz").write_bytes(stored(tmp_path / "whole.npz").read_bytes()[:300])
    np.savez(tmp_path / "unlimited.npz", origins=np.zeros((4, 3)), directions=np.ones((4, 3)))
    for file, words in {
        tmp_path / "one.npy": "not an .npz",
        tmp_path / "text.npz": "not an .npz",
        tmp_path / "cut.npz": "not an .npz",
        tmp_path / "none.npz": "No such file",
        tmp_path: "directory",
        tmp_path / "unlimited.npz": "t_max is not",
        stored(tmp_path / "a.npz", origins=np.zeros((0, 3)), directions=np.ones(3), t_max=1): "no rays",
        stored(tmp_path / "b.npz", directions=np.ones((3, 4))): r"directions \(3, 4\) must",
        stored(tmp_path / "c.npz", t_max=np.ones(5)): r"t_max \(5,\): there are 4 origins",
        stored(tmp_path / "d.npz", origins=np.array([None])): "not an .npz",
    }.items():
        with pytest.raises(SceneError, match=f"^{re.escape(str(file))}: .*{words}"):
            load_rays(file)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("rays", "--rays", "r.npz"), 2, ["--rays", "--mesh"]),
        (("rays", "--json", "."), 6, [".: is a folder; choose a file in it\n"]),
        (("build", "--mesh", "missing.ply"), 3, ["missing.ply"]),
        (("hits", "--device", "nonesuch"), 4, ["nonesuch"]),
        (("build", "--json", "no/such/b.json"), 6, ["no/such"]),
    ],
)
def test_mistakes_end_in_one_message(tmp_path: Path, arguments: tuple[str, ...], code: int, words: list[str]) -> None:
    command = [sys.executable, "-m", "clrt", "bench", *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == code and "Traceback" not in done.stderr
    assert not done.stdout and all(word in done.stderr for word in words), done.stderr
