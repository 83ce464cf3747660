"""The model of GPUs: records equal the kernels' counts, and warps, caches and queues follow closed forms."""

from __future__ import annotations

import json
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import clrt
from clrt.bench.rays.node_visits import visits_a_ray
from clrt.bench.rays.workloads import bumpy_ball, closed_room, workloads
from clrt.bench.simt.calibrate import fit, rms
from clrt.bench.simt.costs import FITTED
from clrt.bench.simt.gpus import GPUS
from clrt.bench.simt.groups import held, warps_in_groups
from clrt.bench.simt.maps import idle_lanes
from clrt.bench.simt.measured import measured_programs, measured_scenes
from clrt.bench.simt.misses import line_stream, miss_curve
from clrt.bench.simt.model import cycles_per_pass
from clrt.bench.simt.record import PathRecorder, record_rays
from clrt.bench.simt.study import QUICK, Queries, errors_at, scene_points
from clrt.bench.simt.variants import Program, simulate
from clrt.bench.simt.visits import BLOCKED, CLOSEST, NODES, SEGMENTS, SHADING, TESTS, Ints, Visits, rank, visits_of
from clrt.bench.simt.warps import in_paths, in_queues, shading_passes, traversal_passes
from clrt.bench.simt.workloads import BLOCK, all_paths, by_rows, sampled_paths
from clrt.cli.bench_simt import simt_command
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.film.tiles import TILE, TILE_PIXELS
from clrt.rendering.renderer import Renderer

pytestmark = pytest.mark.study
SCENES = Path(__file__).parents[2] / "scenes"
RNG = np.random.default_rng(7)
WIDTH = 32
NONE: Ints = np.zeros(0, np.int64)


def shaded(lengths: Ints, material: Ints | None = None) -> Visits:
    """Return paths that shade as many surfaces as these lengths, (paths,), and trace a ray without visits to each."""
    path = np.repeat(np.arange(len(lengths)), lengths)
    segment = rank(path)
    types = np.zeros(len(path), np.int64) if material is None else material
    zeros = np.zeros(len(path), np.int64)
    empty = (NONE,) * 5
    return Visits(len(lengths), path, segment, zeros, zeros, zeros > 0, *empty, path, segment, types)


def visiting(index: Ints, kind: int) -> Visits:
    """Return single rays that each make one visit to these indices."""
    count, zeros = len(index), np.zeros(len(index), np.int64)
    rays = np.arange(count)
    kinds = np.full(count, kind)
    return Visits(count, rays, zeros, zeros, zeros, zeros > 0, rays, zeros, zeros, kinds, index, NONE, NONE, NONE)


@pytest.mark.parametrize("layout", ["cwbvh", "bvh2"])
def test_records_equal_the_kernels_counts(device: Device, layout: str) -> None:
    ball = bumpy_ball(3)
    room = closed_room(*ball)
    query = clrt.RayQuery(*room, device=device.info.index, layout=layout)
    for kind in workloads(*room, ball[0], query.closest_hit, (40, 40)):
        visits = visits_of(record_rays(query, kind.rays, any_hit=kind.any_hit))
        assert visits.rays == len(kind.rays[2]) and np.all(visits.blocked == kind.any_hit)
        counted = visits_a_ray(query, kind.rays, any_hit=kind.any_hit)
        for name, number in (("nodes", NODES), ("tests", TESTS)):
            assert counted[name] * visits.rays == pytest.approx(np.count_nonzero(visits.kind == number))
        assert counted["tests"] > 0.5


def test_records_are_those_of_the_rays_alone(device: Device) -> None:
    """A ray's visits do not depend on the rays next to it, nor on the lane that traces it."""
    ball = bumpy_ball(3)
    room = closed_room(*ball)
    query = clrt.RayQuery(*room, device=device.info.index, layout="cwbvh")
    rays = next(workloads(*room, ball[0], query.closest_hit, (16, 16))).rays
    visits = visits_of(record_rays(query, rays, any_hit=False))
    for ray in (0, 77, 255):
        alone = visits_of(
            record_rays(query, (rays[0][ray, None], rays[1][ray, None], rays[2][ray, None]), any_hit=False)
        )
        own = visits.ray == ray
        for name in ("turn", "place", "kind", "index"):
            assert np.array_equal(getattr(visits, name)[own], getattr(alone, name))


def test_too_many_rays_and_other_integrators_are_refused(device: Device) -> None:
    query = clrt.RayQuery(*bumpy_ball(1), device=device.info.index, layout="cwbvh")
    ray = np.zeros(((1 << 20) + 1, 3), np.float32)
    with pytest.raises(UsageError, match="at most 1048576"):
        record_rays(query, (ray, ray, ray[:, 0]), any_hit=False)
    with pytest.raises(UsageError, match="integrator local follows no paths"):
        PathRecorder(device, clrt.load(SCENES / "local.toml"), "cwbvh", (16, 16))


@pytest.mark.parametrize("name", ["cornell", "spot", "instances"])
def test_paths_are_those_that_are_rendered(device: Device, name: str) -> None:
    """As many rays as an image of one sample per pixel has, and no more surfaces than segments."""
    scene = clrt.load(SCENES / f"{name}.toml")
    size = 64, 48
    scene = replace(scene, render=replace(scene.render, size=size))
    *_, state = Renderer(scene, spp=1, device=device.info.index, lanes=1).passes()
    words = PathRecorder(device, scene, "cwbvh", size).record(np.arange(48, dtype=np.uint32)).words >> 28
    assert np.isin(words, (CLOSEST, BLOCKED)).sum() == state.film.rays
    assert np.count_nonzero(words == SHADING) <= np.count_nonzero(words == SEGMENTS)


def test_identical_rays_leave_no_lane_idle(device: Device) -> None:
    ball = bumpy_ball(3)
    room = closed_room(*ball)
    for layout in ("cwbvh", "bvh2"):
        query = clrt.RayQuery(*room, device=device.info.index, layout=layout)
        first = next(workloads(*room, ball[0], query.closest_hit, (16, 16))).rays
        ray = tuple(np.repeat(array[120:121], 2 * WIDTH, axis=0) for array in first)
        visits = visits_of(record_rays(query, (ray[0], ray[1], ray[2]), any_hit=False))
        one = traversal_passes(visits, in_paths(visits, 1), layout, visits.path == 0)
        for kind, passes in traversal_passes(visits, in_paths(visits, WIDTH), layout, visits.path >= 0).items():
            assert passes.utilisation(WIDTH) == 1
            assert (passes.passes, passes.lines, passes.touched) == tuple(
                2 * each for each in (one[kind].passes, one[kind].lines, one[kind].touched)
            )


def test_lines_of_loads_follow_from_addresses() -> None:
    """Pairs of bvh2's nodes are 64 bytes: two share a line. Consecutive ones touch half a line each; equal ones one."""
    everything = np.ones(WIDTH, bool)
    for stride, lines in ((0, 1), (2, 16), (4, 32), (400, 32)):
        visits = visiting(stride * np.arange(WIDTH), NODES)
        passes = traversal_passes(visits, in_paths(visits, WIDTH), "bvh2", everything)[NODES]
        assert (passes.passes, passes.lanes) == (1, WIDTH)
        assert (passes.lines, passes.touched) == (4 * lines, lines)


def test_lanes_idle_as_geometric_path_lengths_say() -> None:
    """A warp works E[length] of E[longest] of the time; with survival q the longest of n exceeds k with probability
    1 − (1 − q^k)^n."""
    survival, count = 0.7, 4000
    lengths = RNG.geometric(1 - survival, count * WIDTH)
    visits = shaded(lengths)
    lanes = lengths.reshape(count, WIDTH)
    steps = np.arange(200)
    longest = np.sum(1 - (1 - survival**steps) ** WIDTH)
    expected = 1 / (1 - survival) / longest
    worked = shading_passes(visits, in_paths(visits, WIDTH)).utilisation(WIDTH)
    deviation = np.std(lanes.mean(axis=1) - expected * lanes.max(axis=1)) / longest / np.sqrt(count)
    assert abs(worked - expected) < 4 * deviation
    queued = shading_passes(visits, in_queues(visits, WIDTH))
    assert queued.passes == sum(-(-np.count_nonzero(lengths > k) // WIDTH) for k in range(lengths.max()))
    assert queued.utilisation(WIDTH) > 0.99


def test_materials_part_warps_until_they_are_sorted() -> None:
    """A warp of n lanes meets T(1 − (1 − 1/T)^n) of T equally likely types; sorted, each queue has T − 1 mixed warps at
    most."""
    types, count = 5, 2000
    material = RNG.integers(types, size=count * WIDTH)
    visits = shaded(np.ones(count * WIDTH, np.int64), material)
    expected = types * (1 - (1 - 1 / types) ** WIDTH)
    parted = shading_passes(visits, in_queues(visits, WIDTH)).passes / count
    assert abs(parted - expected) < 4 * np.sqrt(types) / np.sqrt(count)
    ordered = shading_passes(visits, in_queues(visits, WIDTH, by_material=True)).passes
    assert count <= ordered <= count + types - 1


def test_queues_keep_the_order_of_paths() -> None:
    """Without an end of any path all designs have the same warps."""
    visits = shaded(np.full(4 * WIDTH, 3))
    paths, queues = in_paths(visits, WIDTH), in_queues(visits, WIDTH)
    assert np.array_equal(paths.of_ray, queues.of_ray) and np.array_equal(paths.of_surface, queues.of_surface)


def test_misses_are_those_of_least_recently_used_replacement() -> None:
    cycle = miss_curve(np.tile(np.arange(100), 20))
    assert cycle.ratio(99) == 1 and cycle.ratio(100) == 0
    weights = 1 / np.arange(1, 1001)
    stream = RNG.choice(1000, 100_000, p=weights / weights.sum())
    curve = miss_curve(stream)
    for capacity in (50, 200, 500):
        kept: OrderedDict[int, None] = OrderedDict()
        missed = 0
        for line in np.r_[stream, stream]:  # the first half fills the cache
            if line in kept:
                kept.move_to_end(line)
            else:
                missed += 1
                kept[line] = None
                if len(kept) > capacity:
                    kept.popitem(last=False)
        assert curve.ratio(capacity) == pytest.approx(missed / len(stream) / 2, rel=0.03)


def test_streams_have_the_lines_of_passes() -> None:
    visits = visiting(np.r_[np.zeros(WIDTH, np.int64), 8 * np.arange(WIDTH)], NODES)
    warps, everything = in_paths(visits, WIDTH), np.ones(2 * WIDTH, bool)
    lines = line_stream(visits, warps, "bvh2", everything)
    touched = traversal_passes(visits, warps, "bvh2", everything)[NODES].touched
    assert len(lines) == touched == 1 + WIDTH and len(np.unique(lines)) == WIDTH


def test_throughput_of_warps_is_between_its_bounds() -> None:
    """One warp issues and waits in turn; many hide all waiting; no number beats either bound."""
    for issue, wait in ((100.0, 300.0), (50.0, 0.0), (10.0, 990.0)):
        intervals = [cycles_per_pass(issue, wait, warps) for warps in (1, 2, 4, 8, 16, 1000)]
        assert intervals[0] == pytest.approx(issue + wait) and intervals[-1] == pytest.approx(issue, rel=0.01)
        assert all(later <= before + 1e-9 for before, later in zip(intervals, intervals[1:]))
        for warps, interval in zip((1, 2, 4, 8, 16), intervals):
            assert interval >= max(issue, (issue + wait) / warps) - 1e-9


def test_registers_limit_warps() -> None:
    """65 536 registers of sm_90 hold 64 warps of 32 registers, 32 of 64, 16 of 128 and 8 of 255."""
    gpu = GPUS["H200"]
    for registers, warps in ((32, 64), (64, 32), (128, 16), (255, 8)):
        assert gpu.schedulers * gpu.in_flight(registers) == warps
    assert warps_in_groups(gpu, 96, 64) == 20 and warps_in_groups(gpu, 96, 256) == 16
    work = np.array([1, 3, 2, 2])
    assert held(work, 1) == 1 and held(work, 2) == pytest.approx(2 / 2.5)


def test_rows_and_tiles_have_the_same_pixels() -> None:
    position = by_rows(2 * BLOCK)
    assert np.array_equal(np.sort(position), np.arange(2 * BLOCK))
    path = np.argsort(position)[:WIDTH]  # the first row: tiles side by side
    assert np.array_equal(path // TILE_PIXELS, np.repeat(np.arange(4), TILE)) and np.all(path % TILE_PIXELS < TILE)


def test_maps_are_of_their_tiles(device: Device) -> None:
    """Tiles that see the background alone have no warp at work on surfaces."""
    size = 64, 48
    sample = all_paths(device, clrt.load(SCENES / "cornell.toml"), "cwbvh", size)
    idle = idle_lanes(sample.visits, "cwbvh", size)
    assert idle["extend"].shape == (12, 8)
    lengths = np.bincount(sample.visits.shaded_path, minlength=sample.visits.paths).reshape(6, 8, 2, WIDTH)
    lanes = lengths.transpose(0, 2, 1, 3).reshape(12, 8, WIDTH)
    with np.errstate(invalid="ignore"):
        expected = 1 - lanes.mean(axis=2) / lanes.max(axis=2)
    assert np.allclose(idle["shade"], expected, equal_nan=True)  # one material: a pass per segment


def test_designs_rank_as_they_must(device: Device) -> None:
    """Fewer registers never slow the megakernel; shorter code never slows shading; queues never have more passes."""
    sample = all_paths(device, clrt.load(SCENES / "materials.toml"), "cwbvh", (64, 48))
    megakernel, queues, ordered = (
        simulate(sample.visits, variant, WIDTH, "cwbvh", sample.data_bytes)
        for variant in ("megakernel", "queues", "sorted")
    )
    gpu = GPUS["H200"]
    seconds = [megakernel.seconds(gpu, Program(registers, 8000, 5000), FITTED) for registers in (64, 128, 255)]
    assert seconds == sorted(seconds)
    seconds = [
        megakernel.seconds(gpu, Program(128, instructions, 1000), FITTED) for instructions in (2000, 8000, 16000)
    ]
    assert seconds == sorted(seconds)
    assert ordered.shading.passes < queues.shading.passes < megakernel.shading.passes
    assert megakernel.rays == queues.rays == ordered.rays
    for stage, each in megakernel.traversals.items():
        assert queues.traversals[stage].passes[NODES].passes < each.passes[NODES].passes
        assert queues.traversals[stage].passes[NODES].lanes == each.passes[NODES].lanes


def test_the_model_is_as_accurate_as_it_says(device: Device) -> None:
    """At measured rates of queries, each left out of the fit; and the stored number is that of a fit."""
    points = list(Queries(device, QUICK).points())
    assert len(points) >= 16
    assert errors_at(points)["factor"]["queries"] < 1.25
    assert fit(points).traversal == pytest.approx(FITTED.traversal, rel=0.1)


def test_stages_are_modelled_that_nothing_was_fitted_to(device: Device) -> None:
    """Extend and connect of queues, from a number fitted to ray queries alone."""
    errors = []
    for name in ("spot", "glass", "textures"):
        sample = sampled_paths(device, clrt.load(SCENES / f"{name}.toml"), "cwbvh", 1024, 8192)
        points = [point for point in scene_points(name, sample) if point.kind in ("extend", "connect")]
        errors += [point.error(FITTED) for point in points]
    assert len(errors) == 6 and rms(errors) < np.log(1.35)


def test_measured_scenes_are_in_the_gallery() -> None:
    assert {point.scene for point in measured_scenes()} <= {path.stem for path in SCENES.glob("*.toml")}
    assert {point.scene for point in measured_scenes()} <= set(measured_programs())
    assert {point.gpu for point in measured_scenes()} <= set(GPUS)


def test_the_command_writes_what_it_prints(tmp_path: Path) -> None:
    target, plot = tmp_path / "simt.json", tmp_path / "idle.png"
    arguments = ["--quick", "--scene", str(SCENES / "spot.toml"), "--json", str(target), "--plot", str(plot)]
    done = CliRunner().invoke(simt_command, arguments, catch_exceptions=False)
    assert done.exit_code == 0 and plot.stat().st_size > 10_000
    written = json.loads(target.read_text(encoding="utf-8"))
    rate = written["scenes"]["spot"]["predicted"]["H200"]["cwbvh"]["queues"]["samples"]
    assert f"{1e-6 * rate:.4g}" in done.output and "modelled" in done.output
    assert set(written["queries"]) == set(GPUS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--plot", "a.png"], "add --scene FILE"),
        (["--scene", str(SCENES / "local.toml")], "local.toml: the integrator local follows no paths"),
        (["--scene", str(SCENES / "furnace.toml")], "furnace.toml: no ray enters a BVH"),
        (["--scene", str(SCENES / "spot.toml"), "--scene", str(SCENES / "spot.toml")], "files of the same name"),
    ],
)
def test_what_cannot_be_simulated_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(simt_command, ["--quick", *arguments])
    assert isinstance(done.exception, UsageError) and message in str(done.exception)
