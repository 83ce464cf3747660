"""Conversion of scenes for Mitsuba, checked against its documentation; Mitsuba itself is not needed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.renderers.mitsuba_bsdfs import BSDFS, finer
from clrt.bench.renderers.mitsuba_renderer import newest_llvm
from clrt.bench.renderers.mitsuba_scene import mitsuba_scene, rows_at_poles
from clrt.errors import UsageError
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.materials.material_types import (
    MATERIALS,
    BlinnPhong,
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    MetallicRoughness,
    Mirror,
    Phong,
    Principled,
)
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

RNG = np.random.default_rng(5)
GREY = Picture(np.full((1, 1, 4), 128, np.uint8), "grey")
PICTURE = Picture(np.array([[[0, 51, 102, 255], [255, 153, 204, 0]]], np.uint8))
#: The plugin of `MetallicRoughness()`.
PLASTIC = {
    "type": "gltf",
    "color": {"type": "rgb", "value": [0.8] * 3},
    "metallic": 0,
    "roughness": 0.5,
    "f0": {"type": "rgb", "value": [pytest.approx(0.04)] * 3},
    "specular": 1,
    "transmission": 0,
    "clearcoat": 0,
    "sheen_color": {"type": "rgb", "value": [0, 0, 0]},
    "smith": "height_correlated",
    "coupling": "albedo",
    "multiple": False,
    "transmits": False,
    "layered": False,
}


def ball(material: Material) -> Scene:
    return Scene(spheres=[Sphere(material=material, name="the ball")])


def bsdf(material: Material) -> Any:
    """Return the plugin inside `twosided`."""
    plugin = mitsuba_scene(ball(material))["sphere0"]["bsdf"]
    assert plugin["type"] == "twosided"
    return plugin["front"]


def test_camera_looks_where_it_should_with_its_left_to_the_left() -> None:
    """Mitsuba's perspective camera looks along +z, with +y up in the image and +x left."""
    camera = Camera(position=(1, 2, 5), look_at=(1, 2, -5), fov_degrees=30)
    sensor = mitsuba_scene(replace(ball(Diffuse()), camera=camera, render=RenderSettings(size=(64, 48))))["sensor"]
    np.testing.assert_allclose(sensor["to_world"], [[-1, 0, 0, 1], [0, 1, 0, 2], [0, 0, -1, 5], [0, 0, 0, 1]])
    assert (sensor["fov"], sensor["fov_axis"]) == (30, "y"), "vertical, full angle"
    assert (sensor["film"]["width"], sensor["film"]["height"], sensor["film"]["rfilter"]) == (64, 48, {"type": "box"})
    slanted = Camera(position=(1, 2, 5), look_at=(-3, 0.5, 1), up=(0.2, 1, -0.1))
    matrix = mitsuba_scene(replace(ball(Diffuse()), camera=slanted))["sensor"]["to_world"]
    np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1) and matrix[:3, 1] @ slanted.up > 0
    np.testing.assert_allclose(np.cross(matrix[:3, 2], [-4, -1.5, -4]), 0, atol=1e-12)


def test_lenses_and_parallel_rays_are_told() -> None:
    lens = Camera(position=(0, 0, 4), aperture_radius=0.1)
    for camera, focus in ((lens, 4), (replace(lens, focus_distance=2.5), 2.5)):
        sensor = mitsuba_scene(replace(ball(Diffuse()), camera=camera))["sensor"]
        assert (sensor["type"], sensor["aperture_radius"], sensor["focus_distance"]) == ("thinlens", 0.1, focus)
    plan = Camera(position=(0, 5, 0), look_at=(0, 0, 0), up=(0, 0, -1), projection="orthographic", view_height=3)
    wide = replace(ball(Diffuse()), camera=plan, render=RenderSettings(size=(80, 40)))
    sensor = mitsuba_scene(wide)["sensor"]
    assert sensor["type"] == "orthographic"
    np.testing.assert_allclose(
        sensor["to_world"] @ [-1, 0.5, 0, 1],
        [3, 5, -1.5, 1],
        atol=1e-12,
        err_msg="of -1 to 1 in its x, which is the picture's left",
    )
    with pytest.raises(UsageError, match="no equirectangular camera"):
        mitsuba_scene(replace(wide, camera=Camera(projection="equirectangular")))


def test_depth_counts_edges_and_direct_light_is_two_of_them() -> None:
    for settings, depth in [(RenderSettings(max_depth=5), 5), (RenderSettings(max_depth=5, integrator="direct"), 2)]:
        integrator = mitsuba_scene(replace(ball(Diffuse()), render=settings), "multijitter")["integrator"]
        assert integrator == {"type": "path", "max_depth": depth}


def test_materials_are_told_by_what_they_reflect() -> None:
    assert bsdf(Diffuse(color=(0.1, 0.2, 0.3)))["reflectance"] == {"type": "rgb", "value": [0.1, 0.2, 0.3]}
    assert bsdf(Mirror(color=(0.5, 0.7, 0.9))) == {
        "type": "conductor",
        "material": "none",
        "specular_reflectance": {"type": "rgb", "value": [0.5, 0.7, 0.9]},
    }
    gold = bsdf(MetallicRoughness(preset="gold", roughness=0.3, smith="separable"))
    assert (gold["type"], gold["metallic"], gold["base_color"]["value"]) == ("principled", 1, [1.0, 0.71, 0.29])
    assert gold["roughness"] == pytest.approx(0.3), "principled squares it, too"
    assert mitsuba_scene(ball(Dielectric(ior=1.3, color=(0.9, 0.8, 0.7))))["sphere0"]["bsdf"] == {
        "type": "dielectric",
        "int_ior": 1.3,
        "ext_ior": 1.0,
        "specular_reflectance": {"type": "rgb", "value": [1.0, 1.0, 1.0]},
        "specular_transmittance": {"type": "rgb", "value": [0.9, 0.8, 0.7]},
    }, "not two-sided"


@pytest.mark.parametrize(
    ("material", "words"),
    [
        (MetallicRoughness(clearcoat=0.5, roughness=Texture(picture=GREY)), "the texture grey"),
        (MetallicRoughness(clearcoat=0.5, normal_map=Texture(picture=GREY)), "a clearcoat with a normal map"),
        (Dielectric(roughness=Texture(picture=GREY)), "the texture grey"),
        (Diffuse(one_sided=True), "one-sided"),
    ],
)
def test_what_has_no_counterpart_is_refused_by_name(material: Material, words: str) -> None:
    with pytest.raises(UsageError, match=f"the ball: Mitsuba does not support .*{words}"):
        mitsuba_scene(ball(material))


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (replace(ball(Diffuse()), render=RenderSettings(back_face_culling="camera")), "leave out back_face_culling"),
        (replace(ball(Diffuse()), render=RenderSettings(clamp_direct=1.0)), "leave out clamp_direct"),
        (replace(ball(Diffuse()), render=RenderSettings(transparent=True)), "transparent, backdrop, .*leave them out"),
        (ball(Diffuse(camera_visible=False)), "camera_visible are not exported to Mitsuba"),
        (ball(Diffuse(emission=(1, 1, 1), double_sided=True)), "leave out double_sided"),
    ],
)
def test_settings_without_a_counterpart_are_refused(scene: Scene, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        mitsuba_scene(scene)


def test_other_gloss_is_a_plugin_of_our_own() -> None:
    """The plugin gets all parameters of the formula in docs/scene-format.md."""
    plastic = bsdf(MetallicRoughness(preset="plastic_high", color=(0.1, 0.2, 0.3), roughness=0.4))
    assert plastic == PLASTIC | {
        "color": {"type": "rgb", "value": [0.1, 0.2, 0.3]},
        "roughness": 0.4,
        "f0": {"type": "rgb", "value": [0.05, 0.05, 0.05]},
    }
    pane = MetallicRoughness(ior=3, specular=0.5, specular_color=(8, 2, 0), transmission=0.25)
    tinted = mitsuba_scene(ball(pane))["sphere0"]["bsdf"]
    assert tinted == PLASTIC | {
        "f0": {"type": "rgb", "value": [1, 0.5, 0]},
        "specular": 0.5,
        "transmission": 0.25,
        "transmits": True,
        "multiple": True,
    }
    tint = Texture(picture=PICTURE, factor=(1, 2, 4))
    map_of_f0 = bsdf(MetallicRoughness(ior=3, specular_color=tint))["f0"]
    white = bsdf(Diffuse(color=replace(tint, factor=(0.25, 0.5, 1))))["reflectance"]
    np.testing.assert_allclose(map_of_f0["bitmap"], white["bitmap"], rtol=1e-6)


@pytest.mark.parametrize(
    ("material", "kind"),
    [
        (Dielectric(roughness=0.7, multiple_scattering=False), "roughdielectric"),
        (Conductor(preset="gold", roughness=0.7), "roughconductor"),
    ],
)
def test_rough_glass_and_metal_have_the_height_correlated_smith_term(material: Material, kind: str) -> None:
    plugin = mitsuba_scene(ball(material))["sphere0"]["bsdf"]
    plugin = plugin["front"] if plugin["type"] == "twosided" else plugin
    assert (plugin["type"], plugin["alpha"]) == ("height_correlated", pytest.approx(0.49))
    assert (plugin["bsdf"]["type"], plugin["bsdf"]["alpha"]) == (kind, plugin["alpha"])


def test_layers_are_a_plugin_of_our_own() -> None:
    velvet = bsdf(MetallicRoughness(color=(0.1, 0.2, 0.3), roughness=0.4, clearcoat=0.5, sheen_color=(0.6, 0.7, 0.8)))
    assert velvet == PLASTIC | {
        "color": {"type": "rgb", "value": [0.1, 0.2, 0.3]},
        "roughness": 0.4,
        "sheen_color": {"type": "rgb", "value": [0.6, 0.7, 0.8]},
        "clearcoat": 0.5,
        "clearcoat_roughness": 0,
        "sheen_roughness": 0,
        "layered": True,
    }


def test_phong_models_are_told_apart() -> None:
    for kind, half_vector in ((Phong, False), (BlinnPhong, True)):
        told = bsdf(kind(color=(0.1, 0.2, 0.3), specular=(0.4, 0.5, 0.6), shininess=20))
        assert told == {
            "type": "phong",
            "color": {"type": "rgb", "value": [0.1, 0.2, 0.3]},
            "shininess": 20,
            "specular": {"type": "rgb", "value": [0.4, 0.5, 0.6]},
            "half_vector": half_vector,
        }


def test_glass_that_mitsuba_lacks_is_a_plugin_of_our_own() -> None:
    """Multiple scattering is added to single scattering; rough or colored sheets are one plugin."""
    told = mitsuba_scene(ball(Dielectric(ior=1.3, roughness=0.7, color=(1, 0.5, 0.25))))["sphere0"]["bsdf"]
    single = replace(Dielectric(ior=1.3, roughness=0.7, color=(1, 0.5, 0.25)), multiple_scattering=False)
    assert told == {
        "type": "all_bounces",
        "ior": 1.3,
        "alpha": pytest.approx(0.49),
        "bsdf": mitsuba_scene(ball(single))["sphere0"]["bsdf"],
        "color": {"type": "rgb", "value": [1, 0.5, 0.25]},
    }
    for pane, alpha in (
        (Dielectric(thin=True, color=(1, 0.5, 0.25)), 0),
        (Dielectric(thin=True, roughness=0.5, color=(1, 0.5, 0.25)), 0.25),
    ):
        assert mitsuba_scene(ball(pane))["sphere0"]["bsdf"] == {
            "type": "sheet",
            "ior": 1.5,
            "alpha": alpha,
            "multiple": alpha > 0,
            "color": {"type": "rgb", "value": [1, 0.5, 0.25]},
        }, "not two-sided"
    assert mitsuba_scene(ball(Dielectric(thin=True)))["sphere0"]["bsdf"]["type"] == "thindielectric"


def test_vertex_colors_multiply_the_color() -> None:
    mesh = Mesh(
        np.eye(3, dtype=np.float32),
        np.array([[0, 1, 2]], np.int32),
        colors=np.full((3, 4), 0.5, np.float32),
        material=MetallicRoughness(color=(1, 0.5, 0.25), opacity=0.8),
    )
    told = mitsuba_scene(Scene(meshes=[mesh]))["mesh0"]
    mask = told["bsdf"]
    assert mask["bsdf"]["front"]["color"] == {"type": "mesh_attribute", "name": "vertex_color"}
    assert mask["opacity"] == {"type": "mesh_attribute", "name": "vertex_opacity"}
    np.testing.assert_allclose(told["colors"], [[0.5, 0.25, 0.125]] * 3)
    np.testing.assert_allclose(told["opacity"], [0.4] * 3)
    uv = np.zeros((3, 2), np.float32)
    with pytest.raises(UsageError, match="vertex colors with a texture"):
        mitsuba_scene(Scene(meshes=[replace(mesh, uv=uv, material=Diffuse(color=Texture(picture=PICTURE)))]))


def test_textures_are_linear_pictures_with_their_factors() -> None:
    """Colors are decoded by the sRGB formula, scalars are not and are gray; UVs are mapped by the transform."""
    paint = Texture(picture=PICTURE, factor=(0.5, 1, 1), scale=(2, 3), offset=(0.25, 0), wrap=("clamp", "clamp"))
    told = bsdf(Diffuse(color=paint))["reflectance"]
    assert (told["type"], told["raw"], told["wrap_mode"], told["filter_type"]) == ("bitmap", True, "clamp", "bilinear")
    curve = [((value / 255 + 0.055) / 1.055) ** 2.4 for value in (51, 102, 255, 153, 204)]
    expected = [[0, curve[0], curve[1]], [0.5 * curve[2], curve[3], curve[4]]]
    np.testing.assert_allclose(told["bitmap"][0], expected, rtol=1e-5)
    np.testing.assert_allclose(told["to_uv"] @ [1, 1, 0, 1], [2.25, 3, 0, 1])
    rough = bsdf(MetallicRoughness(roughness=Texture(picture=PICTURE, channel="blue", factor=0.5)))["roughness"]
    np.testing.assert_allclose(rough["bitmap"][0], [[0.2] * 3, [0.4] * 3], rtol=1e-6)


def test_cuts_are_made_between_texels() -> None:
    """Alpha falls from 1 to 0 over one texel, so a threshold of 0.25 is crossed after three quarters."""
    leaf = Texture(picture=PICTURE, channel="alpha", wrap=("clamp", "clamp"))
    told = mitsuba_scene(ball(Diffuse(opacity=leaf, alpha_cutoff=0.25)))["sphere0"]["bsdf"]
    assert (told["type"], told["opacity"]["filter_type"]) == ("mask", "nearest")
    assert told["opacity"]["bitmap"].shape == (4, 8, 3)
    np.testing.assert_array_equal(told["opacity"]["bitmap"][0, :, 0], [1, 1, 1, 1, 1, 0, 0, 0])
    around = finer(np.array([[[0.0], [1.0]]]), ("repeat", "repeat"), 2)
    np.testing.assert_allclose(around[0, :, 0], [0.25, 0.25, 0.75, 0.75])


def test_glass_that_absorbs_has_a_medium_inside() -> None:
    """exp(−sigma·distance) is the attenuation color."""
    told = mitsuba_scene(ball(Dielectric(attenuation_color=(0.25, 0.5, 1), attenuation_distance=2)))
    assert told["integrator"]["type"] == "volpath"
    inside = told["sphere0"]["interior"]
    sigma = inside["scale"] * np.array(inside["sigma_t"]["value"])
    np.testing.assert_allclose(np.exp(-2 * sigma), [0.25, 0.5, 1], rtol=1e-6)
    assert inside["albedo"] == 0 and max(inside["sigma_t"]["value"]) <= 1


def test_spots_throw_their_falloff() -> None:
    """At the angle whose cosine is halfway between those of the cones, f is ½ and the intensity f²."""
    light = SpotLight(position=(0, 3, 0), direction=(0, -2, 0), intensity=(1, 2, 3), inner_degrees=20, outer_degrees=60)
    told = mitsuba_scene(Scene(lights=[light]))["light0"]
    np.testing.assert_allclose(told["to_world"][:3, [2, 3]], [[0, 0], [-1, 3], [0, 0]], atol=1e-12)
    assert (told["cutoff_angle"], told["beam_width"]) == (60, 60)
    half = (np.cos(np.radians(20)) + 0.5) / 2
    across = np.tan(np.arccos(half)) / np.tan(np.radians(60))  # in half widths of the texture
    row = told["texture"]["bitmap"][len(told["texture"]["bitmap"]) // 2, :, 0]
    middles = (np.arange(len(row)) + 0.5) / len(row) * 2 - 1
    assert np.interp(across, middles, row) == pytest.approx(0.25, abs=1e-3)
    assert np.interp(0.1, middles, row) == 1 and row[0] < 1e-6


def test_filters_reach_beyond_the_picture() -> None:
    for name, border in (("box", False), ("tent", True), ("gaussian", True)):
        film = mitsuba_scene(Scene(render=RenderSettings(filter=name)))["sensor"]["film"]  # type: ignore[arg-type]
        assert (film["rfilter"], film["sample_border"]) == ({"type": name}, border)
    with pytest.raises(UsageError, match="room: .*box, tent or gaussian"):
        mitsuba_scene(Scene(render=RenderSettings(filter="blackman_harris"), name="room"))


def test_principled_has_a_back_side_where_it_transmits() -> None:
    plain = Principled(color=(0.1, 0.2, 0.3), metallic=0.4, ior=1.3, sheen=0.5)
    plugin = bsdf(plain)
    assert (plugin["type"], plugin["base_color"]["value"]) == ("principled", [0.1, 0.2, 0.3])
    assert (plugin["metallic"], plugin["eta"], plugin["sheen"], plugin["clearcoat"]) == (0.4, 1.3, 0.5, 0)
    assert "spec_trans" not in plugin
    glass = mitsuba_scene(ball(replace(plain, spec_trans=0.5)))["sphere0"]["bsdf"]
    assert glass == plugin | {"spec_trans": 0.5}, "not two-sided"
    with pytest.raises(UsageError, match="the ball: .*anisotropic"):
        mitsuba_scene(ball(replace(plain, anisotropic=0.5)))


def test_every_material_is_converted_or_refused() -> None:
    for kind in set(MATERIALS) - set(BSDFS):
        with pytest.raises(UsageError, match=f"the ball: .*{kind.kernel}"):
            mitsuba_scene(ball(kind()))
    assert {Diffuse, Mirror} <= set(BSDFS)


def test_lights_keep_their_units() -> None:
    lamp = Diffuse(color=(0, 0, 0), emission=(17, 12, 4))
    scene = Scene(
        meshes=[Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), lamp)],
        spheres=[Sphere()],
        lights=[
            PointLight(position=(1, 2, 3), intensity=(4, 5, 6)),
            DirectionalLight(direction=(0, -1, 0), irradiance=(3, 2, 1)),
        ],
    )
    told = mitsuba_scene(scene)
    assert told["mesh0"]["emitter"] == {"type": "area", "radiance": {"type": "rgb", "value": [17, 12, 4]}}
    assert told["mesh0"]["vertices"] is scene.meshes[0].vertices and told["mesh0"]["normals"] is None
    assert "emitter" not in told["sphere0"]
    assert told["light0"] == {"type": "point", "position": [1, 2, 3], "intensity": {"type": "rgb", "value": [4, 5, 6]}}
    assert told["light1"] == {
        "type": "directional",
        "direction": [0, -1, 0],
        "irradiance": {"type": "rgb", "value": [3, 2, 1]},
    }
    assert "sky" not in told, "a black sky would be sampled as often as the others"


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (-3.0, 1.0, 2.0)])
def test_suns_are_far_discs(direction: tuple[float, float, float]) -> None:
    """The disc faces the camera's target, with the light's angular diameter and the radiance of that cone."""
    sun = DirectionalLight(direction=direction, irradiance=(3, 2, 1), angle_degrees=0.53)
    told = mitsuba_scene(Scene(lights=[sun], camera=Camera(position=(1, 2, 8), look_at=(1, 2, 3))))["light0"]
    place, half = told["to_world"], np.radians(0.53) / 2
    middle = place[:3, 3] - (1, 2, 3)
    np.testing.assert_allclose(middle / np.linalg.norm(middle), -np.array(direction) / np.linalg.norm(direction))
    np.testing.assert_allclose(np.linalg.norm(place[:3, :2], axis=0) / np.linalg.norm(middle), np.tan(half))
    np.testing.assert_allclose(place[:3, 2], np.array(direction) / np.linalg.norm(direction), atol=1e-12)
    np.testing.assert_allclose(told["emitter"]["radiance"]["value"], np.array([3, 2, 1]) / (np.pi * np.sin(half) ** 2))
    with pytest.raises(UsageError, match="angle_degrees = 120"):
        mitsuba_scene(Scene(lights=[replace(sun, angle_degrees=120.0)]))


def test_skies_turn_counter_clockwise_seen_from_above() -> None:
    constant = mitsuba_scene(Scene(environment=Environment(color=(1, 2, 3), strength=0.5)))
    assert constant["sky"] == {"type": "constant", "radiance": {"type": "rgb", "value": [0.5, 1, 1.5]}}
    image = RNG.uniform(size=(2, 4, 3)).astype(np.float32)
    sky = mitsuba_scene(Scene(environment=Environment(image=image, strength=2, rotation_degrees=90)))["sky"]
    assert (sky["type"], sky["scale"]) == ("envmap", 2)
    np.testing.assert_allclose(sky["to_world"] @ [0, 0, -1, 0], [-1, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(sky["to_world"] @ [0, 1, 0, 1], [0, 1, 0, 1], atol=1e-12)


@pytest.mark.parametrize("height", [1, 2, 5])
def test_rows_at_poles_are_the_same_sky(height: int) -> None:
    """Both interpolate to the same values: ours at (row + ½)/h, clamped at the ends, Mitsuba's at row/(H − 1)."""
    image = RNG.uniform(size=(height, 3, 3)).astype(np.float32)
    rows = rows_at_poles(image)
    v = np.linspace(0, 1, 1001)

    def interpolated(pixels: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = pixels.reshape(len(pixels), -1).astype(np.float64).T
        return np.array([np.interp(v, at, column) for column in columns])

    ours = interpolated(image, (np.arange(height) + 0.5) / height)
    np.testing.assert_allclose(interpolated(rows, np.arange(len(rows)) / (len(rows) - 1)), ours, atol=1e-6)


def test_newest_llvm_is_found_among_others(tmp_path: Path) -> None:
    assert newest_llvm(tmp_path) == (0, None)
    folder = tmp_path / "usr/lib/x86_64-linux-gnu"
    folder.mkdir(parents=True)
    for name in ("libLLVM-14.0.6.so.1", "libLLVM-9.so", "libLLVM.so.19.1", "libLLVM-15.so", "libLLVMSPIRVLib.so.21"):
        (folder / name).touch()
    assert newest_llvm(tmp_path) == (19, folder / "libLLVM.so.19.1")
