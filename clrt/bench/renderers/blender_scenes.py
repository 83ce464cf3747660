"""Scenes built in Blender 5 (`pip install bpy`), and what clrt reads of them through Blender's own glTF exporter.

Suzanne, a sphere and a cube stand on a textured floor, lit by one or all of LIGHTS. Lengths are in meters; +z is up,
as in Blender.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from math import degrees, pi, radians
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...formats.model_choice import ModelChoice
from ...formats.models import read_model
from ...scene.lights import DirectionalLight
from ...scene.materials.material_types import Diffuse
from ...scene.model import Environment, Mesh, RenderSettings, Scene, Vector
from .cycles_renderer import quiet
from .cycles_scene import Nodes, place, set_up, world
from .plastic_floor import low_sun

SETTINGS = RenderSettings(size=(240, 160), max_depth=8)
CAMERA, LOOK_AT, FOV_DEGREES = (0.5, -6.0, 3.0), (0.0, 0.0, 0.45), 27.0
#: The environment map's sun is at clrt's −z, which cycles_scene maps to Blender's −x, and the exporter to clrt's −x.
ROTATION = 90.0
#: Edge length of the area light and of the emissive square.
SIDE = 1.0

#: The bmesh operator and arguments of each shape, and its location, scale and rotation about z in degrees.
SHAPES: dict[str, tuple[str, dict[str, Any], Vector, float, float]] = {
    "floor": ("create_grid", {"size": 5.0}, (0.0, 0.0, 0.0), 1.0, 0.0),
    "Suzanne": ("create_monkey", {}, (-1.4, 0.0, 0.6), 0.6, -20.0),
    "ball": ("create_uvsphere", {"u_segments": 64, "v_segments": 32, "radius": 0.6}, (0.1, -0.2, 0.6), 1.0, 0.0),
    "cube": ("create_cube", {"size": 1.0}, (1.5, 0.2, 0.5), 1.0, 35.0),
}
#: Base colors; the floor has the texture `checks`.
COLORS = {"floor": None, "Suzanne": (0.7, 0.35, 0.2), "ball": (0.3, 0.6, 0.7), "cube": (0.5, 0.5, 0.2)}
Inputs = dict[str | int, Any]
MATTE: Inputs = {"Roughness": 1.0, "Specular IOR Level": 0.0}
PLASTIC: Inputs = {"Roughness": 0.4}
METAL: Inputs = {"Roughness": 0.3, "Metallic": 1.0}
GLASS: Inputs = {"Base Color": (1.0, 1.0, 1.0, 1.0), "Roughness": 0.0, "Transmission Weight": 1.0}
#: With the normal map `bumps`.
BUMPS: Inputs = {**MATTE, "Normal": None}
#: The inputs of Principled BSDFs, by material and object; other objects are matte.
MATERIALS: dict[str, dict[str, Inputs]] = {
    "matte": {},
    "bumps": {"cube": BUMPS},
    "metal": {"ball": METAL},
    "glass": {"ball": GLASS},
    "plastic": dict.fromkeys(COLORS, PLASTIC),
    "all": {"floor": PLASTIC, "Suzanne": METAL, "ball": GLASS, "cube": BUMPS},
}


def build(library: Any, scene: str, material: str, folder: Path) -> Any:
    """Build a scene by names of SCENES and MATERIALS, replacing that of `library` (bpy); images go to `folder`."""
    library.ops.wm.read_factory_settings(use_empty=True)
    data, made = library.data, library.context.scene
    set_up(made, SETTINGS)
    for name in COLORS:
        _add_object(data, made, name, MATERIALS[material].get(name, MATTE))
    camera = data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", radians(FOV_DEGREES)
    made.camera = _aimed(place(data, made, camera), CAMERA)
    for light in SCENES[scene]:
        LIGHTS[light](data, made, folder)
    return made


def exported(library: Any, made: Any, folder: Path) -> Scene:
    """Return the scene read from its glTF export, plus what glTF lacks: sun size, area lights, environment."""
    file = folder / "scene.glb"
    with quiet():
        library.ops.export_scene.gltf(
            filepath=str(file),
            export_apply=True,
            export_cameras=True,
            export_lights=True,
        )
    model = read_model(file, choice=ModelChoice(light_unit="photometric"))
    areas = [emissive_square(each) for each in made.objects if each.type == "LIGHT" and each.data.type == "AREA"]
    angle = sum(degrees(each.data.angle) for each in made.objects if each.type == "LIGHT" and each.data.type == "SUN")
    lights = [
        replace(each, angle_degrees=angle) if isinstance(each, DirectionalLight) else each for each in model.lights
    ]
    sky = Environment(image=low_sun(), rotation_degrees=ROTATION) if made.world else Environment()
    [camera] = model.cameras.values()
    return Scene(
        meshes=[*model.meshes, *areas],
        instances=model.instances,
        lights=lights,
        environment=sky,
        camera=camera,
        render=SETTINGS,
        name=file.stem,
    )


def emissive_square(light: Any) -> Mesh:
    """Return an emissive square for an area light, with its radiance P/(πA), emitting along the light's −z."""
    corners = np.array([[-1, -1, 0, 0], [-1, 1, 0, 0], [1, 1, 0, 0], [1, -1, 0, 0]]) * light.data.size / 2
    x, y, z = (np.array(light.matrix_world) @ (corners + (0, 0, 0, 1)).T)[:3]
    radiance = light.data.energy / (pi * light.data.size**2)
    material = Diffuse(color=(0.0, 0.0, 0.0), emission=(radiance,) * 3)
    return Mesh(np.column_stack([x, z, -y]), np.array([[0, 1, 2], [0, 2, 3]]), material, name=str(light.name))


def _spot(data: Any, made: Any, folder: Path) -> None:
    """Add a spot light without blend: within the cone, glTF's falloff differs from Blender's."""
    light = _add_light(data, made, "SPOT", 1000.0, (2.0, -3.0, 4.0))
    light.shadow_soft_size, light.spot_size, light.spot_blend = 0.0, radians(45.0), 0.0


def _area(data: Any, made: Any, folder: Path) -> None:
    _add_light(data, made, "AREA", 200.0, (-2.5, -1.5, 3.5)).size = SIDE


def _sun(data: Any, made: Any, folder: Path) -> None:
    _add_light(data, made, "SUN", 2.0, (1.5, -2.0, 2.5)).angle = radians(10.0)


def _delta_sun(data: Any, made: Any, folder: Path) -> None:
    _add_light(data, made, "SUN", 2.0, (1.5, -2.0, 2.5)).angle = 0.0


def _point(data: Any, made: Any, folder: Path) -> None:
    _add_light(data, made, "POINT", 500.0, (-1.0, -3.0, 3.0)).shadow_soft_size = 0.0


def _emission(data: Any, made: Any, folder: Path) -> None:
    nodes, material = _nodes(data, "emission")
    _principled(
        nodes,
        {
            **MATTE,
            "Base Color": (0.0, 0.0, 0.0, 1.0),
            "Emission Color": (1.0, 1.0, 1.0, 1.0),
            "Emission Strength": 40.0,
        },
    )
    _aimed(place(data, made, _mesh(data, "emission", material, "create_grid", size=SIDE / 2)), (2.5, 0.0, 3.5))


def _hdri(data: Any, made: Any, folder: Path) -> None:
    made.world = world(data, Environment(image=low_sun()), folder)


LIGHTS: dict[str, Callable[[Any, Any, Path], None]] = {
    "spot": _spot,
    "area": _area,
    "sun": _sun,
    "delta_sun": _delta_sun,
    "point": _point,
    "emission": _emission,
    "HDRI": _hdri,
}
#: The lights of each scene.
SCENES: dict[str, tuple[str, ...]] = {name: (name,) for name in LIGHTS} | {
    "together": tuple(name for name in LIGHTS if name != "delta_sun")
}


def _add_light(data: Any, made: Any, kind: str, energy: float, position: Vector) -> Any:
    """Add a white light aimed at LOOK_AT. energy: in W, or W/m² for suns."""
    light = data.lights.new(kind.lower(), kind)
    light.energy = energy
    _aimed(place(data, made, light), position)
    return light


def _aimed(placed: Any, position: Vector) -> Any:
    """Place the object at a position and aim its −z at LOOK_AT."""
    placed.location = position
    placed.rotation_euler = (placed.location.__class__(LOOK_AT) - placed.location).to_track_quat("-Z", "Y").to_euler()
    return placed


def _add_object(data: Any, made: Any, name: str, inputs: Inputs) -> None:
    nodes, material = _nodes(data, name)
    color = COLORS[name]
    base = (*color, 1.0) if color else nodes("TexImage", image=_image(data, name, checks(), "sRGB")).outputs[0]
    inputs = {"Base Color": base, **inputs}
    if "Normal" in inputs:
        image = nodes("TexImage", image=_image(data, "bumps", bumps(), "Non-Color"))
        inputs["Normal"] = nodes("NormalMap", {"Color": image.outputs[0]}).outputs[0]
    _principled(nodes, inputs)
    if "Transmission Weight" in inputs:
        _make_solid(data, nodes)
    kind, shape, location, scale, turn = SHAPES[name]
    placed = place(data, made, _mesh(data, name, material, kind, **shape))
    placed.location, placed.scale, placed.rotation_euler = location, (scale,) * 3, (0.0, 0.0, radians(turn))
    if name == "Suzanne":
        subdivision = placed.modifiers.new("subdivision", "SUBSURF")
        subdivision.levels = subdivision.render_levels = 2


def _nodes(data: Any, name: str) -> tuple[Nodes, Any]:
    """Add a material and return its nodes and the material."""
    material = data.materials.new(name)
    return Nodes(material), material


def _principled(nodes: Nodes, inputs: Inputs) -> None:
    nodes("OutputMaterial", {"Surface": nodes("BsdfPrincipled", inputs).outputs[0]})


def _make_solid(data: Any, nodes: Nodes) -> None:
    """Make glass solid by a thickness, which the exporter reads from a node group of this name; else it is thin."""
    group = data.node_groups.new("glTF Material Output", "ShaderNodeTree")
    group.interface.new_socket("Thickness", in_out="INPUT", socket_type="NodeSocketFloat")
    nodes("Group", {"Thickness": 1.0}, node_tree=group)


def _mesh(data: Any, name: str, material: Any, kind: str, **shape: Any) -> Any:
    """Add a mesh by a bmesh operator: the cube and squares are flat-shaded, the others smooth."""
    bmesh = import_module("bmesh")
    made, build = data.meshes.new(name), bmesh.new()
    build.loops.layers.uv.new("UVMap")
    getattr(bmesh.ops, kind)(build, calc_uvs=True, **shape)
    build.to_mesh(made)
    build.free()
    made.materials.append(material)
    (made.shade_flat if kind in ("create_cube", "create_grid") else made.shade_smooth)()
    return made


def _image(data: Any, name: str, texels: NDArray[np.float64], space: str) -> Any:
    """Add an 8-bit image of encoded (h, w, 3) texels in [0, 1], row 0 at the bottom."""
    height, width, _ = texels.shape
    image = data.images.new(name, width, height)
    image.colorspace_settings.name = space
    image.pixels.foreach_set(np.dstack([texels, np.ones((height, width))]).astype(np.float32).ravel())
    image.pack()
    return image


def checks() -> NDArray[np.float64]:
    """Return a (256, 256, 3) checkerboard, redder to the right and bluer upwards to reveal rotated or mirrored UVs."""
    v, u = np.mgrid[:256, :256] / 255
    dark = (np.floor(u * 16) + np.floor(v * 16)) % 2
    return np.asarray(np.dstack([0.4 + 0.5 * u, 0.6 * np.ones_like(u), 0.4 + 0.5 * v]) * (1 - 0.4 * dark)[..., None])


def bumps() -> NDArray[np.float64]:
    """Return a (256, 256, 3) normal map of waves with slopes up to 0.5, 8 along each side."""
    v, u = (np.mgrid[:256, :256] + 0.5) / 256 * 8 * 2 * np.pi
    slope = 0.5 * np.dstack([np.sin(u) * np.cos(v), np.cos(u) * np.sin(v), np.zeros_like(u)])
    normal = np.array([0.0, 0.0, 1.0]) - slope
    return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True) / 2 + 0.5)
