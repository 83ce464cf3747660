"""Hard cases of geometry: the default tests make no errors; textbook methods fail the same cases."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from clrt.accel.methods import LayoutName, TriangleTest
from clrt.bench.numerics.cases import departures
from clrt.bench.numerics.cases.departures import lit_scenes
from clrt.bench.numerics.cases.distances import distances
from clrt.bench.numerics.cases.slivers import sliver_tube
from clrt.bench.numerics.cases.spheres import exact_hits, measure_spheres
from clrt.bench.numerics.cases.subject import Subject, ulps
from clrt.bench.numerics.cases.watertight import measure_watertight, misses, placed
from clrt.bench.numerics.families import FAMILIES, FIGURES, measure_families
from clrt.bench.numerics.hard_light import measure_pictures
from clrt.bench.numerics.numerics import GEOMETRY
from clrt.bench.numerics.row import Row
from clrt.bench.rays.hard_meshes import icosphere
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight


@pytest.mark.parametrize("measure", [*GEOMETRY, measure_pictures], ids=lambda measure: str(measure.__name__))
def test_nothing_is_wrong(device: Device, measure: object) -> None:
    assert callable(measure)
    rows = list(measure(Subject(device.info.index), quick=True))
    assert len({row.what for row in rows}) == len(rows) > 0 and all(row.count > 0 for row in rows)
    assert [row for row in rows if row.wrong] == []


@pytest.mark.parametrize("layout", ["bvh2", "cwbvh", "packs", "list"])
def test_other_trees_let_nothing_out_of_slivers(device: Device, layout: LayoutName) -> None:
    assert misses(Subject(device.info.index, layout=layout), sliver_tube(64), 20_000) == 0


def many_are_wrong(rows: Iterable[Row], count: int) -> bool:
    """Return whether more than `count` are wrong, reading only as many rows as necessary."""
    wrong = 0
    return any((wrong := wrong + row.wrong) > count for row in rows)


@pytest.mark.parametrize("triangle", ["moller_trumbore", "precomputed", "baldwin_weber"])
def test_triangles_with_cracks_are_found_out(device: Device, triangle: TriangleTest) -> None:
    subject = Subject(device.info.index, triangle=triangle)
    assert many_are_wrong(measure_watertight(subject, quick=True), 1000)


def test_boxes_without_padding_are_found_out(device: Device) -> None:
    mesh = placed(icosphere(5), 5.0, 1.0)
    assert misses(Subject(device.info.index, box="plain"), mesh, 200_000) > 0
    assert misses(Subject(device.info.index), mesh, 200_000) == 0


def test_textbook_spheres_are_found_out(device: Device) -> None:
    rows = [row for row in measure_spheres(Subject(device.info.index, sphere="textbook"), quick=True)]
    assert sum(row.wrong for row in rows) > 1000
    assert max(row.figure or 0 for row in rows) > 1e6
    robust = measure_spheres(Subject(device.info.index), quick=True)
    assert max(row.figure or 0 for row in robust) < 4  # units in the last place


def test_fixed_offsets_are_found_out(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fixed offsets fail where float32 is coarse."""
    monkeypatch.setattr(departures, "PLACES", [place for place in departures.PLACES if place[1] > 1e5])
    subject = Subject(device.info.index, offset="fixed")
    assert many_are_wrong(departures.measure_departures(subject, quick=True), 100)


def test_pictures_off_by_a_hundredth_are_found_out(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The floors stay as white as they are."""
    monkeypatch.setattr("clrt.bench.numerics.hard_light.ALBEDO", 0.505)
    rows = [row for row in measure_pictures(Subject(device.info.index), quick=True) if row.unit == "standard errors"]
    wrong = [row.what for row in rows if row.wrong]
    assert wrong == ["a point light", "a spherical light", "a tiny spherical light", "992 lamps"]


def test_exact_hits_of_a_sphere() -> None:
    """3-4-5 triangle: a line at distance 3 from the center is inside radius 5 for 4 on either side of the foot."""
    sphere = np.array([0, 0, 0, 5], np.longdouble)
    origin = np.array([[-10, 3, 0], [0, 3, 0], [4.5, 3, 0], [-10, 6, 0]], np.longdouble)
    direction = np.tile(np.array([2, 0, 0], np.longdouble), (4, 1))
    t, beside, _ = exact_hits(sphere, origin, direction)
    np.testing.assert_array_equal(t, [3, 2, np.inf, np.inf])
    np.testing.assert_array_equal(beside, [3, 3, 3, 6])


def test_exact_distances(device: Device) -> None:
    """For a ray perpendicular to a triangle far away, t is the distance up to the rounding of its inputs."""
    t, exact, sure = distances(Subject(device.info.index), 1e3, 0.0, 1000)
    np.testing.assert_allclose(exact, 1e3, rtol=1e-6)
    assert sure.mean() > 0.9 and ulps(t[sure], exact[sure]).max() < 5


def test_ulps() -> None:
    one = np.float32(1)
    found = np.array([one, np.nextafter(one, np.float32(2)), np.inf, 3], np.float32)
    np.testing.assert_array_equal(ulps(found, np.array([1, 1, 1, 3.0])), [0, 1, np.inf, 0])


def test_lit_scenes_fill_the_picture(device: Device) -> None:
    """A light behind the surfaces leaves them dark, so pixels can be wrong both ways."""
    subject = Subject(device.info.index)
    for scene in lit_scenes(np.zeros(3), 1.0, level_only=False).values():
        small = replace(scene, render=replace(scene.render, size=(16, 16)))
        assert subject.picture(small).any(axis=2).all()
        (light,) = scene.lights
        assert isinstance(light, DirectionalLight)
        x, y, z = light.direction
        turned = replace(light, direction=(-x, -y, -z))
        assert not subject.picture(replace(small, lights=[turned])).any()


def test_a_family_is_measured_side_by_side(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clrt.bench.numerics.families.FAMILIES", {"sphere": FAMILIES["sphere"]})
    [(family, tests)] = measure_families(device.info.index, quick=True)
    assert family == "sphere" and tuple(tests) == FAMILIES["sphere"]
    assert all({"mrays", "ratio", "cpu_ratio", *FIGURES["sphere"]} <= set(test) for test in tests.values())
    assert tests["robust"]["wrong"] == 0 < tests["textbook"]["wrong"]
