"""Views rendered by the workers of a farm, bit for bit those of one machine."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.errors import DeviceError, SceneError, UsageError
from clrt.farm.local_processes import Processes

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    with Processes(tmp_path_factory.mktemp("farm")) as started:
        started.add_workers(3)
        yield started


@pytest.mark.parametrize(
    "layers", [["rgb", "depth", "flow"], ["alpha", "indirect", "normal"], ["depth", "normal", "flow"]]
)
def test_views_are_those_of_one_machine(processes: Processes, layers: list[str]) -> None:
    scene = clrt.load(SCENES / "spot.toml")
    cameras = [view.camera for _, view in clrt.frames(clrt.turntable(scene, frames=9))]
    expected = clrt.render_views(scene, cameras, layers, size=(40, 30), spp=4)
    found = clrt.render_views(scene, cameras, layers, size=(40, 30), spp=4, scheduler=processes.address)
    assert list(found) == list(expected)
    for name, layer in expected.items():
        np.testing.assert_array_equal(found[name], layer)


def test_views_that_a_farm_cannot_render_are_named(processes: Processes, device: Device) -> None:
    scene, wrong = clrt.load(SCENES / "spot.toml"), "front"
    options: dict[str, Any] = {"size": (40, 30), "scheduler": processes.address}
    with pytest.raises(SceneError, match=r"view 1: camera: .* is not of type Camera"):
        clrt.render_views(scene, [scene.camera, wrong], "depth", **options)  # type: ignore[list-item]
    with pytest.raises(UsageError, match="opened devices"):
        clrt.render_views(scene, [scene.camera], "depth", device=device, **options)
    with pytest.raises(DeviceError, match="does not answer"):
        clrt.render_views(scene, [scene.camera], "depth", scheduler="tcp://127.0.0.1:9")
    assert clrt.render_views(scene, [], "depth", **options) == {}
