"""`clrt render --frames`: file names, images, resume, and errors."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import clrt
from clrt.cli.frames import numbered
from clrt.cli.render import command
from clrt.output.images import metadata_of, read_image
from clrt.output.video import write_video
from clrt.scene.camera_path import frames

from ..formats.test_gltf_animations import animated
from .test_commands import RUNS, Run, called

FLIGHT = """
camera = { fov_degrees = 50 }
animation = { fps = 2 }
render = { size = [24, 16], spp = 3, max_depth = 3 }
environment = { color = [0.3, 0.5, 0.9] }
sphere = [{ radius = 1 }, { radius = 0.5, center = [1.2, 0.3, 0.4] }]
keyframe = [{ time = 0, position = [0, 1, 4] }, { time = 1, position = [3, 2, 3] },
            { time = 2.5, position = [4, 0, 0] }]
"""


@pytest.fixture
def flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a scene file with six frames around a sphere."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "flight.toml"
    path.write_text(FLIGHT)
    return path


def render(*arguments: str) -> list[str]:
    """Return the files that were written."""
    done = CliRunner().invoke(command, [*arguments, "-q"])
    assert done.exit_code == 0, (done.output, done.exception)
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ("name", "number", "expected"),
    [
        ("a/x_####.png", 7, "a/x_0007.png"),
        ("#_##.exr", 123, "#_123.exr"),
        ("a#/x.png", 7, "a#/x_0007.png"),
        ("x.y.png", 12345, "x.y_12345.png"),
    ],
)
def test_names(name: str, number: int, expected: str) -> None:
    assert numbered(Path(name), number) == Path(expected)


def test_each_frame_is_what_a_render_of_its_own_gives(flight: Path) -> None:
    """Frames are equal bit for bit by the command and from Python; reports are numbered too."""
    written = render("flight.toml", "--frames", "0,3-5:2", "-o", "f_##.exr", "--report", "f.json")
    assert written == ["f_00.exr", "f_0000.json", "f_03.exr", "f_0003.json", "f_05.exr", "f_0005.json"]
    images = dict(clrt.animate("flight.toml", frames=[0, 3, 5]))
    for number, still in frames(clrt.load("flight.toml"), [0, 3, 5]):
        alone = clrt.render(still)
        np.testing.assert_array_equal(read_image(Path(f"f_{number:02}.exr")), alone.pixels)
        np.testing.assert_array_equal(images[number].pixels, alone.pixels)
        report = json.loads(Path(f"f_{number:04}.json").read_text())
        assert (report["frame"], report["spp"], report["scene_hash"]) == (number, 3, alone.report["scene_hash"])
    assert len({image.pixels.tobytes() for image in images.values()}) == 3


def test_frames_of_an_animated_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is the image of that time, at 24 frames per second unless --fps is given; --resume skips them."""
    monkeypatch.chdir(tmp_path)
    gltf = animated()
    gltf.document["scenes"][0]["nodes"] += gltf.document["nodes"][0].pop("children")  # a camera that stands still
    gltf.write(Path("a.glb"))
    small = "a.glb", "--size", "16x16", "--spp", "2", "--depth", "2", "--look", "sky"
    asked = *small, "--animation", "walk", "--frames", "0,2,4", "--fps", "2"
    written = [f"f_{number}.exr" for number in (0, 2, 4)]
    assert render(*asked, "-o", "f_#.exr") == written
    for number in (0, 2, 4):
        render(*small, "--animation", "walk", "--animation-time", str(number / 2), "-o", "still.exr")
        np.testing.assert_array_equal(read_image(Path(f"f_{number}.exr")), read_image(Path("still.exr")))
    assert len({Path(name).read_bytes() for name in written}) == 3
    del gltf.document["nodes"][1]["camera"]
    gltf.write(Path("framed.glb"))
    framed = render("framed.glb", *asked[1:], "-o", "framed_#.png")
    assert len({metadata_of(Path(name), "clrt:frame_hash") for name in framed}) == 3, "one camera, three poses"
    Path(written[1]).unlink()
    assert render(*asked, "-o", "f_#.exr", "--resume") == [written[1]]
    assert len(render(*small, "--frames", "all", "--fps", "2", "-o", "g_#.png")) == 5
    failed = CliRunner().invoke(command, [*small, "--frames", "all", "--animation-time", "1"])
    assert isinstance(failed.exception, clrt.UsageError) and "leave out --frames" in str(failed.exception)


def test_frames_of_models_in_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is the image of that time; --resume skips those that exist, of this scene file alone."""
    monkeypatch.chdir(tmp_path)
    animated().write(Path("a.glb"))
    text = """
render = { size = [16, 16], spp = 2, max_depth = 2 }
environment = { color = [1, 1, 1] }
camera = { position = [2, 1, 9] }
mesh = [{ file = "a.glb", animation = "walk" },
        { file = "a.glb", animation = "1", translate = [-3, -7, 0] }]
"""
    Path("s.toml").write_text(text)
    asked = "s.toml", "--frames", "all", "--fps", "2", "-o", "f_#.exr"
    written = render(*asked)
    assert written == [f"f_{number}.exr" for number in range(5)]
    for number in (0, 3):
        Path("still.toml").write_text(re.sub('(animation = ".*?")', rf"\1, time = {number / 2}", text))
        render("still.toml", "-o", "still.exr")
        np.testing.assert_array_equal(read_image(Path(f"f_{number}.exr")), read_image(Path("still.exr")))
    assert len({Path(name).read_bytes() for name in written}) == 5
    Path(written[1]).unlink()
    Path(written[3]).write_bytes(Path(written[2]).read_bytes())
    assert render(*asked, "--resume") == [written[1], written[3]]
    assert len(render("s.toml", "--turntable", "3", "-o", "t_#.exr")) == 3


def test_resume_makes_what_is_missing(flight: Path) -> None:
    """Frames of another scene or with other settings, and missing ones, are rendered again."""
    every = [f"flight_{n:04}.png" for n in range(6)]
    assert render("flight.toml", "--frames", "all") == every
    again = "flight.toml", "--frames", "all", "--resume"
    assert render(*again) == []
    Path(every[4]).unlink()
    Path(every[1]).write_bytes(Path(every[0]).read_bytes())
    assert render(*again) == [every[1], every[4]] and render(*again) == []
    assert render(*again, "--exposure", "1") == render(*again, "--spp", "2") == every
    flight.write_text(FLIGHT.replace("position = [4, 0, 0]", "position = [4, 0, 1]"))
    assert render(*again, "--spp", "2") == [every[1], *every[3:]], "all but those that fall on other keyframes"


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".webm"])
def test_videos(suffix: str, flight: Path) -> None:
    """Every frame has its place and time; without .png outputs no other files are listed or left."""
    from imageio.v3 import imiter, immeta, improps, imread

    wanted = "flight.toml", "--turntable", "6", "--fps", "12", "--size", "48x32"
    pictures = [f"flight_{n:04}.png" for n in range(6)]
    assert render(*wanted, "-o", f"v{suffix}", "-o", "flight.png") == [*pictures, f"v{suffix}"]
    assert render(*wanted, "-o", f"w{suffix}") == [f"w{suffix}"]
    assert Path(f"v{suffix}").read_bytes() == Path(f"w{suffix}").read_bytes() or suffix == ".webm"
    assert {path.name for path in Path().iterdir()} == {"flight.toml", f"v{suffix}", f"w{suffix}", *pictures}
    plugin = "pillow" if suffix == ".gif" else "FFMPEG"
    assert improps(f"w{suffix}", plugin=plugin).n_images in (6, float("inf"))
    shown = np.stack([np.asarray(frame)[..., :3] for frame in imiter(f"w{suffix}", plugin=plugin)])
    assert shown.shape == (6, 32, 48, 3)
    meta = immeta(f"w{suffix}", plugin=plugin)
    assert meta.get("fps", 12) == 12
    still = np.stack([imread(picture) for picture in pictures]).astype(float)
    errors = [[np.abs(a - b).mean() for b in still] for a in shown.astype(float)]
    assert np.argmin(errors, axis=1).tolist() == list(range(6)) and np.diag(errors).max() < 6


def test_a_video_removes_its_own_files_alone(flight: Path) -> None:
    """Other files in the folder of its frames stay, whether they are outputs or not."""
    Path("v.gif.frames").mkdir()
    Path("v.gif.frames/notes.txt").write_text("mine")
    assert render("flight.toml", "--frames", "0,1", "-o", "v.gif") == ["v.gif"]
    assert [path.name for path in Path("v.gif.frames").iterdir()] == ["notes.txt"]
    asked = ["v.gif.frames/f_0000.png", "v.gif.frames/f_0001.png"]
    assert render("flight.toml", "--frames", "0,1", "-o", "v.gif", "-o", "v.gif.frames/f_####.png") == [*asked, "v.gif"]
    assert {str(path) for path in Path("v.gif.frames").iterdir()} == {*asked, "v.gif.frames/notes.txt"}


def test_gifs_keep_time(tmp_path: Path) -> None:
    """At 24 frames per second each frame is within 5 ms of its time, although durations are multiples of 10 ms."""
    paths = [tmp_path / f"{n}.png" for n in range(30)]
    for n, path in enumerate(paths):
        Image.new("RGB", (8, 8), (8 * n, 0, 0)).save(path)
    lasting = []
    with Image.open(write_video(tmp_path / "a.gif", paths, 24)) as gif:
        for n in range(30):
            gif.seek(n)
            lasting.append(gif.info["duration"])
        assert gif.info["loop"] == 0
    np.testing.assert_allclose(np.cumsum(lasting), 1000 / 24 * np.arange(1, 31), atol=5)


@pytest.mark.processes
def test_interrupted_frames_are_not_written_and_resume_ends_it(flight: Path) -> None:
    wanted = [
        sys.executable,
        "-m",
        "clrt",
        "render",
        "flight.toml",
        "--frames",
        "all",
        "--spp",
        "400",
        "--progress",
        "json",
        "--size",
        "200x150",
        "-o",
        "f.gif",
        "-o",
        "####.png",
    ]
    running = subprocess.Popen(wanted, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    assert running.stderr is not None
    for line in running.stderr:
        told: dict[str, Any] = json.loads(line)
        if told["phase"] == "frame" and told["frame"] == 2:
            running.send_signal(signal.SIGINT)
            break
    assert "flight: interrupted; run the same command with --resume" in running.stderr.read()
    assert running.wait() == 130 and {path.name for path in Path().iterdir()} == {"flight.toml", "0000.png", "0001.png"}
    done = subprocess.run([*wanted, "--resume"], capture_output=True, text=True)
    assert done.stdout.split() == ["0002.png", "0003.png", "0004.png", "0005.png", "f.gif"], done.stderr


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--frames", "7-5"], 2, "'7-5' is not a list of frames"),
        (["--frames", "0-4:0"], 2, "0-99:5"),
        (["--frames", "6"], 2, "flight has no frame 6; its frames are 0 to 5"),
        (["--frames", "all", "--checkpoint", "c"], 2, "--checkpoint is not supported for animations"),
        (["--fps", "3"], 2, "--turntable"),
        (["--turntable", "2", "-o", "a.gif", "--aov", "depth"], 2, "cannot store AOVs"),
        (["--frames", "0", "-o", "a.mp4", "--size", "25x16"], 2, "26x16"),
        (["-o", "a.gif"], 6, ".gif"),
        (["--frames", "0", "-o", "a.gif", "--fps", "60"], 2, "60 frames per second"),
        (["--frames", "0", "-o", "a.gif", "--fps", "0.0015"], 2, "666.667 s are more than the 655.35"),
        (["--turntable", "4", "-o", "a.gif", "--fps", "nan"], 2, "fps: nan is not a finite number"),
        (["--turntable", "4", "-o", "a.gif", "--fps", "inf"], 2, "fps: inf is not a finite number"),
        (["--frames", "all", "--fps", "nan"], 3, "Animation.fps: nan is not a finite number"),
        (["--frames", "all", "--fps", "1e12"], 3, "frames, more than 1000000; check the times"),
        (["--frames", "0", "-o", "no/a.png"], 6, "does not exist"),
    ],
)
def test_mistakes_end_in_one_message(run: Run, arguments: list[str], code: int, words: str, flight: Path) -> None:
    done = run("render", "flight.toml", *arguments, cwd=flight.parent)
    assert done.returncode == code and words in done.stderr and "Traceback" not in done.stderr
    assert not done.stdout and [path.name for path in Path().iterdir()] == ["flight.toml"]


def test_what_does_not_move_has_no_frames(flight: Path) -> None:
    flight.write_text("sphere = [{}]\n")
    done = called("render", "flight.toml", "--frames", "all", cwd=flight.parent)
    assert done.returncode == 3 and "flight: has no animation; write [[keyframe]]" in done.stderr


def test_resuming_needs_the_layers_of_light_groups(flight: Path) -> None:
    """A frame without one of its layers' files is rendered again, and no other."""
    flight.write_text(FLIGHT.replace("[0.3, 0.5, 0.9]", '[0.3, 0.5, 0.9], light_group = "sky"'))
    asked = "flight.toml", "--frames", "0,1", "--aov", "light_groups", "-o", "f_#.png"
    assert render(*asked) == ["f_0.png", "f_0.light_group.sky.png", "f_1.png", "f_1.light_group.sky.png"]
    assert render(*asked, "--resume") == []
    Path("f_1.light_group.sky.png").unlink()
    assert render(*asked, "--resume") == ["f_1.png", "f_1.light_group.sky.png"]
