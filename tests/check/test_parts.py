"""A correct device passes every part of the check, and the references of the parts are exact."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from clrt.check import star
from clrt.check.arithmetic import check_arithmetic
from clrt.check.check_parts import PARTS
from clrt.check.exact_floats import nearest_float32, ulps
from clrt.check.findings import Findings
from clrt.check.floats import operands
from clrt.device.open import Device
from clrt.queries.mesh import RayQuery

from ..covering import others

#: Images of which the one of a room has all.
IN_ROOM = ("ball", "furnace", "lamp")


@pytest.mark.parametrize("part", [*(part for part in PARTS if part not in IN_ROOM), *others(*IN_ROOM)])
def test_a_device_passes(device: Device, part: str) -> None:
    findings = Findings()
    PARTS[part](device, findings)
    assert not findings.failures


def test_fma_of_plain_operations(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The replacement in kernels/core/fma.cl is also rounded once, so hits have the same bits."""
    surface, hits = star.make_star(4), []
    rays = star.rays_from_elsewhere(surface, 1000)
    for fuses in (True, False):
        monkeypatch.setattr(Device, "fuses", fuses)
        query = RayQuery(surface.vertices, surface.faces, device=device.info.id)
        hits.append(query.closest_hit(rays.origins, rays.directions))
    findings = Findings()
    check_arithmetic(device, findings)
    assert not findings.failures
    assert np.array_equal(hits[0], hits[1])


def test_the_nearest_float() -> None:
    """numpy is the reference for doubles; values near midpoints of floats are no doubles, so checked by hand."""
    doubles = np.random.default_rng(0).normal(size=1000) * 2.0 ** np.random.default_rng(1).integers(-60, 60, 1000)
    assert [nearest_float32(Fraction(double)) for double in doubles] == list(doubles.astype(np.float32))
    half, ulp, hair = Fraction(1, 1 << 24), Fraction(1, 1 << 23), Fraction(1, 1 << 80)
    for exact, nearest in [
        (1 + half, 1),
        (1 + half + hair, 1 + ulp),
        (1 + half - hair, 1),
        (-1 - half, -1),
        (1 + ulp + half, 1 + 2 * ulp),
        (-1 - half - hair, -1 - ulp),
    ]:
        assert Fraction(float(nearest_float32(exact))) == nearest


def test_units_in_the_last_place() -> None:
    got = np.array([1 + 2.0**-23, 1.0, 2.0**-23, -8.0], np.float32)
    assert ulps(got, [1.0, 1.0, 2.0**-23 * (1 + 2.0**-25), -8.0 - 2.0**-21]).tolist() == [1.0, 0.0, 0.25, 0.5]


def test_operands_round_to_all_sides() -> None:
    """At least 10 % of sums and products round up, 10 % down, 5 % are halfway, and none leaves the normal range."""
    a, b, c = (values.astype(np.float64) for values in operands())
    for exact in (a + b, a * b):
        rounded = exact.astype(np.float32)
        error = (rounded - exact) / np.spacing(np.abs(rounded))
        assert np.mean(error > 0) > 0.1 and np.mean(error < 0) > 0.1 and np.mean(np.abs(error) == 0.5) > 0.05
        assert np.all((np.abs(exact) > 2.0**-126) & (np.abs(exact) < 2.0**127))
    separate = (a * b).astype(np.float32) + c
    assert np.mean(np.abs(separate) < np.abs(a * b) * 2.0**-20) > 0.2  # there the result of fma is rounding error


def test_the_star_is_closed_and_seen_from_inside() -> None:
    """Every edge belongs to two triangles, in opposite directions, and all triangles face outward."""
    surface = star.make_star()
    edges = {tuple(edge) for a, b in ((0, 1), (1, 2), (2, 0)) for edge in surface.faces[:, [a, b]].tolist()}
    assert len(edges) == 3 * len(surface.faces) and edges == {(b, a) for a, b in edges}
    p0, p1, p2 = surface.vertices[surface.faces].transpose(1, 0, 2)
    assert np.all(np.sum(np.cross(p1 - p0, p2 - p0) * p0, axis=1) > 0)


def test_rays_of_both_kinds_agree() -> None:
    """Rays from the origin, whose hits are known by construction, agree with exact tests of all triangles."""
    surface = star.make_star()
    inside = star.rays_from_inside(surface).take(slice(6, 700, 7))
    t, least, _ = star.intersect_planes(surface, np.zeros_like(inside.corners), inside.directions.astype(np.int64))
    hit = (t > 0) & (least > 0)
    assert np.all(hit.sum(axis=1) == 1)
    assert np.array_equal(surface.faces[hit.argmax(axis=1)], inside.corners)
    np.testing.assert_allclose(t[hit], inside.t, rtol=1e-15)
    signs = np.signbit(star.rays_from_inside(surface).directions[star.rays_from_inside(surface).directions == 0])
    assert signs.any() and not signs.all()


def test_rays_from_elsewhere_hit_and_miss() -> None:
    rays = star.rays_from_elsewhere(star.make_star(), 300)
    assert len(rays.t) > 200 and 0.2 < np.mean(np.isfinite(rays.t)) < 0.9
