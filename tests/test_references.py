"""Reference scenes: the loaded scene matches the JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.output.images import write_image
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness, Mirror

from .references import load_reference

RECORD: dict[str, Any] = {
    "name": "mix",
    "camera": {"origin": [0, 1, 5], "target": [0, 1, 0], "up": [0, 1, 0], "fov": 30, "width": 4, "height": 4},
    "max_depth": 6,
    "materials": {
        "grey": {"type": "diffuse", "color": [0.5, 0.5, 0.5]},
        "brass": {"type": "metal", "color": [0.9, 0.65, 0.35], "roughness": 0.5},
        "white": {"type": "ggx", "color": [1, 1, 1], "alpha": 0.36},
        "tint": {"type": "mirror", "color": [0.5, 0.7, 0.9]},
        "glass": {"type": "glass", "ior": 1.5},
    },
    "shapes": [{"type": "mesh", "file": "floor.ply", "material": "brass", "emission": [3, 2, 1]}]
    + [
        {"type": "sphere", "center": [i, 0, 0], "radius": 0.5, "material": material}
        for i, material in enumerate(["grey", "brass", "white", "tint"])
    ],
    "lights": [{"type": "point", "position": [0, 3, 0], "intensity": [10, 8, 6]}, {"type": "env", "file": "sky.exr"}],
}
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
0 0 2
2 0 0
3 0 1 2
"""


def stored(folder: Path, **changes: Any) -> Path:
    (folder / "floor.ply").write_text(PLY)
    write_image(folder / "sky.exr", np.full((2, 4, 3), 0.25, np.float32))
    write_image(folder / "mix.exr", np.arange(48, dtype=np.float32).reshape(4, 4, 3))
    (folder / "mix.json").write_text(json.dumps(RECORD | changes))
    return folder / "mix.json"


def test_everything_arrives(tmp_path: Path) -> None:
    scene, expected = load_reference(stored(tmp_path))
    assert expected.tolist() == np.arange(48).reshape(4, 4, 3).tolist()
    assert (scene.camera.position, scene.camera.look_at, scene.camera.fov_degrees) == ((0, 1, 5), (0, 1, 0), 30)
    assert (scene.name, scene.render.size, scene.render.max_depth) == ("mix", (4, 4), 6)
    assert scene.lights == [PointLight(position=(0, 3, 0), intensity=(10, 8, 6))]
    assert scene.environment.image is not None and scene.environment.image.shape == (2, 4, 3)
    assert [sphere.center[0] for sphere in scene.spheres] == [0, 1, 2, 3]
    metal = MetallicRoughness(color=(0.9, 0.65, 0.35), metallic=1, roughness=0.5, smith="separable")
    assert [sphere.material for sphere in scene.spheres] == [
        Diffuse(color=(0.5, 0.5, 0.5)),
        metal,
        MetallicRoughness(color=(1, 1, 1), metallic=1, roughness=0.6, smith="separable"),
        Mirror(color=(0.5, 0.7, 0.9)),
    ]
    (floor,) = scene.meshes
    assert floor.vertices.tolist() == [[0, 0, 0], [0, 0, 2], [2, 0, 0]] and floor.faces.tolist() == [[0, 1, 2]]
    assert floor.material == MetallicRoughness(
        color=(0.9, 0.65, 0.35), metallic=1, roughness=0.5, smith="separable", emission=(3, 2, 1)
    )


def test_metals_and_ggx_mean_what_the_renderer_of_the_pictures_meant(tmp_path: Path) -> None:
    """F0 is the color, there is no diffuse lobe, and alpha is roughness² or as stored."""
    scene, _ = load_reference(stored(tmp_path))
    for index, f0, alpha in [(1, (0.9, 0.65, 0.35), 0.25), (2, (1, 1, 1), 0.36)]:
        material = scene.spheres[index].material
        assert isinstance(material, MetallicRoughness)
        assert material.lobes.f0 == pytest.approx(f0) and material.lobes.albedo == pytest.approx((0, 0, 0), abs=0)
        assert material.lobes.alpha == pytest.approx(alpha, rel=1e-12)


def test_constant_light_is_the_environments_color(tmp_path: Path) -> None:
    scene, _ = load_reference(stored(tmp_path, lights=[{"type": "constant", "radiance": [1, 2, 3]}]))
    assert list(scene.environment.color) == [1, 2, 3] and scene.environment.image is None and not scene.lights


@pytest.mark.parametrize(
    "changes, message",
    [
        (
            {
                "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}],
                "materials": {"m": {"type": "velvet"}},
            },
            "velvet",
        ),
        (
            {
                "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}],
                "materials": {"m": {"type": "ggx", "color": [0.5, 1, 1], "alpha": 0.2}},
            },
            "only white",
        ),
        ({"camera": RECORD["camera"] | {"width": 8}}, "square"),
    ],
)
def test_what_has_no_counterpart_is_refused(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        load_reference(stored(tmp_path, **changes))
