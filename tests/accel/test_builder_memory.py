"""Buffer sizes that the BVH builder requires of a device."""

from __future__ import annotations

from dataclasses import replace

import pyopencl as cl
import pytest

from clrt.accel.build import LARGE, build_tree
from clrt.accel.device_builder import LARGEST_ARRAY, SHAPES
from clrt.device.launches.data_parallel import DataParallel
from clrt.device.open import Device
from clrt.errors import NoRoomError

from ..covering import covering
from .cases import soup, spheres


@pytest.mark.programs
@covering("layout, builder", SHAPES, ["ploc", "reinsertion"])
def test_no_array_is_larger_than_foretold(
    device: Device, monkeypatch: pytest.MonkeyPatch, layout: str, builder: str
) -> None:
    """Tests clustered triangles, large overlapping ones, and triangles with spheres."""
    sizes: list[int] = []
    counted = DataParallel._counted

    def noted(work: DataParallel, array: cl.Buffer) -> cl.Buffer:
        sizes.append(array.size)
        return counted(work, array)

    monkeypatch.setattr(DataParallel, "_counted", noted)
    for triangles, balls in ((soup(20_000, 0.01), 0), (soup(20_000, 0.9), 0), (soup(12_000, 0.2), 8_000)):
        sizes.clear()
        build_tree(device, layout, builder, triangles, spheres(balls))
        assert 10 * 20_000 < max(sizes) <= LARGEST_ARRAY * 20_000


def test_where_there_is_no_room_numpy_builds(device: Device) -> None:
    small = replace(device, info=replace(device.info, max_alloc_bytes=LARGE * LARGEST_ARRAY - 1))
    triangles = soup(LARGE, 0.01)
    assert build_tree(small, "bvh8", None, triangles).builder == "sah"
    with pytest.raises(NoRoomError, match=f"{LARGE} primitives.*use the builder sah"):
        build_tree(small, "bvh8", "ploc", triangles)
    assert build_tree(device, "bvh8", None, triangles).builder == "ploc"


@pytest.mark.programs
def test_short_launches_build_the_same_tree(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The build is split into launches of few items each."""
    triangles = soup(5_000, 0.1)
    trees = [build_tree(device, "bvh8", "reinsertion", triangles)]
    monkeypatch.setattr("clrt.device.launches.data_parallel.LAUNCH_ITEMS", {"cpu": 100, "gpu": 100})
    trees.append(build_tree(device, "bvh8", "reinsertion", triangles))
    whole, cut = ({name: array.read(device).tobytes() for name, array in tree.buffers.items()} for tree in trees)
    assert whole == cut
