"""`clrt view` reports what is missing or wrong, and ends on an interrupt."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    "before, options, environment, code, message",
    [
        ("", [], {"DISPLAY": ""}, 6, "neither DISPLAY nor WAYLAND_DISPLAY is set"),
        ("", [], {"DISPLAY": ":4711"}, 6, "no window can be opened"),
        ("sys.modules['imgui_bundle'] = None; ", [], {}, 2, "pip install imgui-bundle PyOpenGL"),
        ("", ["--integrator", "pth"], {}, 2, "did you mean path?"),
        ("", ["--view", "agy"], {}, 2, "did you mean agx?"),
        ("", ["--device", "abacus"], {}, 4, "no usable device matches"),
    ],
    ids=["none", "dead", "extra", "integrator", "view", "device"],
)
def test_what_is_missing_or_wrong_is_said(
    tmp_path: Path, before: str, options: list[str], environment: dict[str, str], code: int, message: str
) -> None:
    (tmp_path / "ball.toml").write_text('[materials.a]\ntype = "diffuse"\n[[sphere]]\nmaterial = "a"\n')
    program = f"import sys; {before}from clrt.cli import main; main(['view', 'ball.toml', *{options}])"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ | environment,
    )
    assert done.returncode == code and message in done.stderr and "Traceback" not in done.stderr, done.stderr


INTERRUPTED = """
import os, signal
from clrt.cli import main
from clrt.window.editor import Editor
frame = Editor.frame
def with_interrupt(editor):
    frame(editor)
    if editor.frames == 5:
        os.kill(os.getpid(), signal.SIGINT)
Editor.frame = with_interrupt
main(["view", "ball.toml", "--spp", "2", "--depth", "3", "--view", "agx", "--exposure", "1"])
"""


def test_the_command_ends_with_an_interrupt(tmp_path: Path) -> None:
    (tmp_path / "ball.toml").write_text(
        '[render]\nsize = [32, 24]\n[materials.a]\ntype = "diffuse"\n[[sphere]]\n'
        'material = "a"\n[environment]\ncolor = [1, 1, 1]\n'
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", INTERRUPTED],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ | {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path / ".config")},
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
    assert (tmp_path / ".config" / "clrt" / "window.ini").is_file(), "where its panels are is remembered"
