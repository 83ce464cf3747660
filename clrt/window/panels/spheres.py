"""Spheres: where they are, how large and of what; more of them, and fewer."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from ...scene.editing import free_name
from ...scene.materials import Diffuse, Material
from ...scene.model import Sphere
from ..editor import Editor
from ..fields import choose, edit_fields
from ..lists import change, pick
from ..navigation import distance

#: A new sphere's radius over the camera's distance.
NEW = 0.1


class Spheres:
    """The panel; `chosen` is the sphere that it edits."""

    def __init__(self) -> None:
        self.chosen = 0

    def show(self, editor: Editor) -> None:
        """Draws it."""
        scene = editor.scene
        self.chosen = pick("##spheres", [sphere.name for sphere in scene.spheres], self.chosen)
        material = scene.spheres[self.chosen].material if scene.spheres else Diffuse()
        new = Sphere(center=scene.camera.look_at, radius=NEW * distance(scene.camera), material=material)
        spheres, self.chosen = change(scene.spheres, self.chosen, {"sphere": new})
        if spheres != scene.spheres:
            editor.edit(spheres=spheres)
        elif spheres:
            imgui.push_id("sphere")
            new, named = _edited(editor, spheres[self.chosen])
            imgui.pop_id()
            if new is not spheres[self.chosen]:
                spheres[self.chosen] = new
                editor.edit(spheres=spheres, materials=named)


def _edited(editor: Editor, sphere: Sphere) -> tuple[Sphere, dict[str, Material]]:
    """The sphere, and the scene's named materials, to which its own may have come."""
    sphere = edit_fields(sphere, editor.step, without={"material"})
    materials, named = editor.materials, editor.scene.materials
    name = next(name for name, material in materials.items() if material is sphere.material)
    chosen = choose("material", list(materials), name)
    if chosen != name:
        sphere = replace(sphere, material=materials[chosen])
    if imgui.button("its own material"):
        sphere = replace(sphere, material=replace(sphere.material))
        named = {**named, free_name(sphere.name, materials): sphere.material}
    return sphere, named
