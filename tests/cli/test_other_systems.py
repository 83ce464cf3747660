"""Commands work without the parts of Python that Windows and macOS lack, and in locales that are not UTF-8."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from clrt.cli import COMMANDS
from clrt.output.images import write_image

from ..covering import others

OTHER = Path(__file__).parents[1] / "other_system.py"
TEXTURES = Path(__file__).parents[2] / "scenes" / "textures.toml"
SMALL = ("--size", "16x16", "--spp", "1", "-q")
#: A call of each command; only the help of those that need a display or other software.
CALLS = {
    "render": ("render", "scene.toml", *SMALL, "-o", "image.png"),
    "debug": ("debug", "scene.toml", "--pixel", "5,5"),
    "info": ("info", "scene.toml"),
    "bake": ("bake", str(TEXTURES), "--mesh", "table", "--size", "8x8", "--spp", "16", "-q", "-o", "baked.png"),
    "relight": ("relight", "groups.exr", "--group", "key=2", "-o", "brighter.png"),
    "convert": ("convert", "model.obj", "other.toml"),
    "compare": ("compare", "red.png", "red.png"),
    "devices": ("devices", "--check"),
    "doctor": ("doctor", "-o", "report.zip"),
    "cache": ("cache",),
    "bench": ("bench", "rays", "--help"),
    "view": ("view", "--help"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a scene whose material has a non-ASCII name, a model and an image."""
    import imageio.v3
    import numpy as np

    (tmp_path / "scene.toml").write_text(
        '[environment]\ncolor = [1, 1, 1]\n[materials."grün"]\ntype = "diffuse"\n[[sphere]]\nmaterial = "grün"\n',
        encoding="utf-8",
    )
    (tmp_path / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    ones = np.ones((8, 8, 3), np.float32)
    write_image(tmp_path / "groups.exr", ones, aovs={"light_group.key": ones})
    imageio.v3.imwrite(tmp_path / "red.png", np.full((8, 8, 3), (255, 0, 0), np.uint8))
    return tmp_path


def test_every_command_is_called() -> None:
    assert set(CALLS) == set(COMMANDS)


@pytest.mark.parametrize(
    ("system", "name"),
    [
        *(("win32", name) for name in ("render", "convert", "cache", "view")),
        *(("darwin", name) for name in ("render", "doctor")),
        *others(
            *(("win32", name) for name in ("relight", "compare", "bake", "debug", "info", "devices", "doctor", "bench"))
        ),
        *others(
            *(
                ("darwin", name)
                for name in (
                    "bake",
                    "debug",
                    "relight",
                    "convert",
                    "compare",
                    "cache",
                    "view",
                    "info",
                    "devices",
                    "bench",
                )
            )
        ),
    ],
)
def test_commands_need_nothing_that_another_system_lacks(folder: Path, system: str, name: str) -> None:
    program = [sys.executable, "-X", "warn_default_encoding", str(OTHER), system]
    done = subprocess.run(
        [*program, *CALLS[name]],
        cwd=folder,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONUTF8": "0", "CLRT_CACHE_DIR": str(folder)},
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("system", "number"), [("win32", signal.SIGUSR2), *others(("darwin", signal.SIGINT), ("darwin", signal.SIGHUP))]
)
def test_interrupted_it_keeps_the_picture(folder: Path, system: str, number: signal.Signals) -> None:
    """Ctrl-Break, simulated by SIGUSR2, works like Ctrl-C."""
    process = subprocess.Popen(
        [
            sys.executable,
            str(OTHER),
            system,
            "render",
            "scene.toml",
            "--size",
            "16x16",
            "--time",
            "600",
            "--progress",
            "json",
            "-o",
            "image.png",
        ],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    while '"spp"' not in process.stderr.readline():
        assert process.poll() is None, "ended before it was interrupted"
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == 130 and (folder / "image.png").is_file()


@pytest.mark.parametrize("encoding", ["cp1252", "cp1252:surrogateescape"])
def test_names_that_the_code_page_lacks(folder: Path, encoding: str) -> None:
    """The encoding is that of standard output to a file; Python on Windows has the second of these."""
    done = subprocess.run(
        [sys.executable, "-m", "clrt", "render", "scene.toml", *SMALL, "-o", "ü日.png"],
        cwd=folder,
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
    )
    assert (done.returncode, done.stdout) == (0, b"\xfc\\u65e5.png\n"), done.stderr
    assert (folder / "ü日.png").exists()


@pytest.mark.parametrize("name", ["render", *others("info", "convert")])
def test_commands_in_the_c_locale(folder: Path, name: str) -> None:
    """Python treats text as ASCII there."""
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "clrt", *CALLS[name]], cwd=folder, capture_output=True, env=os.environ | ascii_only
    )
    assert done.returncode == 0, done.stderr.decode(errors="replace")
