"""`clrt info`: the lists of a scene's materials and lights."""

from __future__ import annotations

import json
from pathlib import Path

from ..formats.glb import ball
from .test_commands import clrt


def test_info_lists_the_materials_and_lights_of_a_scene(tmp_path: Path) -> None:
    """By name, with the fields that were set; an unnamed material has the name of its object."""
    (tmp_path / "t.pgm").write_bytes(b"P5 1 1 255 \xff")
    (tmp_path / "a.toml").write_text("""
[environment]
color = [1, 1, 1]
strength = 0.5
[materials]
shell = { type = "metallic_roughness", clearcoat = 1, color = { image = "t.pgm" } }
lamp = { type = "diffuse", emission = [3, 2, 1] }
[[light]]
type = "point"
position = [0, 2, 0]
intensity = [1, 2, 3]
[[light]]
type = "goniometric"
position = [0, 3, 0]
intensity = [1, 1, 1]
image = "t.pgm"
[[sphere]]
name = "plain"
[[sphere]]
name = "bulb"
center = [3, 0, 0]
material = "lamp"
[[mesh]]
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
uv = [[0, 0], [1, 0], [0, 1]]
material = "shell"
""")
    lines = clrt("info", "a.toml", cwd=tmp_path).stdout.splitlines()
    assert [line.split(maxsplit=1)[1] for line in lines if line.startswith(("material ", "light "))] == [
        '"shell": metallic_roughness, clearcoat, color (texture)',
        '"lamp": diffuse, emission',
        '"plain": diffuse',
        "point: position 0 2 0, intensity 1 2 3",
        "goniometric: position 0 3 0, intensity 1 1 1, image t.pgm (1x1), direction 0 0 1, up 0 1 0",
        "environment: color 1 1 1, strength 0.5",
        'sphere "bulb": radiance 3 2 1',
    ]
    found = json.loads(clrt("info", "a.toml", "--json", cwd=tmp_path).stdout)
    assert found["mesh_list"][0] == {"name": "mesh", "triangles": 1, "uv_sets": 1}
    assert found["material_list"][0] == {
        "name": "shell",
        "type": "metallic_roughness",
        "set": ["clearcoat"],
        "textured": ["color"],
    }
    assert found["light_list"][3] == {"type": "sphere", "name": "bulb", "radiance": [3, 2, 1]}


def test_info_lists_a_sky_by_where_its_sun_is(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(
        "[sky]\nsun_direction = [1, 1, 0]\nturbidity = 2.5\nsky_strength = 2\n[[sphere]]\n"
    )
    lines = clrt("info", "a.toml", cwd=tmp_path).stdout.splitlines()
    sun, sky = (line.split(maxsplit=1)[1] for line in lines if line.startswith("light "))
    assert sun.startswith("directional: direction -0.7071 -0.7071 0, irradiance ") and "angle_degrees 0.5358" in sun
    assert sky == "sky: sun_elevation_degrees 45, sun_azimuth_degrees 90, turbidity 2.5, strength 2"


def test_info_lists_the_extensions_of_a_model_and_what_is_left_out(tmp_path: Path) -> None:
    """Supported extensions by name; others with the reason. A required one can be ignored by name."""
    gltf = ball()
    gltf.document["extensionsUsed"] = ["KHR_materials_ior", "KHR_mesh_quantization", "EXT_new"]
    gltf.document["extensionsRequired"] = ["EXT_other"]
    gltf.write(tmp_path / "a.glb")
    refused = clrt("info", "a.glb", cwd=tmp_path)
    assert refused.returncode and "--ignore-extension EXT_other" in refused.stderr
    lines = clrt("info", "a.glb", "--ignore-extension", "EXT_other", cwd=tmp_path).stdout.splitlines()
    found = dict(line.split(maxsplit=1) for line in lines if " " in line)
    assert found["extensions"] == "KHR_materials_ior KHR_mesh_quantization"
    assert found["left_out"] == "the extension EXT_new: is not supported; the extension EXT_other: is not supported"
