"""Conversion of a scene to Blender 5 for Cycles: `bpy.data` and its objects.

Blender's up is +z: its x, y, z are our z, x, y, so that environment maps need no conversion. To add a material, write
its node in BSDFS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, assert_never

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import UsageError
from ...output.images import write_image
from ...rendering.compile.features import biased_by
from ...scene.geometry.instancing import unfolded
from ...scene.lights import DirectionalLight, GoniometricLight, PointLight, ProjectorLight, SpotLight
from ...scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from ...scene.materials.textures import untextured
from ...scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from ...scene.on_ground import on_ground
from ..rays.hard_meshes import icosphere
from .camera_visibility import check_seen_as_lit

#: Near and far clip distances, relative to the distance of the look-at point.
NEAR, FAR = 1e-4, 1e6
#: Cycles has no spheres: they are tessellated into 20·4^SUBDIVISIONS triangles with the sphere's normals.
SUBDIVISIONS = 6
#: Power in W of a point light of 1 W/sr in all directions.
POINT_WATT = 4 * np.pi
#: Lights with a counterpart.
Exported = PointLight | DirectionalLight


def check_scene(scene: Scene) -> None:
    """Raise UsageError for a feature that has no counterpart in Cycles."""
    owners: list[Mesh | Sphere] = [*unfolded(scene).meshes, *scene.spheres]
    for owner in owners:
        if type(owner.material) not in BSDFS:
            raise UsageError(f"{owner.name}: {owner.material.kernel} is not exported to Cycles yet")
        if isinstance(owner.material, MetallicRoughness) and not _is_metal(owner.material):
            raise UsageError(
                f"{owner.name}: Cycles supports metallic_roughness that is fully metallic, with single "
                'scattering and smith = "height_correlated"'
            )
        if isinstance(owner.material, Dielectric) and owner.material.features() != {"TRANSMISSION"}:
            raise UsageError(f"{owner.name}: Cycles supports dielectric that is smooth, not thin, and absorbs nothing")
    exported_lights(scene)
    if scene.camera.projection != "perspective" or scene.camera.aperture_radius or any(scene.camera.distortion):
        raise UsageError(f"{scene.name}: only pinhole cameras are exported to Cycles")
    if scene.render.integrator == "local":
        raise UsageError(f'{scene.name}: Cycles has no integrator "local"')
    if scene.render.back_face_culling != "none":
        raise UsageError(f"{scene.name}: back_face_culling is not exported to Cycles; leave it out")
    check_seen_as_lit(scene, "Cycles")
    if biases := biased_by(scene.render):
        raise UsageError(f"{scene.name}: clamps are not exported to Cycles; leave out {' and '.join(biases)}")
    if scene.render.filter != "box" or scene.render.max_depth < 2:
        raise UsageError(f'{scene.name}: Cycles is compared with filter = "box" and max_depth of 2 or more')


def blender_scene(data: Any, scene: Scene, folder: Path, bsdfs: Mapping[type[Material], Bsdf] | None = None) -> Any:
    """Add the scene to `data` (bpy.data); images are written to `folder`. bsdfs: used instead of BSDFS."""
    scene = on_ground(scene)
    made = data.scenes.new(scene.name)
    set_up(made, scene.render)
    bsdfs = bsdfs or BSDFS
    for mesh in unfolded(scene).meshes:
        place(data, made, _mesh(data, mesh.vertices, mesh.faces, mesh.normals, _material(data, mesh.material, bsdfs)))
    for sphere in scene.spheres:
        place(data, made, _mesh(data, *sphere_triangles(sphere), _material(data, sphere.material, bsdfs)))
    for light in exported_lights(scene):
        place(data, made, *_light(data, light))
    made.camera = place(data, made, *_camera(data, scene.camera))
    made.world = world(data, scene.environment, folder)
    return made


def set_up(made: Any, settings: RenderSettings) -> None:
    """Disable clamping and denoising, use a box filter one pixel wide; Cycles' bounces are the path depth minus 2."""
    render, cycles, (width, height) = made.render, made.cycles, settings.size
    depth = settings.max_depth if settings.integrator == "path" else 2
    render.engine, render.use_persistent_data = "CYCLES", True
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    cycles.device, cycles.pixel_filter_type, cycles.filter_width = "CPU", "BOX", 1.0
    cycles.max_bounces = depth - 2
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = depth
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    picture = render.image_settings
    picture.file_format, picture.color_mode, picture.color_depth = "OPEN_EXR", "RGB", "32"


class Nodes:
    """Adds nodes to a material or world, by type without "ShaderNode"; inputs are values, or outputs to link."""

    def __init__(self, owner: Any) -> None:
        self._tree = owner.node_tree
        self._tree.nodes.clear()

    def __call__(self, kind: str, inputs: dict[str | int, Any] | None = None, **settings: Any) -> Any:
        node = self._tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            if hasattr(value, "links"):
                self._tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node


def _diffuse(nodes: Nodes, material: Diffuse) -> Any:
    return nodes("BsdfDiffuse", {"Color": (*untextured(material.color), 1), "Roughness": 0.0})


def _mirror(nodes: Nodes, material: Mirror) -> Any:
    return nodes("BsdfAnisotropic", {"Color": (*untextured(material.color), 1), "Roughness": 0.0})


def _metal(nodes: Nodes, material: MetallicRoughness) -> Any:
    """Return a metal. The F82 model equals Schlick's if its tint is white; Blender squares roughness, too."""
    return nodes(
        "BsdfMetallic",
        {"Base Color": (*material.lobes.f0, 1), "Edge Tint": (1, 1, 1, 1), "Roughness": material.roughness},
        fresnel_type="F82",
        distribution="GGX",
    )


def _dielectric(nodes: Nodes, material: Dielectric) -> Any:
    """Mix reflection and refraction: the color of Blender's glass would also tint the reflection."""
    reflection = nodes("BsdfAnisotropic", {"Color": (1, 1, 1, 1), "Roughness": 0.0})
    color = (*untextured(material.color), 1)
    refraction = nodes("BsdfRefraction", {"Color": color, "Roughness": 0.0, "IOR": material.ior})
    part = nodes("Fresnel", {"IOR": material.ior}).outputs[0]
    return nodes("MixShader", {0: part, 1: refraction.outputs[0], 2: reflection.outputs[0]})


Bsdf = Callable[[Nodes, Any], Any]
BSDFS: dict[type[Material], Bsdf] = {
    Diffuse: _diffuse,
    Mirror: _mirror,
    MetallicRoughness: _metal,
    Dielectric: _dielectric,
}


def _is_metal(material: MetallicRoughness) -> bool:
    return (
        not np.any(material.lobes.albedo)
        and material.smith == "height_correlated"
        and not material.features() & {"MULTIPLE_SCATTERING", "LAYERS", "SPECULAR", "ANISOTROPY", "IRIDESCENCE"}
    )


def _material(data: Any, material: Material, bsdfs: Mapping[type[Material], Bsdf]) -> Any:
    """Return a material with its BSDF, and its emission from the front or from both sides."""
    made = data.materials.new(material.kernel)
    nodes = Nodes(made)
    shader = bsdfs[type(material)](nodes, material).outputs[0]
    if any(material.radiance):
        back = nodes("NewGeometry").outputs["Backfacing"]
        front = nodes("Math", {0: 1.0, 1: back}, operation="SUBTRACT").outputs[0]
        strength = 1.0 if material.double_sided else front
        emission = nodes("Emission", {"Color": (*untextured(material.emission), 1), "Strength": strength}).outputs[0]
        shader = nodes("AddShader", {0: shader, 1: emission}).outputs[0]
        made.cycles.emission_sampling = "FRONT_BACK" if material.double_sided else "FRONT"
    nodes("OutputMaterial", {"Surface": shader})
    return made


def _mesh(data: Any, vertices: NDArray[Any], faces: NDArray[Any], normals: NDArray[Any] | None, material: Any) -> Any:
    made = data.meshes.new("mesh")
    made.from_pydata(turned(vertices).tolist(), [], faces.tolist())
    made.materials.append(material)
    if normals is None:
        made.shade_flat()
    else:
        made.shade_smooth()
        made.normals_split_custom_set_from_vertices(turned(normals).tolist())
    return made


def sphere_triangles(sphere: Sphere) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return vertices, faces oriented outwards, and normals of a tessellated sphere."""
    normals, faces = icosphere(SUBDIVISIONS)
    a, b, c = normals[faces].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward, ::-1]
    return np.asarray(sphere.center) + sphere.radius * normals, faces, normals


def exported_lights(scene: Scene) -> list[Exported]:
    """Return the scene's lights. Raises UsageError for one without a counterpart in Cycles."""
    found: list[Exported] = []
    for light in scene.lights:
        match light:
            case PointLight(range=None) | DirectionalLight():
                found.append(light)
            case PointLight() | SpotLight():
                raise UsageError(
                    f"{scene.name}: ranges and spot lights fall off differently in Cycles and are not exported"
                )
            case ProjectorLight() | GoniometricLight():
                raise UsageError(f"{scene.name}: images of point lights are not exported to Cycles")
            case _:
                assert_never(light)
    return found


def _light(data: Any, light: Exported) -> tuple[Any, NDArray[np.float64]]:
    """Return the light, which emits along its −z, and its matrix to the world."""
    if isinstance(light, PointLight):
        made = data.lights.new("light", "POINT")
        made.shadow_soft_size, made.energy, made.color = 0.0, POINT_WATT, light.intensity
        return made, frame_of_axes(np.eye(3), light.position)
    made = data.lights.new("light", "SUN")
    made.angle, made.energy, made.color = np.radians(light.angle_degrees), 1.0, light.irradiance
    z = -np.asarray(light.direction) / np.linalg.norm(light.direction)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return made, frame_of_axes(np.array([x, np.cross(z, x), z]), (0, 0, 0))


def _camera(data: Any, camera: Camera) -> tuple[Any, NDArray[np.float64]]:
    """Return the camera, which looks along its −z with +y up, and its matrix to the world."""
    made = data.cameras.new("camera")
    back = np.subtract(camera.position, camera.look_at, dtype=np.float64)
    distance = np.linalg.norm(back)
    right = np.cross(camera.up, back)
    made.sensor_fit, made.angle = "VERTICAL", np.radians(camera.fov_degrees)
    made.clip_start, made.clip_end = NEAR * distance, FAR * distance
    right, back = right / np.linalg.norm(right), back / distance
    return made, frame_of_axes(np.array([right, np.cross(back, right), back]), camera.position)


def world(data: Any, environment: Environment, folder: Path) -> Any:
    """Return a Blender world; the environment's image, if any, is written to `folder`."""
    made = data.worlds.new("world")
    nodes = Nodes(made)
    color: Any = (*environment.color, 1)
    if environment.image is not None:
        file = folder / "sky.exr"
        write_image(file, environment.image)
        angle = -np.radians(environment.rotation_degrees)
        place = nodes("TexCoord").outputs["Generated"]
        turned = nodes("Mapping", {"Vector": place, "Rotation": (0, 0, angle)}).outputs[0]
        color = nodes("TexEnvironment", {"Vector": turned}, image=data.images.load(str(file))).outputs[0]
    background = nodes("Background", {"Color": color, "Strength": environment.strength}).outputs[0]
    nodes("OutputWorld", {"Surface": background})
    return made


def place(data: Any, made: Any, content: Any, frame: NDArray[np.float64] | None = None) -> Any:
    """Place an object in the scene. frame: (4, 4), to the world."""
    placed = data.objects.new(content.name, content)
    made.collection.objects.link(placed)
    if frame is not None:
        placed.matrix_world = frame.T.tolist()
    return placed


def frame_of_axes(axes: NDArray[np.float64], origin: ArrayLike) -> NDArray[np.float64]:
    """Return the (4, 4) matrix to Blender's world of our (3, 3) axes, one per row, and origin."""
    frame = np.eye(4)
    frame[:3] = np.column_stack([*turned(axes), turned(origin)])
    return frame


def turned(points: ArrayLike) -> NDArray[np.float64]:
    """Convert our x, y, z (..., 3) to Blender's axes."""
    return np.roll(np.asarray(points, np.float64), 1, axis=-1)
