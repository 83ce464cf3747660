"""clrt: a path tracer for any OpenCL device that estimates the error of its images.

    import clrt
    image = clrt.render(clrt.load("scenes/cornell.toml"), spp=256)
    image.save("cornell.png")

Names are imported on first use, so `import clrt` itself loads nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import trimesh
    from .api import animate as animate, load as load, render as render
    from .baking.bake import bake as bake
    from .baking.light_map import LightMap as LightMap
    from .device.discovery.discover import devices as devices
    from .errors import (
        CheckpointError as CheckpointError,
        ClrtError as ClrtError,
        DeviceError as DeviceError,
        KernelError as KernelError,
        ObjectError as ObjectError,
        OutputError as OutputError,
        SceneError as SceneError,
        UsageError as UsageError,
    )
    from .output.datasets.save_views import save_views as save_views
    from .output.denoise import denoise as denoise
    from .output.image import Image as Image
    from .output.image_error import compare as compare
    from .output.images import read_image as read_image
    from .output.relighting import relight as relight
    from .output.scenes import save_scene as save_scene
    from .queries.instanced import InstancedRayQuery as InstancedRayQuery
    from .queries.mesh import RayQuery as RayQuery
    from .rendering.renderer import Renderer as Renderer, State as State
    from .rendering.sensors import (
        ambient_occlusion as ambient_occlusion,
        irradiance as irradiance,
        radiance as radiance,
    )
    from .scene.animation import Animation as Animation, Keyframe as Keyframe
    from .scene.camera_path import frames as frames, turntable as turntable
    from .scene.cameras import CameraEnd as CameraEnd
    from .scene.light_images import LightImage as LightImage
    from .scene.lights import (
        DirectionalLight as DirectionalLight,
        GoniometricLight as GoniometricLight,
        PointLight as PointLight,
        ProjectorLight as ProjectorLight,
        SpotLight as SpotLight,
    )
    from .scene.materials.material_types import (
        BlinnPhong as BlinnPhong,
        Conductor as Conductor,
        Dielectric as Dielectric,
        Diffuse as Diffuse,
        MetallicRoughness as MetallicRoughness,
        Mirror as Mirror,
        Phong as Phong,
        Plastic as Plastic,
        Principled as Principled,
    )
    from .scene.materials.textures import Picture as Picture, Texture as Texture
    from .scene.model import (
        Backdrop as Backdrop,
        Camera as Camera,
        Display as Display,
        Environment as Environment,
        Ground as Ground,
        Instance as Instance,
        Mesh as Mesh,
        RenderSettings as RenderSettings,
        Scene as Scene,
        Sphere as Sphere,
    )
    from .scene.sky.sky import Sky as Sky
    from .scene.stereo import stereo_pair as stereo_pair
    from .scene.view import View as View
    from .views import each_view as each_view, render_views as render_views

    __version__: str

_HOME = {
    "api": ("animate", "load", "render"),
    "baking.bake": ("bake",),
    "baking.light_map": ("LightMap",),
    "device.discovery.discover": ("devices",),
    "errors": (
        "CheckpointError",
        "ClrtError",
        "DeviceError",
        "KernelError",
        "ObjectError",
        "OutputError",
        "SceneError",
        "UsageError",
    ),
    "queries.instanced": ("InstancedRayQuery",),
    "output.datasets.save_views": ("save_views",),
    "output.denoise": ("denoise",),
    "output.image_error": ("compare",),
    "output.image": ("Image",),
    "output.images": ("read_image",),
    "output.relighting": ("relight",),
    "output.scenes": ("save_scene",),
    "queries.mesh": ("RayQuery",),
    "rendering.renderer": ("Renderer", "State"),
    "rendering.sensors": ("ambient_occlusion", "irradiance", "radiance"),
    "scene.animation": ("Animation", "Keyframe"),
    "scene.camera_path": ("frames", "turntable"),
    "scene.cameras": ("CameraEnd",),
    "scene.light_images": ("LightImage",),
    "scene.lights": ("DirectionalLight", "GoniometricLight", "PointLight", "ProjectorLight", "SpotLight"),
    "scene.materials.material_types": (
        "BlinnPhong",
        "Conductor",
        "Dielectric",
        "Diffuse",
        "MetallicRoughness",
        "Mirror",
        "Phong",
        "Plastic",
        "Principled",
    ),
    "formats.trimesh_models": ("Scene",),  # which may contain meshes of trimesh
    "scene.model": (
        "Backdrop",
        "Camera",
        "Display",
        "Environment",
        "Ground",
        "Instance",
        "Mesh",
        "RenderSettings",
        "Sphere",
    ),
    "scene.stereo": ("stereo_pair",),
    "scene.view": ("View",),
    "views": ("each_view", "render_views"),
    "scene.materials.textures": ("Picture", "Texture"),
    "scene.sky.sky": ("Sky",),
}
_MODULES = ("trimesh",)
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}
__all__ = sorted([*_MODULE_OF, *_MODULES])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("clrt")
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'clrt' has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULE_OF[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
