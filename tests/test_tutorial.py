"""Each step of docs/tutorial.md runs, in order, and writes the files that it names."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
#: Files that the steps write.
WRITTEN = (
    "spot.png",
    "converted.toml",
    "studio.png",
    "report.json",
    "error.png",
    "studio.exr",
    "spin.gif",
    "from_python.exr",
)


@pytest.mark.programs
def test_every_step_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs the commands, scene file and Python program as printed; the comment after a print is its output."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(HOUSE / "scenes" / "models" / "spot.obj", tmp_path)
    text = (HOUSE / "docs" / "tutorial.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(sh|toml|python)\n(.*?)```", text, re.DOTALL)
    for language, block in blocks:
        if language == "toml":
            (tmp_path / block.split()[1]).write_text(block, encoding="utf-8")
        elif language == "sh":
            for line in block.splitlines():
                name, *arguments = shlex.split(line)
                assert name == "clrt"
                done = subprocess.run([sys.executable, "-P", "-m", "clrt", *arguments], capture_output=True, text=True)
                assert done.returncode == 0, f"{line}: {done.stderr}"
        else:
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                exec(compile(block, "tutorial.md", "exec"), {})
            assert printed.getvalue().splitlines() == re.findall(r"^print\(.*\)  # (.*)$", block, re.MULTILINE)
    assert len(blocks) >= 8
    assert [name for name in WRITTEN if not (tmp_path / name).is_file()] == []
