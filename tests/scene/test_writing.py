"""A scene file written for a model shows what the model shows."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from clrt.errors import SceneError
from clrt.rendering.choices import Choices
from clrt.rendering.identity import facts_of
from clrt.scene.file import load
from clrt.scene.materials import Diffuse
from clrt.scene.writing import scene_text
from .glb import Gltf, ball
from .test_gltf import cameras

OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0.1\nv 0 0.7 0\nf 1 2 3\n" + "".join(
    f"usemtl {name}\nf 1 2 3\n" for name in ("red", 'odd "name" \\ # é', "lost", "model", "lamp"))
MTL = """newmtl red
Kd 0.9 0.1 0.05
newmtl odd "name" \\ # é
Kd 0.1 0.2 0.3
Ks 1 1 1
Ns 1234.5
newmtl model
Kd 1 0 0
newmtl lamp
Ke 1e-7 12 1e20
"""


def shaded() -> Gltf:
    """Four balls: of two materials that share a name, of none, and of one whose texture differs with its vertices."""
    gltf = ball()
    gltf.document["materials"] = [{"name": "twin", "pbrMetallicRoughness": {"metallicFactor": 0.1}}, {"name": "twin"},
                                  {"pbrMetallicRoughness": {"roughnessFactor": 1 / 3}, "emissiveFactor": [1, 0, 0]}]
    primitive = gltf.document["meshes"][0]["primitives"][0]
    for material in (0, 1, 2):
        gltf.mesh(**primitive, material=material)
    return gltf


@pytest.mark.parametrize("kind", ["obj", "glb", "cameras", "off"])
def test_round_trip(kind: str, tmp_path: Path) -> None:
    """The scene that is read back shares with the model's all that makes a picture."""
    model = tmp_path / "my models é" / f"a.{'glb' if kind == 'cameras' else kind}"
    model.parent.mkdir()
    (model.parent / "a.mtl").write_text(MTL)
    if kind == "obj":
        model.write_text(OBJ)
    elif kind == "off":
        model.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0.3\n3 0 1 2\n")
    else:
        (shaded() if kind == "glb" else cameras()).write(model)
    scene = load(model)
    text = scene_text(scene, "my models é/a" + model.suffix)
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    again = load(tmp_path / "a.toml")
    assert facts_of(again, Choices()) == facts_of(scene, Choices())
    assert again.cameras == scene.cameras
    if kind == "obj":
        assert set(tomllib.loads(text)["materials"]) == {"red", 'odd "name" \\ # é', "lost", "model", "lamp"}
        assert '# The file\'s own: "model"' in text
    if kind == "cameras":
        assert '# or, instead of the lines above: name = "side 2"' in text


def test_some_of_a_file_s_materials_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "a.mtl").write_text(MTL)
    scene = tmp_path / "a.toml"
    head = '[materials.white]\ntype = "diffuse"\ncolor = [1, 1, 1]\n[[mesh]]\nfile = "a.obj"\n'
    scene.write_text(head + 'materials = { red = "white" }\n')
    found = {mesh.name: mesh.material for mesh in load(scene).meshes}
    assert found["red"] == Diffuse(color=(1, 1, 1)) and found["model"] == Diffuse(color=(1, 0, 0))
    scene.write_text(head + 'material = "white"\nmaterials = { read = "white", red = "whit" }\n')
    with pytest.raises(SceneError) as caught:
        load(scene)
    assert caught.value.problems == [
        f"{scene}: mesh[0]: has a material and materials; keep one of them",
        f'{scene}: mesh[0].materials: "read" is unknown; did you mean "red"?',
        f'{scene}: mesh[0].materials.material: "whit" is unknown; did you mean "white"?']
    scene.write_text(head + "materials = 3\n[environment]\nsky = 1\ncolor = [1, 1, 1]\n")
    with pytest.raises(SceneError) as caught:
        load(scene)
    assert caught.value.problems == [
        f'{scene}: environment.sky: 1 is unknown; write "default"',
        f"{scene}: environment: has a sky and color; keep one of them",
        f'{scene}: mesh[0].materials: 3 is not a table; write {{ "name in the file" = "NAME" }}']
