"""Shading normals that differ from the geometric ones: gloss is folded at the horizon, diffuse light fades there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles, Probe
from clrt.bench.numerics.bsdf_cases import uniform
from clrt.bench.numerics.scattering import FITTED
from clrt.bench.rays.hard_meshes import icosphere
from clrt.bench.significance import chi2_test, mean_test, rejected
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import Conductor, Dielectric, Diffuse, MetallicRoughness, Mirror, Phong
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .ggx import bump_shadowing
from .pictures import film, quad

pytestmark = pytest.mark.statistics

WHITE, COLOR = (1.0, 1.0, 1.0), (0.9, 0.5, 0.2)
GLOSSY: list[Material] = [
    MetallicRoughness(color=COLOR, metallic=1.0, roughness=0.4),
    MetallicRoughness(color=COLOR, metallic=1.0, roughness=0.8, multiple_scattering=True),
    MetallicRoughness(color=COLOR, metallic=0.0, roughness=0.5, transmission=1.0),
    MetallicRoughness(
        color=COLOR,
        metallic=1.0,
        roughness=0.7,
        clearcoat=0.5,
        clearcoat_roughness=0.4,
        sheen_color=(0.2, 0.3, 0.4),
        sheen_roughness=0.7,
    ),
    Conductor(roughness=0.5),
    Dielectric(color=COLOR, roughness=0.5),
    Dielectric(roughness=0.5, ior=1 / 1.5),
    Dielectric(color=COLOR, roughness=0.6, thin=True),
]
MATTE: list[Material] = [
    Diffuse(color=COLOR),
    Phong(color=(0.5, 0.4, 0.3), specular=(0.3, 0.4, 0.5), shininess=9.0),
    MetallicRoughness(color=COLOR, metallic=0.5, roughness=0.5),
]
SPECULAR: list[Material] = [Mirror(color=COLOR), Dielectric(color=COLOR)]
#: Cells of the sphere by z and azimuth, and points per cell in each dimension.
CELLS, POINTS = 12, 60


@dataclass
class Tilted:
    """Materials on surfaces whose shading normals are not their geometric ones."""

    materials: list[Material]
    probe: Probe
    codes: Doubles

    def sample(self, which: int, frame: Doubles, numbers: Doubles) -> Doubles:
        """Return wi (3), weight (3), pdf, specular, spread as (n, 9); frame (3, 3): ng, ns, wo."""
        return self.probe("shading_sample", 9, *self._fixed(which, frame, len(numbers)), numbers)

    def value(self, which: int, frame: Doubles, wi: Doubles) -> tuple[Doubles, Doubles]:
        """Return f·|cos| (n, 3) and pdf (n,) of wi (n, 3)."""
        out = self.probe("shading_value", 4, *self._fixed(which, frame, len(wi)), wi)
        return out[:, :3], out[:, 3]

    def _fixed(self, which: int, frame: Doubles, n: int) -> list[Doubles]:
        return [np.full(n, self.codes[which]), *(np.broadcast_to(row, (n, 3)) for row in frame)]


@pytest.fixture(scope="module")
def tilted(device: Device) -> Tilted:
    every = [*GLOSSY, *MATTE, *SPECULAR]
    up = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    sheets = [
        replace(quad([(0, 0, i), (1, 0, i), (1, 1, i), (0, 1, i)], each), normals=up) for i, each in enumerate(every)
    ]
    probe = Probe(device, Scene(meshes=sheets))
    return Tilted(every, probe, probe.compiled.buffers["triangles"][1]["material"][::2].astype(np.float64))


def unit(v: Doubles) -> Doubles:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def frames(count: int, seed: int) -> list[Doubles]:
    """Return frames (3, 3): ng, ns up to 75 degrees from it, and wo above both, with components exact in float32."""
    rng = np.random.default_rng(seed)
    found: list[Doubles] = []
    while len(found) < count:
        ng, turn, wo = unit(rng.normal(size=(3, 3)))
        angle = np.radians(75) * rng.random()
        ns = np.cos(angle) * ng + np.sin(angle) * unit(np.cross(ng, turn))
        if min(wo @ ng, wo @ ns) > 0.05:
            found.append(np.array([ng, ns, wo], np.float32).astype(np.float64))
    return found


def local(frame: Doubles, w: Doubles) -> Doubles:
    """Transform w to a frame whose z is ns."""
    ns = unit(frame[1])
    s = unit(np.cross(ns, np.eye(3)[np.argmin(np.abs(ns))]))
    return np.asarray(w @ np.array([s, np.cross(ns, s), ns]).T)


def mirrored(frame: Doubles, w: Doubles) -> Doubles:
    ng = unit(frame[0])
    return np.asarray(w - 2 * (w @ ng)[:, None] * ng)


def matte(material: Material, cosine: Doubles) -> Doubles | float:
    """Return f·cos (n, 3) of the diffuse part."""
    if isinstance(material, Diffuse | Phong):
        return np.outer(np.maximum(cosine, 0), np.array(material.color)) / np.pi
    return 0.0


@pytest.mark.parametrize("which", range(len(GLOSSY) + 2))
def test_gloss_is_mirrored_at_the_surface(tilted: Tilted, which: int) -> None:
    """The value is f(wi) + gloss(mirrored wi), of those on the same side of ns as wi is of ng; so is the density."""
    material = tilted.materials[which]
    for seed, frame in enumerate(frames(6, which)):
        wi = unit(np.random.default_rng(seed).normal(size=(4000, 3))).astype(np.float32).astype(np.float64)
        other, (ng, ns, wo) = mirrored(frame, wi), unit(frame)
        code = np.full(len(wi), tilted.codes[which])
        plain = [
            tilted.probe("bsdf_value", 4, code, np.broadcast_to(local(frame, wo), wi.shape), local(frame, w), front=1)
            for w in (wi, other)
        ]
        ours, folded = ((w @ ns > 0) == (wi @ ng > 0) for w in (wi, other))
        value = np.where(ours[:, None], plain[0][:, :3], 0)
        value += np.where(folded[:, None], plain[1][:, :3] - matte(material, other @ ns), 0)
        pdf = np.where(ours, plain[0][:, 3], 0) + np.where(folded, plain[1][:, 3], 0)
        sharp = np.min(np.abs([wi @ ng, wi @ ns, other @ ns]), axis=0) > 1e-4
        found = tilted.value(which, frame, wi)
        assert (sharp & folded & ours).any()
        np.testing.assert_allclose(found[0][sharp], value[sharp], rtol=5e-3, atol=2e-5)
        np.testing.assert_allclose(found[1][sharp], pdf[sharp], rtol=5e-3, atol=2e-5)


def test_samples_follow_the_density(tilted: Tilted) -> None:
    """Chi-square over cells of the sphere, with one cell for failed samples; weights are value over density, and a
    sample is on the side to which light is reflected or transmitted."""
    count, chi2 = 1 << 15, {}
    fine = (np.arange(CELLS * POINTS) + 0.5) / (CELLS * POINTS)
    z, phi = np.meshgrid(2 * fine - 1, 2 * np.pi * fine, indexing="ij")
    points = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=-1).reshape(-1, 3)
    for which in range(len(GLOSSY) + len(MATTE)):
        for i, frame in enumerate(frames(2, 100 + which)):
            sample = tilted.sample(which, frame, uniform(count, which))
            kept = sample[:, 6] > 0
            wi, density = sample[kept, :3], tilted.value(which, frame, points)[1]
            expected = density.reshape(CELLS, POINTS, CELLS, POINTS).mean(axis=(1, 3)).ravel() * 4 * np.pi / CELLS**2
            rows = np.minimum((wi[:, 2] + 1) / 2 * CELLS, CELLS - 1).astype(int)
            columns = (np.arctan2(wi[:, 1], wi[:, 0]) % (2 * np.pi) / (2 * np.pi) * CELLS).astype(int) % CELLS
            found = np.bincount(rows * CELLS + columns, minlength=CELLS**2)
            shares = np.array([*expected, max(1 - expected.sum(), 0)])
            chi2[f"{i} {tilted.materials[which]}"] = chi2_test([*found, count - kept.sum()], count * shares + 1e-9)
            value, again = tilted.value(which, frame, wi)
            sure = np.abs(again / sample[kept, 6] - 1) < 1e-3  # A few lie on a horizon
            assert sure.mean() > 0.998
            carried = sample[kept, 3:6] * sample[kept, 6:7] * np.where(wi @ frame[0] < 0, sample[kept, 8], 1)[:, None]
            np.testing.assert_allclose(carried[sure], value[sure], rtol=2e-3, atol=1e-5)
    assert not rejected(chi2)


@pytest.mark.parametrize("which", range(len(GLOSSY)))
def test_no_energy_of_gloss_is_lost(tilted: Tilted, which: int) -> None:
    """The mean weight is that of the same samples around the shading normal alone, for any geometric normal."""
    count, numbers = 1 << 15, uniform(1 << 15, which)
    p: dict[str, float] = {}
    for i, frame in enumerate(frames(8, 200 + which)):
        folded = tilted.sample(which, frame, numbers)
        wo = local(frame, unit(frame[2]))
        plain = tilted.probe(
            "bsdf_sample", 9, np.full(count, tilted.codes[which]), np.broadcast_to(wo, (count, 3)), numbers, front=1
        )
        left, right = (each[:, 3:6] * (each[:, 6:7] > 0) for each in (folded, plain))
        difference = (left - right) / right.mean(axis=0)
        assert (np.abs(difference.mean(axis=0)) < 0.05).all()
        tests = mean_test(difference.mean(axis=0), difference.var(axis=0) + count * 1e-10, count, 0.0)
        p |= {f"{i} {channel}": float(each) for channel, each in enumerate(tests)}
    assert not rejected(p)


@pytest.mark.parametrize("which", range(-len(SPECULAR), 0))
def test_mirrored_views_stay_above(tilted: Tilted, which: int) -> None:
    """There is a single direction on each side, with the weight that it has without folding."""
    for frame in frames(20, 300):
        numbers = uniform(1 << 8, 1)
        sample = tilted.sample(which, frame, numbers)
        ng, ns, wo = unit(frame)
        up = sample[:, :3] @ ng > 0
        assert sample[:, 7].all() and (sample[:, 6] > 0).all() and up.any()
        view = 2 * (wo @ ns) * ns - wo
        view -= 2 * min(view @ ng, 0) * ng
        np.testing.assert_allclose(sample[up, :3], np.broadcast_to(view, (up.sum(), 3)), atol=2e-6)
        plain = tilted.probe(
            "bsdf_sample",
            9,
            np.full(len(numbers), tilted.codes[which]),
            np.broadcast_to(local(frame, wo), (len(numbers), 3)),
            numbers,
            front=1,
        )
        same = (plain[:, 2] > 0) == up
        assert same.mean() > 0.98
        np.testing.assert_allclose(sample[same, 3:6], plain[same, 3:6], rtol=1e-4)


def bumps(seed: int) -> Texture:
    """Return a normal map whose texels are random directions of the upper hemisphere."""
    normals = unit(np.random.default_rng(seed).normal(size=(8, 8, 3)))
    normals[..., 2] = np.abs(normals[..., 2])
    texels = np.full((8, 8, 4), 255, np.uint8)
    texels[..., :3] = np.round((normals + 1) / 2 * 255)
    return Texture(picture=Picture(texels))


def furnace(material: Material, seed: int) -> Scene:
    """Return a sheet with a normal map, or a convex mesh with random normals, in a white furnace."""
    if getattr(material, "normal_map", None) is not None:
        mesh = quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], Diffuse())
        mesh = replace(mesh, uv=np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32), material=material)
    else:
        vertices, faces = icosphere(1)
        normals = unit(vertices + 0.5 * np.random.default_rng(seed).normal(size=vertices.shape))
        mesh = Mesh(vertices, faces, material, normals=normals.astype(np.float32))
    camera = Camera(position=(0, -2, 2.5), look_at=(0, 0, 0), up=(0, 0, 1), fov_degrees=50)
    return Scene(
        meshes=[mesh],
        environment=Environment(color=WHITE),
        camera=camera,
        render=RenderSettings(size=(32, 32), spp=64, max_depth=3),
    )


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_white_gloss_in_a_white_furnace_is_white(device: Device, mapped: bool, seed: int) -> None:
    """With random normals a mirror is white exactly; rough metals with multiple scattering are white in the mean,
    within five standard errors and the error of the fits."""
    normal_map = bumps(seed) if mapped else None
    assert np.abs(film(device, furnace(Mirror(color=WHITE, normal_map=normal_map), seed)).mean - 1).max() < 1e-5
    for roughness in (0.2, 0.6, 1.0):
        metal = MetallicRoughness(
            color=WHITE, metallic=1.0, roughness=roughness, multiple_scattering=True, normal_map=normal_map
        )
        found = film(device, furnace(metal, seed))
        count = found.pixels["count"].astype(np.float64)
        squares = (found.pixels["square"].astype(np.float64) + found.pixels["square_error"])[..., 0] / count
        error = np.sqrt(np.sum((squares - found.mean[..., 0] ** 2) / count)) / count.size
        assert error < 2e-3
        assert found.mean.mean() == pytest.approx(1, abs=5 * error + FITTED)


@pytest.mark.parametrize(
    "material",
    [
        MetallicRoughness(color=COLOR, metallic=1.0, roughness=0.5),
        MetallicRoughness(color=COLOR, roughness=0.4),
        Diffuse(color=COLOR),
        Phong(color=COLOR, specular=(0.1, 0.2, 0.3), shininess=20.0),
    ],
    ids=["metal", "plastic", "diffuse", "phong"],
)
def test_light_samples_and_bsdf_samples_agree(device: Device, material: Material) -> None:
    """For an emitter at the horizon of a bumpy sheet: light samples alone and MIS agree in each integrator."""
    sheet = furnace(replace(material, normal_map=bumps(5)), 5).meshes[0]
    lamp = Sphere(center=(2.5, 0.5, 0.7), radius=0.8, material=Diffuse(color=(0.0,) * 3, emission=(1.0, 2.0, 3.0)))
    scene = Scene(meshes=[sheet], spheres=[lamp], camera=Camera(position=(0, -2, 2.5), up=(0, 0, 1), fov_degrees=40))
    means = {}
    integrators: tuple[Integrator, ...] = ("path", "direct", "local", "raster")
    for integrator in integrators[:2] if isinstance(material, Phong) else integrators:  # Phong: textbook form there
        settings = RenderSettings(size=(24, 24), spp=512, max_depth=2, integrator=integrator)
        means[integrator] = film(device, replace(scene, render=settings)).mean.mean(axis=(0, 1))
    assert min(means["path"]) > 0.005
    for mean in means.values():
        np.testing.assert_allclose(mean, means["path"], rtol=0.01)


@pytest.mark.parametrize(
    "material",
    [
        Diffuse(color=COLOR),
        MetallicRoughness(color=COLOR, specular=0.0),
        MetallicRoughness(color=COLOR, specular=0.0, clearcoat=1e-6),
    ],
    ids=["diffuse", "matte", "coated"],
)
def test_matte_bumps_shadow_themselves(device: Device, material: Material) -> None:
    """Diffuse light is Lambert's law for a bent normal times a shadowing factor that fades at the horizon."""
    rng, up = np.random.default_rng(7), np.array([0.0, 0.0, 1.0])
    for bend in rng.random(8) * 60:
        turn, wi = rng.random() * 2 * np.pi, unit(rng.normal(size=3) * [1, 1, 0.3])
        bent = np.array([np.cos(turn), np.sin(turn), 0]) * np.sin(np.radians(bend)) + up * np.cos(np.radians(bend))
        texel = np.round((bent + 1) / 2 * 255)
        bump = Texture(picture=Picture(np.array([[[*texel, 255]]], np.uint8)))
        ns, wi[2] = unit(texel / 255 * 2 - 1), abs(wi[2])
        sun = DirectionalLight(direction=tuple(-wi), irradiance=(np.pi,) * 3)
        scene = replace(
            furnace(replace(material, normal_map=bump), 0),
            lights=[sun],
            environment=Environment(color=(0.0,) * 3),
            camera=Camera(position=(0, 0, 5), up=(0, 1, 0), fov_degrees=20),
            render=RenderSettings(size=(4, 4), spp=4, integrator="direct"),
        )
        expected = max(float(ns @ wi), 0) * bump_shadowing(up, ns, wi) * np.array(COLOR)
        np.testing.assert_allclose(film(device, scene).mean, np.broadcast_to(expected, (4, 4, 3)), rtol=1e-4, atol=1e-6)


def test_only_shading_normals_compile_the_horizon(device: Device) -> None:
    def features(mesh: Mesh) -> set[str]:
        return {"HORIZON"} & set(compile_scene(Scene(meshes=[mesh]), Choices(device.lanes)).features)

    vertices, faces = icosphere(0)
    assert not features(Mesh(vertices, faces, Diffuse()))
    assert features(Mesh(vertices, faces, Diffuse(), normals=vertices.copy()))
    assert features(furnace(Diffuse(normal_map=bumps(1)), 1).meshes[0])
