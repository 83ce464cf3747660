"""Material extensions of glTF files: unlit, variants, specular-glossiness, glass with textures, and unknown ones."""

from __future__ import annotations

import base64
import io
import logging
import re
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import clrt
from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import Dielectric, Diffuse, MetallicRoughness
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Mesh

from ..scene.shapes import icosphere
from .glb import TRIANGLE, Gltf, ball, read

COUNT = len(icosphere(0)[0])


def of(folder: Path, material: dict[str, Any], colors: NDArray[Any] | None = None) -> Material:
    """Return an icosahedron's material, read from a file."""
    gltf = ball()
    primitive = gltf.document["meshes"][0]["primitives"][0]
    primitive["material"] = 0
    gltf.document["materials"] = [material]
    if colors is not None:
        primitive["attributes"]["COLOR_0"] = gltf.accessor(colors)
    (mesh,) = read(gltf, folder).meshes
    return mesh.material


def image(gltf: Gltf, texels: Any) -> dict[str, int]:
    """Add an image (h, w, 3 or 4), and return the reference to its texture."""
    content = imageio.imwrite("<bytes>", np.array(texels, np.uint8), extension=".png")
    images = gltf.document.setdefault("images", [])
    images.append({"bufferView": gltf.view(content), "mimeType": "image/png"})
    gltf.document["samplers"] = [{"magFilter": 9728}]
    gltf.document.setdefault("textures", []).append({"source": len(images) - 1, "sampler": 0})
    return {"index": len(images) - 1}


def with_uv(folder: Path, gltf: Gltf, material: dict[str, Any], uv: Any) -> list[Mesh]:
    """Add triangles with these texture coordinates (m, 3, 2), and return the meshes that are read."""
    points = np.tile(TRIANGLE, (len(uv), 1)) + np.repeat(np.arange(len(uv)), 3)[:, None]
    gltf.document["materials"] = [material]
    attributes = {"POSITION": gltf.accessor(points), "TEXCOORD_0": gltf.accessor(np.reshape(uv, (-1, 2)))}
    gltf.mesh(attributes=attributes, material=0)
    return read(gltf, folder).meshes


UNLIT: dict[str, Any] = {
    "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.2, 0.1, 0.5]},
    "extensions": {"KHR_materials_unlit": {}},
}


@pytest.mark.parametrize("required", [False, True])
def test_unlit_surfaces_emit_their_color(tmp_path: Path, required: bool, caplog: pytest.LogCaptureFixture) -> None:
    """They reflect nothing, whatever the light, from both sides; without a warning."""
    gltf = ball()
    gltf.document["materials"], gltf.document["extensionsUsed"] = [UNLIT], ["KHR_materials_unlit"]
    gltf.document["extensionsRequired"] = ["KHR_materials_unlit"] * required
    gltf.document["meshes"][0]["primitives"][0]["material"] = 0
    (mesh,) = read(gltf, tmp_path).meshes
    assert mesh.material == Diffuse(color=(0, 0, 0), emission=(0.8, 0.2, 0.1), double_sided=True)
    assert of(tmp_path, UNLIT | {"alphaMode": "BLEND"}).opacity == 0.5 and not caplog.text


def test_unlit_textures_and_vertex_colors(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The texture is emitted; vertex colors multiply it by their mean, with a warning if they differ."""
    gltf = Gltf()
    pbr = {"baseColorTexture": image(gltf, [[[9, 99, 199]]]), "baseColorFactor": [1, 0.5, 0.25, 1]}
    (mesh,) = with_uv(tmp_path, gltf, {**UNLIT, "pbrMetallicRoughness": pbr}, np.zeros((1, 3, 2)))
    emission = mesh.material.emission
    assert isinstance(emission, Texture) and emission.factor == pytest.approx((1, 0.5, 0.25))
    assert emission.picture.texels.tolist() == [[[9, 99, 199, 255]]] and mesh.material.opacity == 1
    even = np.tile([0.5, 1, 0.5], (COUNT, 1))
    assert of(tmp_path, UNLIT, even).emission == pytest.approx((0.4, 0.2, 0.05)) and not caplog.text
    with caplog.at_level(logging.WARNING):
        uneven = of(tmp_path, UNLIT, np.linspace([0, 0, 0], [1, 0.5, 0], COUNT))
    assert uneven.emission == pytest.approx((0.4, 0.05, 0))
    assert caplog.messages[0].endswith('left out: the variation of vertex colors of material "material 0"')


def test_variants_replace_materials(tmp_path: Path) -> None:
    """Of primitives that have one for the variant; the others keep theirs."""
    gltf = ball()
    gltf.document["materials"] = [{"name": name} for name in ("plain", "day", "night")]
    gltf.document["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "Day"}, {"name": "Night"}]}}
    (first,) = gltf.document["meshes"][0]["primitives"]
    mappings = [{"material": 1, "variants": [0]}, {"material": 2, "variants": [1]}]
    extensions = {"KHR_materials_variants": {"mappings": mappings}}
    gltf.document["meshes"][0]["primitives"] = [
        first | {"material": 0, "extensions": extensions},
        first | {"material": 0, "extensions": {"KHR_materials_variants": {"mappings": mappings[:1]}}},
    ]
    path = gltf.write(tmp_path / "a.glb")
    for variant, expected in [
        (None, ["plain", "plain"]),
        ("Day", ["day", "day"]),
        ("Night", ["night", "plain"]),
        (1, ["night", "plain"]),
    ]:
        assert [mesh.material_name for mesh in clrt.load(path, variant=variant).meshes] == expected
    source = load(path).source
    assert source is not None and source.contents["variants"] == ["Day", "Night"]
    with pytest.raises(SceneError, match='variant: "Dawn" is unknown; use one of "Day", "Night"'):
        clrt.load(path, variant="Dawn")


def test_specular_glossiness(tmp_path: Path) -> None:
    """The material reflects F0 = specular at normal incidence, with a roughness of 1 minus the glossiness; the diffuse
    color is the base color, which replaces the metallic-roughness one."""
    old = {"diffuseFactor": [0.5, 0.25, 0.125, 0.5], "specularFactor": [0.9, 0.6, 0.04], "glossinessFactor": 0.75}
    made = of(
        tmp_path,
        {
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 1},
            "alphaMode": "BLEND",
            "extensions": {"KHR_materials_pbrSpecularGlossiness": old},
        },
    )
    assert isinstance(made, MetallicRoughness)
    f0 = np.array(made.parameters()["f0"]) * np.array(made.specular_color)
    assert f0 == pytest.approx([0.9, 0.6, 0.04]) and made.specular == 1
    assert (made.color, made.metallic, made.roughness, made.opacity) == ((0.5, 0.25, 0.125), 0, 0.25, 0.5)
    plain = of(tmp_path, {"extensions": {"KHR_materials_pbrSpecularGlossiness": {}}})
    assert isinstance(plain, MetallicRoughness) and plain.color == pytest.approx((1, 1, 1)) and plain.roughness == 0


def test_specular_glossiness_textures(tmp_path: Path) -> None:
    """Glossiness is the alpha of the specular texture, whose colors are those of F0."""
    gltf = Gltf()
    diffuse, specular = image(gltf, [[[200, 100, 50, 128]]]), image(gltf, [[[255, 0, 99, 51]]])
    old = {"diffuseTexture": diffuse, "specularGlossinessTexture": specular, "glossinessFactor": 0.5}
    (mesh,) = with_uv(
        tmp_path,
        gltf,
        {"alphaMode": "BLEND", "extensions": {"KHR_materials_pbrSpecularGlossiness": old}},
        np.zeros((1, 3, 2)),
    )
    made = mesh.material
    assert isinstance(made, MetallicRoughness) and isinstance(made.color, Texture)
    assert made.color.picture.texels[0, 0].tolist() == [200, 100, 50, 128]
    assert isinstance(made.opacity, Texture) and made.opacity.channel == "alpha"
    rough, shade = made.roughness, made.specular_color
    assert isinstance(rough, Texture) and isinstance(shade, Texture)
    assert (rough.channel, rough.factor) == ("green", 1) and rough.picture.texels[0, 0, 1] == round(255 - 0.5 * 51)
    assert shade.picture.texels[0, 0].tolist() == [255, 0, 99, 51]
    assert np.array(shade.factor) * made.parameters()["f0"] == pytest.approx([1, 1, 1])


@pytest.mark.parametrize("scale", [0.5, 0, -0.5])
def test_scale_of_normal_maps(scale: float, tmp_path: Path) -> None:
    """The tilt, 2c − 1 per channel, times the scale; also if that is negative."""
    gltf = Gltf()
    material = {"normalTexture": image(gltf, [[[200, 90, 255]]]) | {"scale": scale}}
    (mesh,) = with_uv(tmp_path, gltf, material, np.zeros((1, 3, 2)))
    bent = mesh.material.normal_map
    assert bent is not None and isinstance(bent.factor, float)
    tilt = bent.factor * (2 * (bent.picture.texels[0, 0, :2] / 255.0) - 1)
    assert tilt == pytest.approx(scale * (2 * np.array([200, 90]) / 255 - 1)) and bent.picture.texels[0, 0, 2] == 255


BLUE = {"thicknessFactor": 2, "attenuationColor": [0.25, 0.5, 1], "attenuationDistance": 4}


def test_glass_next_to_metal_in_one_primitive(tmp_path: Path) -> None:
    """Faces where the metallic texture is 0, and the transmission texture 1, become glass; the others stay."""
    gltf = Gltf()
    texture = image(gltf, [[[255, 0, 0], [255, 0, 255], [0, 0, 0]]])
    material = {
        "pbrMetallicRoughness": {"metallicRoughnessTexture": texture},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": texture},
            "KHR_materials_volume": BLUE,
        },
    }
    uv = np.array([[[u, 0.5]] * 3 for u in (0.1, 0.5, 0.9, 0.2)])
    sheet, solid = with_uv(tmp_path, gltf, material, uv)
    assert sheet.faces.tolist() == [[3, 4, 5], [6, 7, 8]] and isinstance(sheet.material, MetallicRoughness)
    assert solid.faces.tolist() == [[0, 1, 2], [9, 10, 11]] and isinstance(solid.material, Dielectric)
    assert (
        solid.material.attenuation_color == pytest.approx((0.25, 0.5, 1)) and solid.material.attenuation_distance == 4
    )


def test_sheets_have_the_color_of_their_volume(tmp_path: Path) -> None:
    """Beer and Lambert's law over the thickness, for surfaces that do not become glass."""
    made = of(
        tmp_path,
        {
            "pbrMetallicRoughness": {"metallicFactor": 0.5, "baseColorFactor": [1, 1, 0.5, 1]},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": BLUE},
        },
    )
    assert isinstance(made, MetallicRoughness) and made.color == pytest.approx((0.5, 0.5**0.5, 0.5))


@pytest.mark.parametrize(
    ("name", "refused"),
    [
        ("KHR_materials_novel", False),
        ("KHR_animation_novel", False),
        ("MSFT_texture_dds", False),
        ("EXT_structural_metadata", False),
        ("MPEG_buffer_circular", True),
        ("KHR_gaussian_splatting", True),
    ],
)
def test_required_extensions(name: str, refused: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Those of looks alone are ignored with a warning, others if they are named."""
    gltf = ball()
    gltf.document["extensionsRequired"] = [name]
    path, scene = gltf.write(tmp_path / "a.glb"), tmp_path / "a.toml"
    scene.write_text(f'[[mesh]]\nfile = "a.glb"\nignore_extensions = ["{name}"]\n')
    for loaded in (clrt.load(path, ignore_extensions=[name]), clrt.load(path, ignore_extensions=name), load(scene)):
        assert loaded.meshes and caplog.messages[-1].endswith(f"left out: the extension {name}")
    assert clrt.load(path, ignore_extensions=[name]).source.contents["left_out"] == [  # type: ignore[union-attr]
        f"the extension {name}: is not supported"
    ]
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        if refused:
            with pytest.raises(
                SceneError, match=f"needs the extension {name}, which is not supported.*--ignore-extension {name};"
            ):
                read(gltf, tmp_path)
        else:
            assert read(gltf, tmp_path).meshes and f"left out: the extension {name}" in caplog.text


TEXELS = np.array([[[200, 100, 50], [10, 20, 30]], [[250, 250, 250], [0, 0, 0]]], np.uint8).repeat(8, 0).repeat(8, 1)
#: TEXELS in Basis Universal's UASTC, by its own encoder (basisu 2.5), with Zstandard.
KTX2 = (
    "t4mZ^ATlt!4GJ0x000000RR915C8xG5C8xG00000000000RR910RR910ssI2XaE2JEC2uilmGw#Bme*a00000000000000000000"
    "xBvhE00000Jpcdz000000096100000EC2ui000000strgrU3!~0|Nj65C8xG00000004gg0000000000|NsC09{>OVOH^2Qa%psB"
    "asWbMb7^xRRc>i^WpZ<2Y#=f&F)#oCD77#BU;qG}0RZ?HnM~$CwTb{&fx_ee8l+cWU;kfv?*SJ80N@`0000L71rh)tp8>f8mI7F8"
    "CISTD0s"
)


def encoded(extension: str) -> bytes:
    if extension == "KHR_texture_basisu":
        return base64.b85decode(KTX2)
    content = io.BytesIO()
    kind = {"EXT_texture_webp": "WEBP", "EXT_texture_avif": "AVIF"}[extension]
    Image.fromarray(TEXELS).save(content, kind, quality=100, lossless=kind == "WEBP", subsampling="4:4:4")
    return content.getvalue()


def textured(gltf: Gltf, texture: dict[str, Any], folder: Path) -> Texture | tuple[float, ...]:
    """Return the base color of a material with this texture."""
    gltf.document["textures"] = [texture]
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0.5, 1, 1]}}
    (mesh,) = with_uv(folder, gltf, material, np.zeros((1, 3, 2)))
    assert isinstance(mesh.material, MetallicRoughness)
    return mesh.material.color


@pytest.mark.parametrize("required", [False, True])
@pytest.mark.parametrize("extension", ["EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu"])
def test_image_formats(extension: str, required: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Decoded as their encoders' libraries do, up to the loss of compression; no message."""
    if extension == "KHR_texture_basisu":
        pytest.importorskip("opengl_basisu")
    gltf = Gltf()
    gltf.document["images"] = [{"bufferView": gltf.view(encoded(extension))}]
    gltf.document["extensionsUsed"] = [extension]
    gltf.document["extensionsRequired"] = [extension] * required
    color = textured(gltf, {"extensions": {extension: {"source": 0}}}, tmp_path)
    assert isinstance(color, Texture) and np.array_equal(np.array(color.factor), (1, 0.5, 1))
    assert color.picture.texels.shape == (16, 16, 4) and not caplog.text
    assert np.abs(color.picture.texels[..., :3].astype(int) - TEXELS).max() <= 8


@pytest.mark.parametrize("with_png", [False, True])
def test_basis_universal_without_its_decoder(
    with_png: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The PNG or JPEG that the file also has is used; without one the texture is left out with one message."""
    monkeypatch.setattr("clrt.formats.images.image_reader.find_spec", lambda name: None)
    gltf = Gltf()
    png = image(gltf, TEXELS)["index"] if with_png else 0
    gltf.document.setdefault("images", []).append({"bufferView": gltf.view(encoded("KHR_texture_basisu"))})
    extension = {"KHR_texture_basisu": {"source": len(gltf.document["images"]) - 1}}
    color = textured(gltf, {"extensions": extension, **({"source": png} if with_png else {})}, tmp_path)
    if with_png:
        assert isinstance(color, Texture) and not caplog.text
        np.testing.assert_array_equal(color.picture.texels[..., :3], TEXELS)
        return
    assert color == pytest.approx((0.8, 0.4, 0.8))
    (message,) = caplog.messages
    assert re.search(
        "a.glb: a texture is left out: image 0: is compressed with Basis.*pip install opengl-basisu", message
    )


def test_another_image_replaces_a_damaged_one(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gltf = Gltf()
    png = image(gltf, TEXELS)["index"]
    gltf.document["images"].append({"bufferView": gltf.view(b"RIFF" + bytes(40))})
    color = textured(gltf, {"source": png, "extensions": {"EXT_texture_webp": {"source": 1}}}, tmp_path)
    assert isinstance(color, Texture) and not caplog.text
    np.testing.assert_array_equal(color.picture.texels[..., :3], TEXELS)


def test_anisotropy(tmp_path: Path) -> None:
    """The strength is blue times the factor, the direction red and green; the rotation is in radians."""
    gltf = Gltf()
    source = {"anisotropyStrength": 0.5, "anisotropyRotation": np.pi / 6, "anisotropyTexture": image(gltf, TEXELS)}
    material = {"extensions": {"KHR_materials_anisotropy": source}}
    (mesh,) = with_uv(tmp_path, gltf, material, np.zeros((1, 3, 2)))
    made = mesh.material
    assert isinstance(made, MetallicRoughness) and made.anisotropy_degrees == pytest.approx(30)
    assert isinstance(made.anisotropy, Texture) and (made.anisotropy.channel, made.anisotropy.factor) == ("blue", 0.5)
    assert made.anisotropy_map is not None and made.anisotropy_map.picture is made.anisotropy.picture
    plain = with_uv(
        tmp_path, Gltf(), {"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 2}}}, [[[0, 0]] * 3]
    )
    assert isinstance(plain[0].material, MetallicRoughness) and plain[0].material.anisotropy == 1


def test_anisotropy_without_a_direction(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Primitives without tangents and texture coordinates are isotropic, with a message."""
    made = of(tmp_path, {"name": "brushed", "extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 1}}})
    assert isinstance(made, MetallicRoughness) and made.anisotropy == 0
    assert caplog.messages[0].endswith('left out: anisotropy of material "brushed"')


def test_iridescence(tmp_path: Path) -> None:
    """The strength is red times the factor; green is the thickness between both ends, the upper one without."""
    gltf = Gltf()
    texture = image(gltf, TEXELS)
    source = {
        "iridescenceFactor": 0.5,
        "iridescenceTexture": texture,
        "iridescenceIor": 1.8,
        "iridescenceThicknessMinimum": 200,
        "iridescenceThicknessMaximum": 900,
        "iridescenceThicknessTexture": texture,
    }
    (mesh,) = with_uv(tmp_path, gltf, {"extensions": {"KHR_materials_iridescence": source}}, np.zeros((1, 3, 2)))
    made = mesh.material
    assert isinstance(made, MetallicRoughness) and isinstance(made.iridescence, Texture)
    assert (made.iridescence.channel, made.iridescence.factor) == ("red", 0.5)
    blend = made.iridescence_thickness_map
    assert isinstance(blend, Texture) and (blend.channel, blend.factor) == ("green", 1)
    assert (made.iridescence_ior, made.iridescence_thickness_minimum, made.iridescence_thickness) == (1.8, 200, 900)
    plain = of(tmp_path, {"extensions": {"KHR_materials_iridescence": {"iridescenceFactor": 1}}})
    assert isinstance(plain, MetallicRoughness) and plain.iridescence == 1 and plain.iridescence_thickness_map == 1
    assert (plain.iridescence_ior, plain.iridescence_thickness) == (1.3, 400)


def test_diffuse_transmission(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The fraction is alpha times the factor; a volume is not rendered."""
    gltf = Gltf()
    texture = image(gltf, TEXELS)
    source = {
        "diffuseTransmissionFactor": 0.5,
        "diffuseTransmissionTexture": texture,
        "diffuseTransmissionColorFactor": [1, 0.5, 0.25],
        "diffuseTransmissionColorTexture": texture,
    }
    extensions = {"KHR_materials_diffuse_transmission": source, "KHR_materials_volume": BLUE}
    plain = {"metallicFactor": 0}
    (mesh,) = with_uv(tmp_path, gltf, {"pbrMetallicRoughness": plain, "extensions": extensions}, np.zeros((1, 3, 2)))
    made = mesh.material
    assert isinstance(made, MetallicRoughness) and isinstance(made.diffuse_transmission, Texture)
    assert (made.diffuse_transmission.channel, made.diffuse_transmission.factor) == ("alpha", 0.5)
    color = made.diffuse_transmission_color
    assert isinstance(color, Texture) and np.array_equal(np.array(color.factor), (1, 0.5, 0.25))
    assert caplog.messages[0].endswith('left out: volume of material "material 0"')


@pytest.mark.parametrize("roughness", [0, 0.5])
def test_dispersion(roughness: float, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Of smooth solid glass; rough glass has none, with a message."""
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": BLUE,
        "KHR_materials_dispersion": {"dispersion": 0.36},
    }
    plain = {"metallicFactor": 0, "roughnessFactor": roughness}
    made = of(tmp_path, {"pbrMetallicRoughness": plain, "extensions": extensions})
    assert isinstance(made, Dielectric) and made.dispersion == (0.36 if roughness == 0 else 0)
    assert [message.split("out: ")[1] for message in caplog.messages] == (
        ['dispersion of rough glass of material "material 0"'] if roughness else []
    )
