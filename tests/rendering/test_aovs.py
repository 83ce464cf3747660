"""AOVs against float64 references and against the image itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.programs.program import files_of
from clrt.errors import CheckpointError, UsageError
from clrt.rendering.accumulation.first_hits import first_hit_program
from clrt.rendering.aovs import AOVS, chosen_aovs
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Dielectric, Diffuse, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

from ..covering import others
from .pictures import frame, quad, view_rays
from .test_variants import everything

Doubles = NDArray[np.float64]
Pictures = dict[str, NDArray[Any]]
RED = (0.7, 0.2, 0.1)
SIZE = (20, 15)
CAMERA = Camera(position=(3.0, 2.0, 4.0), fov_degrees=30)
CENTER, RADIUS = np.array([0.2, -0.1, 0.0]), 0.9


def rendered(scene: Scene, names: str = ",".join(AOVS), spp: int = 4, **options: Any) -> tuple[Doubles, Pictures]:
    """Return the image's pixels, float32, and its AOVs."""
    image = clrt.render(scene, spp=spp, aovs=names, **options)
    return image.pixels, image.aovs  # type: ignore[return-value]


#: What a first hit has.
SEEN = "object,depth,position,albedo,normal,geometric_normal"


def seen(scene: Scene) -> Pictures:
    """Return the AOVs SEEN of the scene with panes beside the image, so that all scenes use one program."""

    def pane(material: Any) -> Mesh:
        return quad([(50, 0, 0), (50, 1, 0), (50, 1, 1), (50, 0, 1)], material)

    panes = [pane(Mirror()), pane(Diffuse(opacity=0.0)), pane(Diffuse(one_sided=True))]
    panes[0].normals = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (4, 1))
    return rendered(replace(scene, meshes=[*scene.meshes, *panes]), SEEN, integrator="depth")[1]


ORIGIN = np.zeros(3)


def ball_on_floor(at: Doubles = ORIGIN, scale: float = 1.0) -> Scene:
    """Return a red sphere above a white floor of 2 triangles, in a constant environment, translated and scaled."""

    def place(p: Any) -> Any:
        return tuple((scale * np.array(p, np.float64) + at).tolist())

    floor = quad([place(p) for p in [(-2, -1, 2), (2, -1, 2), (2, -1, -2), (-2, -1, -2)]], Diffuse(color=(1, 1, 1)))
    camera = replace(CAMERA, position=place(CAMERA.position), look_at=place(CAMERA.look_at))
    return Scene(
        meshes=[floor],
        spheres=[Sphere(center=place(CENTER), radius=scale * RADIUS, material=Diffuse(color=RED))],
        camera=camera,
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=SIZE),
    )


def middles(size: tuple[int, int] = SIZE) -> tuple[Doubles, Doubles]:
    """Return unit directions (h, w, 3) of the rays through pixel centres, and their distances to the sphere, or inf."""
    w = view_rays(CAMERA, size, *np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    to_center = CENTER - CAMERA.position
    along = w @ to_center
    inside = RADIUS**2 - to_center @ to_center + along**2
    return w, np.where(inside > 0, along - np.sqrt(np.maximum(inside, 0)), np.inf)


@pytest.mark.parametrize(
    "at, scale",
    [((4e3, -3e3, 0), 1.0), ((0, 0, 0), 2.0**-40), *others(((0, 0, 0), 1.0), ((0, 0, 0), 2.0**30))],
    ids=str,
)
def test_places_and_numbers_are_those_of_the_middle_s_ray(at: Any, scale: float) -> None:
    """Depth, position and ids are those of the pixel centre's ray for any filter, scene position and scale."""
    _, found = rendered(
        ball_on_floor(np.array(at), scale),
        "depth,position,primitive,object,material",
        filter="blackman_harris",
        integrator="normals",
    )
    w, ball = middles()
    floor = (-1 - CAMERA.position[1]) / w[..., 1]
    met = CAMERA.position + floor[..., None] * w
    on_floor = (floor > 0) & (np.abs(met[..., [0, 2]]).max(axis=2) < 2) & ~(ball < np.inf)
    t = np.where(on_floor, floor, ball)
    missed = np.isinf(t)
    assert missed.any() and on_floor.any() and (ball < np.inf).sum() > 20
    depth = scale * t * (w @ frame(CAMERA)[0])
    np.testing.assert_allclose(found["depth"], depth, rtol=1e-6)
    position = np.where(
        missed[..., None], 0, scale * (CAMERA.position + np.where(missed, 0, t)[..., None] * w) + np.array(at)
    )
    np.testing.assert_allclose(found["position"], position, atol=2e-6 * scale + 1e-7 * np.abs(at).max())
    expected = np.where(missed, -1, np.where(on_floor, 0, 1))
    assert np.array_equal(found["object"], expected) and np.array_equal(found["material"], expected)
    half = met[..., 0] > -met[..., 2]  # floor triangles: corners 0 1 2, then 0 2 3
    assert np.array_equal(found["primitive"], np.where(missed, -1, on_floor & ~half))


@pytest.mark.programs
def test_numbers_count_by_objects_and_by_materials() -> None:
    """Primitive ids count triangles within their mesh, object ids meshes then spheres; equal materials share an id."""

    def wall(x: float, material: Any) -> Mesh:
        return quad([(x - 0.5, -2, 0), (x + 0.5, -2, 0), (x + 0.5, 2, 0), (x - 0.5, 2, 0)], material)

    scene = Scene(
        meshes=[wall(-1, Diffuse(color=RED)), wall(0, Mirror()), wall(1, Diffuse(color=RED))],
        spheres=[
            Sphere(center=(2, 0, 0), radius=0.4, material=Dielectric()),
            Sphere(center=(3, 0, 0), radius=0.4, material=Mirror()),
        ],
        camera=Camera(position=(1, 0, 50), look_at=(1, 0, 0), fov_degrees=1.146),
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=(5, 1)),
    )
    _, found = rendered(scene, "object,material,primitive")
    assert found["object"].tolist() == [[0, 1, 2, 3, 4]]
    assert found["material"].tolist() == [[0, 1, 0, 2, 1]]
    assert set(found["primitive"][0, :3].tolist()) <= {0, 1} and found["primitive"][0, 3:].tolist() == [0, 0]


def test_albedo_and_normals_are_of_the_first_surface() -> None:
    """A mirror has its own albedo, and a sky no normal. Shading normals do not change the geometric normal."""
    wall = quad([(-2, -2, -1), (2, -2, -1), (2, 2, -1), (-2, 2, -1)], Mirror(color=(0.9, 0.8, 0.5)))
    wall.normals = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (4, 1))
    scene = Scene(
        meshes=[wall],
        environment=Environment(color=(2, 2, 2)),
        render=RenderSettings(size=(3, 2)),
        camera=Camera(position=(0, 0, 0.9), look_at=(0, 0, -1), fov_degrees=20),
    )
    found = seen(scene)
    for name, expected in (("albedo", (0.9, 0.8, 0.5)), ("normal", (0.6, 0, 0.8)), ("geometric_normal", (0, 0, 1))):
        np.testing.assert_allclose(found[name], np.broadcast_to(expected, (2, 3, 3)), rtol=1e-6, atol=1e-7)
    found = seen(replace(scene, meshes=[]))
    assert not found["albedo"].any() and not found["normal"].any() and not found["position"].any()
    assert np.all(found["object"] == -1) and np.all(found["depth"] == np.inf)


@pytest.mark.programs
def test_textures_and_normal_maps_are_seen() -> None:
    """Albedo is that of the texels; normal maps bend the normal but not the geometric one; materials are left out of
    the program if no AOV needs them.
    """

    def plain(*rgb: int) -> Texture:
        return Texture(picture=Picture(np.full((2, 2, 4), (*rgb, 255), np.uint8)))

    wall = quad([(-2, -2, -1), (2, -2, -1), (2, 2, -1), (-2, 2, -1)], Diffuse())
    wall.uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    wall.material = Diffuse(color=plain(255, 0, 255), normal_map=plain(204, 128, 204))
    scene = Scene(
        meshes=[wall],
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=(3, 2)),
        camera=Camera(position=(0, 0, 0.9), look_at=(0, 0, -1), fov_degrees=20),
    )
    bent = np.array([204, 128, 204]) / 127.5 - 1
    for names in ("albedo,normal,geometric_normal", "normal"):
        _, found = rendered(scene, names, integrator="depth")
        expected: dict[str, Any] = {
            "albedo": (1, 0, 1),
            "normal": bent / np.linalg.norm(bent),
            "geometric_normal": (0, 0, 1),
        }
        for name, aov in found.items():
            np.testing.assert_allclose(aov, np.broadcast_to(expected[name], (2, 3, 3)), atol=1e-6)


def test_what_is_not_there_is_looked_through() -> None:
    """AOVs see through a pane of opacity 0 and a one-sided pane's back, with the depth of the surface behind."""

    def wall(z: float, material: Diffuse) -> Mesh:
        return quad([(-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z)], material)

    back = wall(0.2, Diffuse(one_sided=True))
    back.faces = back.faces[:, ::-1].copy()
    scene = Scene(
        meshes=[wall(0.5, Diffuse(opacity=0.0)), back, wall(-1, Diffuse(color=RED))],
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=(3, 2)),
        camera=Camera(position=(0, 0, 0.9), look_at=(0, 0, -1), fov_degrees=20),
    )
    found = seen(scene)
    assert np.all(found["object"] == 2)
    np.testing.assert_allclose(found["depth"], 1.9, rtol=1e-6)
    np.testing.assert_allclose(found["position"][..., 2], -1, rtol=1e-6)
    np.testing.assert_allclose(found["albedo"], np.broadcast_to(RED, (2, 3, 3)), rtol=1e-6)


def test_albedo_is_a_mean_over_the_pixel() -> None:
    """The pixel mean of the albedo of a wall that covers half of the middle column."""
    half = quad([(-2, -2, -1), (0, -2, -1), (0, 2, -1), (-2, 2, -1)], Diffuse(color=RED))
    scene = Scene(
        meshes=[half],
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=(5, 3)),
        camera=Camera(position=(0, 0, 0.9), look_at=(0, 0, -1), fov_degrees=20),
    )
    found = seen(scene)
    np.testing.assert_allclose(found["albedo"][:, 2], np.tile(np.multiply(RED, 0.5), (3, 1)), rtol=0.13)
    np.testing.assert_allclose(found["albedo"][:, :2], np.broadcast_to(RED, (3, 2, 3)), rtol=1e-6)
    assert not found["albedo"][:, 3:].any()


@pytest.mark.parametrize("spp, rays", [(1, 1), (3, 4), (16, 16), (500, 16), (None, 16)])
def test_means_take_the_rays_of_the_first_samples(spp: int | None, rays: int) -> None:
    """The fraction of a pixel's rays that hit a wall is a multiple of 1 / rays, and not always of 2 / rays."""
    slanted = quad([(-2, -2, -1), (-0.3, -2, -1), (0.3, 2, -1), (-2, 2, -1)], Diffuse())
    scene = Scene(
        meshes=[slanted],
        environment=Environment(color=(1, 1, 1)),
        render=RenderSettings(size=(33, 32), filter="box"),
        camera=Camera(position=(0, 0, 0.9), look_at=(0, 0, -1), fov_degrees=20),
    )
    renderer = Renderer(scene, aovs=["geometric_normal"], spp=spp, integrator="normals")
    hits = np.linalg.norm(np.asarray(renderer.first_hits["geometric_normal"]), axis=-1) * rays
    np.testing.assert_allclose(hits, np.rint(hits), atol=1e-5)
    assert (np.rint(hits) % 2).any() and np.rint(hits.max()) == rays


@pytest.mark.programs
@pytest.mark.parametrize(
    "options", [{}, *others({"adaptive": True}, {"lanes": 1, "filter": "blackman_harris"})], ids=str
)
def test_direct_and_indirect_light_add_up_to_the_picture(options: dict[str, Any]) -> None:
    """Direct and indirect light sum to the image exactly, and the image is the same without these AOVs. Direct light is
    that of paths of depth 2, so it equals the image of max_depth 2 from the same samples."""
    pixels, found = rendered(everything(), "indirect,direct", 32, **options)
    assert list(found) == ["indirect", "direct"]
    assert np.array_equal(found["direct"] + found["indirect"], pixels)
    assert found["direct"].min() >= 0 and found["indirect"].min() >= 0 and found["indirect"].max() > 0.1
    if "adaptive" not in options:
        np.testing.assert_allclose(clrt.render(everything(), spp=32, **options).pixels, pixels, rtol=1e-6, atol=1e-7)
        shallow = clrt.render(everything(), spp=32, max_depth=2, **options).pixels
        np.testing.assert_allclose(found["direct"], shallow, rtol=1e-6, atol=np.spacing(pixels.max()))


@pytest.mark.parametrize(
    "camera",
    [
        {"aperture_radius": 0.3, "focus_distance": 2.0},
        *others({"projection": "orthographic"}, {"projection": "equirectangular"}),
    ],
    ids=str,
)
def test_depth_is_what_the_integrator_of_it_shows(camera: dict[str, Any]) -> None:
    """The depth AOV equals the depth integrator's image for every camera; with a lens it uses
    the ray through its centre.
    """
    scene = ball_on_floor()
    scene.camera = replace(scene.camera, **camera)
    pixels, found = rendered(scene, "depth", 1, integrator="depth")
    shown = pixels[..., 0]
    missed = np.isinf(found["depth"])
    assert 0 < missed.sum() < missed.size and np.array_equal(missed, shown == 0)
    np.testing.assert_allclose(found["depth"][~missed], shown[~missed], rtol=1e-6)


def test_light_needs_an_integrator_of_light() -> None:
    with pytest.raises(UsageError, match="the AOVs direct and indirect store light, and the integrator is normals"):
        clrt.render(everything(), aovs="indirect,direct", integrator="normals")


@pytest.mark.programs
def test_light_of_two_edges_is_all_direct() -> None:
    for options in ({"integrator": "direct"}, {"max_depth": 1}):
        pixels, found = rendered(everything(), "direct,indirect", **options)
        assert np.array_equal(found["direct"], pixels) and not found["indirect"].any()


@pytest.mark.statistics
def test_variance_is_that_of_the_mean() -> None:
    """It matches the variance among renders with other seeds and independent samples (199 degrees of freedom)."""
    scene = ball_on_floor()
    scene.render = replace(scene.render, sampler="independent", size=(8, 6))
    runs = [rendered(scene, "variance,samples", 16, seed=seed) for seed in range(200)]
    measured = np.var([pixels for pixels, _ in runs], axis=0, ddof=1, dtype=np.float64)
    told = np.mean([found["variance"] for _, found in runs], axis=0, dtype=np.float64)
    assert told.mean() == pytest.approx(measured.mean(), rel=0.05)  # 0.1 for each of 48 pixels; channels are alike
    assert all(np.all(found["samples"] == 16) for _, found in runs)
    assert np.all(np.isnan(rendered(scene, "variance", 1)[1]["variance"]))


def test_samples_are_counted_where_they_went() -> None:
    image = clrt.render(everything(), spp=64, adaptive=True, aovs=["samples"])
    counts = image.aovs["samples"]
    assert counts.dtype == np.uint32 and len(np.unique(counts)) > 1
    assert int(counts.sum()) + image.report["nonfinite_samples"] == image.report["samples"]


@pytest.mark.programs
def test_only_what_is_asked_for_is_compiled() -> None:
    """The image's program has no code for AOVs, except for direct or indirect light."""
    plain, light = (compile_scene(everything(), Choices(direct_light=apart)) for apart in (False, True))
    assert set(light.features) - set(plain.features) == {"DIRECT_LIGHT"} and light.files == plain.files
    assert "aov/first_hit.cl" not in plain.files
    programs = {names: files_of(first_hit_program(plain, names)[0]) for names in (("depth",), ("albedo",))}
    assert "aov/first_hit.cl" in programs["depth",] and "bsdf/dispatch.cl" in programs["albedo",]
    assert not any(name.startswith(("bsdf", "light")) for name in programs["depth",])
    for names, apart in (("albedo,depth,variance,samples", False), ("direct", True), ("indirect", True)):
        assert Renderer(everything(), aovs=names).compiled.choices.direct_light == apart


def test_a_checkpoint_keeps_direct_light(tmp_path: Any) -> None:
    """A checkpoint without direct light is rejected as another render's."""
    path, scene = tmp_path / "a.ck", ball_on_floor()
    for _ in Renderer(scene, spp=24, aovs="direct", checkpoint=path).passes(spp=8):
        pass
    resumed = Renderer(scene, spp=24, aovs="direct", checkpoint=path, resume=True)
    *_, state = resumed.passes(spp=24)
    np.testing.assert_array_equal(resumed.aovs(state)["direct"], rendered(scene, "direct", 24)[1]["direct"])
    with pytest.raises(CheckpointError, match="of another render \\(with --aov direct or indirect\\)"):
        Renderer(scene, spp=24, checkpoint=path, resume=True)


def test_names() -> None:
    assert chosen_aovs(" depth,albedo, depth") == chosen_aovs(["depth", "albedo"]) == ("depth", "albedo")
    with pytest.raises(UsageError, match="AOV 'normals' is unknown; choose from albedo, .*; did you mean normal"):
        clrt.render(everything(), aovs=["normals"])
