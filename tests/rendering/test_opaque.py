"""Primitives that are opaque to all rays are not evaluated: the image is the same if all are."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.combinations.identities import with_materials
from clrt.bench.combinations.random_scenes import random_scene
from clrt.device.open import Device
from clrt.rendering.compile import pack_scene
from clrt.rendering.compile.geometry.pack_opaque import opaque_records
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Material
from clrt.scene.model import Scene
from clrt.scene.render_settings import Culling

from ..covering import others

TODAY = date.today().toordinal()
OPAQUE: dict[str, Any] = {"opacity": 1.0, "one_sided": False, "camera_visible": True}
CHANGES: tuple[dict[str, Any], ...] = (
    OPAQUE,
    OPAQUE,
    {"opacity": 0.6},
    {"opacity": 1.0, "one_sided": True},
    {"opacity": 1.0, "camera_visible": False},
    {"catcher": True, "emission": (0.0, 0.0, 0.0), "camera_visible": True},
)


def partly_opaque(number: int) -> Scene:
    """Return a random scene, another one every day, with opaque materials and others."""
    print(f"seed {TODAY}, scene {number}")
    rng = np.random.default_rng((TODAY, number))
    kinds = CHANGES[: 6 if number % 3 == 0 else 5]  # catchers change every path

    def changed(material: Material) -> Material:
        return replace(material, **kinds[rng.integers(len(kinds))])

    scene = with_materials(random_scene(TODAY, number), changed)
    culling: Culling = get_args(Culling)[number % 3]
    return replace(scene, render=replace(scene.render, back_face_culling=culling, transparent=number % 3 == 0))


def rendered(device: Device, scene: Scene) -> NDArray[np.float32]:
    renderer = Renderer(scene, device=device.info.index, spp=4)
    *_, last = renderer.passes()
    return last.pixels


@pytest.mark.parametrize("number", [0, *others(*range(1, 12))])
def test_evaluating_every_surface_gives_the_same_image(
    device: Device, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, opaque = partly_opaque(number), list[float]()

    def none(*arguments: Any) -> NDArray[np.void]:
        records = opaque_records(*arguments)
        opaque.append(float(np.mean(records["rays"])))
        records["rays"] = 0
        return records

    image = rendered(device, scene)
    monkeypatch.setattr(pack_scene, "opaque_records", none)
    np.testing.assert_array_equal(rendered(device, scene), image)
    print(f"opaque on average: {opaque}")
