"""The materials panel: types, presets, and all parameters."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

from clrt.output.view_transform import to_display
from clrt.scene.materials.material import SHARED
from clrt.scene.materials.material_types import MATERIALS, Diffuse
from clrt.scene.materials.presets import CONDUCTORS
from clrt.scene.materials.textures import WHITE, Texture

from .driver import Driver, at, changed, drive, halves
from .scenes import SKY, two_balls


@pytest.mark.programs
def test_a_material_gets_a_preset(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        before = window.picture()
        window.panel("Materials")
        window.choose("##material", "gold")
        window.choose("material/preset", "copper")
        window.rest()
        copper = window.picture()
        left, right = halves(changed(before, copper))
        assert left == 0 and 0.1 < right < 0.3, "the right ball alone"
        gold, dull = at(before, 116, 52), at(copper, 116, 52)
        assert dull[2] > gold[2] and dull[1] < gold[1], "of copper's light more is blue, and less green (table of F0)"

        window.choose("material/type", "mirror")
        window.rest()
        mirror = window.picture()
        left, right = halves(changed(copper, mirror))
        assert left == 0 and 0.1 < right < 0.3
        sky = 0.8 * np.array([[SKY]], np.float32)  # both types have a color, which is kept
        assert at(mirror, 116, 36) == pytest.approx(to_display(sky)[0, 0].tolist(), abs=1), "its top reflects the sky"
        assert window.live.scene.materials["gold"] is window.live.scene.spheres[1].material

    drive(two_balls(), test, tmp_path)


@pytest.mark.programs
def test_every_parameter_can_be_edited(tmp_path: Path) -> None:
    """The panel has a widget named after each field of each material type, but those that only a file's images fill."""

    def test(window: Driver) -> None:
        window.rest()
        window.panel("Materials")
        window.context.item_open("material/emission, normal map, opacity")
        for kind in MATERIALS:
            window.choose("material/type", kind.kernel)
            window.context.yield_(2)
            assert type(window.live.scene.materials["red"]) is kind
            for field in fields(kind):
                if get_type_hints(kind)[field.name] == Texture | None:
                    continue
                shared = "emission, normal map, opacity/" if field.name in SHARED else ""
                widgets = (field.name, f"##{field.name} given", f"{field.name}/##X", f"{field.name}/$$0")
                found = any(window.context.item_exists(f"material/{shared}{widget}") for widget in widgets)
                assert found, f"{kind.kernel}.{field.name}"

    drive(two_balls(integrator="normals", spp=1), test, tmp_path)


@pytest.mark.programs
def test_what_need_not_be_given(tmp_path: Path) -> None:
    """Values that belong together are set and removed together, starting from the preset; textures have own fields."""

    def test(window: Driver) -> None:
        def gold() -> Any:
            return window.live.scene.materials["gold"]

        def tick(item: str) -> None:
            window.context.item_click(item)
            window.context.yield_(2)

        window.rest()
        window.panel("Materials")
        window.choose("##material", "gold")
        window.choose("material/substance", "copper (conductor)")
        tick("material/##eta given")
        assert (gold().eta, gold().k) == CONDUCTORS["copper"]
        tick("material/##k given")
        assert gold().eta is gold().k is None and gold().preset == "copper"
        tick("material/##eta given")
        window.context.item_input_value("material/eta/$$1", 0.25)
        assert gold().eta == (CONDUCTORS["copper"][0][0], 0.25, CONDUCTORS["copper"][0][2])

        window.choose("##material", "floor")
        window.context.item_open("material/color")
        window.context.item_input_value("material/color/scale/$$0", 3)
        window.choose("material/color/wrap[1]", "clamp")
        color = window.live.scene.meshes[0].material.color  # type: ignore[attr-defined]
        assert (color.scale, color.wrap, color.picture) == ((3, 1), ("repeat", "clamp"), WHITE)

    scene = two_balls(integrator="normals", spp=1)
    floor = Diffuse(color=Texture(picture=WHITE))
    scene.meshes[0].uv, scene.meshes[0].material = np.zeros((4, 2), np.float32), floor
    scene.materials["floor"] = floor
    drive(scene, test, tmp_path)
