"""Lights that the window adds."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.scene.lights import LIGHTS, Light
from clrt.scene.model import Camera, Scene
from clrt.scene.validation.validate import validate
from clrt.window.panels.lights import BRIGHT, _new


@pytest.mark.parametrize("kind", LIGHTS)
def test_new_lights_are_equally_bright_where_the_camera_looks(device: Device, kind: type[Light]) -> None:
    camera = Camera(position=(3.0, 1.0, 7.0), look_at=(1.0, 0.5, 0.0), up=(0.0, 2.0, 0.0))
    scene = Scene(lights=[_new(camera)[kind.kernel]], camera=camera)
    validate(scene)
    samples = Probe(device, scene)("light_sample", 12, np.tile([*camera.look_at, 0.0, 1.0, 0.0], (4096, 1)), seed=1)
    irradiance = np.mean(samples[:, 3] * samples[:, 1] / samples[:, 6])
    assert irradiance == pytest.approx(BRIGHT, rel=0.02)
