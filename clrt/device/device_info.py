"""Device properties, and the results of its check and of its speed measurement."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

#: Layers that translate OpenCL to another API: part of the platform's or device's name, and the API.
TRANSLATIONS = {"clvk": "Vulkan", "zink": "Vulkan", "openclon12": "Direct3D 12"}


@dataclass(frozen=True)
class Verdict:
    """The result of a device check. failures: one sentence each, empty if it passed. figures: measurements by name.

    when: the time of the check in UTC (ISO 8601); seconds: its duration. kernels: digest of the kernels that were
    checked (kernel_files.py).
    """

    passed: bool
    failures: list[str] = field(hash=False)  # lists and dicts are unhashable; equality still implies equal hashes
    when: str
    seconds: float
    kernels: str
    figures: dict[str, float | str] = field(default_factory=dict, hash=False)


@dataclass(frozen=True)
class Speed:
    """Throughput of the kernels alone, in millions of rays per second."""

    mrays_primary: float
    mrays_bounce: float
    mrays_shadow: float

    @property
    def mrays(self) -> float:
        """Return the throughput for equal numbers of rays of each kind."""
        return 3 / (1 / self.mrays_primary + 1 / self.mrays_bounce + 1 / self.mrays_shadow)


#: Executions of paths. "lanes" is the megakernel, one path per lane (kernels/integrator/path.cl). The others advance
#: many paths together by one vertex at a time: "waves" those of a tile in one work-item
#: (kernels/integrator/wavefront.cl), "queues" those of a launch, with a kernel per stage (integrator/queues.cl).
Paths = Literal["lanes", "waves", "queues"]
#: BVH layouts that a device may be tuned to.
TunedLayout = Literal["bvh8", "bvh2", "cwbvh"]


@dataclass(frozen=True)
class Tuning:
    """How a device renders fastest, of what was tried. group_size: work-items per work-group of the queues' kernels."""

    paths: Paths
    layout: TunedLayout
    group_size: int


@dataclass(frozen=True)
class DeviceInfo:
    """One OpenCL device, or a driver without devices (`usable` is then False and `why` the reason).

    id: stable until the platform or driver changes. why: a remark, or the reason why it cannot be used and the remedy.
    check, bench, tuning: the result of its last check, its measured speed, and how it renders fastest; None if that is
    not known in its present state. hardware: its UUID and PCI address if its driver reports them. known_faults: of its
    driver's version, as others reported them (discovery/known_faults.json).
    """

    index: int
    id: str
    name: str
    platform: str
    platform_version: str
    driver: str
    type: str
    compute_units: int
    global_bytes: int
    max_alloc_bytes: int
    usable: bool
    why: str
    chosen: bool
    check: Verdict | None = None
    bench: Speed | None = None
    tuning: Tuning | None = None
    hardware: tuple[str, ...] = ()
    known_faults: tuple[str, ...] = ()

    @property
    def failed(self) -> bool:
        """Return whether the check of the device failed."""
        return self.check is not None and not self.check.passed

    @property
    def translated(self) -> str:
        """Return the API that the platform translates OpenCL to, empty if it is native."""
        names = f"{self.platform} {self.name}".lower()
        return next((target for word, target in TRANSLATIONS.items() if word in names), "")


def identity_of(info: DeviceInfo) -> dict[str, str]:
    """Return what results about a device depend on, except for the kernels."""
    try:
        own = version("clrt")
    except PackageNotFoundError:
        own = "not installed"
    return {
        "device": info.id,
        "name": info.name,
        "platform_version": info.platform_version,
        "driver": info.driver,
        "clrt": own,
    }
