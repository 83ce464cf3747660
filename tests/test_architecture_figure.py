"""docs/images/architecture.svg shows the packages as they are."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from .test_package_structure import ROOMS

HOUSE = Path(__file__).parents[1]
SCRIPT = runpy.run_path(str(HOUSE / "docs" / "make_architecture.py"))


def test_the_figure_is_up_to_date() -> None:
    assert SCRIPT["FILE"].read_text(encoding="utf-8") == SCRIPT["drawn"](), "run docs/make_architecture.py"


@pytest.mark.parametrize("rooms", [[*ROOMS, "new"], ROOMS[:-1], ["cli", *(room for room in ROOMS if room != "cli")]])
def test_other_packages_are_noticed(rooms: list[str]) -> None:
    with pytest.raises(ValueError, match="change ROWS"):
        SCRIPT["drawn"](rooms)
