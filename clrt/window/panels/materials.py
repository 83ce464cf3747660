"""Materials panel: every type, with all its parameters and presets (scene.materials)."""

from __future__ import annotations

from dataclasses import fields, replace
from inspect import getdoc
from typing import Any, get_args, get_type_hints

from imgui_bundle import imgui

from ...errors import ObjectError
from ...scene.editing import free_name
from ...scene.materials.material import SHARED, Material
from ...scene.materials.material_types import MATERIALS, Diffuse
from ..editor import Editor
from ..fields import choose

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
    new = _edited(editor, old)
    imgui.pop_id()
    if new is not old:
        editor.repaint(old, new)


def _edited(editor: Editor, material: Material) -> Material:
    """Show widgets for the type's own fields, then for those that all materials share."""
    material = _of_type(material, choose("type", list(TYPES), material.kernel))
    imgui.set_item_tooltip(getdoc(type(material)) or "")
    substance = choose("substance", [*_substances()], None)
    if substance is not None:
        kind, preset = _substances()[substance]
        material = replace(_of_type(material, kind), preset=preset)  # type: ignore[call-arg]
    own = editor.edited(material, SHARED, _together)
    if imgui.tree_node_ex("emission, normal map, opacity"):
        own = editor.edited(own, {field.name for field in fields(own)} - SHARED)
        imgui.tree_pop()
    return own


def _of_type(material: Material, kernel: str) -> Material:
    """Return a material of another type, with the values of the fields that both types have; of those that all types
    have, if the others do not go together in it."""
    kind = TYPES[kernel]
    if type(material) is kind:
        return material
    hints, own = get_type_hints(kind, include_extras=True), get_type_hints(type(material), include_extras=True)
    values: dict[str, Any] = {
        field.name: getattr(material, field.name)
        for field in fields(kind)
        if field.name in own and own[field.name] == hints[field.name]
    }
    try:
        return kind(**values)
    except ObjectError:
        return kind(**{name: value for name, value in values.items() if name in SHARED})


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


def _together(old: Material, **changed: Any) -> Material:
    """Return a changed copy. Fields that must be given together, such as a metal's eta and k, are kept consistent: all
    are set, with the values in effect before, or none."""
    try:
        return replace(old, **changed)
    except ObjectError:
        optional = [field.name for field in fields(old) if field.default is None and field.name not in SHARED]
    taken = any(getattr(old, name) is not None and changed.get(name, 0) is None for name in optional)
    known = old.parameters()
    given: dict[str, Any] = {
        name: None if taken else known.get(name, changed.get(name))
        for name in optional
        if taken or getattr(old, name) is None
    }
    return replace(old, **{**changed, **given})
