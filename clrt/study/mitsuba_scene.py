"""A scene as Mitsuba 3 is told of it: dictionaries of plugins by the names of its manual, for its `rgb` variants.

Numbers, names and numpy arrays only, so that nothing of Mitsuba is needed here: 4x4 arrays are transforms, arrays of
three dimensions pictures, and a plugin of type "mesh" has vertices, faces and normals (mitsuba_renderer.py builds it).
To add a material, write what it is in BSDFS.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..scene.lights import Light, PointLight, SpotLight
from ..scene.instancing import unfolded
from ..scene.material import ALPHA_MIN
from ..scene.materials import Conductor, Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from ..scene.model import Camera, Environment, Mesh, Scene, Sphere
from ..scene.textures import untextured

Plugin = dict[str, Any]

#: How near and far the camera sees, of the distance to where it looks.
NEAR, FAR = 1e-4, 1e6
#: An alpha up to which the separable Smith term takes less than 4e-4 of even light that the height-correlated leaves.
NEARLY_SMOOTH = 0.09


def mitsuba_scene(scene: Scene, sampler: str = "independent") -> Plugin:
    """The plugins of `scene` with its own settings. UsageError names what has no counterpart in Mitsuba."""
    if scene.render.filter != "box":
        raise UsageError(f'{scene.name}: Mitsuba is compared with filter = "box"')
    if scene.render.integrator == "local":
        raise UsageError(f'{scene.name}: Mitsuba has no integrator "local"')
    depth = scene.render.max_depth if scene.render.integrator == "path" else min(scene.render.max_depth, 2)
    plugins: Plugin = {"type": "scene", "integrator": {"type": "path", "max_depth": depth},
                       "sensor": _sensor(scene, sampler)}
    plugins |= {f"mesh{i}": _surface(_mesh(mesh), mesh) for i, mesh in enumerate(unfolded(scene).meshes)}
    plugins |= {f"sphere{i}": _surface({"type": "sphere", "center": list(sphere.center), "radius": sphere.radius},
                                       sphere) for i, sphere in enumerate(scene.spheres)}
    plugins |= {f"light{i}": _light(light) for i, light in enumerate(scene.lights)}
    return plugins | _environment(scene.environment)


def _sensor(scene: Scene, sampler: str) -> Plugin:
    """A pinhole or lens, and its film: pixels are means over their own squares."""
    camera, (width, height) = scene.camera, scene.render.size
    if camera.projection != "perspective":
        raise UsageError(f"{scene.name}: Mitsuba is not told of {camera.projection} cameras yet")
    distance = float(np.linalg.norm(np.subtract(camera.look_at, camera.position)))
    lens: Plugin = {"type": "perspective"}
    if camera.aperture_radius:
        lens = {"type": "thinlens", "aperture_radius": camera.aperture_radius,
                "focus_distance": camera.focus_distance or distance}
    return {**lens, "fov": camera.fov_degrees, "fov_axis": "y", "to_world": _look_at(camera),
            "near_clip": NEAR * distance, "far_clip": FAR * distance, "sampler": {"type": sampler},
            "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}}}


def _look_at(camera: Camera) -> NDArray[np.float64]:
    """Camera to world: Mitsuba's cameras look along +z, with +x to the picture's left."""
    forward = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    left = np.cross(np.asarray(camera.up, np.float64), forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([left, np.cross(forward, left), forward, camera.position])
    return matrix


def _mesh(mesh: Mesh) -> Plugin:
    return {"type": "mesh", "vertices": mesh.vertices, "faces": mesh.faces, "normals": mesh.normals}


def _surface(shape: Plugin, owner: Mesh | Sphere) -> Plugin:
    """The shape with its material, and its light where it has any."""
    kind = type(owner.material)
    if kind not in BSDFS:
        raise UsageError(f"{owner.name}: Mitsuba is not told of {owner.material.kernel} yet")
    try:
        shape["bsdf"] = BSDFS[kind](owner.material)
    except ValueError as error:
        raise UsageError(f"{owner.name}: Mitsuba cannot draw {error}") from None
    if any(owner.material.radiance):
        shape["emitter"] = {"type": "area", "radiance": _rgb(untextured(owner.material.emission))}
    return shape


def _diffuse(material: Diffuse) -> Plugin:
    return _two_sided({"type": "diffuse", "reflectance": _rgb(untextured(material.color))})


def _mirror(material: Mirror) -> Plugin:
    color = _rgb(untextured(material.color))
    return _two_sided({"type": "conductor", "material": "none", "specular_reflectance": color})


def _metal(material: MetallicRoughness) -> Plugin:
    """`principled` is GGX under Schlick's Fresnel term with the separable Smith term, if metallic is 1, exactly."""
    lobes = material.lobes
    if np.any(lobes.albedo):
        raise ValueError("metallic_roughness that is not all metal: its own has another diffuse part")
    if material.features() & {"LAYERS", "SPECULAR"}:
        raise ValueError("metals with layers")
    if material.smith != "separable" or material.multiple_scattering:
        raise ValueError('metals but with smith = "separable" and single scattering')
    return _two_sided({"type": "principled", "metallic": 1.0, "roughness": sqrt(lobes.alpha),
                       "base_color": _rgb(lobes.f0)})


def _dielectric(material: Dielectric) -> Plugin:
    if material.attenuation_distance is not None or (material.thin and material.rough):
        raise ValueError("glass that absorbs, or is thin and rough")
    if untextured(material.roughness)**2 > NEARLY_SMOOTH:
        raise ValueError("glass rougher than 0.3: its own has the separable Smith term")
    plugin = {"type": "thindielectric" if material.thin else "dielectric", "int_ior": material.ior, "ext_ior": 1.0}
    if material.thin and untextured(material.color) != (1.0, 1.0, 1.0):
        raise ValueError("thin glass in color: its own is not crossed again by what bounces inside")
    if material.rough:
        plugin |= {"type": "roughdielectric", "distribution": "ggx",
                   "alpha": max(untextured(material.roughness)**2, ALPHA_MIN)}
    return plugin | {"specular_transmittance": _rgb(untextured(material.color))}


def _conductor(material: Conductor) -> Plugin:
    values = material.parameters()
    if untextured(material.roughness)**2 > NEARLY_SMOOTH:
        raise ValueError("conductor rougher than 0.3: its own has the separable Smith term")
    return _two_sided({"type": "roughconductor", "distribution": "ggx", "eta": _rgb(values["eta"]),
                       "k": _rgb(values["k"]), "alpha": max(untextured(material.roughness)**2, ALPHA_MIN)})


BSDFS: dict[type[Material], Callable[[Any], Plugin]] = {
    Diffuse: _diffuse, Mirror: _mirror, MetallicRoughness: _metal, Dielectric: _dielectric, Conductor: _conductor}


def _two_sided(bsdf: Plugin) -> Plugin:
    """As seen from behind, too, where Mitsuba's reflecting surfaces are black."""
    return {"type": "twosided", "front": bsdf}


def _light(light: Light) -> Plugin:
    if isinstance(light, PointLight):
        return {"type": "point", "position": list(light.position), "intensity": _rgb(light.intensity)}
    if isinstance(light, SpotLight):
        raise UsageError("spot: Mitsuba's spots fall off by the angle, ours by its cosine, squared")
    return {"type": "directional", "direction": list(light.direction), "irradiance": _rgb(light.irradiance)}


def _environment(environment: Environment) -> Plugin:
    """No plugin where the sky is black, since Mitsuba samples all lights alike."""
    color = environment.strength * np.asarray(environment.color)
    if environment.image is None:
        return {"sky": {"type": "constant", "radiance": _rgb(color)}} if color.any() else {}
    angle = np.radians(environment.rotation_degrees)
    turned = np.eye(4)
    turned[np.ix_([0, 2], [0, 2])] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    return {"sky": {"type": "envmap", "bitmap": rows_at_poles(environment.image), "to_world": turned,
                    "scale": environment.strength}}


def rows_at_poles(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same sky, interpolated linearly as well, of 2h + 1 rows of which the first and the last are the poles.

    Ours, (h, w, 3), has rows at (row + ½)/h; Mitsuba's H rows are at row/(H − 1). Of the new ones each second is one of
    ours, and between them is what both would interpolate.
    """
    padded = np.concatenate([image[:1], image, image[-1:]])
    rows = np.empty((2 * len(image) + 1, *image.shape[1:]), np.float32)
    rows[1::2] = image
    rows[::2] = (padded[:-1] + padded[1:]) / 2
    return rows


def _rgb(values: Any) -> Plugin:
    return {"type": "rgb", "value": [float(value) for value in values]}
