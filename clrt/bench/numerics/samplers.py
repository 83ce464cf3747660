"""Hard cases of sampling: furnace tests, samplers against their pdfs, film accumulation, random numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...device.open import Device
from ...rendering.film.film import Film
from ...rendering.renderer import Renderer
from ...scene.materials.material_types import Diffuse, Material
from ...scene.model import Camera, RenderSettings, Scene, Sphere
from ..kernel_probe import Probe
from ..significance import family_row
from .bsdf_cases import Bsdfs, bsdfs
from .film_sums import accumulate, stream_errors
from .furnace import GLASSES, LAYERS, SMITHS, inexact, measure_glass, measure_layers, measure_metals, measure_plastics
from .jacobians import check_density
from .light_sampling import light_tests
from .random_numbers import draw_on, independence, repetitions, uniformity
from .row import Row
from .scattering import QUADRATURE, ROUNDING, Scattered, cases, reciprocity, scatter
from .warps import warp_density_errors, warp_p_values, warp_probe

#: Tolerance of furnace tests, against the single-bounce albedo, or 1 with multiple scattering.
FURNACE = 1e-3
#: Tolerances of furnace tests of rough glass and of layers, against 1.
GLASS_FURNACE, LAYER_FURNACE = 2e-3, 2.5e-3
#: Tolerances of a pdf against 1/area and against its closed form, and of the film's mean against the true one.
AREA, DENSITY, MEAN = 2e-3, 1e-5, 1e-6
LAMP_SAMPLES = 64


class Effort(NamedTuple):
    """Samples per case of each kind, and the subset of cases: every `step`-th material, the first `smiths` Smith terms;
    repetitions are searched among side² pixels and samples.
    """

    scattered: int
    step: int
    furnace: int
    smiths: int
    warped: int
    added: int
    drawn: int
    side: int


FULL = Effort(
    scattered=1 << 18, step=1, furnace=1 << 16, smiths=4, warped=1 << 20, added=(1 << 25) + 8, drawn=1 << 18, side=1024
)
QUICK = Effort(
    scattered=1 << 14, step=7, furnace=1 << 14, smiths=1, warped=1 << 16, added=(1 << 22) + 8, drawn=1 << 14, side=128
)


def measure_samplers(device: Device, *, quick: bool) -> Iterator[Row]:
    """Yield the rows of cases L1, L2, L6, L7 and L8 on one device."""
    effort = QUICK if quick else FULL
    yield from _furnaces(device, effort)
    yield from _materials(device, effort)
    yield from _warps_and_lights(device, effort)
    probe = Probe(device, Scene(render=RenderSettings(sampler="independent")))
    yield from _sums(probe, effort)
    yield from _dropped(device, probe)
    yield from _random_numbers(probe, effort)


def _furnaces(device: Device, effort: Effort) -> Iterator[Row]:
    wrong, count = inexact(device, effort.furnace)
    yield Row("L1", "diffuse and mirror weights equal their color exactly", count, wrong)
    metals = list(measure_metals(device, effort.furnace, SMITHS[: effort.smiths]))
    single, full = ([m for m in metals if m.material.multiple_scattering == multiple] for multiple in (False, True))
    for what, found in (
        ("white metal reflects the albedo of one bounce", single),
        ("white metal with multiple scattering reflects all", full),
        ("white under a glossy coat reflects all", list(measure_plastics(device, effort.furnace))),
    ):
        errors = [abs(each.found - each.exact) for each in found]
        yield Row("L1", what, len(errors), sum(not error <= FURNACE for error in errors), max(errors), "largest error")
    for name in LAYERS:
        errors = [abs(each.found - 1) for each in measure_layers(device, effort.furnace, name, min(effort.step, 4))]
        wrong = sum(not error <= LAYER_FURNACE for error in errors)
        yield Row("L1", f"white with {name} keeps all light", len(errors), wrong, max(errors), "largest error")
    glasses = list(measure_glass(device, 4 * effort.furnace, GLASSES[:: effort.step]))
    errors = [abs(kept.found - 1) for kept in glasses]
    wrong = sum(not error <= GLASS_FURNACE for error in errors)
    yield Row("L1", "white rough glass keeps all light", len(errors), wrong, max(errors), "largest error")


def _materials(device: Device, effort: Effort) -> Iterator[Row]:
    chosen = cases()[:: effort.step]
    materials = list(dict.fromkeys(material for material, _ in chosen))
    subject = bsdfs(device, materials)
    found = [
        scatter(subject, materials.index(material), cosine, effort.scattered, seed)
        for seed, (material, cosine) in enumerate(chosen)
    ]
    yield from scattering_rows(found, effort.scattered)
    pairs = np.concatenate([reciprocity(subject, which, 1 << 12, which) for which in range(len(materials))])
    yield Row(
        "L2",
        "f(wo, wi) = f(wi, wo)",
        len(pairs),
        int(np.sum(~(pairs <= 5 * ROUNDING))),
        float(pairs.max()),
        "largest relative difference",
    )
    yield _areas(subject, chosen, found)


def scattering_rows(found: list[Scattered], samples: int) -> Iterator[Row]:
    """Yield rows for the results of `scatter` for all cases, each with `samples` samples."""
    count = len(found) * samples
    yield family_row("L2", "BSDF samples follow their pdf", {s.name: s.density for s in found if not s.specular})
    yield family_row("L2", "materials reflect no more light than they receive", {s.name: s.energy for s in found})
    integral = max(s.integral for s in found) - 1
    yield Row(
        "L2",
        "BSDF pdfs integrate to at most 1",
        len(found),
        sum(not s.integral <= 1 + QUADRATURE for s in found),
        integral,
        "largest excess",
    )
    weight = float(max(s.weight for s in found))
    yield Row(
        "L2",
        "BSDF weights are value over pdf",
        len(found),
        sum(not s.weight <= ROUNDING for s in found),
        weight,
        "largest relative error",
    )
    yield Row("L2", "BSDF directions have length 1, fail only on the wrong side", count, sum(s.wrong for s in found))


def _areas(subject: Bsdfs, chosen: list[tuple[Material, float]], found: list[Scattered]) -> Row:
    checked = [
        check_density(subject, subject.materials.index(material), cosine)
        for (material, cosine), scattered in zip(chosen, found)
        if not scattered.specular
    ]
    errors = [c.error for c in checked]
    return Row(
        "L2",
        "pdfs equal 1 over the mapped area",
        sum(c.known for c in checked),
        sum(not error <= AREA for error in errors),
        max(errors),
        "largest relative error",
    )


def _warps_and_lights(device: Device, effort: Effort) -> Iterator[Row]:
    warps = warp_probe(device)
    yield family_row("L2", "warps follow their pdf", warp_p_values(warps, effort.warped, 1))
    missed = warp_density_errors(warps)
    yield Row(
        "L2",
        "pdfs of warps equal 1 over the mapped area",
        len(missed),
        sum(not error <= AREA for error in missed.values()),
        max(missed.values()),
        "largest relative error",
    )
    lights = light_tests(device, effort.warped, 1)
    yield family_row("L2", "light and sky samples follow their pdf", {test.name: test.density for test in lights})
    yield Row(
        "L2",
        "light pdfs match their closed forms",
        len(lights),
        sum(not test.error <= DENSITY for test in lights),
        max(test.error for test in lights),
        "largest relative error",
    )


def _sums(probe: Probe, effort: Effort) -> Iterator[Row]:
    for before in (0, 1 << 27):
        streams = list(stream_errors(probe, effort.added, before))
        yield Row(
            "L6",
            f"means of {effort.added} samples after {before}",
            len(streams),
            sum(not (error <= MEAN and miscounted == 0) for _, error, miscounted in streams),
            max(error for _, error, _ in streams),
            "largest relative error",
        )


def _dropped(device: Device, probe: Probe) -> Iterator[Row]:
    bad, one = np.array([[np.nan, 1, 1], [1, np.inf, 1], [1, 1, -np.inf], [3e38, 1, 1]]), np.ones((4, 3))
    film = accumulate(probe, one, bad, 3, 3000).film
    yield Row(
        "L7",
        "NaN samples are dropped and counted",
        4 * 1000,
        abs(film.nonfinite_samples - 4 * 1000) + int(np.sum(film.mean != 1)),
    )
    hits, lost = _lamp(device, 1.0), _lamp(device, 3e38)
    count = round(float(hits.mean[..., 0].sum() * LAMP_SAMPLES))
    yield Row(
        "L7",
        "samples of a light that overflows float32 are dropped and counted",
        count,
        abs(lost.nonfinite_samples - count) + int(np.sum(lost.mean != 0)),
    )


def _lamp(device: Device, radiance: float) -> Film:
    """Return the film of an emissive sphere on black, which covers a part of the image."""
    scene = Scene(
        spheres=[Sphere(material=Diffuse(emission=(radiance, radiance, radiance)))],
        camera=Camera(position=(0.0, 0.0, 5.0)),
        render=RenderSettings(size=(32, 32), max_depth=1),
    )
    *_, last = Renderer(scene, device=device.info.index).passes(spp=LAMP_SAMPLES)
    return last.film


def _random_numbers(probe: Probe, effort: Effort) -> Iterator[Row]:
    draw = draw_on(probe)
    yield family_row("L8", "random numbers, and each of their bits, are uniform", uniformity(draw, effort.drawn))
    yield family_row("L8", "random numbers are independent of their neighbours", independence(draw, effort.drawn))
    yield Row("L8", "pairs of random numbers repeat", 4 * effort.side**2, repetitions(draw, effort.side))
