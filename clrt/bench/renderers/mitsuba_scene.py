"""Conversion of a scene to Mitsuba 3: dictionaries of plugins by the names of its manual, for its `rgb` variants.

The result has numbers, strings and numpy arrays only, so that Mitsuba is not required here: 4x4 arrays are transforms,
3-dimensional arrays are images, and a plugin of type "mesh" has a mesh's arrays (mitsuba_renderer.py builds it).
Materials are converted in mitsuba_bsdfs.py.
"""

from __future__ import annotations

from math import cos, pi, radians, tan
from typing import Any, assert_never

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...rendering.compile.features import biased_by
from ...scene.geometry.instancing import unfolded
from ...scene.light_images import LightImage
from ...scene.lights import DirectionalLight, GoniometricLight, Light, PointLight, ProjectorLight, SpotLight
from ...scene.materials.material_types import Dielectric
from ...scene.materials.textures import Texture
from ...scene.model import Camera, Environment, Mesh, Scene, Sphere
from ...scene.on_ground import on_ground
from .camera_visibility import check_seen_as_lit
from .mitsuba_bsdfs import Plugin, bsdf, color, medium, rgb

#: Near and far clip distances, relative to the distance of the look-at point.
NEAR, FAR = 1e-4, 1e6
#: Distance of a sun's disc, relative to that distance.
SUN_DISTANCE = 1e5
#: The texture that represents a spot light's falloff: texels per side, and the widest cone.
SPOT_TEXELS, SPOT_DEGREES = 2048, 80
#: Largest angular diameter of a sun, for which the disc's diameter is twice its distance.
SUN_DEGREES = 90


def mitsuba_scene(scene: Scene, sampler: str = "independent") -> Plugin:
    """Return the plugins of `scene` with its own settings. Raises UsageError for an unsupported feature."""
    scene = on_ground(scene)
    if scene.render.filter == "blackman_harris":
        raise UsageError(f"{scene.name}: Mitsuba has no such filter; write filter = box, tent or gaussian")
    if scene.render.integrator not in ("path", "direct"):
        raise UsageError(f'{scene.name}: Mitsuba has no integrator "{scene.render.integrator}"')
    if scene.render.back_face_culling != "none":
        raise UsageError(f"{scene.name}: Mitsuba culls no back faces; leave out back_face_culling")
    check_seen_as_lit(scene, "Mitsuba")
    if biases := biased_by(scene.render):
        raise UsageError(f"{scene.name}: Mitsuba clamps nothing; leave out {' and '.join(biases)}")
    owners: list[Mesh | Sphere] = [*unfolded(scene).meshes, *scene.spheres]
    absorbs = any(isinstance(owner.material, Dielectric) and medium(owner.material) for owner in owners)
    plugins: Plugin = {
        "type": "scene",
        "sensor": _sensor(scene, sampler),
        "integrator": {"type": "volpath" if absorbs else "path", "max_depth": path_depth(scene)},
    }
    plugins |= {
        f"{'mesh' if isinstance(owner, Mesh) else 'sphere'}{i}": _surface(owner)
        for kind in (Mesh, Sphere)
        for i, owner in enumerate(each for each in owners if isinstance(each, kind))
    }
    plugins |= {f"light{i}": _light(light, scene.camera) for i, light in enumerate(scene.lights)}
    return plugins | _environment(scene.environment)


def path_depth(scene: Scene) -> int:
    """Return Mitsuba's maximum path depth for the scene's integrator, "path" or "direct"."""
    return scene.render.max_depth if scene.render.integrator == "path" else min(scene.render.max_depth, 2)


def _sensor(scene: Scene, sampler: str) -> Plugin:
    """Return the camera and its film."""
    camera, (width, height) = scene.camera, scene.render.size
    distance = _distance(camera)
    to_world = _frame(camera.position, np.subtract(camera.look_at, camera.position), camera.up)
    lens: Plugin = {"type": "perspective", "fov": camera.fov_degrees, "fov_axis": "y"}
    if camera.projection not in ("perspective", "orthographic"):
        raise UsageError(f"{scene.name}: Mitsuba has no {camera.projection} camera")
    if any(camera.distortion):
        raise UsageError(f"{scene.name}: Mitsuba has no lens distortion")
    if camera.projection == "orthographic":
        tall = camera.view_height or 2 * distance * tan(radians(camera.fov_degrees) / 2)
        lens = {"type": "orthographic"}  # x from -1 to 1
        to_world = to_world @ np.diag([tall * width / height / 2, tall * width / height / 2, 1, 1])
    elif camera.aperture_radius:
        lens |= {
            "type": "thinlens",
            "aperture_radius": camera.aperture_radius,
            "focus_distance": camera.focus_distance or distance,
        }
    return {
        **lens,
        "to_world": to_world,
        "near_clip": NEAR * distance,
        "far_clip": FAR * distance,
        "sampler": {"type": sampler},
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": scene.render.filter},
            "sample_border": scene.render.filter != "box",
        },
    }


def _frame(position: Any, direction: Any, up: Any = (0.0, 1.0, 0.0)) -> NDArray[np.float64]:
    """Return the local-to-world matrix of cameras and spot lights, which look along +z with +x to the image's left."""
    forward = np.asarray(direction, np.float64)
    forward /= np.linalg.norm(forward)
    left = np.cross(np.asarray(up, np.float64), forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([left, np.cross(forward, left), forward, position])
    return matrix


def _surface(owner: Mesh | Sphere) -> Plugin:
    """Return a mesh or sphere with its BSDF, interior medium, and emission if it has any."""
    shape = _mesh(owner) if isinstance(owner, Mesh) else _sphere(owner)
    shape["bsdf"] = bsdf(owner)
    if isinstance(owner.material, Dielectric) and (inside := medium(owner.material)):
        shape["interior"] = inside
    if any(owner.material.radiance):
        if owner.material.double_sided:
            raise UsageError(f"{owner.name}: Mitsuba's area lights emit from one side; leave out double_sided")
        if isinstance(owner, Sphere) and isinstance(owner.material.emission, Texture):
            raise UsageError(f"{owner.name}: Mitsuba samples textured emissive spheres as if they were rotated")
        shape["emitter"] = {"type": "area", "radiance": color(owner.material.emission)}
    return shape


def _mesh(mesh: Mesh) -> Plugin:
    arrays: Plugin = {"vertices": mesh.vertices, "faces": mesh.faces, "normals": mesh.normals}
    sets = {texture.uv_set for texture in mesh.material.textures()}
    if len(sets) > 1:
        raise UsageError(f"{mesh.name}: Mitsuba's meshes have one set of texture coordinates")
    if sets:
        arrays["uv"] = mesh.uv1 if sets == {1} else mesh.uv
    if mesh.colors is not None:
        color = getattr(mesh.material, "color", 1.0)
        arrays["colors"] = mesh.colors[:, :3] * np.float32(1.0 if isinstance(color, Texture) else color)
        if mesh.has_alpha and not isinstance(mesh.material.opacity, Texture):
            arrays["opacity"] = mesh.colors[:, 3] * np.float32(mesh.material.opacity)
    return {"type": "mesh", **arrays}


def _sphere(sphere: Sphere) -> Plugin:
    """Return a sphere rotated to clrt's texture coordinates: from z down, and from −x, the middle, towards −y."""
    place = np.eye(4)
    place[:3] = np.column_stack([(0, 0, -sphere.radius), (-sphere.radius, 0, 0), (0, sphere.radius, 0), sphere.center])
    return {"type": "sphere", "to_world": place}


def _distance(camera: Camera) -> float:
    """Return the distance from the camera to its look-at point."""
    return float(np.linalg.norm(np.subtract(camera.look_at, camera.position)))


def _light(light: Light, camera: Camera) -> Plugin:
    if not isinstance(light, DirectionalLight) and light.range is not None:
        raise UsageError("light: ranges are not exported to Mitsuba")
    match light:
        case PointLight():
            return {"type": "point", "position": list(light.position), "intensity": rgb(light.intensity)}
        case SpotLight():
            return _spot(light)
        case ProjectorLight():
            return _projector(light)
        case GoniometricLight():
            raise UsageError("goniometric: Mitsuba has no such light")
        case DirectionalLight() if light.angle_degrees:
            return _sun(light, camera)
        case DirectionalLight():
            return {"type": "directional", "direction": list(light.direction), "irradiance": rgb(light.irradiance)}
        case _:
            assert_never(light)


def _sun(light: DirectionalLight, camera: Camera) -> Plugin:
    """Return a disc so far away that its direction is the same everywhere; Mitsuba has no emitter for a sun."""
    if light.angle_degrees > SUN_DEGREES:
        raise UsageError(
            f"light: Mitsuba is compared with suns of up to {SUN_DEGREES} degrees; this one has "
            f"angle_degrees = {light.angle_degrees:g}"
        )
    far = SUN_DISTANCE * _distance(camera)
    towards = -np.asarray(light.direction) / np.linalg.norm(light.direction)
    radius = far * tan(radians(light.angle_degrees) / 2)
    place = _frame(camera.look_at + far * towards, light.direction, _up_for(light.direction))
    return {
        "type": "disk",
        "to_world": place @ np.diag([radius, radius, 1, 1]),
        "emitter": {"type": "area", "radiance": rgb(light.radiance)},
    }


def _up_for(direction: Any) -> tuple[float, float, float]:
    """Return an axis that is not parallel to the direction."""
    return (0.0, 1.0, 0.0) if abs(direction[1]) < 0.9 * float(np.linalg.norm(direction)) else (1.0, 0.0, 0.0)


def _spot(light: SpotLight) -> Plugin:
    """Return a spot light. Mitsuba's falloff is linear in the angle; glTF's is represented by a projected texture."""
    frame = _frame(light.position, light.direction, _up_for(light.direction))
    plugin = {"type": "spot", "to_world": frame, "intensity": rgb(light.intensity), "cutoff_angle": light.outer_degrees}
    if light.image is not None:
        if light.falloff != "angle":
            raise UsageError('spot: a spot with an image is exported to Mitsuba only with falloff = "angle"')
        frame = _frame(light.position, light.direction, tuple(-part for part in light.up))  # the image is upside down
        plugin |= {"to_world": frame, "texture": _image(light.image, (1.0, 1.0, 1.0))}
    if light.falloff == "angle":
        return plugin | {"beam_width": light.inner_degrees}
    if light.outer_degrees > SPOT_DEGREES:
        raise UsageError(f"spot: only cones up to {SPOT_DEGREES} degrees from their axis are exported to Mitsuba")
    across = (np.arange(SPOT_TEXELS) * 2 + 1) / SPOT_TEXELS - 1
    off = np.hypot(across[:, None], across) * tan(radians(light.outer_degrees))
    inner, outer = cos(radians(light.inner_degrees)), cos(radians(light.outer_degrees))
    falloff = np.clip((1 / np.sqrt(1 + off**2) - outer) / (inner - outer), 0, 1) ** 2
    return plugin | {
        "beam_width": light.outer_degrees,
        "texture": {
            "type": "bitmap",
            "bitmap": np.repeat(falloff[..., None], 3, 2).astype(np.float32),
            "raw": True,
            "wrap_mode": "clamp",
        },
    }


def _projector(light: ProjectorLight) -> Plugin:
    if light.image_of != "irradiance":
        raise UsageError('projector: Mitsuba has only image_of = "irradiance"')
    return {
        "type": "projector",
        "to_world": _frame(light.position, light.direction, light.up),
        "fov": light.fov_degrees,
        "fov_axis": "y",
        "scale": 1 / pi,
        "irradiance": _image(light.shows, light.intensity),
    }


def _image(image: LightImage, factor: tuple[float, float, float]) -> Plugin:
    """Return a light's image times a color."""
    wrap = image.wrap or ("clamp", "clamp")
    if wrap[0] != wrap[1]:
        raise UsageError("light: Mitsuba's images have one wrap mode")
    if 1 in image.pixels.shape[:2] and image.aspect != 1:
        raise UsageError("light: Mitsuba's images have at least 2x2 pixels")
    to_picture = np.eye(4)
    to_picture[:2][:, [0, 1, 3]] = image.to_picture
    return {
        "type": "bitmap",
        "bitmap": image.pixels * np.array(factor, np.float32),
        "raw": True,
        "to_uv": to_picture,
        "wrap_mode": wrap[0],
        "filter_type": "bilinear" if image.filter == "linear" else "nearest",
    }


def _environment(environment: Environment) -> Plugin:
    """Return the environment; no plugin if it is black, since Mitsuba samples all emitters equally."""
    color = environment.strength * np.asarray(environment.color)
    if environment.image is None:
        return {"sky": {"type": "constant", "radiance": rgb(color)}} if color.any() else {}
    angle = np.radians(environment.rotation_degrees)
    turned = np.eye(4)
    turned[np.ix_([0, 2], [0, 2])] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    return {
        "sky": {
            "type": "envmap",
            "bitmap": rows_at_poles(environment.image),
            "to_world": turned,
            "scale": environment.strength,
        }
    }


def rows_at_poles(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Resample an environment map to 2h + 1 rows, the first and last at the poles, with the same linear interpolation.

    Ours, (h, w, 3), has rows at (row + ½)/h; Mitsuba's H rows are at row/(H − 1). Every other new row is one of ours;
    those between them are what both interpolate.
    """
    padded = np.concatenate([image[:1], image, image[-1:]])
    rows = np.empty((2 * len(image) + 1, *image.shape[1:]), np.float32)
    rows[1::2] = image
    rows[::2] = (padded[:-1] + padded[1:]) / 2
    return rows
