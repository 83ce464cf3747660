"""Reader for Mitsuba 3's XML scenes: the supported parts, and the unsupported ones by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeVar

from ...errors import SceneError
from ...scene.lights import Light
from ...scene.materials.material import Material
from ...scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from ...scene.render_settings import Filter, Integrator
from ..referenced_files import name_of
from ..scene_parts.notes import Notes, UnsupportedError
from .bsdf_types import TYPES
from .camera import camera_of
from .lights import ENVIRONMENTS, OF_SHAPES, environment, light
from .materials import MaterialReader
from .shapes import ShapeReader
from .stand_ins import unknown
from .sun_and_sky import KINDS as SUN_AND_SKY, sun_and_sky
from .textures import TextureReader
from .xml import Plugin, read_xml

Part = TypeVar("Part")

#: Integrators that estimate the same image, by clrt's: Mitsuba 3's, Mitsuba 0.x's, and path guiding.
INTEGRATORS: dict[str, Integrator] = {
    "path": "path",
    "prb": "path",
    "ptracer": "path",
    "volpath": "path",
    "volpathmis": "path",
    "prbvolpath": "path",
    "direct": "direct",
    "volpath_simple": "path",
    "bdpt": "path",
    "photonmapper": "path",
    "ppm": "path",
    "sppm": "path",
    "pssmlt": "path",
    "mlt": "path",
    "erpt": "path",
    "guided_path": "path",
}
#: Integrators that contain another one, which is used.
WRAPPERS = ("moment", "aov", "adaptive", "irrcache")
FILTERS: dict[str, Filter] = {"box": "box", "tent": "tent", "gaussian": "gaussian"}
#: Path depth limit for scenes without one in Mitsuba.
ENDLESS = 1024


#: Ignored parameters of films, which affect how Mitsuba stores the image.
STORED = {
    "pixel_format",
    "component_format",
    "file_format",
    "filename",
    "banner",
    "compensate",
    "attach_log",
    "gamma",
    "high_quality_edges",
}


class MitsubaScene(NamedTuple):
    """differences: how clrt's models approximate Mitsuba's, one sentence each. missing: the unsupported features of
    materials that `stand_in` replaces, by the name of the mesh or sphere."""

    scene: Scene
    differences: list[str]
    missing: dict[str, list[str]]


def read_mitsuba(
    path: Path, stand_in: Material | None = None, approximate: bool = False, parameters: Mapping[str, str] = {}
) -> MitsubaScene:
    """Read the scene in an XML file of Mitsuba 3, as its `rgb` variants render it.

    stand_in: replaces materials that are not supported; approximate: what is not supported is replaced by something
    similar, or left out; parameters: values of $NAME. Raises SceneError if the file is malformed, and UnsupportedError
    with all features that clrt does not support.
    """
    return _Reader(stand_in, Notes(approximate)).scene(read_xml(path, parameters), name_of(path))


class _Reader:
    def __init__(self, stand_in: Material | None, notes: Notes) -> None:
        self._notes = notes
        self._problems: list[str] = []
        self._features: list[str] = []
        self._textures = textures = TextureReader(notes)
        materials = MaterialReader(textures, notes, TYPES, unknown)
        self._shapes = ShapeReader(textures, materials, notes, stand_in)

    def scene(self, root: Plugin, name: str) -> MitsubaScene:
        parts = [part for plugin in root.all("shape") for part in self._tried(self._parts, plugin) or []]
        lights, sky = self._emitters(root.all("emitter"))
        settings, camera = RenderSettings(), Camera()
        for sensor in root.all("sensor")[:1]:
            settings = self._tried(lambda plugin: _film(plugin, self._notes), sensor) or settings
            camera = self._tried(lambda plugin: camera_of(plugin, settings.size, self._notes), sensor) or camera
        for integrator in root.all("integrator"):
            settings = self._tried(lambda plugin: _integrator(plugin, settings, self._notes), integrator) or settings
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
            lights=lights,
            environment=sky or Environment(),
            camera=camera,
            render=settings,
            name=name,
        )
        return MitsubaScene(scene, self._notes.differences, self._shapes.missing)

    def _emitters(self, emitters: list[Plugin]) -> tuple[list[Light], Environment | None]:
        """Return the lights and the environment that a scene's own emitters are."""
        around = [plugin for plugin in emitters if plugin.kind in (*ENVIRONMENTS, "sky", "sunsky")]
        if len(around) > 1:
            self._note(SceneError("scene: has several environment lights; keep one constant or envmap emitter"))
        lights: list[Light | None] = []
        sky: Environment | None = None
        for plugin in emitters:
            if plugin in around[1:] or plugin.kind in OF_SHAPES:
                continue
            if plugin.kind in ENVIRONMENTS:
                sky = self._tried(lambda each: environment(each, self._notes), plugin)
            elif plugin.kind in SUN_AND_SKY:
                above, suns = self._tried(lambda each: sun_and_sky(each, self._notes), plugin) or (None, [])
                sky = above or sky
                lights = [*suns, *lights]  # first, as in a scene file with the sky's parameters
            else:
                lights.append(self._tried(lambda each: light(each, self._textures, self._notes), plugin))
        return [each for each in lights if each], sky

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
                what, feature = f'"{name}" is not supported', f"{plugin.tag} {plugin.kind}, {name}"
                try:
                    self._notes.instead(plugin, what, "leave it out", "it is ignored", feature)
                except UnsupportedError as error:
                    self._note(error)


def _in_use(root: Plugin) -> Iterator[Plugin]:
    """Yield the plugins that were read, and those nested in them, once each."""
    found: dict[Plugin, None] = {}
    waiting = [root]
    while waiting:
        new = [child for _, child in waiting.pop().children if child.used and child not in found]
        found.update(dict.fromkeys(new))
        waiting += new
    yield from found


def _of(parts: list[Mesh | Sphere | Instance], kind: type[Part]) -> list[Part]:
    return [part for part in parts if isinstance(part, kind)]


def _film(sensor: Plugin, notes: Notes) -> RenderSettings:
    """Read size, samples per pixel and filter."""
    size, spp, kind = (768, 576), 4, "gaussian"
    for sampler in sensor.all("sampler"):
        spp = sampler.value("sample_count", int, spp)
        sampler.used |= {*sampler.values}
    for film in sensor.all("film"):
        size = film.value("width", int, size[0]), film.value("height", int, size[1])
        film.used |= STORED
        for rfilter in film.all("rfilter"):
            kind = rfilter.kind
            if (
                kind not in FILTERS
                or rfilter.value("stddev", float, 0.5) != 0.5
                or rfilter.value("radius", float, 1.0) != 1
            ):
                rfilter.used |= {*rfilter.values}
                notes.instead(
                    rfilter,
                    f'filter "{kind}" is not supported like this',
                    "write box, tent or gaussian without parameters",
                    "the default one of that name is used, or gaussian",
                    f"rfilter {kind}",
                )
    return RenderSettings(size=size, spp=spp, filter=FILTERS.get(kind, "gaussian"))


def _integrator(plugin: Plugin, settings: RenderSettings, notes: Notes) -> RenderSettings:
    """Return the settings with the plugin's integrator and depth."""
    while plugin.kind in WRAPPERS and plugin.all("integrator"):
        plugin.used |= {*plugin.values}
        plugin = plugin.all("integrator")[0]
    plugin.used |= {*plugin.values}  # the others affect how the image is computed, not the image
    if plugin.kind not in INTEGRATORS:
        what = f'integrator type "{plugin.kind}" is not supported'
        notes.instead(plugin, what, f"use {', '.join(INTEGRATORS)}", "path is used")
    depth = plugin.value("max_depth", int, -1)
    if plugin.value("hide_emitters", bool, False):
        notes.instead(plugin, "hide_emitters is not supported", "leave it out", "it is ignored", "hide_emitters")
    kind = INTEGRATORS.get(plugin.kind, "path")
    return replace(settings, integrator=kind, max_depth=ENDLESS if depth < 0 else max(depth, 1))
