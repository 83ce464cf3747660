"""A plastic floor under lights that are hard to shade accurately, compared with physical models and other renderers.

Results are means of images with a 2 degree field of view, from straight above and at 75 degrees off the normal,
divided by those of a white Lambertian floor (float64): 1 is what a white matte floor reflects.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from ...device.discovery.discover import choose
from ...scene.lights import DirectionalLight, PointLight
from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.material_types import Diffuse, Material, MetallicRoughness
from ...scene.materials.textures import untextured
from ...scene.model import Camera, Environment, FloatArray, Mesh, RenderSettings, Scene
from ..convergence.contestants import Contestant, choices_on
from .plastic_floor_model import MODELS, Estimate, Plastic, floor_radiance

Judge = Callable[[Scene], Contestant]

WHITE = (1.0, 1.0, 1.0)
MATERIALS: dict[str, Material] = {"Lambert": Diffuse(color=WHITE)} | {
    f"roughness {roughness:g}": MetallicRoughness(color=WHITE, ior=Plastic.IOR, roughness=roughness)
    for roughness in (0.1, 0.5, 1.0)
}
#: Viewing angles from the normal, on the side that the light travels towards.
VIEWS = {"above": 0.0, "75°": 75.0}
DISTANCE, FOV_DEGREES, SIZE = 10.0, 2.0, (16, 16)
#: The sky: size in texels, its radiance, and its sun's; the sun's elevation and Gaussian deviation in degrees.
SKY_SIZE, SKY_RADIANCE, SUN_RADIANCE, SUN_ELEVATION, SUN_WIDTH = (64, 128), 0.2, 100.0, 10.0, 3.0


def lights() -> dict[str, dict[str, Any]]:
    """Return the contents of a scene besides the floor, by name; the light comes from -z."""
    lamp = Mesh(
        vertices=np.array([[-0.5, 0.3, -4], [0.5, 0.3, -4], [0.5, 1.3, -4], [-0.5, 1.3, -4]], np.float32),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        material=Diffuse(color=(0.0, 0.0, 0.0), emission=(10.0, 10.0, 10.0)),
        name="lamp",
    )
    slope = np.radians(60.0)
    return {
        "sun above": {"lights": [DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=WHITE)]},
        "sun at 60°": {"lights": [DirectionalLight(direction=(0.0, -np.cos(slope), np.sin(slope)), irradiance=WHITE)]},
        "point": {"lights": [PointLight(position=(1.0, 2.0, -1.0), intensity=WHITE)]},
        "HDRI": {"environment": Environment(image=low_sun())},
        "low lamp": {"meshes": [lamp]},
    }


def low_sun() -> FloatArray:
    """Return an environment map (h, w, 3), constant except for a sun near the horizon towards -z."""
    height, width = SKY_SIZE
    theta, phi = np.meshgrid(
        (np.arange(height) + 0.5) / height * np.pi, (np.arange(width) + 0.5) / width * 2 * np.pi, indexing="ij"
    )
    elevation = np.radians(SUN_ELEVATION)
    cosine = np.sin(elevation) * np.cos(theta) + np.cos(elevation) * np.sin(theta) * np.cos(phi)
    bell = np.exp(-((np.degrees(np.arccos(np.clip(cosine, -1, 1))) / SUN_WIDTH) ** 2) / 2)
    return np.repeat((SKY_RADIANCE + SUN_RADIANCE * bell)[..., None], 3, axis=2).astype(np.float32)


def floor_scene(light: str, view: str, material: str) -> Scene:
    """Return a scene by names of `lights`, VIEWS and MATERIALS, with direct lighting only."""
    floor = Mesh(
        vertices=np.array([[-50, 0, -50], [-50, 0, 50], [50, 0, 50], [50, 0, -50]], np.float32),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        material=MATERIALS[material],
        name="floor",
    )
    off = np.radians(VIEWS[view])
    camera = Camera(
        position=(0.0, DISTANCE * np.cos(off), DISTANCE * np.sin(off)), up=(0.0, 0.0, -1.0), fov_degrees=FOV_DEGREES
    )
    lit = Scene(**lights()[light], camera=camera, render=RenderSettings(size=SIZE, max_depth=2), name="floor")
    return replace(lit, meshes=[floor, *lit.meshes])


def measure_floor(
    found: Mapping[str, Judge], spp: int, seeds: int, chosen: Collection[str] = ()
) -> Iterator[dict[str, Any]]:
    """Yield a row per light, view and material: {column: (value, standard error)} under "values", MODELS first.

    chosen: these lights; all if empty.
    """
    for light in chosen or lights():
        for view in VIEWS:
            matte = floor_radiance(floor_scene(light, view, "Lambert")).mean
            for material in MATERIALS:
                scene = floor_scene(light, view, material)
                values = {name: floor_radiance(scene, model, seed=1) for name, model in MODELS.items()} | {
                    name: _mean(judge(scene), spp, seeds) for name, judge in found.items()
                }
                yield {
                    "light": light,
                    "view": view,
                    "material": material,
                    "values": {name: (mean / matte, error / matte) for name, (mean, error) in values.items()},
                }


def _mean(renderer: Contestant, spp: int, seeds: int) -> Estimate:
    """Return the mean over all pixels, in red, with its error from the spread over seeds."""
    means = [float(renderer(spp, seed).pixels[..., 0].mean(dtype=np.float64)) for seed in range(1, seeds + 1)]
    return Estimate(float(np.mean(means)), float(np.std(means, ddof=1) / seeds**0.5))


def judges(device: str | int | None = None) -> tuple[dict[str, Judge], dict[str, str]]:
    """Return clrt and the other installed renderers by column, and the reasons why others are missing."""
    number = choose(device)[0].index
    found: dict[str, Judge] = {"clrt": lambda scene: choices_on(scene, [number], {"clrt": {}})["clrt"]}
    missing = {}
    for package, (module, columns) in PEERS.items():
        try:
            found |= columns(import_module(f".{module}", __package__))
        except ImportError:
            missing[package] = f"not installed (pip install {package})"
    return found, missing


def _mitsuba(module: Any) -> dict[str, Judge]:
    """Return Mitsuba's own plastics, with the same F0 and alpha."""
    library, _ = module.load()

    def judge(plastic: Mapping[str, Any], scene: Scene) -> Contestant:
        from .mitsuba_scene import mitsuba_scene

        material = scene.meshes[0].material
        plugins = mitsuba_scene(scene)
        if isinstance(material, MetallicRoughness):
            rough = (
                {"roughness": material.roughness}
                if plastic["type"] == "principled"
                else {"alpha": max(untextured(material.roughness) ** 2, ALPHA_MIN)}
            )
            plugins["mesh0"]["bsdf"] = {"type": "twosided", "front": {**plastic, **rough}}
        contestant: Contestant = module.Mitsuba(library, plugins)
        return contestant

    white = {"type": "rgb", "value": 1.0}
    rough = {
        "type": "roughplastic",
        "distribution": "ggx",
        "int_ior": Plastic.IOR,
        "ext_ior": 1.0,
        "diffuse_reflectance": white,
    }
    return {
        "roughplastic": partial(judge, rough),
        "nonlinear": partial(judge, rough | {"nonlinear": True}),
        "principled": partial(judge, {"type": "principled", "base_color": white, "eta": Plastic.IOR}),
    }


def _cycles(module: Any) -> dict[str, Judge]:
    """Return Blender's Principled BSDF with its defaults, except that it is white and has the material's roughness."""
    from .cycles_scene import BSDFS, Nodes, blender_scene

    def principled(nodes: Nodes, material: MetallicRoughness) -> Any:
        return nodes("BsdfPrincipled", {"Base Color": (*WHITE, 1), "Roughness": material.roughness, "IOR": Plastic.IOR})

    library, bsdfs = import_module("bpy"), BSDFS | {MetallicRoughness: principled}
    return {"Cycles": lambda scene: module.Cycles(library, partial(blender_scene, library.data, scene, bsdfs=bsdfs))}


#: By pip package: module, and the function that makes its columns.
PEERS: dict[str, tuple[str, Callable[[Any], dict[str, Judge]]]] = {
    "mitsuba": ("mitsuba_renderer", _mitsuba),
    "bpy": ("cycles_renderer", _cycles),
}
