"""Widgets for the fields of dataclasses, chosen by the fields' types and limits, so that the window can edit whatever
the scene file can hold, under the same names.

Every function takes a value and returns it, the same object if nothing was changed. Numbers that were typed or dragged
become the shortest decimals with the same float32 value.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import fields, replace
from functools import partial
from math import inf, isfinite
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from imgui_bundle import imgui

from ..scene.fields.limits import Ge, Gt, Le, Lt
from ..scene.light_images import LightImage
from ..scene.materials.textures import Texture

Value = TypeVar("Value")
Pictured = TypeVar("Pictured", Texture, LightImage)

#: Types of values with an image, which the window does not replace.
IMAGES = (Texture, LightImage)

#: Largest range for which a slider is used.
WIDEST = 20000
#: Ranges wider than this get a logarithmic slider.
WIDE = 1000
#: Relative change of a number per pixel of dragging, if larger than that of a coordinate.
DRAG = 0.005
#: Slider maxima of fields whose upper limit is rarely needed; larger values can be typed (Ctrl and a click).
USUAL = {"max_depth": 64}
#: Lines of a list before it scrolls.
LINES = 20
#: Most numbers in one widget.
LONGEST = 4
#: The largest int of the widgets.
LARGEST = 2**31 - 1
COLOR = imgui.ColorEditFlags_.float.value | imgui.ColorEditFlags_.hdr.value


class NumberLimits(NamedTuple):
    """Minimum and maximum of a number."""

    least: float = -inf
    most: float = inf

    def clamp(self, value: float) -> float:
        """Return the nearest number within the limits."""
        return min(max(value, self.least), self.most)


def edit_fields(
    record: Value, step: float, without: Collection[str] = (), changed_copy: Callable[..., Any] = replace
) -> Value:
    """Show widgets for all fields of a dataclass but some. step: change of a coordinate per pixel of dragging.

    changed_copy: called with the record and its changed fields, as dataclasses.replace, returns the new one.
    """
    hints = get_type_hints(type(record), include_extras=True)
    changed = {}
    for field in fields(record):  # type: ignore[arg-type]
        if field.name not in without:
            value = getattr(record, field.name)
            new = edit(field.name, hints[field.name], value, step)
            if new is not value:
                changed[field.name] = new
    return changed_copy(record, **changed) if changed else record


def edit(label: str, hint: Any, value: Any, step: float) -> Any:
    """Show a widget for a value of one of the types that scenes consist of (see scene.fields)."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        kinds = [part for part in parts if part is not NoneType]
        if len(kinds) < len(parts):
            return _edit_optional(label, kinds[0], value, step)
        return edit(label, next((kind for kind in kinds if _is(kind, value)), kinds[0]), value, step)
    if hint in IMAGES:
        return _edit_image(label, value, step)
    if origin is Literal:
        return choose(label, parts, value)
    if origin is tuple:
        return _edit_tuple(label, parts, value, step)
    widget: Callable[[str, Any], tuple[bool, Any]] = _PLAIN.get(_base(hint), partial(_number, hint, step))
    changed, new = widget(label, value)
    return new if changed else value


def choose(label: str, choices: Sequence[Value], value: Value, none: str = "none") -> Value:
    """Show a list to choose one value from; `none` is the text for None."""
    names = [none if choice is None else str(choice) for choice in choices]
    changed, index = imgui.combo(label, choices.index(value) if value in choices else -1, names, LINES)
    return choices[index] if changed else value


def _edit_optional(label: str, kind: Any, value: Any, step: float) -> Any:
    """Show a widget for a value that may be None: one more choice, or a checkbox."""
    if get_origin(kind) is Literal:
        return choose(label, (None, *get_args(kind)), value)
    if kind in IMAGES and value is None:
        imgui.text_disabled(f"{label}: none")
        return None
    changed, given = imgui.checkbox(f"##{label} given", value is not None)
    imgui.same_line()
    if changed:
        value = _initial(kind) if given else None
    if value is None:
        imgui.text_disabled(f"{label}: not given")
        return None
    return edit(label, kind, value, step)


def _edit_image(label: str, image: Pictured, step: float) -> Pictured:
    """Show widgets for the mapping of a texture or a light's image."""
    name = image.picture.name if isinstance(image, Texture) else image.name
    if imgui.tree_node_ex(f"{label}: {name}###{label}"):
        image = edit_fields(image, step, without={"picture", "pixels", "name"})
        imgui.tree_pop()
    return image


def _edit_tuple(label: str, kinds: tuple[Any, ...], value: tuple[Any, ...], step: float) -> tuple[Any, ...]:
    """Show a color widget if all numbers are at least 0, a vector widget, or separate widgets."""
    kinds = kinds[:1] * len(value) if kinds[-1] is ... else kinds
    if not kinds:
        imgui.text_disabled(f"{label}: none")
        return value
    limits = [limits_of(kind) for kind in kinds]
    if limits[0] is None or len(kinds) > LONGEST:
        new = tuple(edit(f"{label}[{i}]", kind, part, step) for i, (kind, part) in enumerate(zip(kinds, value)))
        return new if any(a is not b for a, b in zip(new, value)) else value
    if _base(kinds[0]) is int:
        changed, parts = getattr(imgui, f"drag_int{len(kinds)}")(label, value)
    elif len(kinds) == 3 and limits[0] in (NumberLimits(0, 1), NumberLimits(0)):
        changed, parts = imgui.color_edit3(label, value, COLOR)
    else:
        drag = getattr(imgui, f"drag_float{len(kinds)}")
        changed, parts = drag(label, value, _speed(max(map(abs, value)), step), format="%.5g")
    if not changed:
        return value
    return tuple(
        old if part == np.float32(old) else _shortest(limit.clamp(part), kind)
        for part, old, limit, kind in zip(parts, value, limits, kinds)
        if limit is not None
    )


def _number(hint: Any, step: float, label: str, value: float) -> tuple[bool, float]:
    """Show a slider if the type has limits, otherwise a drag widget."""
    limits = limits_of(hint) or NumberLimits()
    least, most = limits.least, USUAL.get(label, limits.most)
    slides, whole = isfinite(least) and most - least <= WIDEST, _base(hint) is int
    flags = imgui.SliderFlags_.logarithmic.value if most - least > WIDE else 0
    new: float
    if whole and slides:
        changed, new = imgui.slider_int(label, int(value), int(least), int(most), "%d", flags)
    elif whole:
        changed, new = imgui.drag_int(label, min(int(value), LARGEST))
    elif slides:
        changed, new = imgui.slider_float(label, value, least, most, "%.4g", flags)
    else:
        changed, new = imgui.drag_float(label, value, _speed(abs(value), step), format="%.5g")
    return changed, _shortest(limits.clamp(new), hint)


def limits_of(hint: Any) -> NumberLimits | None:
    """Return the limits of a number's type; None for other types."""
    if _base(hint) not in (int, float):
        return None
    limits = NumberLimits()
    for limit in getattr(hint, "__metadata__", ()):
        if isinstance(limit, Ge | Gt):
            least = limit.bound if isinstance(limit, Ge) else _next(limit.bound, inf, hint)
            limits = limits._replace(least=least)
        elif isinstance(limit, Le | Lt):
            limits = limits._replace(most=limit.bound if isinstance(limit, Le) else _next(limit.bound, -inf, hint))
    return limits


def _next(bound: float, towards: float, hint: Any) -> float:
    """Return the number next to an excluded bound."""
    whole = bound + (1 if towards > bound else -1)
    return whole if _base(hint) is int else float(np.nextafter(np.float32(bound), np.float32(towards)))


_PLAIN: dict[Any, Any] = {bool: imgui.checkbox, str: imgui.input_text}


def _initial(hint: Any) -> Any:
    """Return the initial value of an optional field that becomes enabled: 1, the nearest allowed, or the first word."""
    if get_origin(hint) is tuple:
        return tuple(map(_initial, get_args(hint)))
    if get_origin(hint) is Literal:
        return get_args(hint)[0]
    return _shortest((limits_of(hint) or NumberLimits()).clamp(1), hint)


def _is(kind: Any, value: Any) -> bool:
    """Return whether a value is of a type."""
    base = get_origin(_base(kind)) or _base(kind)
    return isinstance(value, (float, int) if base is float else base)


def _base(hint: Any) -> Any:
    """Return a type without its limits."""
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def _speed(size: float, step: float) -> float:
    return max(DRAG * size, step)


def _shortest(number: float, hint: Any) -> float:
    """Return the number with the fewest digits that has the same float32 value."""
    return int(number) if _base(hint) is int else float(str(np.float32(number)))
