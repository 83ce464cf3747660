"""Starts renders in separate processes, as users do."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

SCENES = Path(__file__).parents[2] / "scenes"
GALLERY = sorted(SCENES.glob("*.toml"))
CORNELL = SCENES / "cornell.toml"
#: A device may write checkpoints all the time, so that a signal often comes while one is written.
ALL_THE_TIME = (
    "-c",
    "import clrt.rendering.checkpoint.checkpoints as checkpoint; checkpoint.COST = 0; "
    "from clrt.cli import main; main()",
)
CLRT = ("-P", "-m", "clrt")


def start(
    folder: Path, *options: object, program: tuple[str, ...] = CLRT, environment: Mapping[str, str] | None = None
) -> subprocess.Popen[str]:
    """Start `clrt render` with these options in the folder."""
    return subprocess.Popen(
        [sys.executable, *program, "render", *map(str, options)],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
    )


def finish(process: subprocess.Popen[str], code: int = 0) -> str:
    """Wait for the process to end with this exit code and return its standard error."""
    _, messages = process.communicate(timeout=600)
    assert process.returncode == code and "Traceback" not in messages, (process.returncode, messages)
    return messages


def await_rendering(process: subprocess.Popen[str]) -> None:
    """Return once a render with `--progress json` reports that it renders."""
    assert process.stderr is not None
    while (line := process.stderr.readline()) and '"render"' not in line:
        assert process.poll() is None
