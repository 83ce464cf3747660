"""Convergence: figures for known errors, cached references, and the command."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from math import nan
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import clrt
from clrt.bench.convergence.contestants import CHOICES, MORE_CHOICES, Picture, choices_on
from clrt.bench.convergence.converge import Effort, Point, figures, measure_convergence, take_turns
from clrt.bench.convergence.reference import FIRST_SEED, STEP_SPP, Reference, render_reference
from clrt.cli.bench_converge import NAMES, converge_command
from clrt.device.cache_files import REFERENCES
from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.output.images import read_image
from clrt.rendering.renderer import Renderer
from clrt.scene.model import Camera, Scene

from .known import EXACT, MEANS, TRUTH, sampler

SCENE = """
[camera]
position = [0, 1, 6]
[render]
size = [24, 16]
max_depth = 4
[environment]
color = [0.3, 0.3, 0.4]
[materials]
white = { type = "diffuse" }
lamp = { type = "diffuse", emission = [9, 6, 3] }
[[mesh]]
vertices = [[-4, -1, -4], [-4, -1, 4], [4, -1, 4], [4, -1, -4]]
faces = [[0, 1, 2], [0, 2, 3]]
material = "white"
[[sphere]]
center = [0.5, 0, 0]
material = "white"
[[sphere]]
center = [-2, 5, 2]
material = "lamp"
"""


def test_figures_are_those_of_known_errors() -> None:
    """relMSE = variance/n · mean(1/(r² + 0.01)); with 9216 values its standard deviation is 1.5 %."""
    contestants = {"first": sampler(0.5, 0.01), "twice as slow": sampler(0.5, 0.02), "steep": sampler(0.5, 0.02, 1.5)}
    points = take_turns(contestants, EXACT, Effort(seconds=0.7, seeds=5, steps=2))
    rows = figures(points, EXACT)
    assert rows["first"]["spp"] == [1, 2, 4, 8, 16, 32, 64], "128 samples would take longer than 0.7 s"
    assert rows["steep"]["spp"] == rows["twice as slow"]["spp"] == [1, 2, 4, 8, 16, 32]
    one = 0.5 * float(np.mean(1 / (TRUTH**2 + 0.01)))
    assert rows["first"]["relmse"] == pytest.approx([one / spp for spp in rows["first"]["spp"]], rel=0.05)
    assert [row["slope"] for row in rows.values()] == pytest.approx([-1, -1, -1.5], abs=0.02)
    assert [row["ratio"] for row in rows.values()] == pytest.approx([1, 2, 2 / 32**0.5], rel=0.05)
    assert [row["cpu_ratio"] for row in rows.values()] == [row["ratio"] for row in rows.values()]
    for row in rows.values():
        assert row["msamples"] == pytest.approx(1e-6 * 64 * 48 / row["seconds"][0])
        assert row["relmse_seconds"] == row["relmse"][-1] * row["seconds"][-1] == row["relmse_cpu_seconds"] / 2
        assert row["mean_ratio"] == pytest.approx([1, 1, 1], abs=1e-2) and row["agrees"]


def test_relmse_against_a_reference_with_noise_of_its_own() -> None:
    """16 steps of variance 1: the reference's error estimate, 1/16 · mean(1/(r² + 0.01)), is subtracted."""
    rng = np.random.default_rng(7)
    steps = [TRUTH + rng.normal(size=TRUTH.shape) for _ in range(16)]
    reference = Reference(np.zeros((0, 3)), np.zeros_like(TRUTH), np.zeros_like(TRUTH))
    for step in steps:
        reference = reference.plus(step)
    scale = float(np.mean(1 / (np.mean(steps, 0) ** 2 + 0.01)))
    assert (reference.steps, reference.spp) == (16, 16 * STEP_SPP)
    np.testing.assert_allclose(reference.pixels, np.mean(steps, 0), rtol=1e-6)
    np.testing.assert_allclose(reference.means, np.mean(steps, (1, 2)), rtol=1e-12)
    assert reference.relmse == pytest.approx(scale / 16, rel=0.03)
    row = figures(take_turns({"one": sampler(0.25, 0.4)}, reference, Effort(1, 5, 2)), reference)["one"]
    assert row["relmse"] == pytest.approx([0.25 * scale, 0.125 * scale], rel=0.05), "not 0.3125 and 0.1875"


def test_figures_end_where_errors_no_longer_stand_out() -> None:
    """Figures include only errors above the reference's own, and sample counts that every seed has reached."""
    reference = Reference(MEANS, 2 * TRUTH, 2 * TRUTH**2 + 1e-3 * (TRUTH**2 + 0.01))
    own = reference.relmse
    assert own == pytest.approx(5e-4)

    def levels(*errors: float) -> dict[int, list[Point]]:
        return {2**k: [Point(2**k, 2.0**k, 2.0**k, own + error, [1.006, 1, nan])] * 3 for k, error in enumerate(errors)}

    rows = figures({"a": levels(0.4, 0.2, 0.1, 1e-5), "b": levels(0.4, 0.1), "c": levels(1e-6)}, reference)
    assert [row["last"] for row in rows.values()] == [2, 1, 0] and not any(row["agrees"] for row in rows.values())
    assert [row["slope"] for row in rows.values()] == pytest.approx([-1, -2, nan], nan_ok=True)
    assert [row["ratio"] for row in rows.values()] == pytest.approx([1, 0.5, 1e-6 / 0.4])
    assert rows["a"]["mean_ratio"] == pytest.approx([1.006, 1, nan], nan_ok=True)

    def slower(spp: int, seed: int) -> Picture:
        return Picture(spp, spp * (0.1 if seed else 0.01), 1.0, TRUTH.astype(np.float32))

    assert list(take_turns({"slower": slower}, EXACT, Effort(1, 2, 2))["slower"]) == [1, 2, 4, 8]


def test_other_scenes_are_noticed() -> None:
    points = take_turns({"same": sampler(0.01, 0.1), "brighter": sampler(0.01, 0.1, gain=1.02)}, EXACT, Effort(1, 3, 2))
    rows = figures(points, EXACT)
    assert rows["same"]["agrees"] and not rows["brighter"]["agrees"]
    assert rows["brighter"]["mean_ratio"] == pytest.approx([1.02] * 3, abs=1e-3)


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Return a sphere on a floor under an emissive sphere out of view."""
    (tmp_path / "ball.toml").write_text(SCENE)
    return load(tmp_path / "ball.toml")


def rendered(scene: Scene, steps: int, device: Device) -> tuple[Reference, list[int]]:
    """Return the reference, and which of its steps were rendered for it."""
    heard: list[int] = []
    return render_reference(scene, steps, device=device.info.index, on_step=heard.append), heard


def test_references_are_kept_and_go_on(
    scene: Scene, device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    two, first = rendered(scene, 2, device)
    again, second = rendered(scene, 2, device)
    three, third = rendered(scene, 3, device)
    assert (first, second, third, three.steps) == ([0, 1], [], [2], 3)
    np.testing.assert_array_equal(again.pixels, two.pixels)
    pictures = [Renderer(scene, spp=STEP_SPP, seed=FIRST_SEED - step, device=device.info.index) for step in range(3)]
    means = [list(renderer.passes(spp=STEP_SPP))[-1].film.mean for renderer in pictures]
    np.testing.assert_allclose(three.pixels, np.mean(means, 0), rtol=1e-6)
    assert rendered(scene, 2, device)[0].steps == 3, "what is there already is not thrown away"
    for other in (
        replace(scene, render=replace(scene.render, max_depth=3)),
        replace(scene, camera=Camera()),
        replace(scene, spheres=[replace(scene.spheres[0], radius=0.9), scene.spheres[1]]),
    ):
        assert rendered(other, 2, device)[1] == [0, 1]


@pytest.mark.parametrize("damage", ["cut", "changed", "empty", "others"])
def test_damaged_references_are_rendered_anew(
    damage: str, scene: Scene, device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    whole, _ = rendered(scene, 2, device)
    (file,) = tmp_path.glob(REFERENCES)
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes({"cut": content[: len(content) // 2], "changed": content}.get(damage, b""))
    if damage == "others":
        np.savez(file, means=np.zeros((9, 3)), total=np.zeros((2, 2, 3)), squares=np.zeros((2, 2, 3)))
    anew, heard = rendered(scene, 2, device)
    assert heard == [0, 1]
    np.testing.assert_array_equal(anew.pixels, whole.pixels)


def test_renderers_choices_are_taken(scene: Scene, device: Device) -> None:
    """Eight lanes and one give the same numbers; another sampler gives other numbers with the same mean."""
    assert {"clrt", "clrt, independent", "clrt, lanes 1"} <= set(CHOICES) and next(iter(CHOICES)) == "clrt"
    contestants = choices_on(scene, [device.info.index])
    assert list(choices_on(scene, [0, 1], {"x": {}})) == ["x (device 0)", "x (device 1)"]
    pictures = {name: render(64, 7) for name, render in contestants.items()}
    for name in ("clrt, lanes 1", "clrt, bvh2"):
        assert np.median(pictures[name].pixels / pictures["clrt"].pixels) == pytest.approx(1, rel=1e-5)
    for name in ("clrt, independent", "clrt, stratified"):
        assert np.mean(pictures[name].pixels != pictures["clrt"].pixels) > 0.5
        assert pictures[name].pixels.mean() == pytest.approx(pictures["clrt"].pixels.mean(), rel=0.1)
    assert min(min(picture.seconds, picture.cpu_seconds) for picture in pictures.values()) > 0


def test_independent_samples_of_a_real_scene_have_slope_minus_one(scene: Scene, device: Device) -> None:
    (result,) = measure_convergence(
        [scene],
        [device.info.index],
        Effort(seconds=0.2, seeds=4, steps=4),
        choices={"independent": {"sampler": "independent"}},
    )
    row = result["contestants"]["independent"]
    assert (result["scene"], result["size"], result["max_depth"]) == ("ball", (24, 16), 4)
    assert result["reference"]["spp"] == 4 * STEP_SPP and len(row["spp"]) > 3
    assert row["slope"] == pytest.approx(-1, abs=0.15) and row["agrees"]


def test_command_prints_draws_and_stores_figures(tmp_path: Path) -> None:
    (tmp_path / "ball.toml").write_text(SCENE.replace("24, 16", "20, 16"))
    program = """
import sys
sys.modules.update({"mitsuba": None, "bpy": None})
from clrt.cli import main
main(["bench", "converge", "ball.toml", "--quick", "--time", "0.004", "--peers", "--json", "c.json", "--plot", "c.png"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    written = json.loads((tmp_path / "c.json").read_text())
    (scene,) = written["scenes"]
    assert list(written) == ["quick", "scenes", "calibration"] and set(written["calibration"]) <= set(CHOICES)
    assert {"scene", "size", "max_depth", "reference", "contestants", "missing"} == set(scene)
    assert scene["missing"] == {name: f"not installed (pip install {name})" for name in ("mitsuba", "bpy")}
    assert all(f"{package}: {why}" in done.stdout for package, why in scene["missing"].items())
    assert "ball: without mitsuba: not installed" in done.stderr
    assert list(scene["contestants"]) == list(CHOICES)
    for name, row in scene["contestants"].items():
        assert {
            "spp",
            "seconds",
            "cpu_seconds",
            "relmse",
            "last",
            "msamples",
            "relmse_seconds",
            "relmse_cpu_seconds",
            "ratio",
            "cpu_ratio",
            "slope",
            "mean_ratio",
            "agrees",
            "noise_ratio",
            "z",
            "p",
            "biased",
            "relmse_range",
        } == set(row)
        assert all(low <= mean <= high for mean, (low, high) in zip(row["relmse"], row["relmse_range"]))
        assert len(row["spp"]) == len(row["seconds"]) == len(row["relmse"]) == len(row["noise_ratio"])
        assert any(line.startswith(f"  {name}  ") for line in done.stdout.splitlines())
    assert scene["contestants"]["clrt"]["ratio"] == 1
    assert done.stdout.splitlines()[-2:] == ["c.json", "c.png"] and read_image(tmp_path / "c.png").std() > 0.05
    assert "ball: step 1 of 2 of its reference" in done.stderr and "step" not in done.stdout


def test_command_does_what_is_asked(tmp_path: Path) -> None:
    """Sample counts, seeds, size, choices and reference are used; independent samples have the estimated errors, once
    there are enough to estimate how fast these fall."""
    (tmp_path / "ball.toml").write_text(SCENE)
    asked = [
        "--choice",
        "independent",
        "--choice",
        "unplanned",
        "--spp",
        "32",
        "--spp",
        "3",
        "--seeds",
        "4",
        "--size",
        "32x16",
        "--reference-spp",
        "2000",
        "--quick",
        "--json",
        str(tmp_path / "c.json"),
    ]
    done = CliRunner().invoke(converge_command, [str(tmp_path / "ball.toml"), *asked])
    assert done.exit_code == 0, done.output
    written = json.loads((tmp_path / "c.json").read_text())
    (scene,) = written["scenes"]
    assert scene["size"] == [32, 16] and scene["reference"]["spp"] == 2000
    rows = scene["contestants"]
    assert list(rows) == list(written["calibration"]) == ["clrt, independent", "clrt, unplanned"]
    for name, row in rows.items():
        assert row["spp"] == [3, 32] and [len(ratios) for ratios in row["noise_ratio"]] == [4, 4]
        assert written["calibration"][name]["pictures"] == 8 and not row["biased"]
        assert written["calibration"][name]["median"] == pytest.approx(median(sum(row["noise_ratio"], [])))
    assert median(rows["clrt, independent"]["noise_ratio"][1]) == pytest.approx(1, abs=0.15)
    assert "3: " in done.output and "images  to 1.2x   median    worst" in done.output


def test_each_integrator_has_a_reference_of_its_own(tmp_path: Path) -> None:
    """Path depths differ, so the images differ, and each agrees with its own reference."""
    (tmp_path / "ball.toml").write_text(SCENE)
    asked = [
        "--integrator",
        "path",
        "--integrator",
        "direct",
        "--choice",
        "clrt",
        "--spp",
        "64",
        "--seeds",
        "3",
        "--reference-spp",
        "512",
        "--quick",
        "--json",
        str(tmp_path / "c.json"),
        "--plot",
        str(tmp_path / "c.svg"),
    ]
    done = CliRunner().invoke(converge_command, [str(tmp_path / "ball.toml"), *asked])
    assert done.exit_code == 0, done.output
    scenes = json.loads((tmp_path / "c.json").read_text())["scenes"]
    assert [scene["scene"] for scene in scenes] == ["ball, path", "ball, direct"]
    assert all(scene["contestants"]["clrt"]["mean_ratio"] == pytest.approx([1, 1, 1], abs=0.02) for scene in scenes)
    assert (tmp_path / "c.svg").read_text().count("<svg") == 1


def test_a_given_reference_is_used(tmp_path: Path) -> None:
    """Errors are those of the same seeds' images relative to the file; nothing else is rendered."""
    (tmp_path / "ball.toml").write_text(SCENE)
    truth = np.random.default_rng(5).uniform(0.2, 1, (16, 24, 3)).astype(np.float32)
    clrt.Image(truth).save(tmp_path / "ref.exr")
    asked = [
        "--choice",
        "clrt",
        "--spp",
        "4",
        "--seeds",
        "2",
        "--json",
        str(tmp_path / "c.json"),
        "--plot",
        str(tmp_path / "c.svg"),
        "--reference",
        str(tmp_path / "ref.exr"),
    ]
    done = CliRunner().invoke(converge_command, [str(tmp_path / "ball.toml"), *asked])
    assert done.exit_code == 0, done.output
    assert "reference given" in done.output and "step" not in done.output
    row = json.loads((tmp_path / "c.json").read_text())["scenes"][0]["contestants"]["clrt"]
    pictures = [clrt.render(tmp_path / "ball.toml", spp=4, seed=seed).pixels for seed in (0, 1)]
    errors = [
        float(np.mean((picture - truth.astype(np.float64)) ** 2 / (truth.astype(np.float64) ** 2 + 0.01)))
        for picture in pictures
    ]
    assert row["relmse"] == [pytest.approx(np.mean(errors), rel=1e-5)]
    for wrong, words in [(["--size", "8x8"], "is 24x16, the image 8x8"), (["--reference-spp", "9"], "leave out")]:
        failed = CliRunner().invoke(converge_command, [str(tmp_path / "ball.toml"), *asked, *wrong])
        assert isinstance(failed.exception, clrt.UsageError) and words in str(failed.exception)


def test_command_knows_all_choices() -> None:
    assert [f"clrt, {name}".removesuffix(", clrt") for name in NAMES] == [*CHOICES, *MORE_CHOICES]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["no.toml"], 3, "no.toml"),
        (["no.toml", "--plot", "a/b.png"], 6, "a/b.png"),
        ([], 2, "SCENE"),
        (["no.toml", "--device", "nonesuch"], 4, "nonesuch"),
        (["no.toml", "--time", "0"], 2, "--time"),
        (["no.toml", "--choice", "lanes"], 2, "'lanes 1'"),
    ],
)
def test_mistakes_end_in_one_message(arguments: list[str], code: int, words: str, tmp_path: Path) -> None:
    done: Any = subprocess.run(
        [sys.executable, "-m", "clrt", "bench", "converge", *arguments], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == code and words in done.stderr and "Traceback" not in done.stderr
