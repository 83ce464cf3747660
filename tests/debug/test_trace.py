"""The traced paths of a pixel are those of the render: their records add up, vertex by vertex."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.debug import trace
from clrt.debug.record import PathEnd
from clrt.debug.trace import PixelPaths, trace_pixel
from clrt.device.open import Device
from clrt.device.programs import program
from clrt.errors import DeviceError, UsageError
from clrt.formats.load_scene import load
from clrt.rendering.accumulation import checked_loops
from clrt.rendering.compile.choices import Choices, Guiding
from clrt.rendering.guiding import training
from clrt.rendering.guiding.training import Training
from clrt.rendering.renderer import Renderer
from clrt.scene.geometry import instancing
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import RenderSettings, Scene, Sphere

from ..check.sabotage import sabotaged
from ..covering import others
from ..rendering.lamps import lamps
from ..rendering.test_variants import everything, painted, planted, shelf

pytestmark = pytest.mark.programs

SCENES = Path(__file__).parents[2] / "scenes"
SIZE, SPP = (32, 24), 8
Doubles = NDArray[np.float64]


def gallery(name: str) -> Callable[[], Scene]:
    return lambda: load(SCENES / f"{name}.toml")


def biased(scene: Scene) -> Scene:
    """Return the scene with strong clamps and back-face culling for camera rays."""
    settings = replace(scene.render, clamp_direct=0.5, clamp_indirect=0.05, back_face_culling="camera")
    return replace(scene, render=settings)


#: All kinds of lights, materials and primitives; textures, partial opacity, coats and instances; every material in all
#: its variants, media included; many lights, in a light BVH; clamps; and scenes of the gallery.
SUBJECTS: dict[str, Callable[[], Scene]] = {
    "biased": lambda: biased(planted(painted(everything()))),
    "lamps": lambda: replace(lamps(40), spheres=[*lamps(40).spheres, Sphere(radius=0.8)]),
}
PARTS_OF_SUBJECTS: dict[str, Callable[[], Scene]] = {
    "shelf": shelf,
    "everything": everything,
    "painted": lambda: planted(painted(everything())),
    "clamped": lambda: biased(everything()),
    "glass": gallery("glass"),
    "night": gallery("night"),
    "guided": everything,
}


def pixels(seed: int, count: int) -> list[tuple[int, int]]:
    rng = np.random.default_rng(seed)
    return [(int(x), int(y)) for x, y in zip(rng.integers(0, SIZE[0], count), rng.integers(0, SIZE[1], count))]


@pytest.fixture(scope="module", params=[*SUBJECTS, *others(*PARTS_OF_SUBJECTS)])
def traced(request: pytest.FixtureRequest, device: Device) -> tuple[Doubles, list[PixelPaths]]:
    """Return the mean of a render of a subject, and the paths of some of its pixels."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(instancing, "FEW_TRIANGLES", 0)
        patch.setattr(training, "FULL", Training((1, 2), 1024))
        scene = (SUBJECTS | PARTS_OF_SUBJECTS)[request.param]()
        guiding: Guiding = "on" if request.param == "guided" else "off"
        renderer = Renderer(scene, device=device, size=SIZE, spp=SPP, max_depth=7, seed=5, guiding=guiding)
        *_, state = renderer.passes(spp=SPP)
        paths = [trace_pixel(renderer.scene, device, pixel, Choices(guiding=guiding)) for pixel in pixels(3, 12)]
    return state.film.mean, paths


def test_contributions_add_up_to_the_pixel(traced: tuple[Doubles, list[PixelPaths]]) -> None:
    """To float rounding, unless it flipped a decision: of about 100 samples of 100 decisions each, one may be
    flipped."""
    mean, paths = traced
    assert any(each.value.any() for each in paths)
    differs = [np.abs(each.value - mean[each.pixel[::-1]]).max() > 1e-5 * (each.value.max() + 0.1) for each in paths]
    assert sum(differs) <= 1


def test_vertices_follow_from_each_other(traced: tuple[Doubles, list[PixelPaths]]) -> None:
    """The next surface lies in the sampled direction; MIS weights and probabilities are in range, and sums
    consistent."""
    for paths in traced[1]:
        rows = {name: paths.rows[name].astype(np.float64) for name in paths.rows.dtype.names or ()}
        assert all(np.isfinite(rows[name]).all() for name in rows if name != "distance")
        assert np.all(paths.rows["end"][paths.starts + paths.lengths - 1] != PathEnd.NONE)
        goes = np.flatnonzero((paths.rows["end"][:-1] == PathEnd.NONE) & (paths.rows["primitive"][1:] >= 0))
        way = rows["position"][goes + 1] - rows["position"][goes]
        there = rows["direction"][goes] * rows["distance"][goes + 1, None]
        assert np.abs(way - there).max(initial=0) <= 1e-4 * np.abs(rows["position"]).max()
        for part, whole in (("emission", rows["throughput"] * rows["radiance"]), ("direct", rows["unshadowed"])):
            assert np.all(rows[part] >= 0) and np.all(rows[part] <= whole * (1 + 1e-5) + 1e-30), part
        asked = rows["sent"] != 0
        assert np.all(rows["light_probability"][asked] > 0) and np.all(rows["light_probability"] <= 1 + 1e-6)
        assert np.all((rows["light_weight"][asked] > 0) & (rows["light_weight"][asked] <= 1))
        assert not rows["direct"][~asked].any()


def test_light_samples_are_their_factors(device: Device) -> None:
    """Without media: throughput, BSDF, radiance and MIS weight over the pdf (Veach 1997, eq. 9.15)."""
    scene = everything()
    paths = trace_pixel(replace(scene, render=replace(scene.render, spp=64)), device, (20, 22))
    rows = paths.rows[paths.rows["sent"] != 0]
    factors = rows["throughput"] * rows["light_bsdf"] * rows["light_radiance"]
    np.testing.assert_allclose(
        rows["unshadowed"], factors * (rows["light_weight"] / rows["light_pdf"])[:, None], rtol=1e-5
    )
    assert len(rows) > 50 and len(np.unique(rows["light"])) > 3


def test_lanes_and_launches_change_nothing(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = everything()
    whole = trace_pixel(scene, device, (7, 20))
    monkeypatch.setattr(trace, "MOST_RECORDS", 3 * scene.render.max_depth)
    cut = trace_pixel(scene, device, (7, 20), Choices(16 if device.lanes == 1 else 1, layout="bvh8"))
    np.testing.assert_allclose(cut.values, whole.values, rtol=1e-4, atol=1e-6)
    assert np.array_equal(cut.starts, whole.starts)


def test_direct_light_ends_at_two_edges(device: Device) -> None:
    scene = everything()
    settings = replace(scene.render, integrator="direct")
    assert trace_pixel(replace(scene, render=settings), device, (20, 20)).lengths.max() == 2


@pytest.mark.parametrize("pixel", [(45, 0), (0, 33), (-1, 0)])
def test_pixels_outside_are_refused(device: Device, pixel: tuple[int, int]) -> None:
    with pytest.raises(
        UsageError,
        match=rf"pixel {pixel[0]},{pixel[1]} is outside the image of 45x33; X must be "
        "0 to 44 and Y 0 to 32",
    ):
        trace_pixel(everything(), device, pixel)


def test_integrators_without_paths_are_refused(device: Device) -> None:
    with pytest.raises(UsageError, match='integrator "local" traces no paths; choose path or direct'):
        trace_pixel(Scene(render=RenderSettings(integrator="local")), device, (0, 0))


def test_samples_that_are_not_finite_are_dropped(device: Device) -> None:
    """They are dropped from the film, too: 1e38·1e38 is beyond float32."""
    bright = Sphere(material=Diffuse(emission=(1e38, 0.0, 0.0)))
    scene = Scene(spheres=[bright], render=RenderSettings(size=(3, 3), spp=4))
    paths = trace_pixel(scene, device, (1, 1))
    assert not paths.kept.any() and not paths.value.any()


def test_paths_that_were_ended_are_missed(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For drivers that end loops early (test_loop_limit.py)."""
    folder = sabotaged(tmp_path / "kernels", r"!loops_ended\(launch.width\)", "(launch.width == 0)")
    monkeypatch.setattr(program, "kernel_folder", lambda: folder)
    monkeypatch.setattr(checked_loops, "loop_turns", lambda device: 50_000)
    with pytest.raises(DeviceError, match="after 50000 iterations, and 4 of 4 paths .* need more"):
        trace_pixel(everything(), device, (4, 4))
