"""Offsets of rays that leave instances: larger than the rounding of the transform to the mesh's frame and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.numerics.cases.instances import lit_plane, transforms_of_kinds
from clrt.bench.numerics.cases.subject import Subject
from clrt.device.open import Device
from clrt.rendering.compile.geometry import pack_instances
from clrt.scene.geometry import instancing
from clrt.scene.model import Scene

from .test_instances import SETTINGS, by_hand


@pytest.fixture(autouse=True)
def keep_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep instances of small meshes as instances."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)


@pytest.mark.statistics
def test_planes_do_not_shadow_themselves(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays that leave a plane never hit it again, but do if the error bound of their points leaves out the rounding
    of the transform to the mesh's frame, and rays start at the bound."""
    scene = replace(lit_plane(transforms_of_kinds()["turned"][0]), render=replace(SETTINGS, integrator="direct"))
    assert Subject(device.info.index).picture(scene).all()
    assert not np.any(met_again(Probe(device, scene), scene))
    monkeypatch.setattr(pack_instances, "ROUNDINGS", 0.0)
    at_the_bound = {"LEAST * largest(absolute3(p))": "ZERO"}
    assert np.any(met_again(Probe(device, scene, changes=at_the_bound), scene))


def met_again(probe: Probe, scene: Scene) -> NDArray[np.bool_]:
    """Return whether rays that leave the first instance, a plane, on its camera's side hit anything, (n,)."""
    rng, count = np.random.default_rng(5), 1 << 17
    corners, eye = by_hand(scene.instances[0]).vertices.astype(np.float64), np.array(scene.camera.position)
    centre = corners.mean(axis=0)
    axes = np.linalg.svd(corners - centre, full_matrices=False)[2]
    normal = axes[2] * np.sign((eye - centre) @ axes[2])
    points = centre + (rng.uniform(-0.2, 0.2, (count, 2)) * np.ptp((corners - centre) @ axes[:2].T, axis=0)) @ axes[:2]
    leave = rng.normal(size=(count, 3))
    leave += (np.abs(leave @ normal) - leave @ normal)[:, None] * normal
    out = probe("leave", 14, np.broadcast_to(eye, points.shape), points - eye, leave)
    return np.asarray((out[:, 0] >= 0) & np.isfinite(out[:, 13]))
