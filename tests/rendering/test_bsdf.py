"""Every registered material: samples match the pdf and value, f is reciprocal, and no energy is gained."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.numerics.bsdf_cases import Bsdfs, bsdfs
from clrt.bench.numerics.jacobians import check_density
from clrt.bench.numerics.samplers import AREA, scattering_rows
from clrt.bench.numerics.scattering import FITTED, ROUNDING, Scattered, above, cases, reciprocity, scatter
from clrt.bench.significance import rejected
from clrt.device.open import Device
from clrt.scene.materials.material_types import MATERIALS, Diffuse, Material, MetallicRoughness

from ..oracle.draws import DRAWERS, Draws, random_material
from ..oracle.scenes import todays_seed
from .ggx import cook_torrance

pytestmark = pytest.mark.statistics

SAMPLES = 1 << 15
#: Features of materials with another formula.
OTHERWISE = {"MULTIPLE_SCATTERING", "LAYERS", "SPECULAR", "ANISOTROPY", "IRIDESCENCE"}
#: Kernel text and replacements that make it slightly wrong: densities, sampled directions, and a value.
WRONG = {
    "density of the microfacets": (
        "facets / (1.0f + ggx_lambda(STRETCHED(m, wo), m->alpha))",
        "facets / (1.05f + ggx_lambda(STRETCHED(m, wo), m->alpha))",
    ),
    "density of the cosine": ("shares.diffuse * cosine_pdf(wi.z)", "shares.diffuse * (0.5f / PI)"),
    "density of further bounces": (
        "cos_theta * cos_theta + WIDEST_ALPHA",
        "cos_theta * cos_theta + 1.5f * WIDEST_ALPHA",
    ),
    "shares of the lobes": ("choose(lobe < share.specular,", "choose(lobe < 0.9f * share.specular,"),
    "visible normals": ("1.0f - u.y * (1.0f + stretched.z)", "1.0f - u.y * (1.0f + 0.9f * stretched.z)"),
}


@pytest.fixture(scope="module")
def every(device: Device) -> Bsdfs:
    return bsdfs(device, list(dict.fromkeys(material for material, _ in cases())))


def taken() -> list[tuple[Material, float]]:
    """Return every material at every angle, but transmissive ones, which take ten times as long, at every third angle
    (every second of two), with an offset that changes per material. The study covers all of them."""
    through: dict[Material, list[float]] = {}
    for material, cosine in cases():
        if "TRANSMISSION" in material.features():
            through.setdefault(material, []).append(cosine)
    kept = {material: cosines[i % min(3, len(cosines)) :: 3] for i, (material, cosines) in enumerate(through.items())}
    return [(material, cosine) for material, cosine in cases() if cosine in kept.get(material, [cosine])]


@pytest.fixture(scope="module")
def found(every: Bsdfs) -> list[Scattered]:
    return [
        scatter(every, every.materials.index(material), cosine, SAMPLES, seed)
        for seed, (material, cosine) in enumerate(taken())
    ]


def test_samples_follow_the_density(found: list[Scattered]) -> None:
    """Chi-square over cells of the sphere, with one cell for failed samples: what the pdf's integral leaves out."""
    assert not rejected({case.name: case.density for case in found if not case.specular})


def test_no_light_is_made(found: list[Scattered]) -> None:
    """In a white furnace nothing is brighter than 1: one-sided test of the mean weight."""
    assert not rejected({case.name: case.energy for case in found})


def test_rows_of_the_study(found: list[Scattered]) -> None:
    """The study's rows: the tests above, densities that integrate to at most 1, weights equal to value over density,
    unit vectors, and failures exactly below the horizon."""
    rows = list(scattering_rows(found, SAMPLES))
    assert len(rows) == 5 and not [row for row in rows if row.wrong]


def test_specular_is_a_single_direction_on_each_side(found: list[Scattered]) -> None:
    """Only specular materials report specular samples; the others have a density, on which eval and pdf agree."""
    assert [case.specular for case in found] == [material.is_specular for material, _ in taken()]


def test_densities_are_one_over_the_area_of_the_map(every: Bsdfs) -> None:
    """The density is 1 over the Jacobian determinant, known for most samples of every material at most angles; all
    single-lobe materials are included.
    """
    some = [(material, cosine) for material, cosine in cases() if not material.is_specular]
    checked = {
        f"{cosine:.2g} {material}": check_density(every, every.materials.index(material), cosine)
        for material, cosine in some
    }
    assert not {name: check for name, check in checked.items() if not check.error <= AREA}
    assert sum(check.known for check in checked.values()) > 200 * len(checked)
    assert sum(check.lobes == 1 and check.known > 100 for check in checked.values()) > 20


def test_reciprocity(every: Bsdfs) -> None:
    """f(wo, wi) = f(wi, wo); eval gives f·cos wi."""
    for which, material in enumerate(every.materials):
        assert reciprocity(every, which, 4000, which).max() < 5 * ROUNDING, material


def test_below_the_horizon_nothing_is_reflected(every: Bsdfs) -> None:
    """Only transmissive materials scatter below the horizon, and nothing is seen from below without being flipped."""
    wo, wi = above(1000, 3), above(1000, 4) * [1, 1, -1]
    for which, material in enumerate(every.materials):
        assert not every.value(which, wi, wo)[0].any(), material
        if "TRANSMISSION_LOBES" in material.features():
            continue
        for a, b in ((wo, wi), (wi, wi)):
            assert not every.value(which, a, b)[0].any(), material
        assert not every.value(which, wo, wi)[1].any(), material


@pytest.mark.parametrize("end", ["wi", "wo"])
def test_values_at_grazing_angles(every: Bsdfs, end: str) -> None:
    """They and the densities stay finite, down to cosines that are only the rounding of a dot product."""
    cosines = 10.0 ** -np.arange(1, 31)
    grazing = np.column_stack([np.sqrt(1 - cosines**2), np.zeros_like(cosines), cosines])
    steep = np.broadcast_to([-0.48, 0.36, 0.8], grazing.shape)
    wo, wi = (steep, grazing) if end == "wi" else (grazing, steep)
    for which, material in enumerate(every.materials):
        value, pdf = every.value(which, wo, wi)
        assert np.isfinite(value).all() and np.isfinite(pdf).all(), material


def test_the_others_of_a_scene_change_nothing(device: Device) -> None:
    """Values of a few materials are the same as in a program compiled for many."""
    seed, (wo, wi) = todays_seed(), (above(300, 7), above(300, 8))
    print(f"seed {seed}")
    kinds: list[type[Material]] = [MetallicRoughness, MetallicRoughness, *DRAWERS]
    many = bsdfs(device, [random_material(Draws(seed, number, 0), kinds[number % len(kinds)]) for number in range(72)])
    alike = [i for i, material in enumerate(many.materials) if type(material) is MetallicRoughness]
    rng = np.random.default_rng(seed)
    for number in range(8):
        chosen = rng.choice(alike if number % 2 else len(many.materials), 5, replace=False)
        few = bsdfs(device, [many.materials[i] for i in chosen])
        for which, among_many in enumerate(chosen):
            for one, other in zip(few.value(which, wo, wi), many.value(among_many, wo, wi)):
                np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-6, err_msg=str(few.materials))


def test_cook_torrance(every: Bsdfs) -> None:
    """eval against the published formula in float64, in all its forms."""
    wo, wi = above(20_000, 5), above(20_000, 6)
    for which, material in enumerate(every.materials):
        if not isinstance(material, MetallicRoughness) or material.features() & OTHERWISE:
            continue
        if material.lobes.alpha > 0.05**2:
            expected = cook_torrance(material, wo, wi) * wi[:, 2:]
            # A float32 half vector changes D by some roundings over alpha², and by more where wi is close to −wo.
            roundings = 3e-6 / material.lobes.alpha / np.linalg.norm(wo + wi, axis=1, keepdims=True)
            off = np.abs(every.value(which, wo, wi)[0] - expected)
            # (1 − E(wi))(1 − E(wo))/(1 − mean E): the error of each factor
            fitted = 3 * FITTED * wi[:, 2:] / np.pi if material.coupled_by == "albedo" else 0
            assert np.all(off <= roundings * expected + fitted + 2 * 2**-24 / np.pi), material


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_by_little_is_rejected(device: Device, what: str) -> None:
    """The tests above can fail: each of these errors of a few per cent is detected for at least one material."""
    materials: list[Material] = [
        MetallicRoughness(roughness=0.9, metallic=metallic, color=(1.0, 0.5, 0.2), multiple_scattering=True)
        for metallic in (0.0, 1.0)
    ]
    wrong = bsdfs(device, materials, dict([WRONG[what]]))
    found = [scatter(wrong, i, cosine, 4 * SAMPLES, 1) for i in (0, 1) for cosine in (0.6, 0.1)]
    assert rejected({case.name: case.density for case in found}, 1e-9)


def test_a_wrong_area_is_rejected(device: Device) -> None:
    """A density of one lobe that is wrong by 5%."""
    wrong = bsdfs(device, [MetallicRoughness(roughness=0.3, metallic=1.0)], dict([WRONG["density of the microfacets"]]))
    assert check_density(wrong, 0, 0.6).error > 0.04 > AREA


def test_too_much_light_is_rejected(device: Device) -> None:
    """Lambert below a gloss weighted by 1 − F at wi·h, as published and as in glTF, gains energy at grazing wo."""
    wrong = bsdfs(device, [MetallicRoughness(color=(1.0, 1.0, 1.0), roughness=0.1, coupling="half_vector")])
    assert rejected({"": scatter(wrong, 0, 0.1, SAMPLES, 1).energy}, 1e-9)


def test_one_way_light_is_rejected(device: Device) -> None:
    text = "mul(transmitted(m, wi.z), transmitted(m, wo.z))"
    wrong = bsdfs(device, [MetallicRoughness(roughness=0.5, coupling="fresnel")], {text: text.replace("wo", "wi")})
    assert reciprocity(wrong, 0, 1000, 1).max() > 0.01


def test_registry_is_covered() -> None:
    """The cases contain each material with both ends of its ranges, each flag and option; and
    each angle, also transmitted.
    """
    materials = [material for material, _ in taken()]
    assert set(materials) == {material for material, _ in cases()}
    angles = [
        {cosine for material, cosine in some if "TRANSMISSION" in material.features()} for some in (taken(), cases())
    ]
    assert angles[0] == angles[1]
    assert {type(material) for material in materials} == set(MATERIALS)
    metals = [material for material in materials if isinstance(material, MetallicRoughness)]
    flags = {(metal.metallic, metal.multiple_scattering) for metal in metals}
    assert flags >= {(0, False), (0, True), (1, False), (1, True)}
    assert len({metal.smith for metal in metals}) == 4 and len({metal.preset for metal in metals}) == 13
    assert Diffuse(color=(1.0, 0.5, 0.2)) in materials
    layers = {"CLEARCOAT", "SHEEN", "THROUGH", "SPECULAR"}
    assert layers <= {feature for metal in metals for feature in metal.features()}
