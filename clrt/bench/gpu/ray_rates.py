"""Rays per second by BVH layout, traversal, kind of rays and work-group size: enough rays to fill the device."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache, partial
from pathlib import Path
from statistics import median

import numpy as np

from ...accel.methods import TREELESS
from ...device.device_info import Paths
from ...device.open import Device, open_device
from ...formats.load_scene import load
from ...queries.mesh import RayQuery
from ...rendering.renderer import Renderer
from ..rays.device_speed import BUSY, MEASURED, busy_side, shortest_seconds
from ..rays.layout_speed import CONTESTANTS
from ..rays.ray_speed import Run, every
from ..rays.workloads import Workload, bumpy_ball, closed_room, workloads
from .executions import executions
from .gallery import steady_rate
from .request import Item, Request, Row
from .small_scenes import smaller

#: Subdivisions of the bumpy ball, and the side of the image that the camera rays form; with --quick.
SUBDIVISIONS, LARGEST, QUICK_SUBDIVISIONS, QUICK_LARGEST = 7, 2048, 2, 8
#: Sizes of work-groups: those of a device that vectorizes over work-items, and of one that does not.
GROUPS, FEW_GROUPS = (32, 64, 128, 256), (1, 2, 4)
#: Scenes whose paths are traced with each size of work-groups.
GROUP_SCENES = ("cornell", "materials")


class Rays:
    """Mesh in a closed room and its rays, which are made when they are first needed."""

    def __init__(self, request: Request) -> None:
        self._quick, self._device = request.quick, request.device
        self._ball = bumpy_ball(QUICK_SUBDIVISIONS if self._quick else SUBDIVISIONS)
        self._room = closed_room(*self._ball)
        self.query = lru_cache(1)(self._query)  # several BVHs would not fit into small devices

    def _query(self, name: str) -> RayQuery:
        layout, traversal = CONTESTANTS[name]
        return RayQuery(*self._room, device=self._device, layout=layout, traversal=traversal)

    @cached_property
    def kinds(self) -> dict[str, Workload]:
        """Rays by kind, as many as keep the device busy with its default layout."""
        query = RayQuery(*self._room, device=self._device)
        side = busy_side(query, self._room, self._ball, QUICK_LARGEST if self._quick else LARGEST)
        return {kind.name: kind for kind in workloads(*self._room, self._ball[0], query.closest_hit, (side, side))}

    @property
    def default(self) -> RayQuery:
        """Query with the device's layout."""
        return RayQuery(*self._room, device=self._device)


KINDS = ("primary", "bounce", "shadow", "occluded")


def layout_items(request: Request) -> Iterator[Item]:
    """Yield each layout with each kind of rays, the device's own layout first."""
    rays, own = Rays(request), open_device(request.device).layout
    for name in sorted(CONTESTANTS, key=lambda name: CONTESTANTS[name][0] != own):
        for kind in KINDS:
            yield Item(f"{name}, {kind}", partial(_layout_rate, rays, name, kind, request.quick))


def _layout_rate(rays: Rays, name: str, kind: str, quick: bool) -> Row:
    query, workload = rays.query(name), rays.kinds[kind]
    if query.tree.name in TREELESS:
        workload = _as_many_as_take_long(query, workload)
    return {
        "layout": name,
        "kind": kind,
        "builder": query.tree.builder,
        "stack": query.tree.stack,
        **_rate(query, workload, 0.0 if quick else MEASURED),
    }


def _rate(query: RayQuery, workload: Workload, budget: float) -> Row:
    run = Run(query, query.any_hit if workload.any_hit else query.closest_hit, workload.rays)
    seconds, count = shortest_seconds(query, workload, budget), len(workload.rays[2])
    run()
    return {
        "rays": count,
        "mrays": 1e-6 * count / seconds,
        "mrays_call": 1e-6 * count / median(run.calls),
        "hits": float(np.mean(run.answers if workload.any_hit else run.answers["primitive"] >= 0)),
        "longest_launch": query.longest_launch,
    }


def _as_many_as_take_long(query: RayQuery, workload: Workload) -> Workload:
    """Return an evenly spaced subset of the rays, doubled until it keeps the device busy by brute force."""
    step = 1 << (len(workload.rays[2]) // 64).bit_length()
    while step > 1:
        some = workload._replace(rays=every(step, workload.rays))
        if shortest_seconds(query, some) >= BUSY:
            return some
        step //= 2
    return workload


@dataclass(frozen=True)
class GroupedDevice(Device):
    """An opened device with another work-group size."""

    group: int = 64

    @property
    def local_size(self) -> int:
        """Return the work-group size."""
        return self.group

    @property
    def group_size(self) -> int:
        """Return that of the queues' kernels."""
        return self.group

    @staticmethod
    def of(device: Device, group: int) -> GroupedDevice:
        """Return the device with work-groups of this size."""
        return GroupedDevice(**{each.name: getattr(device, each.name) for each in fields(device)}, group=group)


def group_items(request: Request) -> Iterator[Item]:
    """Yield each size of work-groups with rays, then with scenes."""
    rays, device = Rays(request), open_device(request.device)
    usual, most = FEW_GROUPS if device.local_size == 1 else GROUPS, device.cl.max_work_group_size
    groups = [each for each in usual if each <= most]
    for group in groups:
        for kind in KINDS[:2]:
            yield Item(f"{kind}, {group}", partial(_group_rate, rays, kind, group, request.quick))
    for file in map(Path, request.scenes):
        for paths in executions(request.device) if file.stem in GROUP_SCENES else ():
            for group in groups:
                measure = partial(_group_paths, file, paths, device, group, request.quick)
                yield Item(f"{file.stem}, {paths}, {group}", measure)


def _group_rate(rays: Rays, kind: str, group: int, quick: bool) -> Row:
    query = rays.default
    query.device = GroupedDevice.of(query.device, group)
    return {"of": kind, "group": group, **_rate(query, rays.kinds[kind], 0.0 if quick else MEASURED)}


def _group_paths(file: Path, paths: Paths, device: Device, group: int, quick: bool) -> Row:
    scene = smaller(load(file)) if quick else load(file)
    renderer = Renderer(scene, device=GroupedDevice.of(device, group), spp=None, paths=paths, seed=1)
    rate = steady_rate(renderer, 0.0, 0.0) if quick else steady_rate(renderer)
    return {"of": f"{file.stem}, {paths}", "group": group, **rate}
