"""Mapping of a renderer's options, given by name, to settings of its scene and choices about its program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from ..accel.methods import HitTests
from ..scene.model import RenderSettings
from .aovs import chosen_aovs, needs_direct_light, seen_first
from .compile.choices import Choices


def settings_of(settings: RenderSettings, options: Mapping[str, Any]) -> RenderSettings:
    """Return a scene's settings, overridden by the given options; None means not given."""
    return replace(settings, **_given(options, settings))


def choices_of(options: Mapping[str, Any]) -> Choices:
    """Return the choices, including those that the requested AOVs imply. Raises UsageError for unknown values."""
    aovs = chosen_aovs(options.get("aovs") or ())
    tests, chosen = HitTests(**_given(options, HitTests)), _given(options, Choices)
    by_aovs = {"direct_light": needs_direct_light(aovs)} | ({"first_hits": True} if seen_first(aovs) else {})
    return Choices(**{**chosen, **by_aovs, "tests": tests})


def beyond(options: Mapping[str, Any], settings: RenderSettings) -> dict[str, Any]:
    """Return the options that are neither settings nor choices."""
    known = {field.name for kind in (settings, Choices, HitTests) for field in fields(kind)}
    return {name: value for name, value in options.items() if name not in known}


def _given(options: Mapping[str, Any], kind: Any) -> dict[str, Any]:
    """Return the given options that are fields of a dataclass."""
    return {field.name: options[field.name] for field in fields(kind) if options.get(field.name) is not None}
