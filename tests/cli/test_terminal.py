"""Output on terminals of any width and type, and what is never sent to them."""

from __future__ import annotations

import fcntl
import io
import logging
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from clrt.cli.bar import BarProgress, StatusLine, bar, columns, fitted
from clrt.cli.displays import make_progress
from clrt.cli.goal import Goal
from clrt.cli.progress_reporter import PHASES, PlainProgress

from ..covering import others
from .test_progress import SCENE, state

TEXT = st.text("ab 7%", max_size=30)


class Terminal(io.StringIO):
    """Fake terminal that wraps right after the last column, as some do, and rejects escape sequences."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.width, self.lines, self._column = width, [""], 0

    def write(self, text: str) -> int:
        for character in text:
            if character == "\n":
                self.lines.append("")
            elif character == "\r":
                self._column = 0
                continue
            else:
                assert character.isprintable()
                line = self.lines[-1].ljust(self._column)
                self.lines[-1] = line[: self._column] + character + line[self._column + 1 :]
                if self._column + 1 < self.width:
                    self._column += 1
                    continue
                self.lines.append("")
            self._column = 0
        return len(text)

    def isatty(self) -> bool:
        return True


@given(st.integers(2, 100), st.lists(st.lists(TEXT, min_size=1, max_size=5), max_size=6))
def test_a_status_is_one_line(width: int, statuses: list[list[str]]) -> None:
    """A status replaces the previous one and never wraps; erasing it leaves nothing."""
    terminal = Terminal(width)
    line = StatusLine(terminal)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clrt.cli.bar.columns", lambda terminal: width)
        for parts in statuses:
            line.show(parts)
            assert len(terminal.lines) == 1 and len(fitted(parts, width - 1)) < width
            assert terminal.lines[0].rstrip() == fitted(parts, width - 1).rstrip()
        line.erase()
        assert [each.strip() for each in terminal.lines] == [""]


@given(st.lists(TEXT, max_size=6), st.integers(1, 90))
def test_parts_that_fit(parts: list[str], room: int) -> None:
    """All parts if they fit; otherwise the first, truncated, and those of the others that fit after it."""
    line, every = fitted(parts, room), "  ".join(filter(None, parts))
    first = next(filter(None, parts), "")
    assert len(line) <= room and line.startswith(first[:room])
    assert line == every or len(every) > room


@given(st.floats(0, 1))
def test_bars_are_full_at_the_end_alone(done: float) -> None:
    assert len(bar(done)) == len(bar(1)) and (bar(done) == bar(1)) == (done == 1)


@pytest.mark.parametrize("redirected", [False, True])
@pytest.mark.parametrize("width", [12, 20, 40, 80, 200])
def test_what_stays(width: int, redirected: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The final status of an image, warnings and file names remain, each on its own line; the bar does not."""
    terminal, stdout = Terminal(width), io.StringIO()
    monkeypatch.setattr("clrt.cli.bar.columns", lambda terminal: width)
    monkeypatch.setattr(sys, "stdout", stdout if redirected else terminal)
    monkeypatch.setattr(sys, "stderr", terminal)
    with BarProgress() as progress:
        for name in ("load", "build", "compile"):
            progress.phase(name)
        logging.lastResort.handle(logging.makeLogRecord({"msg": "a warning"}))  # type: ignore[union-attr]
        progress.phase("render", "a device", 1 << 30)
        for spp in (1, 2, 4):
            progress.state(state(spp, 0.1 * spp, 0.5), Goal(4, None, None))
            assert terminal.lines[-1].startswith("rendering"[: width - 1])
        progress.phase("write")
        print("a.png")
    kept = [line.rstrip() for line in terminal.lines]
    assert kept[0] == "a warning" and kept[2:] == ([""] if redirected else ["a.png", ""])
    assert stdout.getvalue() == ("a.png\n" if redirected else "")
    assert kept[1] == fitted(["100 %", "4 spp", "noise 0.5000", "0.4 s", "0.00 Msamples/s"], width - 1)


@pytest.mark.parametrize(
    ("variables", "kind"),
    [
        ({"TERM": "xterm-256color"}, BarProgress),
        ({"TERM": "linux", "NO_COLOR": "1"}, BarProgress),
        ({"TERM": "xterm", "CI": "false"}, BarProgress),
        ({"TERM": "xterm", "CI": "true"}, PlainProgress),
        ({"TERM": "dumb"}, PlainProgress),
        ({"TERM": "unknown"}, PlainProgress),
        ({"TERM": ""}, PlainProgress),
        ({}, PlainProgress),
    ],
)
def test_who_gets_a_bar(variables: dict[str, str], kind: type, monkeypatch: pytest.MonkeyPatch) -> None:
    """A requested bar is shown on every terminal, but never elsewhere."""
    for name in ("TERM", "CI"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stderr", Terminal(80))
    assert type(make_progress(None, False)) is kind and type(make_progress("bar", False)) is BarProgress
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert type(make_progress(None, False)) is type(make_progress("bar", False)) is PlainProgress


@pytest.mark.parametrize(
    ("size", "variable", "found"),
    [(40, "", 40), (40, "20", 20), (20, "40", 20), (0, "", 80), (0, "30", 30), (40, "0", 40), (40, "wide", 40)],
)
def test_columns(size: int, variable: str, found: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The terminal's width or COLUMNS; a terminal without a size has 80."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, size, 0, 0))
    monkeypatch.setenv("COLUMNS", variable)
    with open(theirs, "w") as terminal:
        assert columns(terminal) == found
    os.close(ours)
    assert columns(io.StringIO()) == 80


def on_terminal(folder: Path, width: int, *arguments: str, **variables: str) -> str:
    """Return everything that a command sends to a terminal, which is also its standard output."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "clrt", *arguments],
        cwd=folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=os.environ | {"TERM": "xterm-256color"} | variables,
    )
    os.close(theirs)
    sent = b""
    try:
        while piece := os.read(ours, 1 << 16):
            sent += piece
    except OSError:  # end of file on Linux
        pass
    os.close(ours)
    assert process.wait() == 0, sent
    return sent.decode().replace("\r\n", "\n")


@pytest.mark.parametrize("width", [20, 80])
def test_renders(tmp_path: Path, width: int) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    terminal = Terminal(width)
    terminal.write(on_terminal(tmp_path, width, "render", "scene.toml"))
    first, *others = [line.rstrip() for line in terminal.lines]
    assert first.startswith("100 %  4 spp") and others == ["scene.png", ""]


def test_plain_lines(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    lines = on_terminal(tmp_path, 200, "render", "scene.toml", TERM="dumb").splitlines()
    assert lines[0] == PHASES["load"] and lines[-2:] == [PHASES["write"], "scene.png"]
    assert all(line.isprintable() for line in lines)


@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "scene.toml"),
        ("devices",),
        ("doctor",),
        ("cache",),
        ("render", "scene.toml", "--progress", "json"),
        ("render", "--help"),
        ("bench", "--help"),
        *others((("debug", "scene.toml", "--pixel", "1,1"),)),
    ],
    ids=" ".join,
)
def test_no_escape_sequences(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    sent = on_terminal(tmp_path, 40, *arguments, FORCE_COLOR="1", CLICOLOR_FORCE="1")
    assert sent and all(line.isprintable() for line in sent.splitlines())
