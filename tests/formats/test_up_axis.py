"""Up axes and units: by option, in a scene file, and as files and formats say."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.cli.convert import command as convert
from clrt.errors import SceneError, UsageError
from clrt.formats.load_scene import load
from clrt.formats.up_axis import upright
from clrt.scene.axes_and_units import Axis

from .glb import Gltf
from .test_gltf import cameras

POINTS = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]


def ply(path: Path, comment: str = "") -> Path:
    """A tetrahedron with edges of 1, 2 and 3 along the axes."""
    comments = f"comment {comment}\n" if comment else ""
    head = f"ply\nformat ascii 1.0\n{comments}element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    faces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    path.write_text(f"{head}element face 4\nproperty list uchar int vertex_index\nend_header\n{rows}{faces}")
    return path


@pytest.mark.parametrize("axis", get_args(Axis))
def test_the_axis_that_points_up(axis: Axis) -> None:
    """It becomes +Y, by a rotation without rounding; with +Z up −Y becomes the front, +Z."""
    turn = upright(axis)
    along = np.eye(4)["xyz".index(axis)]
    np.testing.assert_array_equal(turn @ along, [0, 1, 0, 0])
    assert np.linalg.det(turn) == 1 and set(turn.ravel()) <= {0, 1, -1}
    front = np.array([0, -1, 0, 0] if axis == "z" else [0, 0, 1, 0])
    np.testing.assert_array_equal(turn @ front, [0, 0, 1, 0])


def test_options_and_scene_files_agree(tmp_path: Path) -> None:
    """`clrt convert` remembers axis and unit; the scene file's other keys come after them."""
    model, scene = ply(tmp_path / "a.ply"), tmp_path / "a.toml"
    plain = load(model).meshes[0].vertices
    np.testing.assert_array_equal(plain, POINTS)
    bare = load(model, up="z", unit="in")
    np.testing.assert_allclose(bare.meshes[0].vertices, plain[:, [0, 2, 1]] * [0.0254, 0.0254, -0.0254], rtol=1e-6)
    done = CliRunner().invoke(convert, [str(model), str(scene), "--up", "z", "--unit", "in"])
    assert done.exit_code == 0, done.output
    assert 'up = "z"\nunit = "in"\n' in scene.read_text()
    again = load(scene)
    np.testing.assert_array_equal(again.meshes[0].vertices, bare.meshes[0].vertices)
    assert again.camera == bare.camera
    scene.write_text('[[mesh]]\nfile = "a.ply"\nup = "z"\ntranslate = [0, 10, 0]\nscale = 2\n')
    np.testing.assert_allclose(load(scene).meshes[0].vertices, plain[:, [0, 2, 1]] * [2, 2, -2] + [0, 10, 0])


def test_cameras_of_a_model_turn_with_it(tmp_path: Path) -> None:
    model: Gltf = cameras()
    path = model.write(tmp_path / "a.glb")
    plain, turned = load(path).cameras, load(path, up="z").cameras
    for name in plain:
        x, y, z = plain[name].position
        np.testing.assert_allclose(turned[name].position, (x, z, -y))


def test_survey_coordinates_stand_upright(tmp_path: Path) -> None:
    """A comment that names a coordinate reference system says that z is the height; others say nothing."""
    heights = load(ply(tmp_path / "a.ply", "crs EPSG:32633")).meshes[0].vertices[:, 1]
    assert heights.max() == 3
    assert load(tmp_path / "a.ply", up="y").meshes[0].vertices[:, 1].max() == 2
    assert load(ply(tmp_path / "b.ply", "a crs of none")).meshes[0].vertices[:, 1].max() == 2


def test_misspelled_axes_and_units(tmp_path: Path) -> None:
    ply(tmp_path / "a.ply")
    (tmp_path / "a.toml").write_text('[[mesh]]\nfile = "a.ply"\nup = "w"\nunit = "mmm"\n')
    with pytest.raises(SceneError) as caught:
        load(tmp_path / "a.toml")
    up, unit = caught.value.problems
    assert 'mesh[0].up: "w"' in up and 'mesh[0].unit: "mmm"' in unit
    with pytest.raises(UsageError, match=r'a.toml: up and unit are for model files; in a scene file, write up = "z"'):
        load(tmp_path / "a.toml", up="z")
    with pytest.raises(UsageError, match="up 'w' is unknown; choose from x, y, z"):
        load(tmp_path / "a.ply", up="w")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="unit 3 is unknown; choose from m, cm, mm, in, ft"):
        load(tmp_path / "a.ply", unit=3)  # type: ignore[arg-type]
