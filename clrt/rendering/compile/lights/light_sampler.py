"""Packing of the data for light sampling (kernels/light/choice.cl): light bounds, and a light BVH over many lights."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..records import LIGHT_GROUP, LIGHT_PLACE
from .light_bounds import Doubles, LightGroups
from .light_bvh import group_records, light_tree

#: Maximum number of finite lights that are evaluated one by one; if there are more, this many groups of them are.
FEW = 32


@dataclass(frozen=True)
class LightSampler:
    """Light sampling data. choices: number of entries to choose from, the last `infinite` of them infinite lights; 0
    without lights, and 1 if there is nothing to choose. tree: whether a light BVH is traversed below the chosen entry.
    """

    choices: int
    infinite: int = 0
    tree: bool = False
    buffers: dict[str, tuple[str, NDArray[Any]]] = field(default_factory=dict)

    @property
    def files(self) -> list[str]:
        """Kernel file that implements the choice."""
        return ["light/choice.cl" if self.choices > 1 else "light/only.cl"] if self.choices else []


def pack_choice(lights: LightGroups, infinite: Doubles) -> LightSampler:
    """Pack the data for n finite lights, numbered 0 to n − 1, and for the infinite ones after them, (k, 4).

    Each infinite light is a scalar and a vector: for a normal n, its irradiance is about scalar + vector·n, or 0 if
    negative.
    """
    first = min(len(lights), FEW)
    choices = first + len(infinite)
    if choices < 2:
        return LightSampler(choices)
    # Keeps importances in the range of floats, whatever the unit of radiance is.
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
    return LightSampler(choices, len(infinite), len(lights) > FEW, buffers)
