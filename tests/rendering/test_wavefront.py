"""Wavefront rendering: the film equals that of the megakernel, except that rays are counted per tile."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.device.device_info import Paths
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import PATHS
from clrt.rendering.film.film import Film
from clrt.rendering.film.tiles import tile_sums
from clrt.rendering.renderer import Renderer
from clrt.scene.model import Scene

from ..covering import others
from .pictures import session
from .test_variants import everything, painted, plastic_ball, sights

SPP = 7  # not a multiple of a wave's samples

PAINTED = painted(everything())


def transparent(scene: Scene) -> Scene:
    """Return the scene with coverage, through glass, too."""
    return replace(scene, render=replace(scene.render, transparent=True, transparent_glass=True))


def catching(scene: Scene) -> Scene:
    """Return the same with a mesh as a catcher, of a material that does not emit."""
    scene = transparent(scene)
    caught = next(i for i, mesh in enumerate(scene.meshes) if not any(mesh.material.radiance))
    meshes = list(scene.meshes)
    meshes[caught] = replace(meshes[caught], material=replace(meshes[caught].material, catcher=True))
    return replace(scene, meshes=meshes)


#: Most share one program.
SCENES = {
    "painted": PAINTED,
    "too bright": replace(PAINTED, environment=replace(PAINTED.environment, strength=1e38)),
    "two edges": replace(PAINTED, render=replace(PAINTED.render, max_depth=2)),
    "one edge": replace(PAINTED, render=replace(PAINTED.render, max_depth=1)),
    "a pixel": replace(PAINTED, render=replace(PAINTED.render, size=(1, 1))),
    "sky": replace(everything(), meshes=[], spheres=[]),
    "transparent": transparent(PAINTED),
    "catching": catching(PAINTED),
}
PLASTIC = plastic_ball()
OTHERS = {"everything": everything(), "lens": dict(sights(everything()))["lens"]}


def followed(device: Device, paths: Paths, scene: Scene, *parts: int, lanes: int = 8, **chosen: Any) -> Film:
    """Return the film after as many samples per pixel as `parts` sum to, rendered one part after another."""
    running = session(device, scene, lanes=lanes, paths=paths, **chosen)
    for samples in parts or [SPP]:
        for _ in running.render(samples):
            pass
    assert running.compiled.entry == PATHS[paths]
    return running.film()


def assert_same(waves: Film, lanes: Film) -> None:
    """Films agree to rounding, like the SIMD widths in test_variants; with pip's PoCL they are bit-identical."""
    for name in {"sum", "square", "direct", "alpha", "caught", "bare", "catcher"} & set(lanes.pixels.dtype.names or ()):
        one, other = (film.pixels[name].astype(np.float64) + film.pixels[f"{name}_error"] for film in (waves, lanes))
        assert np.mean(np.abs(one - other) > 1e-5 * (np.abs(other) + 0.1)) < 4e-3
    for name in ("count", "dropped"):
        np.testing.assert_array_equal(waves.pixels[name], lanes.pixels[name])
    one, other = (tile_sums(film.pixels["rays"]) for film in (waves, lanes))
    assert np.mean(one != other) < 0.1 and one.sum() == pytest.approx(other.sum(), rel=1e-4)


@pytest.mark.programs
@pytest.mark.parametrize("name", [*SCENES, *others(*OTHERS)])
def test_waves_are_the_same_paths(device: Device, name: str) -> None:
    scene = (SCENES | OTHERS)[name]
    lanes, waves = (followed(device, paths, scene) for paths in ("lanes", "waves"))
    assert lanes.mean.mean() > (0.05 if lanes.alpha is not None else 0.1)
    assert (lanes.nonfinite_samples > 0) == (name == "too bright")
    assert_same(waves, lanes)


@pytest.mark.programs
@pytest.mark.parametrize(
    "chosen", [{"sampler": "sobol", "layout": "bvh8"}, {"sampler": "stratified", "direct_light": True}], ids=str
)
def test_waves_with_every_choice(device: Device, chosen: dict[str, Any]) -> None:
    lanes, waves = (followed(device, paths, PLASTIC, **chosen) for paths in ("lanes", "waves"))
    assert ("direct" in (waves.pixels.dtype.names or ())) == ("direct_light" in chosen)
    assert_same(waves, lanes)


@pytest.mark.parametrize("max_depth", [1, 2, 3])
def test_direct_light_of_short_paths(device: Device, max_depth: int) -> None:
    """Direct light is that of paths of depth 2 at most, so it is everything if max_depth is 2 or less."""
    scene = replace(PLASTIC, render=replace(PLASTIC.render, max_depth=max_depth))
    found = followed(device, "waves", scene, sampler="stratified", direct_light=True).pixels
    assert np.array_equal(found["direct"], found["sum"]) == (max_depth <= 2)


def test_sums_do_not_depend_on_the_cut(device: Device) -> None:
    """Samples are added per pixel in their order, so sums are bit-identical for any number of samples per wave."""
    whole, parts = (followed(device, "waves", everything(), *cut).pixels for cut in ((9,), (1, 2, 6)))
    np.testing.assert_array_equal(whole, parts)


def test_waves_need_eight_lanes(device: Device) -> None:
    with pytest.raises(UsageError, match="waves needs 8 lanes, not 1"):
        Renderer(everything(), device=device.info.index, lanes=1, paths="waves")
    with pytest.raises(UsageError, match="paths 'rows' is unknown; choose from lanes, waves"):
        Renderer(everything(), device=device.info.index, paths="rows")  # type: ignore[arg-type]
    assert [Choices(lanes).on(None).paths for lanes in (1, 8, 16)] == ["lanes", "waves", "lanes"]
