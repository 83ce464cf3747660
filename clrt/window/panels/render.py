"""Render panel: render settings, device, and display settings."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Annotated, Any

from imgui_bundle import imgui

from ...accel.traversal_kernels import BUILDER_NAMES, TREES, TRIANGLE_TESTS
from ...live.settings import Settings
from ...output.view_transform import VIEWS
from ...scene.fields.limits import Ge, Le
from ..editor import Editor
from ..fields import choose, edit
from ..tone_mapping import DisplaySettings

#: Settings with a fixed set of values, by name; None selects automatically by device and scene.
CHOICES: dict[str, list[Any]] = {
    "tree": [None, True, False],
    "builder": [None, *BUILDER_NAMES],
    "layout": [None, *TREES],
    "triangle": [*TRIANGLE_TESTS],
}
#: The other settings, and their types (live.settings).
NUMBERS: dict[str, Any] = {
    "samples": Annotated[int, Ge(1), Le(64)],
    "scale": Annotated[float, Ge(0.05), Le(4)],
    "frame_rate": Annotated[float, Ge(0), Le(120)],
    "denoise": bool,
}


def show(editor: Editor) -> None:
    """Draw the panel."""
    imgui.push_id("render")
    render = editor.edited(editor.scene.render)
    if render is not editor.scene.render:
        editor.edit(render=render)
    imgui.separator_text("Tracing")
    settings = _edited(editor, editor.settings)
    if settings is not editor.settings:
        editor.choose(settings)
    imgui.separator_text("Display")
    exposure = Annotated[float, Ge(-10), Le(10)]
    editor.look = DisplaySettings(
        choose("view", [*VIEWS, "aces"], editor.look.view),
        edit("exposure", exposure, editor.look.exposure, editor.step),
    )
    imgui.pop_id()


def _edited(editor: Editor, settings: Settings) -> Settings:
    changed: dict[str, Any] = {}
    for field in fields(settings):
        name, old = field.name, getattr(settings, field.name)
        if name == "device":
            new = _device(editor, old)
        elif name in CHOICES:
            new = choose(name, CHOICES[name], old, "automatic")
        else:
            new = edit(name, NUMBERS[name], old, editor.step)
        if new is not old:
            changed[name] = new
    return replace(settings, **changed) if changed else settings


def _device(editor: Editor, selector: Any) -> Any:
    """Show a list of devices with the current one selected; none is if several render together."""
    names = [f"{info.name} ({info.platform})" for info in editor.devices]
    ids = [info.id for info in editor.devices]
    at_work = selector if selector in ids else editor.snapshot.device
    now = next((i for i, info in enumerate(editor.devices) if at_work in (info.id, info.name)), -1)
    changed, chosen = imgui.combo("device", now, names)
    return ids[chosen] if changed else selector
