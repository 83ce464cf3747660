"""Packs what one light of several is chosen by (kernels/light/choice.cl): groups of lights, and a tree of many."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .light_groups import Doubles, LightGroups
from .light_tree import group_records, light_tree
from .records import LIGHT_GROUP, LIGHT_PLACE

#: Lights of finite extent that are looked at one by one; where there are more, so many groups of them are.
FEW = 32


@dataclass(frozen=True)
class LightChoice:
    """choices: from how many one is chosen, the last `infinite` of them infinite lights. tree: whether more follows.

    Without lights there are no choices; one is none.
    """

    choices: int
    infinite: int = 0
    tree: bool = False
    buffers: dict[str, tuple[str, NDArray[Any]]] = field(default_factory=dict)

    @property
    def files(self) -> list[str]:
        """The kernel file that chooses."""
        return ["light/choice.cl" if self.choices > 1 else "light/only.cl"] if self.choices else []


def pack_choice(lights: LightGroups, infinite: Doubles) -> LightChoice:
    """lights: n of finite extent, numbered 0 to n − 1. infinite: (k, 4), what comes after them.

    A scalar and a vector each: where the normal is n, their irradiance is about scalar + vector·n, or 0 if below.
    """
    first = min(len(lights), FEW)
    choices = first + len(infinite)
    if choices < 2:
        return LightChoice(choices)
    # Whatever the unit of radiance is, importances then stay in the range of floats.
    scale = max(lights.intensity.sum(), np.abs(infinite).max(initial=0))
    lights = replace(lights, intensity=lights.intensity / scale)
    buffers: dict[str, tuple[str, NDArray[Any]]] = {}
    if len(lights) > FEW:
        groups, places = light_tree(lights, FEW, len(infinite))
        buffers["light_places"] = ("LightPlace", np.append(places, np.arange(first, choices)).astype(LIGHT_PLACE))
    else:
        groups = np.append(group_records(lights, ~np.arange(first)), np.zeros(len(infinite), LIGHT_GROUP))
    endless = groups[first:choices]
    endless["intensity"], endless["axis"] = infinite[:, 0] / scale, infinite[:, 1:] / scale
    endless["below"] = ~np.arange(len(lights), len(lights) + len(infinite))
    buffers["light_groups"] = ("LightGroup", groups)
    return LightChoice(choices, len(infinite), len(lights) > FEW, buffers)
