"""Accumulation on devices of this machine."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.open import Device
from ...scene.model import Scene
from .accumulation import Accumulation
from .denoiser_guides import render_guides
from .device_report import machine_report
from .first_hits import first_hits


class LocalAccumulation(Accumulation):
    """Samples of a scene that is on devices here, where other kernels can be run on it, too."""

    def machine(self, devices: Sequence[Device]) -> dict[str, Any]:
        """Return the report's fields on these devices, and on the programs and BVHs built for them."""
        return machine_report(devices, self)

    def guides(self) -> dict[str, NDArray[np.float32]]:
        """Return the guides for a denoiser, see `render_guides`."""
        return render_guides(self)

    def first_hits(self, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """Return AOVs of the first hits in the scene being rendered, see `first_hits`."""
        return first_hits(self, scene, names)
