"""Reader for pbrt's scenes: the supported parts, and the unsupported ones by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from ...errors import SceneError
from ...scene.lights import Light
from ...scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from ..referenced_files import name_of
from ..scene_parts.notes import Notes, UnsupportedError
from .camera import exposed_camera, mirror_of
from .description import Description, describe
from .directives import Reader
from .entities import Entity
from .infinite import environment
from .lights import INFINITE, light
from .material_types import TYPES, unknown
from .materials import MaterialReader
from .render_settings import exposure, settings_of
from .shapes import ShapeReader
from .shutter import Shutter
from .spectra import Spectra
from .textures import TextureReader
from .tokens import Doubles

Part = TypeVar("Part")


class PbrtScene(NamedTuple):
    """differences: how clrt's models approximate pbrt's, one sentence each."""

    scene: Scene
    differences: list[str]


def read_pbrt(path: Path, approximate: bool = False) -> PbrtScene:
    """Read the scene in a file of pbrt-v4 or v3.

    approximate: what is not supported is replaced by something similar, or left out. Raises SceneError if the file is
    malformed, and UnsupportedError with all features that clrt does not support.
    """
    reader = Reader(path)
    description = describe(reader, reader.directives(path))
    return _Converter(description, Notes(approximate)).scene(name_of(path))


class _Converter:
    def __init__(self, description: Description, notes: Notes) -> None:
        self._description = description
        self._notes = notes
        self._problems: list[str] = []
        self._features: list[str] = []

    def scene(self, name: str) -> PbrtScene:
        description, notes = self._description, self._notes
        camera_entity = description.entity("Camera")
        mirror = mirror_of(camera_entity)
        settings = self._tried(lambda: settings_of(description, notes)) or RenderSettings()
        spectra = Spectra(description.old, self._tried(lambda: exposure(description)) or 1.0)
        textures = TextureReader(spectra, notes, description.old)
        materials = MaterialReader(description, textures, notes, TYPES, unknown)
        shutter = self._tried(lambda: Shutter.of(camera_entity, description.times)) or Shutter(0, 1, (0, 1))
        shapes = ShapeReader(description, textures, materials, notes, mirror, shutter)
        for each in description.lights:
            self._tried(lambda each=each: self._note_motion(each))  # type: ignore[misc]
        if "Volume" in description.single:
            volume = description.entity("Volume")
            volume.ignore()
            self._tried(lambda: notes.instead(volume, "media are not supported", "leave it out", "it is left out"))
        parts = self._parts(shapes)
        lights, sky = self._lights(spectra, mirror)
        camera = self._tried(lambda: exposed_camera(camera_entity, settings.size, mirror, notes, shutter)) or Camera()
        if not self._problems:
            self._note_unread()
        if self._features:
            raise UnsupportedError(self._problems, self._features)
        if self._problems:
            raise SceneError(self._problems)
        if camera.end or any(isinstance(each, Instance) and each.to_world_end is not None for each in parts):
            camera = replace(camera, shutter=(shutter.opens, shutter.closes))
        scene = Scene(
            meshes=[each for each in parts if isinstance(each, Mesh)],
            spheres=[each for each in parts if isinstance(each, Sphere)],
            instances=[each for each in parts if isinstance(each, Instance)],
            lights=lights,
            environment=sky,
            camera=camera,
            render=settings,
            name=name,
        )
        return PbrtScene(scene, notes.differences)

    def _note_motion(self, source: Entity) -> None:
        if source.to_world_end is not None:
            stand_in = "the transformation at the start is used"
            self._notes.instead(source, "motion of lights is not supported", "leave it out", stand_in)

    def _parts(self, shapes: ShapeReader) -> list[Mesh | Sphere | Instance]:
        description = self._description
        found: list[Mesh | Sphere | Instance] = []
        for use in description.shapes:
            found += self._tried(lambda use=use: list(shapes.parts(use))) or []  # type: ignore[misc]
        for name in dict.fromkeys(placed.name for placed in description.instances):
            if name in description.objects:
                self._tried(lambda name=name: shapes.object_parts(name))  # type: ignore[misc]
        for placed in description.instances:
            found += self._tried(lambda placed=placed: list(shapes.instances(placed))) or []  # type: ignore[misc]
        return found

    def _lights(self, spectra: Spectra, mirror: Doubles) -> tuple[list[Light], Environment]:
        description, notes = self._description, self._notes
        around = [each for each in description.lights if each.kind in INFINITE]
        lights = []
        for entity in description.lights:
            if entity not in around:
                lights.append(
                    self._tried(lambda entity=entity: light(entity, spectra, notes, mirror, description.old))  # type: ignore[misc]
                )
        sky = self._tried(lambda: environment(around, spectra, notes, mirror, description.old))
        return [each for each in lights if each], sky or Environment()

    def _tried(self, read: Callable[[], Part]) -> Part | None:
        """Return what `read` returns; None if it raises SceneError, which is noted. Values beyond float32 become Inf,
        which `validate` rejects."""
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                return read()
        except SceneError as error:
            self._problems += [problem for problem in error.problems if problem not in self._problems]
            if isinstance(error, UnsupportedError):
                self._features += [feature for feature in error.features if feature not in self._features]
            return None

    def _note_unread(self) -> None:
        """Note the parameters of entities in use that were not read."""
        for entity in dict.fromkeys(self._in_use()):
            for name in entity.unread():
                what, feature = f'"{name}" is not supported', f"{entity.tag} {entity.kind}, {name}"
                self._tried(
                    lambda entity=entity, what=what, feature=feature: self._notes.instead(  # type: ignore[misc]
                        entity, what, "leave it out", "it is ignored", feature
                    )
                )

    def _in_use(self) -> Iterator[Entity]:
        description = self._description
        rendered = {placed.name for placed in description.instances}
        shown = [*description.shapes, *(use for name in rendered for use in description.objects.get(name, []))]
        entities: Iterable[Entity | str | None] = [
            *description.lights,
            description.entity("Camera"),
            *(each for use in shown for each in (use.shape, use.material, use.area)),
        ]
        for each in entities:
            if isinstance(each, Entity) and each.used:
                yield each
            elif isinstance(each, str) and each in description.materials:
                yield description.materials[each]
