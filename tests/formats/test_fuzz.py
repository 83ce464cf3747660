"""Damaged files of every format load or raise a clear error; `python -m tests.fuzz` runs any number of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..covering import others
from ..fuzz import FORMATS, GOOD, case, outcome, run, seeds_in
from ..fuzz_seeds import write_seeds

#: Formats of which few damaged files load: compressed ones, and scenes, whose every value is checked.
RARE = {".3mf", ".exr", ".png", ".serialized", ".toml", ".usdc", ".usdz"}


@pytest.mark.parametrize("count", [300, *others(900)])
def test_damaged_files(tmp_path: Path, count: int) -> None:
    """Several hundred cases in a process with limited memory; some of each format do not load, and some of each do,
    except perhaps of RARE."""
    write_seeds(tmp_path / "seeds")
    told: list[str] = []
    results = run(count, tmp_path, told=told.append)
    assert not told
    assert set(results) == set(FORMATS)
    assert all(counts["error"] and set(counts) <= set(GOOD) for counts in results.values())
    assert {name for name, counts in results.items() if not counts["picture"]} <= RARE
    assert sum(counts.total() for counts in results.values()) == count


def test_what_is_damaged_is_good_before(tmp_path: Path) -> None:
    """The undamaged seed files render, and cases are the same in every run."""
    write_seeds(tmp_path / "seeds")
    seeds = seeds_in(tmp_path / "seeds")
    assert [outcome(seed, render=False) for seed in seeds] == ["picture"] * len(seeds)
    assert case(seeds, 77) == case(seeds, 77)
