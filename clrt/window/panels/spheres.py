"""Spheres panel: position, radius and material; adds and removes spheres."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from ...scene.editing import free_name
from ...scene.materials.material_types import Diffuse, Material
from ...scene.model import Sphere
from ..editor import Editor
from ..fields import choose
from ..lists import change, pick
from ..navigation import distance

#: A new sphere's radius relative to the camera's distance.
NEW = 0.1


def show(editor: Editor) -> None:
    """Draw the panel."""
    scene = editor.scene
    editor.sphere = pick("##spheres", [sphere.name for sphere in scene.spheres], editor.sphere)
    material = scene.spheres[editor.sphere].material if scene.spheres else Diffuse()
    new = Sphere(center=scene.camera.look_at, radius=NEW * distance(scene.camera), material=material)
    spheres, editor.sphere = change(scene.spheres, editor.sphere, {"sphere": new})
    if spheres != scene.spheres:
        editor.edit(spheres=spheres)
    elif spheres:
        imgui.push_id("sphere")
        new, named = _edited(editor, spheres[editor.sphere])
        imgui.pop_id()
        if new is not spheres[editor.sphere]:
            spheres[editor.sphere] = new
            editor.edit(spheres=spheres, materials=named)


def _edited(editor: Editor, sphere: Sphere) -> tuple[Sphere, dict[str, Material]]:
    """Return the edited sphere, and the scene's named materials, to which a new one may have been added."""
    sphere = editor.edited(sphere, without={"material"})
    materials, named = editor.materials, editor.scene.materials
    name = next(name for name, material in materials.items() if material is sphere.material)
    chosen = choose("material", list(materials), name)
    if chosen != name:
        sphere = replace(sphere, material=materials[chosen])
    if imgui.button("its own material"):
        sphere = replace(sphere, material=replace(sphere.material))
        named = {**named, free_name(sphere.name, materials): sphere.material}
    return sphere, named
