"""Progress output of a render, for people and for programs."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.cli.goal import FrameSpeed, Goal, RenderSpeed, duration, time_left
from clrt.rendering.compile.records import PIXEL
from clrt.rendering.film.film import Film
from clrt.rendering.renderer import State

SCENE = "[render]\nsize = [16, 8]\nspp = 4\n[environment]\ncolor = [1, 1, 1]\n[[sphere]]\n"
STATE = {"phase", "spp", "seconds", "noise", "relmse", "samples_per_second", "seconds_left"}


def render(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    (folder / "scene.toml").write_text(SCENE)
    return subprocess.run(
        [sys.executable, "-P", "-m", "clrt", "render", "scene.toml", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=200,
    )


def state(spp: int, seconds: float, noise: float | None = None) -> State:
    """Return the state of a render of ten pixels."""
    pixels = np.zeros((2, 5), PIXEL)
    pixels["count"] = spp
    return State(spp, seconds, noise, None, Film(pixels))


def test_the_pace_is_that_of_late() -> None:
    """The rate is 100 per second at first, then 10; it follows the recent samples."""
    pace, samples = RenderSpeed(), 0.0
    for second in range(1, 101):
        samples += 100 if second <= 50 else 10
        pace.add(float(second), int(samples))
        assert pace.rate == pytest.approx(100 if second <= 50 else 10 if second >= 60 else pace.rate)
    assert 10 < 5500 / 100 < 100, "the mean since the start is neither"


def test_the_first_pace_is_the_mean_so_far() -> None:
    """The rate stays the same if the time has not advanced."""
    pace = RenderSpeed()
    pace.add(2.0, 400)
    assert pace.rate == 200
    pace.add(2.0, 400)
    assert pace.rate == 200


@pytest.mark.parametrize(
    ("goal", "left"),
    [
        (Goal(40, None, None), 15.0),  # ten pixels lack 30 samples each, at 20 per second
        (Goal(None, 5.0, None), 2.0),
        (Goal(40, 5.0, None), 2.0),
        (Goal(None, None, 0.1), 15.0),  # half the noise takes four times the samples
        (Goal(None, None, None), None),
    ],
)
def test_the_time_left(goal: Goal, left: float | None) -> None:
    assert time_left(state(10, 3.0, noise=0.2), goal, 20.0) == (None if left is None else pytest.approx(left))


def test_json_progress_is_a_line_an_object(tmp_path: Path) -> None:
    result = render(tmp_path, "--progress", "json")
    told: list[dict[str, Any]] = [json.loads(line) for line in result.stderr.splitlines()]
    phases = [each["phase"] for each in told]
    assert result.returncode == 0 and list(dict.fromkeys(phases)) == ["load", "build", "compile", "render", "write"]
    states = [each for each in told if "spp" in each]
    assert [each["device_bytes"] > 0 for each in told if "device" in each] == [True]
    assert [each["spp"] for each in states] == [1, 2, 4] and all(set(each) == STATE for each in states)
    assert all(each["samples_per_second"] > 0 and each["seconds_left"] >= 0 for each in states)


@pytest.mark.parametrize(
    ("options", "shown", "hidden"),
    [
        (["-q"], [], ["loading", "device 0"]),
        ([], ["loading the scene", "rendering", "4 spp", "writing"], ["device", "program of"]),
        (["-v"], ["device ", "chosen as", "program of"], ["its files"]),
        (["-vv"], ["device ", "its files: ", "integrator/path_segment.cl"], []),
    ],
)
def test_how_much_is_told(tmp_path: Path, options: list[str], shown: list[str], hidden: list[str]) -> None:
    result = render(tmp_path, "--progress", "plain", *options)
    assert (result.returncode, result.stdout) == (0, "scene.png\n"), result.stderr
    assert all(word in result.stderr for word in shown) and not any(word in result.stderr for word in hidden)


def test_percentages_are_rounded_down() -> None:
    """An unfinished render is never reported as 100 %."""
    assert Goal(1000, None, None).percent(state(999, 3.0)) == " 99 %  "
    assert Goal(None, None, 0.1).percent(state(10, 3.0, 0.1001)) == " 99 %  "
    assert Goal(1000, None, None).percent(state(1000, 3.0)) == "100 %  "


def test_frames_of_this_run_foretell_the_others() -> None:
    """Five frames are from an earlier run; those of this one take 2 s each."""
    speed = FrameSpeed()
    assert speed.left(100.0, 5, 20) is None
    for done in range(6, 21):
        assert speed.left(100.0 + 2 * (done - 5), done, 20) == pytest.approx(2 * (20 - done))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.4, "0 s"), (119, "119 s"), (120, "2 min"), (7100, "118 min"), (7200, "2.0 h"), (1e6, "277.8 h")],
)
def test_durations_are_short(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_frames_tell_the_time_left_for_all(tmp_path: Path) -> None:
    result = render(tmp_path, "--turntable", "3", "--progress", "json", "-o", "view_#.png")
    frames = [each for each in map(json.loads, result.stderr.splitlines()) if each["phase"] == "frame"]
    assert [each["done"] for each in frames] == [0, 1, 2] and frames[0]["seconds_left"] is None
    assert all(each["seconds_left"] > 0 for each in frames[1:])
    plain = render(tmp_path, "--turntable", "3", "--progress", "plain", "-o", "view_#.png", "--force")
    assert len(re.findall(r"^frame \d, [23] of 3, about \d+ s left for all$", plain.stderr, re.MULTILINE)) == 2
