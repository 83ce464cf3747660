"""Hard cases of light sampling and samplers that users can run."""

from __future__ import annotations

import pytest

from clrt.bench.numerics import samplers
from clrt.bench.numerics.row import Row
from clrt.device.open import Device


@pytest.fixture(scope="module")
def rows(device: Device) -> list[Row]:
    """Return the quick cases with still fewer materials; rendering/test_bsdf.py covers all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(samplers, "QUICK", samplers.QUICK._replace(step=31))
        return list(samplers.measure_samplers(device, quick=True))


def test_nothing_is_wrong(rows: list[Row]) -> None:
    assert {row.case for row in rows} == {"L1", "L2", "L6", "L7", "L8"}
    assert not [row for row in rows if row.wrong]


def test_every_row_counts_something(rows: list[Row]) -> None:
    assert len({(row.case, row.what) for row in rows}) == len(rows) > 15
    assert all(row.count > 0 and (row.figure is None) == (row.unit == "") for row in rows)
