"""Damaged files of every format load or raise a clear error; `python -m tests.fuzz` runs any number of them."""

from __future__ import annotations

from pathlib import Path

from ..fuzz import FORMATS, GOOD, case, outcome, run, seeds_in
from ..fuzz_seeds import write_seeds


def test_damaged_files(tmp_path: Path) -> None:
    """Several hundred cases in a process with limited memory; for each format some still load and some do not."""
    write_seeds(tmp_path / "seeds")
    told: list[str] = []
    results = run(700, tmp_path, told=told.append)
    assert not told
    assert set(results) == set(FORMATS)
    for counts in results.values():
        assert set(counts) == set(GOOD)
    assert sum(count.total() for count in results.values()) == 700


def test_what_is_damaged_is_good_before(tmp_path: Path) -> None:
    """The undamaged seed files render, and cases are the same in every run."""
    write_seeds(tmp_path / "seeds")
    seeds = seeds_in(tmp_path / "seeds")
    assert [outcome(seed, render=False) for seed in seeds] == ["picture"] * len(seeds)
    assert case(seeds, 77) == case(seeds, 77)
