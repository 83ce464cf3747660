"""Materials of USD files: UsdPreviewSurface and its textures, subsets and primvars."""

from __future__ import annotations

import logging
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from clrt.formats.usd.materials import DEFAULTS, _placed
from clrt.formats.usd.reader import read_usd
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Mesh

from .usd_files import BOUND, SQUARE, ST, TEXTURED, material, mesh, texture, usda

pytestmark = pytest.mark.needs("pxr")


@pytest.fixture(autouse=True)
def images(tmp_path: Path) -> None:
    """A ramp of texels from 0 to 255 in all channels, alpha being reversed."""
    ramp = np.arange(256, dtype=np.uint8)
    imageio.imwrite(tmp_path / "ramp.png", np.stack([ramp, ramp, ramp, 255 - ramp], axis=1).reshape(16, 16, 4))


def surface(folder: Path, inputs: str, nodes: str = "", content: str = ST) -> MetallicRoughness:
    (read,) = read_usd(usda(folder, mesh(content + BOUND) + material(inputs, nodes))).meshes
    assert isinstance(read.material, MetallicRoughness) and read.material_name == "look"
    return read.material


def linear(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4))


def test_defaults_are_those_of_the_specification(tmp_path: Path) -> None:
    assert surface(tmp_path, "") == MetallicRoughness(color=(0.18,) * 3, roughness=0.5, clearcoat_roughness=0.01)
    assert DEFAULTS["ior"] == 1.5


def test_constants(tmp_path: Path) -> None:
    made = surface(
        tmp_path,
        """
        color3f inputs:diffuseColor = (0.5, 0.25, 1)
        color3f inputs:emissiveColor = (3, 0, 7)
        float inputs:metallic = 0.75
        float inputs:roughness = 0.125
        float inputs:clearcoat = 0.5
        float inputs:clearcoatRoughness = 0.25
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0.25
        float inputs:ior = 2
""",
    )
    assert made == MetallicRoughness(
        color=(0.5, 0.25, 1.0),
        emission=(3.0, 0.0, 7.0),
        metallic=0.75,
        roughness=0.125,
        clearcoat=0.5,
        clearcoat_roughness=0.25,
        opacity=0.5,
        alpha_cutoff=0.25,
        ior=2.0,
    )


def test_specular_workflow(tmp_path: Path) -> None:
    """The specular color is the reflectance at normal incidence, whatever `metallic` and `ior` are."""
    made = surface(
        tmp_path,
        "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.5, 0.25, 1)\nfloat inputs:metallic = 1",
    )
    assert made.metallic == 0 and isinstance(made.specular_color, tuple)
    f0 = ((made.ior - 1) / (made.ior + 1)) ** 2
    np.testing.assert_allclose(f0 * np.array(made.specular_color), [0.5, 0.25, 1])


def test_indices_of_refraction_below_one(tmp_path: Path) -> None:
    assert surface(tmp_path, "float inputs:ior = 0.5").ior == 2
    assert surface(tmp_path, "float inputs:ior = 0").ior == 4


@pytest.mark.parametrize("space", ["sRGB", "raw", "auto"])
@pytest.mark.parametrize(
    ("scale", "bias"),
    [((1, 1, 1, 1), (0, 0, 0, 0)), ((0.5, 0.25, 1, 1), (0, 0, 0, 0)), ((-1, 0.5, 1, 1), (1, 0.25, 0, 0))],
)
def test_color_textures(tmp_path: Path, space: str, scale: tuple[float, ...], bias: tuple[float, ...]) -> None:
    """A color is scale times the decoded texel plus bias, to within a texel's rounding."""
    nodes = texture(
        "ramp.png",
        f'token inputs:sourceColorSpace = "{space}"\nfloat4 inputs:scale = {scale}\nfloat4 inputs:bias = {bias}',
    )
    color = surface(tmp_path, TEXTURED, nodes).color
    assert isinstance(color, Texture)
    steps = np.arange(256) / 255
    decoded = steps if space == "raw" else linear(steps)
    expected = decoded[:, None] * scale[:3] + bias[:3]
    found = linear(color.picture.texels.reshape(-1, 4)[:, :3] / 255) * color.factor
    np.testing.assert_allclose(found, expected, atol=0.005)


@pytest.mark.parametrize("output", ["r", "a"])
def test_number_textures(tmp_path: Path, output: str) -> None:
    nodes = texture("ramp.png", "float4 inputs:scale = (0.5, 1, 1, 0.25)")
    roughness = surface(tmp_path, f"float inputs:roughness.connect = </look/image.outputs:{output}>", nodes).roughness
    assert isinstance(roughness, Texture)
    assert (roughness.channel, roughness.factor) == {"r": ("red", 0.5), "a": ("alpha", 0.25)}[output]
    np.testing.assert_array_equal(roughness.picture.texels[0, :, 0], np.arange(16))


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", [0, 128, 255]),
        ("float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)", [0, 128, 255]),
        ("float4 inputs:scale = (2, -2, 2, 1)\nfloat4 inputs:bias = (-1, 1, -1, 0)", [0, 127, 255]),
    ],
)
def test_normal_maps(tmp_path: Path, content: str, expected: list[int]) -> None:
    """Scale and bias become glTF's, 2 and −1; a negative scale mirrors."""
    bent = surface(
        tmp_path, "normal3f inputs:normal.connect = </look/image.outputs:rgb>", texture("ramp.png", content)
    ).normal_map
    assert bent is not None and bent.factor == 1
    texels = bent.picture.texels.reshape(-1, 4)
    assert texels[[0, 128, 255], 0].tolist() == [0, 128, 255]
    assert texels[[0, 128, 255], 1].tolist() == (expected if "-2" not in content else [255, 127, 0])


def test_wrap_modes_and_two_sets_of_coordinates(tmp_path: Path) -> None:
    """v points up in the file; each texture reads the primvar that its reader names."""
    nodes = texture("ramp.png", 'token inputs:wrapS = "mirror"\ntoken inputs:wrapT = "clamp"') + texture(
        "ramp.png", uv="detail", name="second"
    )
    content = ST + 'texCoord2f[] primvars:detail = [(0.25, 0.75)] (interpolation = "constant")\n'
    inputs = TEXTURED + "\nfloat inputs:metallic.connect = </look/second.outputs:g>"
    (read,) = read_usd(usda(tmp_path, mesh(content + BOUND) + material(inputs, nodes))).meshes
    made = read.material
    assert isinstance(made, MetallicRoughness)
    assert isinstance(made.color, Texture) and isinstance(made.metallic, Texture)
    assert made.color.wrap == ("mirror", "clamp") and made.metallic.wrap == ("repeat", "repeat")
    assert (made.color.uv_set, made.metallic.uv_set) == (0, 1) and made.metallic.channel == "green"
    assert read.uv is not None and read.uv1 is not None
    np.testing.assert_allclose(read.uv, np.column_stack([read.vertices[:, 0], 1 - read.vertices[:, 1]]))
    np.testing.assert_allclose(read.uv1, [[0.25, 0.25]] * 4)


@settings(max_examples=30, deadline=None)
@given(
    scale=st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
    shift=st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
    degrees=st.floats(-360, 360),
    point=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
)
def test_texture_transforms(
    scale: tuple[float, float], shift: tuple[float, float], degrees: float, point: tuple[float, float]
) -> None:
    """UsdTransform2d scales, then rotates counter-clockwise, then translates, with v upwards."""
    made = _placed({"scale": scale, "translation": shift, "rotation": degrees})
    turned = (point[0] * scale[0] + 1j * point[1] * scale[1]) * np.exp(1j * np.radians(degrees)) + complex(*shift)
    u, v = made.to_picture @ [point[0], 1 - point[1], 1]
    np.testing.assert_allclose([u, 1 - v], [turned.real, turned.imag], atol=1e-9)


def test_transform_nodes_are_followed(tmp_path: Path) -> None:
    nodes = (
        texture("ramp.png", "float2 inputs:st.connect = </look/place.outputs:result>")
        + """
    def Shader "place"
    {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </look/image_reader.outputs:result>
        float2 inputs:scale = (2, 3)
        float2 inputs:translation = (0.25, 0.5)
        float2 outputs:result
    }
"""
    )
    color = surface(tmp_path, TEXTURED, nodes).color
    assert isinstance(color, Texture) and list(color.scale) == [2, 3]
    np.testing.assert_allclose(color.to_picture @ [0, 1, 1], [0.25, 1 - 0.5])


def test_textures_that_are_missing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A missing file gives the node's fallback; missing coordinates remove the texture; both are warned of."""
    with caplog.at_level(logging.WARNING):
        made = surface(tmp_path, TEXTURED, texture("none.png", "float4 inputs:fallback = (0.5, 0.25, 0, 1)"))
        assert made.color == (0.5, 0.25, 0.0)
        assert "a texture is left out: none.png: no such image file" in caplog.text
        assert surface(tmp_path, TEXTURED, texture("ramp.png"), "").color == (1.0, 1.0, 1.0)
    assert "textures of meshes without their texture coordinates (1)" in caplog.text


def test_subsets(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A mesh for each material; faces of no subset have the mesh's own; an unknown shader is named."""
    base = SQUARE.replace("[4]", "[3, 3]").replace("[0, 1, 2, 3]", "[0, 1, 2, 0, 2, 3]")
    subset = """
    uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
    def GeomSubset "part" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </other>
    }
"""
    other = material("", name="other").replace("UsdPreviewSurface", "Fancy")
    with caplog.at_level(logging.WARNING):
        meshes = read_usd(usda(tmp_path, mesh(BOUND + subset, base=base) + material("") + other)).meshes
    assert [(each.material_name, len(each.faces)) for each in meshes] == [("look", 1), ("other", 1)]
    np.testing.assert_allclose(meshes[1].vertices, [[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert 'the shader of material "other" (Fancy)' in caplog.text


def test_primvars_as_colors(tmp_path: Path) -> None:
    """A material whose color reads displayColor has the mesh's colors; others ignore them."""
    color = (
        'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] (interpolation = "vertex")\n'
    )
    reader = """
    def Shader "colors"
    {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "displayColor"
        float3 outputs:result
    }
"""
    connected = "color3f inputs:diffuseColor.connect = </look/colors.outputs:result>"

    def read(inputs: str) -> Mesh:
        return read_usd(usda(tmp_path, mesh(color + BOUND) + material(inputs, reader))).meshes[0]

    shown = read(connected)
    assert isinstance(shown.material, MetallicRoughness) and shown.material.color == (1.0, 1.0, 1.0)
    assert shown.colors is not None and shown.colors.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    assert read("").colors is None


def test_double_sided(tmp_path: Path) -> None:
    content = "uniform bool doubleSided = 1\n"
    meshes = read_usd(
        usda(tmp_path, mesh(content + BOUND) + mesh(content, "b") + mesh(BOUND, "c") + material(""))
    ).meshes
    assert [each.material.double_sided for each in meshes] == [True, True, False]
    assert isinstance(meshes[1].material, Diffuse)
