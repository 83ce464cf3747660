"""Identities that the images of any scene satisfy: sums of lights, equal means of all strategies, symmetries.

A property generates sides from a scene. The image of each side equals that of the first, except for noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from ...device.programs.kernel_files import kernel_folder
from ...errors import SceneError
from ...scene.geometry.instancing import baked
from ...scene.geometry.transform import rotation, scaling, transform_mesh, translation
from ...scene.light_groups import group_of, light_groups
from ...scene.lights import STRENGTHS, DirectionalLight, Light
from ...scene.materials.material import Material
from ...scene.materials.material_types import MATERIALS, Diffuse
from ...scene.materials.textures import Texture
from ...scene.model import Environment, Instance, Mesh, Scene, Sphere
from ...scene.render_settings import Integrator
from .random_draws import Draws
from .random_scenes import BLACK
from .similarity import random_similarity

#: Names of light groups; without a name a light is in the rest's.
GROUPS = ("", "key", "fill")

Lit = TypeVar("Lit", Mesh, Instance, Sphere)


@dataclass(frozen=True)
class Side:
    """One side of an equation: `scale` times the sum of the scenes' images, or of their layers of the light group
    `group`.

    files: kernel files that replace the program's own, by their name in `#include NAME`; mirrored: left and right are
    exchanged; guided: whether paths are guided.
    """

    name: str
    scenes: list[Scene]
    files: Mapping[str, list[str]] = field(default_factory=dict)
    scale: float = 1.0
    mirrored: bool = False
    group: str | None = None
    guided: bool = False


Property = Callable[[Scene, Draws], list[Side]]


def additivity(scene: Scene, draws: Draws) -> list[Side]:
    """The image in all lights is the sum of the images in each light alone."""
    return [Side("all lights", [scene]), Side("one light each", list(single_lights(scene)))]


def groups(scene: Scene, draws: Draws) -> list[Side]:
    """The layer of a light group is the image in the lights of this group alone."""
    grouped = in_groups(scene, draws)
    group = draws.one_of(light_groups(grouped))
    return [Side(f"the layer {group}", [grouped], group=group), Side("its lights alone", [only_lit(grouped, group)])]


def strategies(scene: Scene, draws: Draws) -> list[Side]:
    """BSDF sampling and light sampling alone have the mean of both combined (MIS).

    Each leaves to the other what it cannot sample: delta lights, specular directions, environments below their mean.
    Light sampling also leaves directions whose density is below a hundredth of BSDF sampling's, as in texels that are
    hardly brighter than the mean: their samples are so rare and bright that their variance is not seen.
    """
    return [
        Side("both", [scene]),
        Side("BSDF sampling", [scene], {"MIS_WEIGHTS": ["bench/bsdf_sampling.cl"]}),
        Side("light sampling", [scene], {"MIS_WEIGHTS": ["bench/light_sampling.cl"]}),
    ]


def choice(scene: Scene, draws: Draws) -> list[Side]:
    """The mean does not depend on the light selection probabilities."""
    return [Side("by importance", [scene]), Side("uniformly", [scene], {"LIGHT_CHOICE": ["bench/uniform_choice.cl"]})]


def integrators(scene: Scene, draws: Draws) -> list[Side]:
    """Paths of depth 2 give the direct lighting that `direct`, `local` and `raster` compute.

    The environment is left out, as it is unoccluded ambient light in the last two, and materials with another form in
    the local integrators are replaced by Lambertian ones.
    """
    plain = with_materials(replace(scene, environment=Environment()), _without_local_form)
    plain = replace(plain, render=replace(scene.render, max_depth=2))
    names: tuple[Integrator, ...] = ("path", "direct", "local")
    sides = [Side(name, [replace(plain, render=replace(plain.render, integrator=name))]) for name in names]
    with suppress(SceneError):  # not every camera can be rasterised
        sides.append(Side("raster", [replace(plain, render=replace(plain.render, integrator="raster"))]))
    return sides


def brightness(scene: Scene, draws: Draws) -> list[Side]:
    """Scaling all light by a factor scales the image."""
    factor = draws.decades(-3.0, 3.0)
    return [Side("as it is", [scene]), Side(f"{factor:g} times the light", [brighter(scene, factor)], scale=1 / factor)]


def similarity(scene: Scene, draws: Draws) -> list[Side]:
    """A scene that is moved, rotated, mirrored and scaled together with its camera has the same image."""
    similar = random_similarity(scene, draws)
    return [Side("as it is", [scene]), Side(str(similar), [similar.of(scene)], mirrored=similar.mirrored)]


def partition(scene: Scene, draws: Draws) -> list[Side]:
    """Meshes may be split in two or replaced by instances, and instances by meshes."""
    halves = [half for mesh in scene.meshes for half in _halves(mesh)]
    placed = [_as_instance(mesh, draws) for mesh in scene.meshes]
    return [
        Side("as it is", [scene]),
        Side("cut in two", [replace(scene, meshes=halves)]),
        Side("all instances", [replace(scene, meshes=[], instances=placed + scene.instances)]),
        Side("all meshes", [replace(scene, meshes=scene.meshes + list(map(baked, scene.instances)), instances=[])]),
    ]


def bystanders(scene: Scene, draws: Draws) -> list[Side]:
    """Objects outside the view change nothing, although the program contains their materials.

    One of them has a material type of the scene, with its own parameters.
    """
    own = [type(each) for each in _materials(scene)]
    kinds: list[type[Material]] = [draws.one_of(MATERIALS), draws.one_of(own)]
    small = [
        Sphere(center=(x, -8.0, 0.0), radius=1e-3, material=draws.material(kind, emission=BLACK))
        for x, kind in enumerate(kinds)
    ]
    return [Side("as it is", [scene]), Side("with others far below", [replace(scene, spheres=scene.spheres + small)])]


def guiding(scene: Scene, draws: Draws) -> list[Side]:
    """Guided paths have the same means as others."""
    return [Side("as it is", [scene]), Side("guided", [scene], guided=True)]


#: Properties by name.
PROPERTIES: dict[str, Property] = {
    each.__name__: each
    for each in (
        additivity,
        groups,
        strategies,
        choice,
        integrators,
        brightness,
        similarity,
        partition,
        bystanders,
        guiding,
    )
}
#: Properties with moderate scenes (see Draws), because one side does without a sampling strategy.
MODERATE = {"strategies", "choice", "integrators"}


def single_lights(scene: Scene) -> Iterator[Scene]:
    """Yield the scene in each light alone: those without a surface, the environment, each emissive material."""
    dark = brighter(scene, 0.0)
    for i, light in enumerate(scene.lights):
        yield replace(dark, lights=[light])
    if scene.environment.image is not None or any(scene.environment.color):
        yield replace(dark, environment=scene.environment)
    emissive = {id(each): each for each in _materials(scene) if any(each.radiance)}
    for own in emissive.values():
        yield with_materials(replace(dark, **_users(scene)), lambda each: each if each is own else _times(each, 0.0))


def in_groups(scene: Scene, draws: Draws) -> Scene:
    """Return the scene with each of its lights, its environment and its emissive materials in one of GROUPS."""
    lights: list[Light] = [replace(light, light_group=draws.one_of(GROUPS)) for light in scene.lights]
    environment = replace(scene.environment, light_group=draws.one_of(GROUPS))
    names = {id(each): draws.one_of(GROUPS) for each in _materials(scene) if any(each.radiance)}
    return with_materials(
        replace(scene, lights=lights, environment=environment),
        lambda each: replace(each, light_group=names[id(each)]) if id(each) in names else each,
    )


def only_lit(scene: Scene, group: str) -> Scene:
    """Return the scene in the lights of a light group alone."""
    dark = brighter(scene, 0.0)
    lights = [light for light in scene.lights if group_of(light.light_group) == group]
    environment = scene.environment if group_of(scene.environment.light_group) == group else dark.environment
    return with_materials(
        replace(dark, **_users(scene), lights=lights, environment=environment),
        lambda each: each if group_of(each.light_group) == group else _times(each, 0.0),
    )


def brighter(scene: Scene, factor: float) -> Scene:
    """Return the scene with all light multiplied by a factor; without lights if that is 0."""
    sky, lights = scene.environment, list[Light]()
    for light in scene.lights if factor else ():
        scaled: dict[str, Any] = {
            name: _scaled(value, factor) for name, value in vars(light).items() if name in STRENGTHS
        }
        lights.append(replace(light, **scaled))
    environment = replace(sky, strength=sky.strength * factor) if factor else Environment()
    return with_materials(replace(scene, lights=lights, environment=environment), lambda each: _times(each, factor))


def brightest(scene: Scene) -> float:
    """Return the largest radiance that rays can find."""
    sky = scene.environment
    found = [each.radiance for each in scene.lights if isinstance(each, DirectionalLight) and each.angle_degrees]
    found += [each.radiance for each in _materials(scene)]
    return float(max(sky.strength * np.max(sky.color if sky.image is None else sky.image), np.max(found)))


def with_materials(scene: Scene, change: Callable[[Material], Material]) -> Scene:
    """Return the scene with `change` applied once to each of its materials."""
    made = {id(each): change(each) for each in _materials(scene)}

    def changed(user: Lit) -> Lit:
        return user if user.material is None else replace(user, material=made[id(user.material)])

    meshes = {id(mesh): changed(mesh) for mesh in (*scene.meshes, *(each.mesh for each in scene.instances))}
    return replace(
        scene,
        meshes=[meshes[id(mesh)] for mesh in scene.meshes],
        spheres=list(map(changed, scene.spheres)),
        instances=[replace(changed(each), mesh=meshes[id(each.mesh)]) for each in scene.instances],
    )


def _users(scene: Scene) -> dict[str, Any]:
    return {name: getattr(scene, name) for name in ("meshes", "instances", "spheres")}


def _materials(scene: Scene) -> Iterator[Material]:
    users: list[Mesh | Sphere | Instance] = [*scene.meshes, *scene.spheres, *scene.instances]
    yield from (user.material for user in users if user.material is not None)
    yield from (each.mesh.material for each in scene.instances)


def _times(material: Material, factor: float) -> Material:
    """Return the material with its emission multiplied by a factor."""
    emission = material.emission
    if isinstance(emission, Texture):
        emission = replace(emission, factor=_scaled(material.radiance, factor)) if factor else BLACK
    else:
        emission = _scaled(emission, factor)
    return replace(material, emission=emission)


def _scaled(color: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    red, green, blue = (part * factor for part in color)
    return red, green, blue


def _without_local_form(material: Material) -> Material:
    """Return a Lambertian material in place of one whose kernel has another form in the local integrators."""
    if "LOCAL" not in kernel_folder().joinpath(f"bsdf/{material.kernel}.cl").read_text(encoding="utf-8"):
        return material
    return Diffuse(color=getattr(material, "color", Diffuse().color), emission=material.emission)


def _halves(mesh: Mesh) -> list[Mesh]:
    """Return two meshes with every other face each.

    A mesh with a normal map is not split: its tangents are averaged over adjacent faces.
    """
    if len(mesh.faces) < 2 or mesh.material.bent_by is not None:
        return [mesh]
    return [
        replace(mesh, faces=np.ascontiguousarray(mesh.faces[start::2]), name=f"{mesh.name}, {start}")
        for start in (0, 1)
    ]


def _as_instance(mesh: Mesh, draws: Draws) -> Instance:
    """Return an instance with a random transform, of the mesh transformed by its inverse."""
    x, y, z = draws.vector(0.3, 3.0)
    matrix = translation(draws.vector()) @ rotation(draws.vector(-180, 180)) @ scaling((x, y, -z))
    return Instance(transform_mesh(mesh, np.linalg.inv(matrix).astype(np.float64)), matrix, name=mesh.name)
