"""Path guiding: the field's densities, unbiased images with less noise, the same however work is divided."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.significance import t_test
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.farm.orders import Order
from clrt.farm.share_renderer import ShareRenderer
from clrt.output.image_error import relmse
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.records import QUARTER, SPATIAL_NODE
from clrt.rendering.film.tiles import row_by_row
from clrt.rendering.guiding import training
from clrt.rendering.guiding.learned_field import learned_field
from clrt.rendering.guiding.quadtrees import DEPTH, UNIFORM, morton_codes, quadtrees
from clrt.rendering.guiding.radiance_cache import light_at
from clrt.rendering.guiding.recorded_paths import VERTEX
from clrt.rendering.guiding.spatial_tree import spatial_tree
from clrt.rendering.guiding.training import Training
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Environment, Scene

from ..covering import others
from .checkpoints import SIZE, renderer, run, same
from .pictures import box, quad
from .test_checkpoint import interrupt_after

Doubles = NDArray[np.float64]

WHITE = Diffuse(color=(0.7, 0.7, 0.7))


@pytest.fixture(autouse=True)
def short_training(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three passes of a small image train enough for scenes of a few surfaces."""
    monkeypatch.setattr(training, "FULL", Training((2, 4, 8), 64 * 64))


def covered_light() -> Scene:
    """Return a closed room with a lamp in a box that is open at the top: elsewhere all light is indirect."""
    lamp = quad(
        [(-0.3, -1, 0.3), (0.3, -1, 0.3), (0.3, -1, -0.3), (-0.3, -1, -0.3)], Diffuse(emission=(50.0, 50.0, 50.0))
    )
    shade = [quad([(-0.4, -1.5, s), (0.4, -1.5, s), (0.4, 1.2, s), (-0.4, 1.2, s)], WHITE) for s in (-0.4, 0.4)] + [
        quad([(s, -1.5, -0.4), (s, -1.5, 0.4), (s, 1.2, 0.4), (s, 1.2, -0.4)], WHITE) for s in (-0.4, 0.4)
    ]
    return Scene(
        meshes=[box(2.0, WHITE), lamp, *shade],
        camera=Camera(position=(1.9, -1.5, 1.9), look_at=(-1.0, -0.5, -1.5), fov_degrees=80),
    )


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[tuple[NDArray[np.void], dict[str, NDArray[np.void]]]]]:
    """Collect the vertices of each pass of a training, with the buffers that were learned from them."""
    passes: list[tuple[NDArray[np.void], dict[str, NDArray[np.void]]]] = []

    def keep(vertices: NDArray[np.void]) -> object:
        field = learned_field(vertices)
        passes.append((vertices, {name: array for name, (_, array) in field.items()}))
        return field

    monkeypatch.setattr(training, "learned_field", keep)
    yield passes


def field_density(field: dict[str, NDArray[np.void]], vertex: np.void) -> tuple[float, float]:
    """Return the field's share at a vertex and its density along the vertex's direction, cut by cut."""
    nodes, quarters, node = field["spatial_nodes"], field["quarters"], 0
    while (axis := nodes["axis"][node]) >= 0:
        node = nodes["child"][node] + int(vertex["place"][axis] >= nodes["value"][node])
    density, first = UNIFORM, int(nodes["child"][node])
    x, y = (int(vertex["direction"]) & 0xFFFF) / 65536, (int(vertex["direction"]) >> 16) / 65536
    while first >= 0:
        x, y = 2 * x, 2 * y
        quarter = first + int(x >= 1) + 2 * int(y >= 1)
        x, y = x % 1, y % 1
        density *= 4 * float(quarters["share"][quarter])
        first = int(quarters["quarters"][quarter])
    return float(nodes["value"][node]), density


def test_kernels_use_the_density_that_was_learned(
    device: Device, recorded: list[tuple[NDArray[np.void], dict[str, NDArray[np.void]]]]
) -> None:
    """Each direction's recorded density is the mixture's; E[1/density] over a hemisphere is 2·pi, its solid angle."""
    renderer(device, covered_light(), guiding="on")
    assert len(recorded) == 3
    (_, field), (vertices, _) = recorded[1:]
    random = np.random.default_rng(date.today().toordinal())
    for vertex in random.choice(vertices[vertices["pdf"] > 0], 500):
        share, density = field_density(field, vertex)
        mixture = share * density + (1 - share) * vertex["bsdf_pdf"]
        np.testing.assert_allclose(vertex["pdf"], mixture, rtol=1e-4)
    x, y = (vertices["direction"] & 0xFFFF) / 65536, (vertices["direction"] >> 16) / 65536
    z, turn = 2 * y - 1, 2 * np.pi * x
    radius = np.sqrt(1 - z**2)
    directions = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    above = (vertices["place"][:, 3:] * directions).sum(axis=1) > 1e-4
    found = np.divide(above, vertices["pdf"], out=np.zeros(len(vertices)), where=vertices["pdf"] > 0)
    error = found.std() / np.sqrt(len(found))
    assert error < 0.05 and abs(found.mean() - 2 * np.pi) < 5 * error, (found.mean(), error)


@pytest.mark.statistics
def test_guided_images_have_the_same_mean(device: Device) -> None:
    """Over 16 seeds, by Student's t."""
    means = [
        [
            run(renderer(device, covered_light(), guiding=guiding, seed=seed, spp=32), spp=32).pixels.mean()
            for seed in range(16)
        ]
        for guiding in ("off", "on")
    ]
    difference = np.array(means[0]) - np.array(means[1])
    assert t_test(difference.mean() / (difference.std(ddof=1) / 4), 15) > 1e-4, means


@pytest.mark.statistics
def test_guided_images_have_less_noise(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pixels of 64 samples differ from a reference by a third of what they do without, once a field is well trained."""
    monkeypatch.setattr(training, "FULL", Training((1, 2, 4, 8, 16), 128 * 128))
    reference = run(renderer(device, covered_light(), guiding="on", seed=2, spp=1024), spp=1024).pixels
    errors = [
        relmse(run(renderer(device, covered_light(), guiding=guiding, spp=64), spp=64).pixels, reference) or 1.0
        for guiding in ("off", "on")
    ]
    assert errors[1] < errors[0] / 3, errors


def test_a_white_furnace_stays_white(device: Device) -> None:
    """Within the noise that guiding makes where there was none; a box reflects as much as falls on it."""
    scene = Scene(
        meshes=[quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse(color=(1.0, 1.0, 1.0)))],
        environment=Environment(color=(1.0, 1.0, 1.0)),
        camera=Camera(position=(0, 3, 5), look_at=(0, 0, 0)),
    )
    pixels = run(renderer(device, scene, guiding="on", spp=256), spp=256).pixels.astype(float)
    assert abs(pixels.mean() - 1) < 5 * pixels.mean(axis=2).std() / np.sqrt(pixels[..., 0].size)


@pytest.mark.parametrize("lanes, paths", [(8, "waves"), *others((1, "queues"))])
def test_executions_give_the_same_image(device: Device, lanes: int, paths: str) -> None:
    """Bit for bit that of the megakernel."""
    images = [
        run(renderer(device, covered_light(), guiding="on", lanes=lanes, paths=each), spp=24).pixels
        for each in ("lanes", paths)
    ]
    np.testing.assert_array_equal(images[0], images[1])


def test_several_devices_give_the_same_image(device: Device) -> None:
    alone = renderer(device, covered_light(), guiding="on")
    together = Renderer(covered_light(), device=[device.info.index] * 2, size=SIZE, seed=1, spp=24, guiding="on")
    run(alone, spp=24)
    run(together, spp=24)
    assert same(alone, together)


def test_a_farms_worker_renders_the_same_samples(device: Device) -> None:
    """It trains the same field itself."""
    alone = renderer(device, covered_light(), guiding="on")
    run(alone, spp=4)
    worker = ShareRenderer(Order(alone.scene, Choices(guiding="on"), 24, (device.info.index,)))
    share = worker.share(np.arange(alone.session.tile_samples.size, dtype=np.uint32), 0, 4, None)
    np.testing.assert_array_equal(row_by_row(share, SIZE)["sum"], alone.session.film().pixels["sum"])


def test_a_checkpoint_resumes_to_the_same_image(device: Device, tmp_path: Path) -> None:
    at_once = renderer(device, covered_light(), guiding="on")
    run(at_once, spp=24)
    file = tmp_path / "guided.ckpt"
    interrupted = renderer(device, covered_light(), guiding="on", checkpoint=file)
    interrupt_after(interrupted, 7)
    resumed = renderer(device, covered_light(), guiding="on", checkpoint=file, resume=True)
    run(resumed, spp=24)
    assert same(at_once, resumed)


def test_another_view_is_that_of_a_new_renderer(device: Device) -> None:
    """Paths from another camera train another field."""
    seen = covered_light()
    other = Camera(position=(-1.9, 0, 1.9), look_at=(0, -0.5, 0), fov_degrees=70)
    moved = renderer(device, seen, guiding="on")
    moved.look(other)
    fresh = renderer(device, Scene(meshes=seen.meshes, camera=other), guiding="on")
    run(moved, spp=8)
    run(fresh, spp=8)
    assert same(moved, fresh)


def random_places(random: np.random.Generator, count: int) -> NDArray[np.float32]:
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    return np.concatenate([random.normal(size=(count, 3)), faces[random.integers(0, 6, count)]], axis=1).astype("f4")


def test_leaves_of_spatial_trees(device: Device) -> None:
    """Leaves are where the nodes' cuts lead, hold a few times `most` at most and face one way; merged ones hold the
    leaves that they are made of."""
    random = np.random.default_rng(date.today().toordinal())
    places = random_places(random, 20000)
    tree = spatial_tree(places, 300)
    leaves = tree.leaves_at(places)
    assert tree.nodes.dtype == SPATIAL_NODE and leaves.max() + 1 == tree.leaf_count > 30
    for k in random.integers(0, len(places), 200):
        node = 0
        while (axis := tree.nodes["axis"][node]) >= 0:
            node = tree.nodes["child"][node] + int(places[k, axis] >= tree.nodes["value"][node])
        assert tree.nodes["child"][node] == leaves[k]
    assert np.bincount(leaves).max() < 900
    for leaf in range(tree.leaf_count):
        assert np.ptp(places[leaves == leaf, 3:], axis=0).max() == 0
    merged, within = tree.merged(3000)
    assert 1 < merged.leaf_count < tree.leaf_count / 4
    np.testing.assert_array_equal(merged.leaves_at(places), within[leaves])


def test_scenes_without_light_or_surfaces(device: Device) -> None:
    """Nothing to learn, and nothing to guide: the images are those without."""
    for scene in (Scene(meshes=[box(2.0, WHITE)]), Scene(environment=Environment(color=(0.5, 0.5, 0.5)))):
        images = [run(renderer(device, scene, guiding=guiding, spp=4), spp=4).pixels for guiding in ("off", "on")]
        np.testing.assert_array_equal(images[0], images[1])


def test_what_cannot_be_guided_is_told(device: Device) -> None:
    for integrator in ("direct", "local", "raster", "normals"):
        with pytest.raises(UsageError, match=f"guiding needs the integrator path, not {integrator}; leave out one"):
            renderer(device, covered_light(), guiding="on", integrator=integrator)
    with pytest.raises(UsageError, match="guiding needs a camera: .* leave it out"):
        clrt.irradiance(covered_light(), [[0, 1, 0]], [[0, 1, 0]], guiding="on", device=device.info.index)
    with pytest.raises(UsageError, match="guiding"):
        renderer(device, covered_light(), guiding=True)


def test_quadtrees_are_distributions(device: Device) -> None:
    """Over the cells of the finest grid densities integrate to 1, and follow light of one sample per cell."""
    random = np.random.default_rng(date.today().toordinal())
    codes = np.arange(4**DEPTH, dtype=np.uint32)
    light = random.uniform(size=len(codes)) * np.where(codes < 4**DEPTH // 4, 9, 1)
    trees = np.zeros(len(codes), np.int32)
    made = quadtrees(trees, codes, light, light**2, 1)
    assert made.quarters.dtype == QUARTER and len(made.quarters) > 40
    density = made.density(trees, codes)
    np.testing.assert_allclose((density * 4 * np.pi / len(codes)).sum(), 1, rtol=1e-6)
    quarter = density.reshape(4, -1).mean(axis=1) / UNIFORM / 4
    np.testing.assert_allclose(quarter, [0.75, 1 / 12, 1 / 12, 1 / 12], rtol=0.02)
    assert (made.quarters["share"].reshape(-1, 4).sum(axis=1) - 1 < 1e-6).all()


def test_morton_codes() -> None:
    """Bit for bit."""
    random = np.random.default_rng(date.today().toordinal())
    x, y = random.integers(0, 1 << 16, (2, 100), dtype=np.uint32)
    for code, column, row in zip(morton_codes(x | y << np.uint32(16)), x, y):
        bits = [int(value) >> (16 - DEPTH) for value in (column, row)]
        assert int(code) == sum((bits[k % 2] >> k // 2 & 1) << k for k in range(2 * DEPTH))


def test_light_crosses_cells() -> None:
    """Cells in a row, each of whose paths goes on to the next with the weight ½, the last of which sees light of 1."""
    count, cells = 6, 5
    vertices = np.zeros(cells * count, VERTEX)
    vertices["weight"], vertices["pdf"], vertices["goes"] = 0.5, 1.0, True
    vertices["ends"][cells - 1 :: cells] = True
    vertices["direct"][cells - 1 :: cells] = 1.0
    arriving, reflected = light_at(vertices, np.tile(np.arange(cells, dtype=np.int32), count), cells)
    np.testing.assert_allclose(reflected, 0.5 ** np.arange(cells, 0, -1))
    np.testing.assert_allclose(arriving[:cells], 0.5 ** np.arange(cells - 1, -1, -1))
