"""Reader for Mitsuba 3's XML scenes: the supported parts, and the unsupported ones by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import atan, degrees, hypot, radians, tan
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from ...errors import SceneError
from ...scene.materials.material import Material
from ...scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from ...scene.render_settings import Filter, Integrator
from ..referenced_files import name_of
from .lights import environment, light
from .materials import MaterialReader
from .shapes import ShapeReader
from .textures import TextureReader
from .values import Doubles
from .xml import Plugin, UnsupportedError, read_xml

Part = TypeVar("Part")

#: Integrators that estimate the same image, by clrt's; those in WRAPPERS are unwrapped.
INTEGRATORS: dict[str, Integrator] = {
    "path": "path",
    "prb": "path",
    "ptracer": "path",
    "volpath": "path",
    "volpathmis": "path",
    "prbvolpath": "path",
    "direct": "direct",
}
WRAPPERS = ("moment", "aov")
FILTERS: dict[str, Filter] = {"box": "box", "tent": "tent", "gaussian": "gaussian"}
#: Default of Mitsuba's camera, and the diagonal in mm of the film that focal_length refers to.
FOCAL_LENGTH, DIAGONAL = "50mm", hypot(36, 24)
#: Path depth limit for scenes without one in Mitsuba.
ENDLESS = 1024
#: Tolerance for a camera's axes to be orthogonal and equally long.
ODD = 1e-5
#: Ignored parameters, which affect how Mitsuba computes the image, not the image.
IMMATERIAL = {
    "rr_depth",
    "near_clip",
    "far_clip",
    "pixel_format",
    "component_format",
    "file_format",
    "banner",
    "compensate",
    "samples_per_pass",
    "emitter_samples",
    "bsdf_samples",
    "shading_samples",
}


class MitsubaScene(NamedTuple):
    """differences: how clrt's models approximate Mitsuba's, one sentence each. missing: the unsupported features of
    materials that `stand_in` replaces, by the name of the mesh or sphere."""

    scene: Scene
    differences: list[str]
    missing: dict[str, list[str]]


def read_mitsuba(path: Path, stand_in: Material | None = None) -> MitsubaScene:
    """Read the scene in an XML file of Mitsuba 3, as its `rgb` variants render it.

    stand_in: replaces materials that are not supported. Raises SceneError if the file is malformed, and
    UnsupportedError with all features that clrt does not support.
    """
    return _Reader(stand_in).scene(read_xml(path), name_of(path))


class _Reader:
    def __init__(self, stand_in: Material | None) -> None:
        self._problems: list[str] = []
        self._features: list[str] = []
        textures = TextureReader()
        self._materials = MaterialReader(textures)
        self._shapes = ShapeReader(textures, self._materials, stand_in)

    def scene(self, root: Plugin, name: str) -> MitsubaScene:
        parts = [part for plugin in root.all("shape") for part in self._tried(self._parts, plugin) or []]
        skies, lights = [], []
        for plugin in root.all("emitter"):
            if plugin.kind in ("constant", "envmap"):
                skies.append(self._tried(environment, plugin))
            else:
                lights.append(self._tried(light, plugin))
        if len(skies) > 1:
            self._note(SceneError("scene: has several environment lights; keep one constant or envmap emitter"))
        settings, camera = RenderSettings(), Camera()
        for sensor in root.all("sensor")[:1]:
            settings = self._tried(_film, sensor) or settings
            camera = self._tried(lambda plugin: _camera(plugin, settings.size), sensor) or camera
        for integrator in root.all("integrator"):
            settings = self._tried(lambda plugin: _integrator(plugin, settings), integrator) or settings
        if not self._problems and not self._shapes.missing:
            self._note_unread(root)
        if self._features:
            raise UnsupportedError(self._problems, self._features)
        if self._problems:
            raise SceneError(self._problems)
        scene = Scene(
            meshes=_of(parts, Mesh),
            spheres=_of(parts, Sphere),
            instances=_of(parts, Instance),
            lights=[each for each in lights if each],
            environment=next(filter(None, skies), Environment()),
            camera=camera,
            render=settings,
            name=name,
        )
        return MitsubaScene(scene, self._materials.differences, self._shapes.missing)

    def _parts(self, plugin: Plugin) -> list[Mesh | Sphere | Instance]:
        return list(self._shapes.parts(plugin))

    def _tried(self, read: Callable[[Plugin], Part], plugin: Plugin) -> Part | None:
        """Return what `read` returns for a plugin; None if it raises SceneError, which is noted."""
        try:
            return read(plugin)
        except SceneError as error:
            self._note(error)
            return None

    def _note(self, error: SceneError) -> None:
        self._problems += [problem for problem in error.problems if problem not in self._problems]
        if isinstance(error, UnsupportedError):
            self._features += [feature for feature in error.features if feature not in self._features]

    def _note_unread(self, root: Plugin) -> None:
        """Note the parameters of plugins in use that were not read."""
        for plugin in _in_use(root):
            for name in plugin.unread():
                self._note(
                    UnsupportedError(
                        f'{plugin.where}: "{name}" is not supported; leave it out',
                        [f"{plugin.tag} {plugin.kind}, {name}"],
                    )
                )


def _in_use(root: Plugin) -> Iterator[Plugin]:
    """Yield the plugins that were read, and those nested in them."""
    for _, child in root.children:
        if child.used:
            yield child
            yield from _in_use(child)


def _of(parts: list[Mesh | Sphere | Instance], kind: type[Part]) -> list[Part]:
    return [part for part in parts if isinstance(part, kind)]


def _film(sensor: Plugin) -> RenderSettings:
    """Read size, samples per pixel and filter."""
    size, spp, kind = (768, 576), 4, "gaussian"
    for sampler in sensor.all("sampler"):
        spp = sampler.value("sample_count", int, spp)
        sampler.used.add("seed")
    for film in sensor.all("film"):
        size = film.value("width", int, size[0]), film.value("height", int, size[1])
        film.used |= IMMATERIAL
        for rfilter in film.all("rfilter"):
            kind = rfilter.kind
            if (
                kind not in FILTERS
                or rfilter.value("stddev", float, 0.5) != 0.5
                or rfilter.value("radius", float, 1.0) != 1
            ):
                rfilter.refuse(
                    f'filter "{kind}" is not supported like this',
                    "write box, tent or gaussian without parameters",
                    f"rfilter {kind}",
                )
    return RenderSettings(size=size, spp=spp, filter=FILTERS[kind])


def _integrator(plugin: Plugin, settings: RenderSettings) -> RenderSettings:
    """Return the settings with the plugin's integrator and depth."""
    while plugin.kind in WRAPPERS and plugin.all("integrator"):
        plugin.used.add("aovs")
        plugin = plugin.all("integrator")[0]
    if plugin.kind not in INTEGRATORS:
        plugin.refuse_kind(", ".join(INTEGRATORS))
    plugin.used |= IMMATERIAL
    depth = plugin.value("max_depth", int, -1)
    if plugin.value("hide_emitters", bool, False):
        plugin.refuse("hide_emitters is not supported", "leave it out", "hide_emitters")
    return replace(settings, integrator=INTEGRATORS[plugin.kind], max_depth=ENDLESS if depth < 0 else max(depth, 1))


def _camera(plugin: Plugin, size: tuple[int, int]) -> Camera:
    """Read the camera of a sensor with a film of this size."""
    if plugin.kind not in ("perspective", "thinlens", "orthographic"):
        plugin.refuse_kind("perspective, thinlens or orthographic")
    plugin.used |= IMMATERIAL
    to_world, aspect = plugin.transform("to_world"), size[0] / size[1]
    position, forward, up = (to_world[:3, column] for column in (3, 2, 1))
    lengths = _lengths(plugin, to_world)
    distance = plugin.value("focus_distance", float, 1.0)
    seen = position + distance * forward / lengths[2]
    camera = Camera(position=position.tolist(), look_at=seen.tolist(), up=up.tolist())
    if plugin.kind == "orthographic":
        return replace(camera, projection="orthographic", view_height=2 * lengths[0] / aspect)
    radius = plugin.value("aperture_radius", float, 0.0)
    return replace(
        camera,
        fov_degrees=_vertical_fov(plugin, aspect),
        aperture_radius=radius,
        focus_distance=distance if radius else None,
    )


def _lengths(plugin: Plugin, to_world: Doubles) -> tuple[float, float, float]:
    """Return the lengths of a sensor's axes; these must be orthogonal and not mirror or stretch the image."""
    axes = to_world[:3, :3]
    x, y, z = np.linalg.norm(axes, axis=0).tolist()
    if (
        min(x, y, z) == 0
        or np.abs((axes / (x, y, z)).T @ (axes / (x, y, z)) - np.eye(3)).max() > ODD
        or (abs(x - y) > ODD * x)
        or np.linalg.det(axes) < 0
    ):
        plugin.refuse(
            "its to_world mirrors, shears or stretches the image",
            "only rotate, translate and scale uniformly",
            "sensor that mirrors or stretches",
        )
    return x, y, z


def _vertical_fov(plugin: Plugin, aspect: float) -> float:
    """Return the vertical angle in degrees, from `fov` along `fov_axis`, or from `focal_length` on 36 x 24 mm film."""
    axis = plugin.value("fov_axis", str, "x").lower()
    if "fov" in plugin.values:
        spread = tan(radians(plugin.value("fov", float, 0.0)) / 2)
    else:
        text = plugin.value("focal_length", str, FOCAL_LENGTH).removesuffix("mm")
        try:
            spread = DIAGONAL / (2 * float(text))
        except (ValueError, ZeroDivisionError):
            raise SceneError(f'{plugin.where}: focal_length "{text}" is not a length; write it like "50mm"') from None
        axis = "diagonal"
    axis = {"smaller": "y" if aspect > 1 else "x", "larger": "x" if aspect > 1 else "y"}.get(axis, axis)
    shares = {"x": 1 / aspect, "y": 1.0, "diagonal": 1 / hypot(1, aspect)}
    if axis not in shares:
        raise SceneError(f'{plugin.where}: fov_axis "{axis}" is unknown; write x, y, diagonal, smaller or larger')
    return degrees(2 * atan(spread * shares[axis]))
