"""The command line end to end: files, output and exit codes."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from clrt.cli import main
from clrt.device.launches.hang_watchdog import VARIABLE
from clrt.output.images import read_image

from ..covering import others

SCENE = """
[camera]
position = [0, 0, 5]
[render]
size = [24, 16]
spp = 4
[environment]
color = [0.5, 0.6, 0.7]
[materials.red]
type = "diffuse"
color = [0.8, 0.1, 0.1]
[[sphere]]
radius = 1
material = "red"
"""
REPORT_FIELDS = {
    "scene",
    "device",
    "platform",
    "driver",
    "version",
    "width",
    "height",
    "spp",
    "integrator",
    "max_depth",
    "seed",
    "seconds",
    "samples",
    "samples_per_second",
    "rays",
    "rays_per_second",
    "stop_reason",
    "noise",
    "nonfinite_samples",
    "bvh",
    "kernel",
    "peak_device_bytes",
    "history",
    "total_seconds",
}
BVH_FIELDS = {"triangles", "spheres", "instances", "nodes", "bytes", "build_seconds", "sah_cost", "layout"}


def clrt(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "clrt", *map(str, arguments)], cwd=cwd, capture_output=True, text=True)


def called(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Return what `clrt` says and returns, without a process of its own, whose start takes longer than a mistake, and
    without the watchdog, which would fork this one."""
    said, told = io.BytesIO(), io.BytesIO()
    outputs = [io.TextIOWrapper(each, "utf-8", write_through=True) for each in (said, told)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(outputs[0]), redirect_stderr(outputs[1]):
        patch.setenv(VARIABLE, "0")
        patch.chdir(cwd)
        with pytest.raises(SystemExit) as ended:
            main([*map(str, arguments)])
    assert isinstance(ended.value.code, int)
    return subprocess.CompletedProcess("clrt", ended.value.code, said.getvalue().decode(), told.getvalue().decode())


Run = Callable[..., subprocess.CompletedProcess[str]]
RUNS = [called, *others(clrt)]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "ball.toml"
    path.write_text(SCENE)
    return path


def test_render_writes_pictures_and_report(scene: Path) -> None:
    result = clrt("render", scene, "-o", "a.exr", "-o", "a.png", "-o", "a.hdr", "--report", "r.json", cwd=scene.parent)
    assert (result.returncode, result.stdout.split()) == (0, ["a.exr", "a.png", "a.hdr", "r.json"]), result.stderr
    pixels = read_image(scene.parent / "a.exr")
    assert pixels.shape == (16, 24, 3)
    assert pixels[0, 0] == pytest.approx([0.5, 0.6, 0.7], rel=1e-6), "the sky fills the corner"
    report = json.loads((scene.parent / "r.json").read_text())
    assert REPORT_FIELDS <= set(report) and BVH_FIELDS <= set(report["bvh"])
    assert (report["spp"], report["samples"], report["stop_reason"]) == (4, 24 * 16 * 4, "spp")
    assert [entry["spp"] for entry in report["history"]] == [1, 2, 4]
    assert {"build_seconds", "cached", "features"} <= set(report["kernel"])


def test_default_output_is_named_after_the_scene(scene: Path) -> None:
    result = clrt("render", scene, "-q", cwd=scene.parent)
    assert (result.returncode, result.stdout, result.stderr) == (0, "ball.png\n", "")
    assert read_image(scene.parent / "ball.png").shape == (16, 24, 3)


def test_command_line_overrides_the_scene_and_measures_against_a_reference(scene: Path) -> None:
    options = ("--size", "8x8", "--seed", "7", "--depth", "2")
    assert clrt("render", scene, *options, "--spp", "512", "-o", "ref.exr", cwd=scene.parent).returncode == 0
    result = clrt(
        "render",
        scene,
        *options,
        "--spp",
        "8",
        "--reference",
        "ref.exr",
        "--report",
        "r.json",
        "--progress",
        "json",
        cwd=scene.parent,
    )
    report = json.loads((scene.parent / "r.json").read_text())
    assert (report["width"], report["height"], report["seed"], report["max_depth"]) == (8, 8, 7, 2)
    assert all(entry["relmse"] >= 0 for entry in report["history"])
    assert report["history"][-1]["relmse"] < report["history"][0]["relmse"]
    phases = [json.loads(line)["phase"] for line in result.stderr.splitlines()]
    assert list(dict.fromkeys(phases)) == ["load", "build", "compile", "render", "write"]


def test_warnings_are_json_where_progress_is(scene: Path) -> None:
    scene.write_text(SCENE.replace("color = [0.5, 0.6, 0.7]", "color = [0, 0, 0]"))
    result = clrt("render", scene, "--progress", "json", cwd=scene.parent)
    lines = [json.loads(line) for line in result.stderr.splitlines()]
    assert all("phase" in line for line in lines)
    assert [line["warning"] for line in lines if "warning" in line] == [
        "ball: the image is black: nothing in this scene emits light"
    ]


def test_time_and_error_end_a_render(scene: Path) -> None:
    clrt("render", scene, "--time", "0.3", "--report", "t.json", cwd=scene.parent)
    clrt("render", scene, "--error", "0.01", "--report", "e.json", cwd=scene.parent)
    timed, measured = (json.loads((scene.parent / name).read_text()) for name in ("t.json", "e.json"))
    assert timed["stop_reason"] == "time" and timed["seconds"] >= 0.3 and timed["spp"] > 4
    assert measured["stop_reason"] == "error" and measured["noise"] <= 0.01


def test_interrupt_keeps_the_picture(scene: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "clrt",
        "render",
        str(scene),
        "--time",
        "600",
        "-o",
        "i.exr",
        "--report",
        "i.json",
        "--progress",
        "json",
    ]
    process = subprocess.Popen(command, cwd=scene.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    while '"spp"' not in process.stderr.readline():
        assert process.poll() is None, "ended before it was interrupted"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130
    assert json.loads((scene.parent / "i.json").read_text())["stop_reason"] == "interrupted"
    assert read_image(scene.parent / "i.exr")[0, 0] == pytest.approx([0.5, 0.6, 0.7], rel=1e-6)


def test_caches_that_cannot_be_written_cost_nothing_but_time(scene: Path) -> None:
    """PoCL hides its device without a cache folder; here the home is a file, so that the test also works as root."""
    (scene.parent / "home").write_text("")
    environment = {key: value for key, value in os.environ.items() if key not in ("XDG_CACHE_HOME", "POCL_CACHE_DIR")}
    result = subprocess.run(
        [sys.executable, "-m", "clrt", "render", str(scene), "-q"],
        cwd=scene.parent,
        text=True,
        capture_output=True,
        env={**environment, "HOME": str(scene.parent / "home")},
    )
    assert (result.returncode, result.stdout) == (0, "ball.png\n"), result.stderr


def test_six_mistakes_are_six_messages(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("""
[camera]
position = [0, 0, 0]
look_at = [0, 0, 0]
fov_degrees = 400
[render]
sise = [64, 64]
[materials.white]
type = "difuse"
[[sphere]]
radius = -1
material = "whit"
[[mesh]]
file = "nowhere.ply"
""")
    result = clrt("render", "bad.toml", cwd=tmp_path)
    assert result.returncode == 3 and result.stdout == ""
    errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    for word in ("look_at", "fov_degrees", "sise", "difuse", "radius", "whit", "nowhere.ply"):
        assert any(word in line for line in errors), f"{word} is not named in:\n{result.stderr}"
    assert "did you mean" in result.stderr and "Traceback" not in result.stderr
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("render", "missing.toml"), 3, ["missing.toml"]),
        (("render", "loop.toml"), 3, ["loop.toml: no such scene file"]),
        (("render", "x.png"), 3, ["x.png: a scene must be one of .toml"]),
        (("render", "."), 3, [".: is a folder, not a scene"]),
        (("convert", "nope.obj", "z.toml"), 3, ["nope.obj: no such model file"]),
        (("render", "ball.toml", "--reference", "ball.toml"), 3, ["ball.toml: cannot be decoded as an image"]),
        (("render", "ball.toml", "-o", "no/such/folder/x.png"), 6, ["no/such/folder"]),
        (("render", "ball.toml", "-o", "x.pgn"), 6, [".pgn", "did you mean", ".png"]),
        (("render", "ball.toml", "--device", "nonesuch"), 4, ["nonesuch"]),
        (("render", "ball.toml", "--size", "0x4"), 2, ["0x4"]),
        (("render", "ball.toml", "--view", "srbg"), 2, ["srbg"]),
        (("render", "ball.toml", "-q", "--view", "ocio:Nope"), 2, ["view 'Nope' is unknown"]),
        (("render", "ball.toml", "--exposure", "nan"), 2, ["exposure is nan", "finite"]),
        (("render", "ball.toml", "--spp", "0"), 2, ["--spp"]),
        (("render", "ball.toml", "--time", "-1"), 2, ["time", "-1"]),
        (("render", "ball.toml", "--time", "inf"), 2, ["time is inf; it must be above 0 and finite"]),
        (("render", "ball.toml", "-o", "r.exr", "--reference", "r.exr"), 2, ["r.exr", "reference"]),
        (("render", "ball.toml", "--size", "60000x60000"), 4, ["60000x60000", "GiB", "--size"]),
        (("compare", "ball.toml", "ball.toml"), 3, ["ball.toml"]),
        (("rendr", "ball.toml"), 2, ['command "rendr" is unknown; did you mean "render"?']),
        (("bench", "raiz"), 2, ['command "raiz" is unknown; write one of agree,']),
    ],
)
def test_mistakes_end_in_one_message(
    scene: Path, run: Run, arguments: tuple[str, ...], code: int, words: list[str]
) -> None:
    scene.with_name("loop.toml").symlink_to("loop.toml")
    scene.with_name("x.png").touch()
    result = run(*arguments, cwd=scene.parent)
    assert result.returncode == code and result.stdout == ""
    assert "Traceback" not in result.stderr and all(word in result.stderr for word in words), result.stderr
    assert "leaked" not in result.stderr  # OpenImageIO reports objects leaked at exit


def test_print_kernel_prints_what_the_scene_needs(scene: Path) -> None:
    source = clrt("render", scene, "--print-kernel", cwd=scene.parent).stdout
    assert "closest_hit(" in source and "diffuse_eval" in source and "intersect_lone_spheres" in source
    assert "mirror_eval" not in source and "intersect_triangles(const" not in source and "sky_texels" not in source


def test_info_lists_what_is_compiled_and_uploaded(scene: Path) -> None:
    info = json.loads(clrt("info", scene, "--json", cwd=scene.parent).stdout)
    assert info["spheres"] == 1 and info["triangles"] == 0 and info["materials"] == {"diffuse": 1}
    assert "MATERIAL_DIFFUSE" in info["features"] and "bsdf/diffuse.cl" in info["files"]
    assert sum(info["buffers"].values()) == info["bytes"]
    assert info["buffers"]["film"] == 64 * 24 * 16


def test_info_lists_materials_and_presets(scene: Path) -> None:
    found = json.loads(clrt("info", "--materials", "--json", cwd=scene.parent).stdout)
    types = {kind["type"]: {field["name"]: field for field in kind["fields"]} for kind in found["types"]}
    assert types["dielectric"]["ior"] == {"name": "ior", "values": "a number 0.25 to 4", "default": 1.5}
    assert types["diffuse"]["color"]["values"] == "3 numbers, each 0 to 1 or a texture"
    assert found["presets"]["metallic_roughness"]["ruby"]["f0"] == [0.08] * 3
    assert found["presets"]["conductor"]["gold"]["eta"] == [0.223, 0.428, 1.335]
    text = clrt("info", "--materials", cwd=scene.parent).stdout
    assert all(name in text for name in [*types, "chromium", "emission", "height_correlated"])
    assert clrt("info", cwd=scene.parent).returncode == 2


def test_devices_lists_the_one_in_use(scene: Path) -> None:
    devices = json.loads(clrt("devices", "--json", cwd=scene.parent).stdout)
    fields = {
        "index",
        "id",
        "name",
        "platform",
        "platform_version",
        "driver",
        "type",
        "compute_units",
        "global_bytes",
        "max_alloc_bytes",
        "usable",
        "why",
        "chosen",
    }
    assert all(fields <= set(device) for device in devices)
    assert [device["chosen"] for device in devices].count(True) == 1
    chosen = next(device for device in devices if device["chosen"])
    assert clrt("render", scene, "--device", chosen["id"], cwd=scene.parent).returncode == 0


def test_compare_prints_the_metrics(scene: Path) -> None:
    from clrt.output.images import write_image

    reference = np.full((4, 4, 3), 0.5, np.float32)
    write_image(scene.parent / "r.exr", reference)
    write_image(scene.parent / "i.exr", reference * np.float32(1.1))
    result = json.loads(clrt("compare", "i.exr", "r.exr", "--json", cwd=scene.parent).stdout)
    assert result["relmse"] == pytest.approx(0.05**2 / (0.5**2 + 0.01), rel=1e-5)
    assert result["mean_ratio"] == pytest.approx([1.1] * 3, rel=1e-6) and result["nonfinite"] == 0


def test_bench_rays_counts_the_hits_of_a_file(tmp_path: Path) -> None:
    """A square of two triangles, and a grid of rays of which a quarter hits it."""
    (tmp_path / "square.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    x, y = np.meshgrid((np.arange(32) + 0.5) / 16, (np.arange(32) + 0.5) / 16)
    origins = np.stack([x.ravel(), y.ravel(), np.ones(1024)], axis=1)
    np.savez(tmp_path / "rays.npz", origins=origins, directions=np.tile([0, 0, -1], (1024, 1)), t_max=np.full(1024, 9))
    result = clrt("bench", "rays", "--mesh", "square.obj", "--rays", "rays.npz", "--json", "b.json", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    figures = json.loads((tmp_path / "b.json").read_text())
    assert (figures["hits"], figures["rays"], figures["triangles"]) == (256, 1024, 2)
    assert all(figures[name] > 0 for name in ("build_seconds", "mrays_closest", "mrays_any", "bytes_per_triangle"))
    (tmp_path / "no.npz").write_text("no rays")
    failed = clrt("bench", "rays", "--mesh", "square.obj", "--rays", "no.npz", cwd=tmp_path)
    assert failed.returncode == 3 and "no.npz" in failed.stderr and "Traceback" not in failed.stderr


@pytest.mark.parametrize(
    ("error", "sampler", "least"),
    [(0.02, "sobol", 0.5), *others((0.035, "independent", 0.85), (0.02, "independent", 0.85))],
)
def test_error_is_reached_and_not_far_passed(scene: Path, error: float, sampler: str, least: float) -> None:
    """With Sobol' samples the error falls in steps, by a factor of up to 2 at powers of two."""
    scene.write_text(SCENE + '[[light]]\ntype = "point"\nposition = [0, 3, 1]\nintensity = [20, 20, 20]\n')
    asked = ("--error", error, "--sampler", sampler, "--report", "e.json")
    assert clrt("render", scene, *asked, cwd=scene.parent).returncode == 0
    assert least * error < json.loads((scene.parent / "e.json").read_text())["noise"] <= error


def test_a_scene_without_light_says_so(tmp_path: Path) -> None:
    (tmp_path / "dark.toml").write_text("[render]\nsize = [4, 4]\nspp = 1\n[[sphere]]\n")
    assert "nothing in this scene emits light" in clrt("render", "dark.toml", cwd=tmp_path).stderr
    assert clrt("render", "dark.toml", "-q", cwd=tmp_path).stderr == ""


@pytest.mark.parametrize("size", [(64, 48), *others(((30, 80),))])
def test_convert_in_a_size(size: tuple[int, int], tmp_path: Path) -> None:
    """The scene file has the size, and the camera that frames the model in it; at the default size it has another."""
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 4 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\n")
    asked = "--size", f"{size[0]}x{size[1]}"
    assert called("convert", "a.obj", "a.toml", *asked, cwd=tmp_path).returncode == 0
    assert called("convert", "a.obj", "square.toml", cwd=tmp_path).returncode == 0
    for name, *options in (("a.obj", *asked), ("a.toml",), ("square.toml", *asked)):
        done = called("render", name, *options, "-o", f"{name}.exr", "--spp", "2", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    expected, found, other = (read_image(tmp_path / f"{name}.exr") for name in ("a.obj", "a.toml", "square.toml"))
    assert expected.shape[:2] == size[::-1]
    np.testing.assert_array_equal(found, expected)
    assert (other != expected).any()


def test_convert(tmp_path: Path) -> None:
    """Converted to another folder, paths stay valid; existing files are not overwritten without --force."""
    (tmp_path / "models").mkdir()
    (tmp_path / "scenes").mkdir()
    (tmp_path / "models" / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = clrt("convert", "models/a.obj", "scenes/a.toml", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "scenes/a.toml\n", "")
    assert 'file = "../models/a.obj"' in (tmp_path / "scenes" / "a.toml").read_text()
    for name in ("models/a.obj", "scenes/a.toml"):
        assert (
            called(
                "render", name, "-o", f"{Path(name).suffix[1:]}.exr", "--size", "16x16", "--spp", "4", cwd=tmp_path
            ).returncode
            == 0
        )
    np.testing.assert_array_equal(read_image(tmp_path / "obj.exr"), read_image(tmp_path / "toml.exr"))
    done = called("convert", "models/a.obj", "scenes/a.toml", cwd=tmp_path)
    assert done.returncode == 2 and "already exists" in done.stderr and "--force" in done.stderr
    assert called("convert", "models/a.obj", "scenes/a.toml", "--force", cwd=tmp_path).returncode == 0
    assert called("convert", "scenes/a.toml", "b.toml", cwd=tmp_path).returncode == 2
    assert called("convert", "models/a.obj", "b.obj", cwd=tmp_path).returncode == 2
    done = called("convert", "models/a.obj", "b.toml", "--camera", "side", cwd=tmp_path)
    assert done.returncode == 3 and '--camera: "side" is unknown' in done.stderr
