"""The examples of docs/rays.md run and print the output that they state."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

GUIDE = Path(__file__).parents[1] / "docs" / "rays.md"


def test_examples_print_what_they_say(capsys: pytest.CaptureFixture[str]) -> None:
    """Blocks run in order and share variables; the comment after each print is its expected output."""
    names: dict[str, Any] = {}
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    for block in blocks:
        exec(compile(block, str(GUIDE), "exec"), names)
        assert capsys.readouterr().out.splitlines() == re.findall(r"^print\(.*\)  # (.*)$", block, re.MULTILINE)
    assert len(blocks) >= 4
