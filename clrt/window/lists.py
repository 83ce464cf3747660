"""A list box, with buttons that add and remove entries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from imgui_bundle import imgui

Entry = TypeVar("Entry")

#: Lines that a list shows before it scrolls.
LINES = 6


def pick(label: str, names: Sequence[str], chosen: int) -> int:
    """Show a list box, and return the selected line's index. Only visible lines are drawn, so lists may be long."""
    height = (min(max(len(names), 1), LINES) + 0.5) * imgui.get_text_line_height_with_spacing()
    if imgui.begin_list_box(label, (-1, height)):
        clipper = imgui.ListClipper()
        clipper.begin(len(names))
        while clipper.step():
            for i in range(clipper.display_start, clipper.display_end):
                if imgui.selectable(f"{i}: {names[i]}", i == chosen)[0]:
                    chosen = i
        imgui.end_list_box()
    return min(chosen, len(names) - 1)


def change(entries: Sequence[Entry], chosen: int, new: Mapping[str, Entry]) -> tuple[list[Entry], int]:
    """Show buttons that add an entry of `new` by name, or remove the chosen one; return the entries and the chosen."""
    changed = list(entries)
    for name, entry in new.items():
        if imgui.button(f"add {name}"):
            changed, chosen = [*changed, entry], len(changed)
        imgui.same_line()
    imgui.begin_disabled(not 0 <= chosen < len(changed))
    if imgui.button("remove"):
        del changed[chosen]
    imgui.end_disabled()
    return changed, min(chosen, len(changed) - 1)
