"""glTF files that show a mesh several times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError
from clrt.formats.gltf.reader import read_gltf
from clrt.formats.load_scene import load
from clrt.scene.geometry import instancing
from clrt.scene.geometry.instancing import baked
from clrt.scene.model import Model

from .glb import Gltf, ball

COUNT = 7
RNG = np.random.default_rng(0)
MOVES = RNG.normal(size=(COUNT, 3)).astype(np.float32)
SIZES = RNG.uniform(0.5, 2, (COUNT, 3)).astype(np.float32)
TURNS = RNG.normal(size=(COUNT, 4))


def many(rotation: str = "<f4") -> Gltf:
    """Return a ball whose node, at (0, 10, 0), has instances."""
    gltf = ball()
    turns = TURNS / np.linalg.norm(TURNS, axis=1, keepdims=True)
    if rotation == "<i2":
        quantised = gltf.accessor(np.round(turns * 32767), "<i2", normalized=True)
    attributes = {
        "TRANSLATION": gltf.accessor(MOVES),
        "SCALE": gltf.accessor(SIZES),
        "ROTATION": quantised if rotation == "<i2" else gltf.accessor(TURNS),
    }
    gltf.document["nodes"][0] |= {
        "translation": [0, 10, 0],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}},
    }
    gltf.document |= {"extensionsUsed": ["EXT_mesh_gpu_instancing"], "extensionsRequired": ["EXT_mesh_gpu_instancing"]}
    return gltf


def triangles(model: Model) -> list[NDArray[np.float32]]:
    meshes = model.meshes + [baked(each) for each in model.instances]
    return [mesh.vertices[mesh.faces] for mesh in meshes]


@pytest.mark.parametrize("rotation", ["<f4", "<i2"])
@pytest.mark.parametrize("few", [0, 1 << 16])
def test_instances_of_a_node(rotation: str, few: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are scaled, rotated, translated, and then transformed with the node; meshes of few triangles are baked."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", few)
    model = read_gltf(many(rotation).write(tmp_path / "a.glb"))
    assert (len(model.meshes), len(model.instances)) == ((COUNT, 0) if few else (0, COUNT))
    assert len({id(each.mesh) for each in model.instances}) == (0 if few else 1)
    (plain,) = triangles(read_gltf(ball().write(tmp_path / "b.glb")))
    for i, found in enumerate(triangles(model)):
        expected = (plain * SIZES[i]) @ Rotation.from_quat(TURNS[i]).as_matrix().T + MOVES[i] + [0, 10, 0]
        np.testing.assert_allclose(found, expected, atol=2e-3 if rotation == "<i2" else 1e-5)


def test_nodes_that_share_a_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They become instances, except for one hidden by a scale of 0, which remains a flat mesh."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    gltf = ball()
    gltf.node(mesh=0, translation=[3, 0, 0])
    gltf.node(mesh=0, scale=[0, 0, 0])
    scene = load(gltf.write(tmp_path / "a.glb"))
    (hidden,) = scene.meshes
    assert not hidden.vertices.any() and [each.to_world[0, 3] for each in scene.instances] == [0, 3]
    assert scene.camera.look_at[0] == pytest.approx(1.5, abs=0.2)


def test_a_mesh_table_places_a_files_instances(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """[[instance]] shows all of them again; each one's own matrix is applied first."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    many().write(tmp_path / "a.glb")
    (tmp_path / "s.toml").write_text(
        '[[mesh]]\nname = "crowd"\nfile = "a.glb"\nscale = 2\n[[instance]]\nmesh = "crowd"\ntranslate = [5, 0, 0]\n'
    )
    scene = load(tmp_path / "s.toml")
    assert not scene.meshes and len(scene.instances) == 2 * COUNT
    once = 2 * (MOVES + [0, 10, 0])
    np.testing.assert_allclose(
        [each.to_world[:, 3] for each in scene.instances], np.concatenate([once, once + [5, 0, 0]]), rtol=1e-6
    )


@pytest.mark.parametrize(
    "damage, message",
    [
        ({"TRANSLATION": 2, "SCALE": 0}, "has 7 and 12 transforms; write the same"),
        ({}, "has no transforms"),
        ({"TRANSLATION": 4}, "accessor 4 is VEC4, not VEC3"),
        ({"TRANSLATION": 99}, "accessor 99, but the file has"),
        ({"ROTATION": 5}, "instance 0 has a transform that is not finite"),
    ],
)
def test_damage(damage: dict[str, int], message: str, tmp_path: Path) -> None:
    gltf = many()
    gltf.accessor(np.zeros((COUNT, 4)))
    gltf.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = damage
    with pytest.raises(SceneError, match=message):
        read_gltf(gltf.write(tmp_path / "a.glb"))
