"""Materials panel: every type, with all its parameters and presets (scene.materials)."""

from __future__ import annotations

from dataclasses import fields, replace
from inspect import getdoc
from typing import Any, get_args, get_type_hints

from imgui_bundle import imgui

from ...scene.editing import free_name
from ...scene.materials.material import SHARED, Material
from ...scene.materials.material_types import MATERIALS, Diffuse
from ..editor import Editor
from ..fields import choose, edit_fields

TYPES = {kind.kernel: kind for kind in MATERIALS}


def show(editor: Editor) -> None:
    """Draw the panel."""
    names, chosen = list(editor.materials), editor.material
    editor.material = choose("##material", names, chosen if chosen in names else names[0]) if names else ""
    imgui.same_line()
    if imgui.button("add"):
        editor.material = free_name("material", names)
        editor.edit(materials={**editor.scene.materials, editor.material: Diffuse()})
    if editor.material not in editor.materials:
        return
    old = editor.materials[editor.material]
    imgui.push_id("material")
    new = _edited(old, editor.step)
    imgui.pop_id()
    if new is not old:
        editor.repaint(old, new)


def _edited(material: Material, step: float) -> Material:
    """Show widgets for the type's own fields, then for those that all materials share."""
    material = _of_type(material, choose("type", list(TYPES), material.kernel))
    imgui.set_item_tooltip(getdoc(type(material)) or "")
    substance = choose("substance", [*_substances()], None)
    if substance is not None:
        kind, preset = _substances()[substance]
        material = replace(_of_type(material, kind), preset=preset)  # type: ignore[call-arg]
    own = _together(material, edit_fields(material, step, without=SHARED))
    if imgui.tree_node_ex("emission, normal map, opacity"):
        own = edit_fields(own, step, without={field.name for field in fields(own)} - SHARED)
        imgui.tree_pop()
    return own


def _of_type(material: Material, kernel: str) -> Material:
    """Return a material of another type, with the values of the fields that both types have."""
    kind = TYPES[kernel]
    if type(material) is kind:
        return material
    hints, own = get_type_hints(kind, include_extras=True), get_type_hints(type(material), include_extras=True)
    return kind(
        **{
            field.name: getattr(material, field.name)
            for field in fields(kind)
            if field.name in own and own[field.name] == hints[field.name]
        }
    )


def _substances() -> dict[str, tuple[str, str]]:
    """Return type and preset, by the names in the list."""
    found = {}
    for kind in MATERIALS:
        if "preset" in get_type_hints(kind):
            for preset in _words(get_type_hints(kind)["preset"]):
                found[f"{preset} ({kind.kernel})"] = (kind.kernel, preset)
    return found


def _words(hint: Any) -> list[str]:
    """Return the strings of a Literal, which may be a part of a union."""
    return [word for part in get_args(hint) for word in ([part] if isinstance(part, str) else _words(part))]


def _together(old: Material, new: Material) -> Material:
    """Keep fields that must be given together consistent, such as a metal's eta and k: set all, with the values in
    effect before, or none."""
    if new is old or not new.conflicts():
        return new
    optional = [field.name for field in fields(new) if field.default is None and field.name not in SHARED]
    taken = any(getattr(old, name) is not None and getattr(new, name) is None for name in optional)
    known = old.parameters()
    given: dict[str, Any] = {
        name: None if taken else known.get(name, getattr(new, name))
        for name in optional
        if taken or getattr(old, name) is None
    }
    return replace(new, **given)
