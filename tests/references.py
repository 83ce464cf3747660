"""Reference scenes stored as JSON together with converged images, converted to clrt scenes.

`NAME.json` has a camera (`fov`: full angle, of a square image), materials, shapes (.ply meshes, spheres), lights and
`max_depth`; `NAME.exr` is the converged image; meshes and environment maps are in the same folder.

    python -m tests.references FOLDER [SPP]

renders each and prints how far it is from its reference image.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.formats.images.image_reader import read_picture
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

Record = dict[str, Any]


def load_reference(json_path: Path) -> tuple[Scene, NDArray[np.float32]]:
    """Return the scene of `json_path` and its (h, w, 3) float32 linear image. ValueError if clrt lacks a feature."""
    record: Record = json.loads(json_path.read_text(encoding="utf-8"))
    folder, view = json_path.parent, record["camera"]
    if view["width"] != view["height"]:
        raise ValueError(f"{json_path}: the camera's fov is defined for square pictures only")
    scene = Scene(
        meshes=[
            mesh
            for shape in record["shapes"]
            if shape["type"] == "mesh"
            for mesh in _meshes(folder, shape, record["materials"])
        ],
        spheres=[_sphere(shape, record["materials"]) for shape in record["shapes"] if shape["type"] == "sphere"],
        lights=[
            PointLight(position=_triple(light["position"]), intensity=_triple(light["intensity"]))
            for light in record["lights"]
            if light["type"] == "point"
        ],
        camera=Camera(
            position=_triple(view["origin"]),
            look_at=_triple(view["target"]),
            up=_triple(view["up"]),
            fov_degrees=view["fov"],
        ),
        environment=_environment(folder, record["lights"]),
        render=RenderSettings(size=(view["width"], view["height"]), max_depth=record["max_depth"]),
        name=record["name"],
    )
    return scene, read_picture(json_path.with_suffix(".exr"))


def _meshes(folder: Path, shape: Record, materials: dict[str, Record]) -> list[Mesh]:
    from clrt.formats.models import read_mesh

    material = _material(shape, materials)
    return [replace(mesh, material=material) for mesh in read_mesh(folder / shape["file"], "file")]


def _sphere(shape: Record, materials: dict[str, Record]) -> Sphere:
    return Sphere(center=_triple(shape["center"]), radius=shape["radius"], material=_material(shape, materials))


def _environment(folder: Path, lights: list[Record]) -> Environment:
    for light in lights:
        if light["type"] == "constant":
            return Environment(color=_triple(light["radiance"]))
        if light["type"] == "env":
            return Environment(image=read_picture(folder / light["file"]))
    return Environment()


def _material(shape: Record, materials: dict[str, Record]) -> Material:
    record = materials[shape["material"]]
    if record["type"] not in MAKERS:
        raise ValueError(f"material {shape['material']}: clrt has no {record['type']} yet")
    return replace(MAKERS[record["type"]](record), emission=_triple(shape.get("emission", (0.0, 0.0, 0.0))))


def _ggx(record: Record) -> Material:
    """Return GGX with a constant Fresnel term, which Schlick's equals only if F0 = 1."""
    if record["color"] != [1, 1, 1]:
        raise ValueError(f"ggx of color {record['color']}: only white has the same reflectance at every angle")
    return MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=sqrt(record["alpha"]), smith="separable")


MAKERS: dict[str, Callable[[Record], Material]] = {
    "diffuse": lambda record: Diffuse(color=_triple(record["color"])),
    "metal": lambda record: MetallicRoughness(
        color=_triple(record["color"]), metallic=1.0, roughness=record["roughness"], smith="separable"
    ),
    "ggx": _ggx,
    "mirror": lambda record: Mirror(color=_triple(record["color"])),
    "glass": lambda record: Dielectric(ior=record["ior"]),
}


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)


def main(folder: Path, spp: int) -> None:
    """Print a line for each reference in `folder`."""
    import clrt

    print(f"{'reference':16} {'relMSE':>10} {'noise²':>10}  {'mean ratio - 1, in 1e-5':28} seconds")
    for path in sorted(folder.glob("*.json")):
        try:
            scene, expected = load_reference(path)
        except (ValueError, KeyError):
            continue  # an index or a table, or a scene that clrt does not support
        image = clrt.render(scene, spp=spp)
        result = clrt.compare(image.pixels, expected)
        ratios = "".join(f"{(ratio - 1) * 1e5:9.1f}" for ratio in result["mean_ratio"])
        print(
            f"{path.stem:16} {result['relmse']:10.3g} {image.report['noise'] ** 2:10.3g}  {ratios}  "
            f"{image.report['seconds']:6.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 256)
