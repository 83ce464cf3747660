"""Tuning of a device: the trial survives crashes and hangs, and its result is kept, checked and used."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from clrt.accel.methods import LayoutName
from clrt.bench.tuning import candidates as candidate_module, trial, tune as tune_module
from clrt.bench.tuning.candidates import candidates
from clrt.bench.tuning.trial_scenes import trial_scenes
from clrt.bench.tuning.tune import Trial, tune
from clrt.cli import first_use
from clrt.device.device_info import TunedLayout, Tuning
from clrt.device.discovery.discover import find_devices
from clrt.device.discovery.tunings import keep_tuning, kept_tuning
from clrt.device.open import Device, open_device
from clrt.errors import DeviceError
from clrt.rendering.compile.choices import Choices
from clrt.rendering.renderer import Renderer

from ..c_library import compile_library

FAULTY = Path(__file__).parents[1] / "device" / "faulty.c"
ONE, OTHER, THIRD = Tuning("waves", "bvh8", 1), Tuning("lanes", "bvh8", 1), Tuning("lanes", "bvh2", 1)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path / "cache"))


def test_the_best_of_a_trial() -> None:
    """By geometric means 2, 1.5 and 1.47: the fastest counts, unless it is hardly faster than the first."""
    seconds = {ONE: {"a": 1.0, "b": 4.0}, OTHER: {"a": 1.5, "b": 1.5}, THIRD: {"a": 0.98, "b": 2.205}}
    assert Trial(seconds, {}).best == THIRD
    assert Trial({ONE: seconds[OTHER], THIRD: seconds[THIRD]}, {}).best == ONE


@pytest.mark.parametrize(
    "entry", ["", "[", "{}", {"paths": 1}, {"group_size": 0}, {"group_size": 1 << 20}, {"layout": "list"}, {"x": 1}]
)
def test_wrong_entries_count_as_none(device: Device, tmp_path: Path, entry: str | dict[str, object]) -> None:
    assert kept_tuning(device.info) is None and keep_tuning(device.info, ONE) and kept_tuning(device.info) == ONE
    assert kept_tuning(replace(device.info, driver="another")) is None
    (file,) = (tmp_path / "cache").glob("*.tuning.json")
    kept = json.loads(file.read_text())
    file.write_text(json.dumps({**kept, "result": kept["result"] | entry}) if isinstance(entry, dict) else entry)
    assert kept_tuning(device.info) is None


def test_layouts_exist() -> None:
    assert set(get_args(TunedLayout)) <= set(get_args(LayoutName))


def test_a_tuning_for_another_width_is_not_used(device: Device) -> None:
    wrong = "queues" if device.lanes > 1 else "waves"
    tuned = replace(device, info=replace(device.info, tuning=Tuning(wrong, "cwbvh", 64)))  # type: ignore[arg-type]
    found = Renderer(trial_scenes(8)["room"], device=tuned, spp=1).compiled
    assert found.choices.paths == Choices().on(device).paths and found.choices.lanes == device.lanes


@pytest.mark.programs
def test_a_tuning_is_kept_and_used(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first use of a device of a tuned type finds its tuning, later ones take it."""
    monkeypatch.setattr(first_use, "TUNED", (device.info.type,))
    (tuned,) = first_use.tuned([device])
    assert tuned.info.tuning in candidates(device)
    monkeypatch.setattr(tune_module, "TRIAL", "nonesuch")
    assert first_use.tuned([open_device(device.info.id)])[0].info.tuning == tuned.info.tuning
    last = candidates(device)[-1]
    keep_tuning(device.info, last)
    running = Renderer(trial_scenes(16)["room"], device=device.info.id, spp=1)
    assert (running.choices.on(running.device).paths, running.device.layout) == (last.paths, last.layout)
    assert next(info for info, _ in find_devices() if info.id == device.info.id).tuning == last


@pytest.mark.programs
@pytest.mark.needs("gcc")
@pytest.mark.parametrize("kind", ["crashes", "hangs"])
def test_a_trial_survives_its_driver(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """A driver that fails after some launches in every process: candidates before it count, the others fail."""
    library = compile_library(FAULTY, tmp_path / "libfaulty.so", "-ldl")
    first = tune(device, 100.0).seconds  # compiles
    for name, value in {"LD_PRELOAD": str(library), "FAULT": kind, "FAULT_QUEUE": "0"}.items():
        monkeypatch.setenv(name, value)
    for after in (150, 250, 400, 700):  # enough for the first candidate, not for all: that depends on the machine
        monkeypatch.setenv("FAULT_AFTER", str(after))
        told: list[str] = []
        try:
            found = tune(device, 24.0, told.append)
            break
        except DeviceError as error:
            assert "cannot be tuned" in str(error) and len(told) == len(first)
    assert found.seconds and found.failures and set(found.seconds) | set(found.failures) == set(first)
    assert len(told) == len(found.failures)
    assert all(("signal 6" if kind == "crashes" else "did not finish") in each for each in found.failures.values())


def test_a_device_without_results(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune_module, "TRIAL", "nonesuch")
    with pytest.raises(DeviceError, match="cannot be tuned: the process exited with code 1.*nonesuch"):
        tune(device, 30.0)


def test_candidates_begin_with_the_default(device: Device) -> None:
    first = candidates(device)[0]
    assert (first.layout, first.group_size) == (device.layout, device.group_size)
    assert len(set(candidates(device))) == len(candidates(device))
    assert candidate_module.GROUP_SIZES[0] == 128 and trial.TURNS > 1
