"""What the options of a renderer, given by name, ask for: settings of its scene, and choices about its program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from ..accel.kernels import HitTests
from ..scene.model import RenderSettings
from .aovs import chosen_aovs, needs_direct_light, seen_first
from .choices import Choices


def settings_of(settings: RenderSettings, options: Mapping[str, Any]) -> RenderSettings:
    """A scene's settings with those that are given. Options that are None are not."""
    return replace(settings, **_given(options, settings))


def choices_of(options: Mapping[str, Any]) -> Choices:
    """What is chosen, also by the AOVs that are asked for. UsageError for what is unknown."""
    aovs = chosen_aovs(options.get("aovs") or ())
    tests, chosen = HitTests(**_given(options, HitTests)), _given(options, Choices)
    by_aovs = {"direct_light": needs_direct_light(aovs)} | ({"first_hits": True} if seen_first(aovs) else {})
    return Choices(**{**chosen, **by_aovs, "tests": tests})


def beyond(options: Mapping[str, Any], settings: RenderSettings) -> dict[str, Any]:
    """The options that are neither settings nor choices."""
    known = {field.name for kind in (settings, Choices, HitTests) for field in fields(kind)}
    return {name: value for name, value in options.items() if name not in known}


def _given(options: Mapping[str, Any], kind: Any) -> dict[str, Any]:
    """Those that are fields of a dataclass."""
    return {field.name: options[field.name] for field in fields(kind) if options.get(field.name) is not None}
