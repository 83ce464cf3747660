"""The commands and Python examples of the how-tos run and print the output that they state."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HOUSE = Path(__file__).parents[1]
#: Page → number of its blocks, and files that they write.
PAGES = {
    "rays": (4, ()),
    "python": (6, ("ball.png", "denoised.png", "ball.toml", "red.png", "torus.png")),
    "denoise": (1, ("smooth.exr",)),
    "transparent-background": (2, ("product.png", "product.exr")),
    "light-measurements": (2, ()),
    "bake": (3, ("light.exr", "light.png", "light.json", "occlusion.png", "table.exr")),
    "motion-blur": (1, ("spot.png",)),
    "sky": (2, ("noon.png", "outside.toml", "hour_09.png", "hour_21.png")),
    "light-groups": (2, ("night.exr", "moonlit.png", "dimmed.png")),
    "dataset": (4, ("view_0003.exr", "spot/transforms.json", "spot/images/view_00003.png")),
}


@pytest.mark.programs
@pytest.mark.parametrize("name", PAGES)
def test_examples_print_what_they_say(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks run in order and share variables; the comment after each print is its expected output."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(HOUSE / "scenes")
    page = HOUSE / "docs" / f"{name}.md"
    names: dict[str, Any] = {}
    blocks = re.findall(r"```(sh|python)\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    for language, block in blocks:
        if language == "sh":
            for line in block.splitlines():
                program, *arguments = shlex.split(line)
                assert program == "clrt"
                subprocess.run([sys.executable, "-P", "-m", "clrt", *arguments], check=True)
        else:
            exec(compile(block, str(page), "exec"), names)
            assert capsys.readouterr().out.splitlines() == re.findall(r"^print\(.*\)  # (.*)$", block, re.MULTILINE)
    count, files = PAGES[name]
    assert len(blocks) >= count and [file for file in files if not (tmp_path / file).is_file()] == []
