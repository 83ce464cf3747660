"""Hard cases of geometry, light transport and devices: the number of wrong results, and the accuracy of the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ...device.discovery.discover import choose, find_devices
from ...device.open import open_device
from ...errors import ClrtError
from .cases.axes import measure_axes
from .cases.degenerate import measure_degenerate
from .cases.departures import measure_departures
from .cases.devices import measure_devices
from .cases.distances import measure_distances
from .cases.instances import measure_instances
from .cases.scales import measure_scales
from .cases.slivers import measure_slivers
from .cases.spheres import measure_spheres
from .cases.subject import Subject
from .cases.watertight import measure_watertight
from .hard_light import measure_pictures
from .hit_agreement import measure_hits
from .row import Row
from .samplers import measure_samplers

GEOMETRY: tuple[Callable[..., Iterator[Row]], ...] = (
    measure_watertight,
    measure_scales,
    measure_slivers,
    measure_distances,
    measure_axes,
    measure_degenerate,
    measure_departures,
    measure_spheres,
    measure_instances,
)


def chosen_devices(device: str | int | None) -> list[int]:
    """Return the index of the device, or of all except simulators."""
    if device is not None:
        return [choose(device)[0].index]
    return [info.index for info, _ in find_devices() if info.usable and info.type != "simulator"]


def measure_device(device: int, *, quick: bool) -> Iterator[Row]:
    """Yield all rows of one device with its default tests. A measurement that fails gives a row with a wrong answer."""
    for measure in GEOMETRY:
        yield from _or_error(measure.__name__, lambda: measure(Subject(device), quick=quick))
    yield from _or_error("measure_pictures", lambda: measure_pictures(Subject(device), quick=quick))
    yield from _or_error("measure_samplers", lambda: measure_samplers(open_device(device), quick=quick))


def measure_together(devices: list[int], *, quick: bool) -> Iterator[Row]:
    """Yield rows for the agreement of BVHs and devices on hits, and of devices on images."""
    for mesh in measure_hits(quick=quick, device=devices[0] if len(devices) == 1 else None):
        rays = sum(way.get("rays", 0) for way in mesh["ways"])
        differ = sum(sum(way["differ"].values()) for way in mesh["ways"] if "differ" in way)
        failed = sum("error" in way for way in mesh["ways"])
        yield Row("G2", f"{mesh['mesh']}: hits of {len(mesh['ways'])} trees, ways and devices", rays, differ + failed)
    yield from measure_devices(devices, quick=quick)


def _or_error(name: str, measure: Callable[[], Iterator[Row]]) -> Iterator[Row]:
    try:
        yield from measure()
    except ClrtError as error:
        yield Row("-", f"{name.removeprefix('measure_')} failed: {error}", 1, 1)
