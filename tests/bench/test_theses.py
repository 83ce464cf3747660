"""The theses' experiments: figures, scenes, and output."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clrt.bench.rays.workloads import Mesh, joined
from clrt.bench.theses.experiments import DEPTHS, QUICK, Models, experiments, measure_theses
from clrt.bench.theses.figures import column, dragon, statue, tree, tube, write_models
from clrt.bench.theses.thesis_scenes import GLASS, dragon_scene, hall, tree_scene
from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.formats.models import read_model
from clrt.rendering.renderer import Renderer
from clrt.scene.validation.validate import scene_problems

MODELS = Path(__file__).parents[2] / "scenes" / "models"
FIGURES = {
    "dragon": (dragon(), 19_332),
    "wood": (tree()[0], 84),
    "leaves": (tree()[1], 180),
    "statue": (statue(1), 27_920),
    "column": (column(1), 3_924),
}


@pytest.mark.parametrize("name", FIGURES)
def test_figures_are_closed_and_face_outward(name: str) -> None:
    """Every edge has two triangles with opposite orientation; the enclosed volume is positive."""
    (vertices, faces), count = FIGURES[name]
    assert len(faces) == count and faces.min() == 0 and faces.max() == len(vertices) - 1
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    there, back = edges @ [len(vertices), 1], edges @ [1, len(vertices)]
    assert len(np.unique(there)) == len(there) and np.array_equal(np.sort(there), np.sort(back))
    a, b, c = vertices[faces].astype(np.float64).transpose(1, 0, 2)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0 and np.all(np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0)


def test_a_straight_tube_is_a_prism() -> None:
    """The volume follows from the area of the regular polygon and two flat pyramids at the ends."""
    (vertices, faces), sides = tube([(0, 0, 0), (0, 0, 4)], [0.5, 0.5], 9, 12), 12
    a, b, c = vertices[faces].astype(np.float64).transpose(1, 0, 2)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    polygon = sides / 2 * 0.5**2 * np.sin(2 * np.pi / sides)
    assert len(faces) == 2 * 9 * sides and volume == pytest.approx(polygon * (4 + 2 * 0.25 / 3), rel=1e-5)


def test_the_models_that_ship_are_these(tmp_path: Path) -> None:
    write_models(tmp_path)
    for name in ("dragon.ply", "tree.obj"):
        ours, shipped = (
            joined([(mesh.vertices, mesh.faces) for mesh in read_model(folder / name).meshes])
            for folder in (tmp_path, MODELS)
        )
        np.testing.assert_allclose(ours[0], shipped[0], atol=1e-6)
        np.testing.assert_array_equal(ours[1], shipped[1])
    assert {mesh.material_name for mesh in read_model(MODELS / "tree.obj").meshes} == {"wood", "leaves"}


def test_scenes_are_of_the_size_that_the_theses_name() -> None:
    counts = [sum(len(mesh.faces) for mesh in scene.meshes) for scene in (dragon_scene(), tree_scene(), hall(1))]
    assert counts == [19_332 + 2, 264 + 2, 27_920 + 4 * 3_924 + 3 * 2]
    assert len(statue()[1]) == 448_880 and len(statue()[1]) + 4 * len(column()[1]) == pytest.approx(7e5, rel=1e-3)
    for scene in (dragon_scene(MODELS / "spot.obj"), tree_scene(MODELS / "tree.obj"), hall(1, MODELS / "spot.obj")):
        first = scene.meshes[0]
        assert not scene_problems(scene) and first.vertices[:, 1].min() == pytest.approx(0, abs=1e-6)
        assert np.ptp(np.concatenate([mesh.vertices for mesh in scene.meshes[:-5]] or [first.vertices], 0)) < 8


def test_mirrors_show_more_by_depth_and_ever_less_of_it(device: Device) -> None:
    """Each further bounce adds rays, but fewer than the previous one: only those still between the mirrors."""
    rays = []
    for depth in (1, 2, 4, 7, 12):
        scene = hall(1, mirrors=True, figure=GLASS)
        renderer = Renderer(scene, device=device.info.index, size=(64, 36), max_depth=depth + 1)
        *_, state = renderer.passes(spp=4)
        rays.append(state.film.rays)
    more = np.diff(rays) / np.diff([1, 2, 4, 7, 12])
    assert np.all(more > 0) and np.all(np.diff(more) < 0)


def test_every_row_of_the_theses_is_there() -> None:
    """The theses' published figures are included, by the name of the experiment."""
    found: dict[str, list[float]] = {
        experiment.name: [1 / variant.theirs for variant in experiment.variants if variant.theirs]
        for experiment in experiments(QUICK)
    }
    rastered: dict[str, list[float]] = {"shadows": [540], "mirrors": [530]} if len(found["shadows"]) > 1 else {}
    expected: dict[str, list[float]] = {
        "dragon": [1 / 0.01954, 1 / 0.697],
        "tree": [1 / 0.00776, 1 / 0.06],
        "shadows": [537],
        "mirrors": [446, 440, 435],
        "mirror": [215, 187, 174],
        "far": [300, 277, 268],
    }
    for name, values in expected.items():
        assert found[name] == pytest.approx(values + rastered.get(name, []))


def test_figures_of_frames(device: Device) -> None:
    """Figures of a small dragon scene: rays are scaled to the whole image if only a part was rendered."""
    effort = QUICK._replace(smaller=40, rounds=2)
    result = next(measure_theses(effort, device=device.info.index))
    rows = result["rows"]
    assert result["triangles"] == 19_334 and result["size"] == (55, 33)
    assert rows["with a tree"]["samples"] == 6 * 55 * 33 and rows["with a tree"]["frames"] in (1, 2)
    for name, row in rows.items():
        assert row["seconds"] > 0 and row["frames_per_second"] == 1 / row["seconds"]
        assert row["layout"] == (
            "list"
            if name.startswith("without") and "eight" not in name
            else "packs"
            if "eight" in name
            else device.layout
        )
        assert 1.2 < row["rays"] / row["samples"] < 4
    assert rows["without, 2 bounces, 1 ray"]["rays"] < rows["without"]["rays"] / 4
    assert [ratio["theirs"] for ratio in result["ratios"]] == [None, None, pytest.approx(697 / 19.54), None]
    first = result["ratios"][0]
    assert first["ours"] == rows["without"]["seconds"] / rows["with a tree"]["seconds"]


def test_command_prints_draws_and_stores_figures(tmp_path: Path) -> None:
    program = f"""
import clrt.bench.theses.experiments as theses
theses.QUICK = theses.QUICK._replace(smaller=40, rounds=1)
from clrt.cli import main
main(["bench", "theses", "--quick", "--tree", {str(MODELS / "tree.obj")!r}, "--json", "t.json", "--plot", "t.png"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    written = json.loads((tmp_path / "t.json").read_text())
    names = [experiment["name"] for experiment in written["experiments"]]
    assert names == ["dragon", "tree", "shadows", "mirrors", "mirror", "far"] and written["quick"]
    assert written["models"] == {"dragon": None, "tree": str(MODELS / "tree.obj"), "statue": None}
    depths = [row["depth"] for row in written["experiments"][4]["rows"].values() if row["depth"]]
    assert depths == list(DEPTHS)
    assert "theirs: Radeon RX 9070 XT" in done.stdout and "theirs 35.67" in done.stdout
    assert done.stdout.splitlines()[-2:] == ["t.json", "t.png"] and (tmp_path / "t.png").stat().st_size > 10_000


def test_mistakes_end_in_one_message(tmp_path: Path) -> None:
    for arguments, code, words in [
        (["--json", "no/t.json"], 6, "no/t.json"),
        (["--dragon", "no.ply"], 3, "no.ply"),
        (["--device", "nonesuch"], 4, "nonesuch"),
    ]:
        done = subprocess.run(
            [sys.executable, "-m", "clrt", "bench", "theses", *arguments], cwd=tmp_path, text=True, capture_output=True
        )
        assert done.returncode == code and words in done.stderr and "Traceback" not in done.stderr


def test_shipped_scenes_show_them() -> None:
    for name, count in (("dragon", 19_334), ("tree", 266)):
        scene = load(MODELS.parent / f"{name}.toml")
        assert sum(len(mesh.faces) for mesh in scene.meshes) == count and scene.animation is not None


def test_models_stand_for_the_figures() -> None:
    scenes = [experiment.variants[0].scene for experiment in experiments(QUICK, Models(statue=MODELS / "spot.obj"))]
    cow: Mesh = joined([(mesh.vertices, mesh.faces) for mesh in read_model(MODELS / "spot.obj").meshes])
    assert [len(scene.meshes[0].faces) == len(cow[1]) for scene in scenes] == [False, False, True, True, True, True]
