"""Small valid files of every format, as seeds for tests.fuzz."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import imageio.v3 as imageio
import numpy as np

from clrt.output.images import write_image

from .formats.glb import Gltf, ball
from .formats.test_gltf import cameras, compressed
from .formats.test_meshes import (
    obj,
    obj_with_normals,
    off,
    ply_ascii,
    ply_big_endian,
    ply_binary,
    ply_with_normals,
    stl_ascii,
    stl_binary,
)
from .formats.test_meshopt import compress
from .formats.test_mitsuba_serialized import TRIANGLE, serialized, stream
from .formats.test_ply import XYZ, Element, written
from .formats.test_stl import binary
from .formats.threemf_files import painted
from .formats.usd_files import BOUND, ST, TEXTURED, material, mesh, texture, usda, usdz
from .fuzz import FORMATS, LARGEST, OBJ
from .scene.shapes import icosphere

SCENE = """
[camera]
position = [0, 1, 5]
look_at = [0, 1, 0]
fov_degrees = 30
[render]
size = [64, 32]
spp = 16
[environment]
image = "sky.hdr"
[materials.white]
type = "diffuse"
color = [0.73, 0.73, 0.73]
[materials."my ring"]
type = "metallic_roughness"
preset = "gold"
roughness = 0.2
[materials.lamp]
type = "diffuse"
emission = [17, 12, 4]
[materials.wood]
type = "diffuse"
color = { image = "wood.png", scale = [2, 2] }
[[mesh]]
file = "n.ply"
material = "white"
[[mesh]]
file = "a.obj"
materials = { "" = "lamp" }
[[mesh]]
name = "floor"
vertices = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
faces = [[0, 1, 2]]
scale = [1, 2, 3]
rotate_degrees = [90, 0, 90]
translate = [10, 20, 30]
[[sphere]]
center = [0, 1, 0]
radius = 2
material = "my ring"
[[light]]
type = "point"
position = [1.5, 4, 3]
intensity = [60, 58, 50]
[[light]]
type = "projector"
position = [1, 4, 3]
direction = [0, -1, -0.5]
intensity = [9, 9, 9]
image = { image = "wood.png", scale = [-1, 1], wrap = ["clamp", "mirror"] }
"""
MTL = """newmtl a
Kd 0.5 0.25 0.125
Ks 1 1 1
Ns 30
illum 2
newmtl b
Pr 0.5
Pm 1
Ke 1 2 3
map_Kd -s 2 2 2 wood.png
"""


MITSUBA = """<scene version="3.0.0">
<default name="spp" value="16"/>
<integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="thinlens"><float name="fov" value="50"/><float name="aperture_radius" value="0.1"/>
<transform name="to_world"><lookat origin="1, -7, 3" target="0, 0, 1" up="0, 0, 1"/></transform>
<film type="hdrfilm"><rfilter type="box"/><integer name="width" value="48"/><integer name="height" value="32"/></film>
<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler></sensor>
<bsdf type="twosided" id="board"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
<rgb name="color0" value="0.8, 0.3, 0.2"/><transform name="to_uv"><scale x="4" y="3"/><rotate z="1" angle="20"/>
</transform></texture></bsdf></bsdf>
<bsdf type="roughplastic" id="wood"><texture type="bitmap" name="diffuse_reflectance">
<string name="filename" value="wood.png"/></texture><string name="distribution" value="ggx"/></bsdf>
<alias id="wood" as="plank"/>
<shape type="rectangle"><transform name="to_world"><scale value="4"/></transform><ref id="board"/></shape>
<shape type="cylinder"><point name="p0" value="1.5, 0, 0.3"/><point name="p1" value="2.2, 0.4, 1.6"/>
<ref id="plank"/></shape>
<shape type="shapegroup" id="group"><shape type="obj"><string name="filename" value="a.obj"/></shape></shape>
<shape type="instance"><ref id="group"/><transform name="to_world"><rotate x="1" angle="70"/></transform></shape>
<shape type="ply"><string name="filename" value="b.ply"/><bsdf type="roughconductor">
<spectrum name="eta" value="400:0.2, 700:0.8"/><rgb name="k" value="3"/><float name="alpha" value="0.08"/></bsdf>
</shape>
<shape type="cube"><bsdf type="principled"><float name="specular" value="0.4"/><rgb name="base_color" value="0.9"/>
<float name="spec_trans" value="0.5"/><texture type="checkerboard" name="roughness"/></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.5"/><bsdf type="mask"><float name="opacity" value="0.3"/>
<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf></bsdf>
<medium type="homogeneous" name="interior"><rgb name="sigma_t" value="1, 2, 4"/><rgb name="albedo" value="0"/></medium>
</shape>
<shape type="disk"><emitter type="area"><spectrum name="radiance" value="400:1, 500:3, 700:6"/></emitter></shape>
<emitter type="spot"><rgb name="intensity" value="#ff8000"/><float name="cutoff_angle" value="30"/></emitter>
<emitter type="projector"><float name="fov" value="30"/><texture type="bitmap" name="irradiance">
<string name="filename" value="wood.png"/></texture></emitter>
<emitter type="envmap"><string name="filename" value="sky.hdr"/><float name="scale" value="2"/></emitter></scene>
"""
MITSUBA_0 = """<scene version="0.6.0">
<integrator type="bdpt"><integer name="maxDepth" value="-1"/></integrator>
<shape type="serialized"><string name="filename" value="a.serialized"/><integer name="shapeIndex" value="1"/>
<transform name="toWorld"><matrix value="1 0 0 0 0 1 0 2 0 0 1 0 0 0 0 1"/></transform>
<bsdf type="phong"><srgb name="diffuseReflectance" value="#808080"/><float name="exponent" value="20"/></bsdf></shape>
<emitter type="point"><blackbody name="intensity" temperature="5000K" scale="1e-3"/>
<transform name="toWorld"><translate x="1" y="2"/></transform></emitter></scene>
"""
PBRT = """Film "rgb" "integer xresolution" 48 "integer yresolution" 32 "float iso" 200
Sampler "zsobol" "integer pixelsamples" 16 Integrator "volpath" "integer maxdepth" 4
LookAt 1 -7 3  0 0 1  0 0 1
Camera "perspective" "float fov" 50 "float lensradius" .1
WorldBegin
LightSource "infinite" "string filename" "sky.hdr" "float scale" 2
LightSource "projection" "string filename" "wood.png" "float fov" 40 "float power" 9
LightSource "spot" "blackbody I" 3000 "float power" 100 "point3 from" [1 2 3] "float coneangle" 40
Texture "wood" "spectrum" "imagemap" "string filename" "wood.png" "float uscale" 2 "bool invert" true
Texture "board" "spectrum" "checkerboard" "rgb tex1" [.8 .3 .2] "rgb tex2" [.1 .1 .1]
Texture "mixed" "spectrum" "mix" "texture tex1" "wood" "rgb tex2" [1 1 1] "float amount" .3
MakeNamedMaterial "plank" "string type" "coateddiffuse" "texture reflectance" "mixed" "float roughness" .1
MakeNamedMedium "tea" "string type" "homogeneous" "rgb sigma_a" [1 2 4] "rgb sigma_s" [0 0 0]
AttributeBegin Material "diffuse" "texture reflectance" "board"
Shape "bilinearmesh" "point3 P" [-4 -4 0 4 -4 0 -4 4 0 4 4 0] AttributeEnd
AttributeBegin NamedMaterial "plank" ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 2 0 1 1] ReverseOrientation
Shape "cylinder" "float phimax" 270 Shape "loopsubdiv" "integer levels" 1
"point3 P" [0 0 0 1 0 0 0 1 0 0 0 1] "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2] AttributeEnd
ObjectBegin "group" Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" [400 2 700 4]
Shape "plymesh" "string filename" "b.ply" Shape "sphere" "float radius" .5 ObjectEnd
AttributeBegin Rotate 70 1 0 0 ObjectInstance "group" AttributeEnd
AttributeBegin MediumInterface "tea" "" Material "dielectric" "spectrum eta" "glass-BK7" Translate 0 0 2
Shape "sphere" "float alpha" .5 AttributeEnd
AreaLightSource "diffuse" "spectrum L" [400 1 700 3] "bool twosided" true
Shape "disk" "float innerradius" .2
"""
PBRT_3 = """Film "image" "integer xresolution" [48] "float scale" [2]
Camera "environment"
WorldBegin
LightSource "infinite" "rgb L" [1 1 1] "string mapname" "sky.exr"
Material "uber" "color Kd" [.1 .2 .3] "rgb opacity" [.5 .5 .5] "float roughness" .2
Shape "trianglemesh" "integer indices" [0 1 2] "point P" [0 0 0 1 0 0 0 1 0] "float uv" [0 0 1 0 0 1]
Include "part.pbrt"
WorldEnd
"""


def write_seeds(folder: Path, more: Iterable[Path] = ()) -> None:
    """Write a few seeds of each format to `folder`, and the small files found in the folders `more`."""
    folder.mkdir(parents=True)
    for name, write in {
        "a.obj": obj,
        "n.obj": obj_with_normals,
        "a.ply": ply_ascii,
        "b.ply": ply_binary,
        "c.ply": ply_big_endian,
        "n.ply": ply_with_normals,
        "a.stl": stl_ascii,
        "b.stl": stl_binary,
        "a.off": off,
    }.items():
        write(folder / name)
    (folder / "quads.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n"
    )
    vertex: Element = ("vertex", XYZ, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    corners = [([0, 1, 2, 3], [0.5] * 8), ([0, 1, 2], [0.0] * 6)]
    seams: Element = ("face", ["list uchar int vertex_indices", "list uchar float texcoord"], corners)
    strips: Element = ("tristrips", ["list int int vertex_indices"], [([0, 1, 2, -1, 3, 2, 1, 0],)])
    for name, elements in {
        "seams.ply": [vertex, seams],
        "strips.ply": [vertex, strips],
        "points.ply": [vertex],
    }.items():
        (folder / name).write_bytes(written(elements, "binary_big_endian"))
    (folder / "colors.stl").write_bytes(binary(np.eye(3)[None], b"COLOR=\1\2\3\4", [31]))
    (folder / "colors.off").write_text("COFF\n3 1 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2 8 8 8\n")
    (folder / "old.hdr").write_bytes(b"#?RADIANCE\nEXPOSURE=2\n\n+X 2 -Y 2\n" + b"\7\7\7\201\1\1\1\3")
    (folder / "a.mtl").write_text(MTL)
    (folder / "b.obj").write_text(OBJ.replace("damaged", "a"))
    (folder / "a.toml").write_text(SCENE)
    for name, text in {"a.xml": MITSUBA, "old.xml": MITSUBA_0}.items():
        (folder / name).write_text(text)
    for name, text in {"a.pbrt": PBRT, "old.pbrt": PBRT_3, "part.pbrt": 'Shape "sphere"\n'}.items():
        (folder / name).write_text(text)
    parts = [stream(TRIANGLE, np.array([[0, 1, 2]]), 4)] * 2
    (folder / "a.serialized").write_bytes(serialized(parts))
    pixels = np.random.default_rng(0).random((24, 48, 3), np.float32)
    pixels[:, 20:40] = 0.5
    for name in ("sky.hdr", "sky.exr"):
        write_image(folder / name, pixels)
    for name in ("wood.png", "wood.jpg"):
        imageio.imwrite(folder / name, (pixels * 255).astype(np.uint8))
    for name, document in {
        "a.glb": ball(),
        "b.gltf": ball(),
        "cameras.gltf": cameras(),
        "draco.glb": compressed(),
        "meshopt.glb": compress(ball(), "EXT_meshopt_compression", 0),
        "meshopt 1.glb": compress(ball(), "KHR_meshopt_compression", 1),
        "textured.glb": textured((folder / "wood.jpg").read_bytes()),
    }.items():
        document.write(folder / name)
    painted().write(folder / "a.3mf")
    write_stages(folder)
    for place in more:
        for file in sorted(place.rglob("*")):
            if file.suffix == ".bin":  # under the name that its model refers to
                shutil.copyfile(file, folder / file.name)
            elif file.is_file() and file.suffix.lower() in FORMATS and file.stat().st_size <= LARGEST:
                shutil.copyfile(file, folder / f"{place.name}-{file.name.lower()}")


def write_stages(folder: Path) -> None:
    """Write USD files of a textured square, a light and a camera."""
    from pxr import Sdf

    prims = (
        mesh(ST + BOUND) + material(TEXTURED, texture("wood.png")) + 'def SphereLight "lamp" {}\ndef Camera "view" {}'
    )
    text = usda(folder, prims)
    Sdf.Layer.FindOrOpen(str(text)).Export(str(folder / "a.usdc"))
    files = {"a.usdc": (folder / "a.usdc").read_bytes(), "wood.png": (folder / "wood.png").read_bytes()}
    usdz(folder / "a.usdz", files)


def textured(picture: bytes) -> Gltf:
    """Return a textured sphere with strided, quantized and sparse accessors and an embedded image."""
    vertices, faces = icosphere(0)
    gltf = Gltf()
    rows = np.zeros(len(vertices), [("position", "<i2", 4), ("uv", "<u2", 2)])
    rows["position"][:, :3], rows["uv"] = vertices * 32767, vertices[:, :2] * 30000 + 32000
    view = gltf.view(rows.tobytes(), byteStride=rows.itemsize)
    sparse = {
        "count": 2,
        "indices": {"bufferView": gltf.view(bytes([2, 5])), "componentType": 5121},
        "values": {"bufferView": gltf.view(np.array([[7, 8, 9], [4, 5, 6]], "<i2").tobytes())},
    }
    position = gltf.accessor(vertices, "<i2", view, normalized=True, sparse=sparse)
    uv = gltf.accessor(vertices[:, :2], "<u2", view, byteOffset=8, normalized=True)
    gltf.document |= {
        "images": [{"bufferView": gltf.view(picture), "mimeType": "image/jpeg"}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071}],
        "materials": [
            {
                "name": "wood",
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}},
                "normalTexture": {"index": 0},
                "alphaMode": "MASK",
            }
        ],
        "extensionsUsed": ["KHR_mesh_quantization"],
    }
    gltf.mesh(
        attributes={"POSITION": position, "TEXCOORD_0": uv}, material=0, indices=gltf.accessor(faces.ravel(), "<u1")
    )
    gltf.node(mesh=0, matrix=(np.diag([2.0, -1, 3, 1])).ravel().tolist())
    return gltf
