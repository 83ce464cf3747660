"""Baking of light and ambient occlusion into the texture coordinates of a mesh."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from ..accel.methods import HitTests
from ..errors import SceneError, UsageError, did_you_mean
from ..float_errors import with_default_errors
from ..rendering.compile.choices import Choices
from ..rendering.light_meter import LightMeter, LightPart
from ..rendering.listed_keywords import listed
from ..rendering.sensors import SensorOptions, reach_of
from ..scene.fields.field_types import field_problems, show
from ..scene.model import Instance, Mesh, Scene
from ..scene.ray_list import REPLICAS, RayList
from ..scene.render_settings import RenderSettings
from ..scene.validation.validate import validate
from .light_map import LightMap
from .padding import padded
from .texel_points import PLACES, TexelPoints, other_set

Doubles = NDArray[np.float64]
Quantity = Literal["irradiance", "indirect", "direct", "occlusion"]
_PARTS: dict[Quantity, LightPart] = {
    "irradiance": "all",
    "indirect": "indirect",
    "direct": "direct",
    "occlusion": "all",
}
#: Maximum number of texels that are measured at once: on the device they take a kilobyte each.
PART = 1 << 16
#: Maximum width and height of an image.
MOST_TEXELS = 8192
#: Maximum samples per texel if they end at a given noise.
MOST_SPP = 1 << 16

_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class BakeOptions:
    """What is baked, and how. The fields are described at `bake`."""

    what: Quantity = "irradiance"
    size: int | tuple[int, int] = 1024
    padding: int = 4
    uv_set: int = 0
    distance: float | None = None
    noise: float | None = None

    @property
    def width_and_height(self) -> tuple[int, int]:
        """The image's size."""
        return (self.size, self.size) if isinstance(self.size, int) else self.size

    def check(self) -> None:
        """Raise UsageError for values that cannot be used."""
        if problems := field_problems(BakeOptions, vars(self), "bake"):
            raise UsageError("\n".join(problems))
        if not all(1 <= length <= MOST_TEXELS for length in self.width_and_height):
            raise UsageError(f"size is {self.size}; give 1 to {MOST_TEXELS} texels, or (width, height)")
        if not 0 <= self.padding <= MOST_TEXELS:
            raise UsageError(f"padding is {self.padding}; give 0 to {MOST_TEXELS} texels")
        if self.uv_set not in (0, 1):
            raise UsageError(f"uv_set is {self.uv_set}; give 0 or 1")
        if self.noise is not None and not 0 < self.noise < np.inf:
            raise UsageError(f"noise is {self.noise}; give a number above 0, or leave it out")
        if self.distance is not None and self.what != "occlusion":
            raise UsageError(f"distance limits occlusion, and {self.what} is baked; leave it out")
        reach_of(self.distance)


class BakeState(NamedTuple):
    """State of a bake: the fraction done; of the texels measured so far their mean samples, value and standard error;
    noise: the error over the value."""

    done: float
    spp: float
    mean: float
    standard_error: float
    noise: float
    seconds: float


class Bake:
    """A bake in progress. Raises the exceptions of `bake`."""

    def __init__(self, scene: Scene, mesh: str | Mesh | Instance, how: BakeOptions, options: Mapping[str, Any]) -> None:
        how.check()
        validate(scene)
        self._how = how
        chosen = _chosen(scene, mesh)
        own = chosen.mesh if isinstance(chosen, Instance) else chosen
        to_world = chosen.to_world if isinstance(chosen, Instance) else np.eye(3, 4)
        self.name = chosen.name
        shown = f"{show(self.name)} of {scene.name}"
        self._points = TexelPoints(own, to_world, shown, how.uv_set, how.width_and_height)
        if self._points.flat:
            _log.warning(
                "mesh %s: %d of its %d faces have no area in its texture coordinates, and hardly any texel shows them; "
                "unwrap them, in Blender by UV > Smart UV Project%s",
                shown,
                self._points.flat,
                len(own.faces),
                other_set(own, how.uv_set),
            )
        if overlaps := self._points.faces.overlaps:
            _log.warning(
                "mesh %s: faces overlap in its texture coordinates at %d of the %d texels that it covers, where one of "
                "them is baked; unwrap it without overlaps, in Blender by UV > Lightmap Pack%s",
                shown,
                overlaps,
                len(self._points.texels),
                other_set(own, how.uv_set),
            )
        given = dict(options)
        if how.noise is not None and given.get("spp") is None:
            given["spp"] = MOST_SPP
        self.meter = LightMeter(scene, given, _PARTS[how.what])
        self._values = np.zeros((len(self._points.texels), 3), np.float32)
        self._errors = np.zeros_like(self._values)
        self._sums = np.zeros(2)  # of values and errors, in finished parts
        self._samples = 0
        self._start = time.perf_counter()

    def states(self) -> Iterator[BakeState]:
        """Measure the texels part by part; yield the state whenever there are new samples."""
        total = len(self._values)
        count = -(-total // PART)
        length = -(-total // max(count, 1))
        for number in range(count):
            part = slice(number * length, min((number + 1) * length, total))
            for done in self._measure(part, length):
                yield self._state((number + done) / count, part)
            self._sums += self._sums_of(part)

    def _sums_of(self, part: slice) -> Doubles:
        return np.array([each[part].sum(dtype=np.float64) for each in (self._values, self._errors)])

    def _state(self, done: float, part: slice) -> BakeState:
        """Return the state while a part is measured and those before it are finished."""
        mean, error = map(float, (self._sums + self._sums_of(part)) / max(3 * part.stop, 1))
        noise, seconds = error / mean if mean else 0.0, time.perf_counter() - self._start
        return BakeState(done, self._samples / max(part.stop, 1), mean, error, noise, seconds)

    def _measure(self, part: slice, length: int) -> Iterator[float]:
        """Measure a part, as one of `length` texels, like all others; yield its fraction that is done."""
        how, texels = self._how, self._points.texels[part]
        count = len(texels)
        places = self._points.of(np.pad(texels, (0, length - count), "edge"))
        is_light = how.what != "occlusion"
        rays = RayList(
            origins=places.points,
            directions=places.normals.astype(np.float32),
            surface_normals=places.surface_normals.astype(np.float32),
            measures="irradiance" if is_light else "ambient_occlusion",
            reach=reach_of(how.distance),
            replicas=REPLICAS // len(PLACES),
        )
        scale = np.pi if is_light else 1.0
        before = self._samples
        for samples, (value, error) in self.meter.measure(rays):
            self._values[part], self._errors[part] = scale * value[:count], scale * error[:count]
            self._samples = before + samples * count
            enough = how.noise is not None and self._errors[part].mean() <= how.noise * self._values[part].mean()
            yield 1.0 if enough else min(1.0, samples / self.meter.spp)
            if enough:
                break

    def light_map(self) -> LightMap:
        """Return the image, once all parts are measured."""
        width, height = self._how.width_and_height
        covered = self._points.covered
        images = np.zeros((height, width, 6), np.float32)
        images[covered] = np.concatenate([self._values, self._errors], axis=1)
        images = padded(images, covered, self._how.padding)
        return LightMap(images[..., :3], images[..., 3:], covered, self._report())

    def _report(self) -> dict[str, Any]:
        total = len(self._values)
        state = self._state(1.0, slice(total, total))
        named = {"mesh": self.name, "what": self._how.what, "texels": total, **state._asdict()}
        return {name: value for name, value in named.items() if name != "done"} | {"device": self.meter.device_name}


def _chosen(scene: Scene, mesh: str | Mesh | Instance) -> Mesh | Instance:
    """Return the mesh or instance of the scene. Raises SceneError unless there is exactly one."""
    parts: list[Mesh | Instance] = [*scene.meshes, *scene.instances]
    found = [each for each in parts if (each.name == mesh if isinstance(mesh, str) else each is mesh)]
    if len(found) == 1:
        return found[0]
    if found:
        raise SceneError(
            f"{scene.name} has {len(found)} meshes named {show(cast(str, mesh))}, and one is baked at a time; "
            "give them different names, or in Python pass the Mesh itself"
        )
    name = mesh if isinstance(mesh, str) else getattr(mesh, "name", repr(mesh))
    names = list(dict.fromkeys(each.name for each in parts))
    listed_names = ", ".join(map(show, names[:20])) + (", …" if len(names) > 20 else "")
    remedy = f"it has {listed_names}{did_you_mean(name, names)}" if names else "it has no meshes"
    raise SceneError(f"{scene.name} has no mesh {show(name)}; {remedy}")


@listed(SensorOptions, (RenderSettings, Choices, HitTests))
@with_default_errors
def bake(
    scene: Scene,
    mesh: str | Mesh | Instance,
    what: Quantity = "irradiance",
    *,
    size: int | tuple[int, int] = 1024,
    padding: int = 4,
    uv_set: int = 0,
    distance: float | None = None,
    noise: float | None = None,
    **options: Unpack[SensorOptions],
) -> LightMap:
    """Bake the light on a mesh, or its ambient occlusion, into an image over its texture coordinates.

    - mesh: the scene's mesh or instance, or its name
    - what: "irradiance" of the fronts of its faces, in the scene's unit of radiance times sr; its "indirect" or
      "direct" part; or "occlusion", from 0, closed, to 1, open
    - size: texels, of a square or as (width, height)
    - padding: how many texels around the mesh's charts repeat their nearest texel
    - uv_set: 0 for the mesh's `uv`, 1 for `uv1`
    - distance: within which surfaces occlude; None for any
    - noise: end each part of 65536 texels once their mean standard error is this fraction of their mean

    A texel is the mean of the light at four points in it, or at those of the mesh nearest to them; `spp` counts the
    samples of all. Raises SceneError if the mesh cannot be found, has no texture coordinates or some beyond 0 to 1,
    UsageError for other values, and what `render` raises. Faces that overlap in texture coordinates are a warning.
    """
    how = BakeOptions(what=what, size=size, padding=padding, uv_set=uv_set, distance=distance, noise=noise)
    job = Bake(scene, mesh, how, options)
    for _ in job.states():
        pass
    return job.light_map()
