"""Reading of glTF materials with their textures and extensions."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.scene.materials.material import Material, as_color
from clrt.scene.materials.material_types import Dielectric, MetallicRoughness
from clrt.scene.materials.textures import Texture

from ..scene.shapes import icosphere
from .glb import TRIANGLE, Gltf, ball, read


def textured(color: tuple[int, int, int], folder: Path, **material: Any) -> MetallicRoughness:
    """`drawn`, of what is no glass."""
    found = drawn(color, folder, **material)
    assert isinstance(found, MetallicRoughness)
    return found


def drawn(color: tuple[int, int, int], folder: Path, **material: Any) -> Material:
    """The material of a triangle whose three corners address the right one of a texture's two texels."""
    import imageio.v3 as imageio

    gltf = Gltf()
    picture = imageio.imwrite("<bytes>", np.array([[[9, 99, 199], color]], np.uint8), extension=".png")
    gltf.document["images"] = [{"bufferView": gltf.view(picture), "mimeType": "image/png"}]
    gltf.document["samplers"] = [{"magFilter": 9728, "wrapS": 33648, "wrapT": 33071}]
    gltf.document["textures"] = [{"source": 0, "sampler": 0}]
    gltf.document["materials"] = [material]
    uv = gltf.accessor(np.array([[0.6, 0.5], [0.99, 0.1], [-0.25, 1.0]]))
    gltf.mesh(attributes={"POSITION": gltf.accessor(TRIANGLE), "TEXCOORD_0": uv}, material=0)
    return read(gltf, folder).meshes[0].material


def test_material_factors_are_cut_to_their_limits(tmp_path: Path) -> None:
    gltf = ball()
    gltf.document["materials"] = [
        {
            "pbrMetallicRoughness": {
                "baseColorFactor": [1.5, 0.25, -1, 1],
                "metallicFactor": 0.5,
                "roughnessFactor": 2,
            },
            "emissiveFactor": [1, 0.5, 0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}},
        }
    ]
    gltf.document["meshes"][0]["primitives"][0]["material"] = 0
    assert read(gltf, tmp_path).meshes[0].material == MetallicRoughness(
        color=(1, 0.25, 0), metallic=0.5, roughness=1, emission=(8, 4, 0)
    )


def test_textures_of_every_parameter(tmp_path: Path) -> None:
    """One image with its factors, channels, transform and sampler; the materials of a file share it."""
    placed = {
        "index": 0,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 3]}},
    }
    factors = {
        "baseColorTexture": placed,
        "metallicRoughnessTexture": {"index": 0},
        "metallicFactor": 0.5,
        "baseColorFactor": [1, 0.5, 1, 0.75],
    }
    material = textured(
        (188, 188, 0),
        tmp_path,
        pbrMetallicRoughness=factors,
        emissiveFactor=[1, 0.5, 1],
        emissiveTexture={"index": 0},
        normalTexture={"index": 0, "scale": 0.5},
        alphaMode="MASK",
        alphaCutoff=0.25,
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
    )
    color, metallic, roughness, opacity = material.color, material.metallic, material.roughness, material.opacity
    assert isinstance(color, Texture) and isinstance(metallic, Texture) and isinstance(roughness, Texture)
    assert isinstance(opacity, Texture) and isinstance(material.emission, Texture) and material.normal_map is not None
    assert color.picture.texels.tolist() == [[[9, 99, 199, 255], [188, 188, 0, 255]]]
    assert all(texture.picture is color.picture for texture in material.textures()) and len(material.textures()) == 6
    assert as_color(color.factor) == pytest.approx((1, 0.5, 1))
    assert (color.offset, color.scale) == ((0.5, 0.25), (2, 3))
    assert color.rotation_degrees == pytest.approx(90)
    assert (color.wrap, color.filter) == (("mirror", "clamp"), "nearest")
    assert (metallic.channel, metallic.factor, roughness.channel, roughness.factor) == ("blue", 0.5, "green", 1)
    assert (opacity.channel, opacity.factor, opacity.scale, material.alpha_cutoff) == ("alpha", 0.75, (2, 3), 0.25)
    assert as_color(material.emission.factor) == pytest.approx((4, 2, 4)) and material.normal_map.factor == 0.5


def test_a_cutoff_that_nothing_reaches(tmp_path: Path) -> None:
    """Above 1 a mask hides everything, for any opacity."""
    assert textured((255, 255, 255), tmp_path, alphaMode="MASK", alphaCutoff=1.0).alpha_cutoff == 1
    assert textured((255, 255, 255), tmp_path, alphaMode="MASK", alphaCutoff=1.5).opacity == 0


@pytest.mark.parametrize(
    "extensions",
    [{}, {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}],
    ids=["opaque", "glass"],
)
def test_sides(tmp_path: Path, extensions: dict[str, Any]) -> None:
    """Double-sided materials emit from both sides; by default, and without a material, only the front emits."""
    found = []
    for sides in ({"doubleSided": True}, {"doubleSided": False}, {}, None):
        gltf = ball()
        if sides is not None:
            gltf.document["materials"] = [{"emissiveFactor": [1, 1, 1], "extensions": extensions, **sides}]
            gltf.document["meshes"][0]["primitives"][0]["material"] = 0
        found.append(read(gltf, tmp_path).meshes[0].material.double_sided)
    assert found == [True, False, False, False]


def test_layers_and_glass(tmp_path: Path) -> None:
    """Extensions map to parameters; a volume with full transmission becomes glass."""
    texture = {"index": 0}
    layered = textured(
        (255, 255, 255),
        tmp_path,
        extensions={
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 0.5,
                "clearcoatRoughnessFactor": 0.25,
                "clearcoatRoughnessTexture": texture,
                "clearcoatNormalTexture": {"index": 0, "scale": 0.75},
            },
            "KHR_materials_sheen": {
                "sheenColorFactor": [0.1, 0.2, 0.3],
                "sheenRoughnessFactor": 0.4,
                "sheenRoughnessTexture": texture,
            },
            "KHR_materials_specular": {"specularTexture": texture, "specularColorFactor": [2, 1, 0.5]},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
        },
    )
    coat, specular, bent = layered.clearcoat_roughness, layered.specular, layered.clearcoat_normal_map
    assert layered.normal_map is None and bent is not None and bent.factor == 0.75
    assert layered.without_textures().clearcoat_normal_map is None
    assert isinstance(coat, Texture) and (coat.factor, coat.channel) == (0.25, "green")
    wool = layered.sheen_roughness
    assert isinstance(wool, Texture) and (wool.factor, wool.channel) == (0.4, "alpha")
    assert layered == replace(layered, sheen_color=(0.1, 0.2, 0.3))
    assert isinstance(specular, Texture) and specular.channel == "alpha"
    assert layered == replace(layered, specular_color=(2, 1, 0.5), ior=1.33, transmission=0.75, clearcoat=0.5)
    gltf = ball()
    gltf.document["materials"] = [
        {
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 1, 1], "metallicFactor": 0, "roughnessFactor": 0.5},
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_ior": {"ior": 1.4},
                "KHR_materials_volume": {
                    "thicknessFactor": 1,
                    "attenuationDistance": 2,
                    "attenuationColor": [0.5, 1, 1],
                },
            },
        }
    ]
    gltf.document["meshes"][0]["primitives"][0]["material"] = 0
    assert read(gltf, tmp_path).meshes[0].material == Dielectric(
        color=(1, 0.5, 1), ior=1.4, roughness=0.5, attenuation_color=(0.5, 1, 1), attenuation_distance=2
    )


@pytest.mark.parametrize("ior", [0, 1, 1.5, 4, 5, 25])
def test_reflectance_follows_the_ior(ior: float, tmp_path: Path) -> None:
    """KHR_materials_ior: ((ior - 1)/(ior + 1))² times the specular color; 0 stands for infinity."""
    tint = np.array([1, 0.5, 0.01])
    extensions = {"KHR_materials_ior": {"ior": ior}, "KHR_materials_specular": {"specularColorFactor": tint.tolist()}}
    gltf = ball()
    gltf.document["materials"] = [{"extensions": extensions, "pbrMetallicRoughness": {"metallicFactor": 0}}]
    gltf.document["meshes"][0]["primitives"][0]["material"] = 0
    made = read(gltf, tmp_path).meshes[0].material
    assert isinstance(made, MetallicRoughness)
    reflectance = np.array(made.parameters()["f0"]) * np.array(made.specular_color)
    expected = 1.0 if ior == 0 else ((ior - 1) / (ior + 1)) ** 2
    assert reflectance == pytest.approx(expected * tint, rel=1e-6)


GLASS: dict[str, Any] = {
    "KHR_materials_transmission": {"transmissionFactor": 1},
    "KHR_materials_volume": {"thicknessFactor": 1},
}
LAYERS: dict[str, Any] = {
    "KHR_materials_clearcoat": {"clearcoatFactor": 1},
    "KHR_materials_sheen": {"sheenColorFactor": [0, 0.5, 0]},
    "KHR_materials_specular": {"specularFactor": 0.5},
}
PANE = {"baseColorFactor": [1, 1, 1, 0.5], "metallicFactor": 0}


@pytest.mark.parametrize(
    "materials, told",
    [
        (
            [{"name": "jar", "alphaMode": "BLEND", "pbrMetallicRoughness": PANE, "extensions": GLASS | LAYERS}],
            'left out: alphaMode and clearcoat and sheen and specular of material "jar"',
        ),
        (
            [
                {"alphaMode": "MASK", "pbrMetallicRoughness": PANE, "extensions": GLASS},
                {
                    "pbrMetallicRoughness": PANE,
                    "extensions": GLASS | {"KHR_materials_transmission": {"transmissionFactor": 0.5}},
                },
            ],
            'left out: alphaMode of material "material 0", volume of material "material 1"',
        ),
        ([{"pbrMetallicRoughness": PANE, "extensions": GLASS}], ""),
        ([{"alphaMode": "BLEND", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": GLASS}], ""),
        ([{"alphaMode": "BLEND", "pbrMetallicRoughness": PANE, "extensions": LAYERS}], ""),
        ([{"extensions": {"KHR_materials_volume": {"thicknessFactor": 1}}}], ""),
    ],
)
def test_features_that_are_not_rendered_are_named_once(
    materials: list[dict[str, Any]], told: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Per file in one warning, by material; not those without effect, nor those that are rendered."""
    gltf = ball()
    gltf.document["materials"] = materials
    (first,) = gltf.document["meshes"][0]["primitives"]
    gltf.document["meshes"][0]["primitives"] = [{**first, "material": number} for number in range(len(materials))] * 2
    with caplog.at_level(logging.WARNING):
        read(gltf, tmp_path)
    assert [record.getMessage().split(": ", 1)[1] for record in caplog.records] == ([told] if told else [])


def test_glass_has_bumps(tmp_path: Path) -> None:
    """As any other surface."""
    material = drawn(
        (255, 255, 255),
        tmp_path,
        normalTexture={"index": 0, "scale": 0.25},
        extensions={
            "KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_volume": {"thicknessFactor": 1},
        },
        pbrMetallicRoughness={"metallicFactor": 0},
    )
    assert isinstance(material, Dielectric) and material.normal_map is not None and material.normal_map.factor == 0.25


@pytest.mark.parametrize("wrap, name", [(10497, "repeat"), (33648, "mirror"), (33071, "clamp")])
def test_glass_beside_metal_in_one_picture(tmp_path: Path, wrap: int, name: str) -> None:
    """The image's left half is metal. Faces on the right half alone become glass, with their wrapped coordinates; the
    others become metallic_roughness, except that all are glass if the factor removes the metal."""
    import imageio.v3 as imageio

    where = {"repeat": lambda u: u % 1, "mirror": lambda u: abs((u + 1) % 2 - 1), "clamp": lambda u: min(max(u, 0), 1)}
    for middle, factor in [(u, f) for u in (-1.3, -0.7, -0.2, 0.3, 0.7, 1.2, 1.8, 2.4) for f in (1, 0)]:
        gltf = Gltf()
        picture = imageio.imwrite("<bytes>", np.array([[[0, 128, 255], [0, 128, 7]]], np.uint8), extension=".png")
        gltf.document |= {
            "images": [{"bufferView": gltf.view(picture), "mimeType": "image/png"}],
            "samplers": [{"wrapS": wrap, "wrapT": wrap}],
            "textures": [{"source": 0, "sampler": 0}],
            "materials": [
                {
                    "extensions": {
                        "KHR_materials_transmission": {"transmissionFactor": 1},
                        "KHR_materials_volume": {"thicknessFactor": 1},
                    },
                    "pbrMetallicRoughness": {"metallicFactor": factor, "metallicRoughnessTexture": {"index": 0}},
                }
            ],
        }
        uv = gltf.accessor(np.array([[middle - 0.1, 0.5], [middle + 0.1, 0.1], [middle, 1.0]]))
        gltf.mesh(attributes={"POSITION": gltf.accessor(TRIANGLE), "TEXCOORD_0": uv}, material=0)
        is_glass = isinstance(read(gltf, tmp_path).meshes[0].material, Dielectric)
        assert is_glass == (factor == 0 or where[name](middle) > 0.5), (middle, factor)


@pytest.mark.parametrize("mode, channels, cutoff", [("OPAQUE", 3, None), ("BLEND", 4, None), ("MASK", 4, 1.0)])
def test_alpha_of_vertex_colors(tmp_path: Path, mode: str, channels: int, cutoff: float | None) -> None:
    """It is kept except on opaque materials."""
    gltf = ball()
    gltf.document["materials"] = [{"alphaMode": mode, "alphaCutoff": 1.0}]
    primitive = gltf.document["meshes"][0]["primitives"][0]
    primitive["material"] = 0
    primitive["attributes"]["COLOR_0"] = gltf.accessor(np.full((len(icosphere(0)[0]), 4), 0.5))
    mesh = read(gltf, tmp_path).meshes[0]
    assert mesh.colors is not None and mesh.colors.shape[1] == channels
    assert mesh.material.opacity == 1 and mesh.material.alpha_cutoff == cutoff


def test_missing_texture_is_grey_with_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gltf = ball()
    gltf.document |= {
        "images": [{"uri": "lost.png"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"}],
    }
    primitive = gltf.document["meshes"][0]["primitives"][0]
    primitive["material"] = 0
    primitive["attributes"]["TEXCOORD_0"] = gltf.accessor(icosphere(0)[0][:, :2])
    with caplog.at_level(logging.WARNING):
        material = read(gltf, tmp_path).meshes[0].material
    assert isinstance(material, MetallicRoughness) and material.color == (0.8, 0.8, 0.8)
    assert "lost.png" in caplog.text and material.opacity == 1
