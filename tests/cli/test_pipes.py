"""Images written to standard output, pipes and devices."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clrt.cli.pipes import FORMATS, ITS_NAMES, STDOUT, Pipe, pipe_at, split_pipes
from clrt.errors import OutputError, UsageError
from clrt.output.images import read_image

from ..covering import others
from .test_checkpoints import SCENE

CLRT = f"{sys.executable} -P -m clrt"
SMALL = "--size 12x8 --spp 2"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    os.mkfifo("fifo")
    return tmp_path


def shell(line: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(["bash", "-o", "pipefail", "-c", line], capture_output=True)


@pytest.mark.parametrize("name", [*map(str, ITS_NAMES), "/dev/null", "fifo"])
def test_formats(folder: Path, name: str) -> None:
    """The format is that of the prefix, else of the extension, else PNG; the path is the pipe's."""
    path = STDOUT if Path(name) in ITS_NAMES else Path(name)
    assert pipe_at(Path(name)) == Pipe(path, ".png")
    for form in FORMATS:
        for prefix in (form, form.upper()):
            assert pipe_at(Path(f"{prefix}:{name}")) == Pipe(path, f".{form}")
        os.mkfifo(f"{form}.{form}")
        assert pipe_at(Path(f"{form}.{form}")) == Pipe(Path(f"{form}.{form}"), f".{form}")
    unknown = pipe_at(Path(f"gif:{name}"))
    assert unknown is not None
    with pytest.raises(OutputError, match="unknown image format .gif"):
        unknown.check()


def test_what_is_no_pipe(folder: Path) -> None:
    """Regular files, also with such names, and missing ones."""
    (folder / "png:a.png").touch()
    paths = tuple(map(Path, ("ball.toml", "a.png", "png:a.png", "exr:b.exr", ".", "no/such", "-.png")))
    assert split_pipes(paths) == (paths, ())


def test_a_pipe_takes_one_image(folder: Path) -> None:
    files, pipes = split_pipes(map(Path, ("a.png", "-", "exr:fifo")))
    assert files == (Path("a.png"),) and pipes == (Pipe(STDOUT, ".png"), Pipe(Path("fifo"), ".exr"))
    with pytest.raises(UsageError, match="given twice"):
        split_pipes(map(Path, ("-", "exr:/dev/stdout")))


@pytest.mark.parametrize(
    ("form", "redirection"),
    [
        ("png", "-o - | cat > got"),
        ("exr", "-o exr:fifo & cat fifo > got; wait $!"),
        *others(
            ("exr", "-o exr:- > got"),
            ("hdr", "-o hdr:/dev/stdout >> got"),
            ("png", "-o >(cat > got); sleep 0.2"),
            ("png", "-o /dev/fd/1 -o other.exr --report other.json --denoise --progress json > got"),
        ),
    ],
)
def test_images(folder: Path, form: str, redirection: str) -> None:
    """The pipe gets the same image as a file, and nothing else."""
    options = "--denoise" if "--denoise" in redirection else ""
    assert shell(f"{CLRT} render ball.toml {SMALL} {options} -q -o file.{form}").returncode == 0
    done = shell(f"{CLRT} render ball.toml {SMALL} {redirection}")
    assert (done.returncode, done.stdout) == (0, b""), done.stderr
    got = Path("got").rename(f"got.{form}")
    assert np.array_equal(read_image(got), read_image(Path(f"file.{form}")))
    assert "other" not in redirection or {path.name for path in folder.glob("other*")} == {
        "other.exr",
        "other.raw.exr",
        "other.json",
    }


@pytest.mark.parametrize(
    ("options", "code", "told"),
    [
        ("-o - --turntable 2", 2, "takes one image"),
        ("-o - -o exr:-", 2, "given twice"),
        ("-o - --aov depth", 2, ".exr or .png"),
        ("-o xyz:-", 6, "png, jpg, webp, tif, exr or hdr"),
        ("-o - >&-", 2, "is closed"),
    ],
)
def test_mistakes(folder: Path, options: str, code: int, told: str) -> None:
    done = shell(f"{CLRT} render ball.toml {options}")
    assert (done.returncode, done.stdout, done.stderr.count(b"\n")) == (code, b"", 1) and told.encode() in done.stderr


@pytest.mark.parametrize("name", ["-", "exr:/dev/stdout", "tty"])
def test_terminals_show_no_image(folder: Path, name: str) -> None:
    """Refused with one line before the render."""
    ours, terminal = pty.openpty()
    (folder / "tty").symlink_to(os.ttyname(terminal))
    done = subprocess.run([*CLRT.split(), "render", "ball.toml", "-o", name], stdout=terminal, stderr=subprocess.PIPE)
    os.close(terminal)
    os.close(ours)
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1 and b"is a terminal" in done.stderr


@pytest.mark.parametrize("to", ["a closed pipe", "/dev/full"])
def test_a_reader_that_has_gone_loses_nothing(folder: Path, to: str) -> None:
    """There is one error; the image is in the working folder, and the checkpoint is complete."""
    reading, writing = os.pipe() if to == "a closed pipe" else (os.open(to, os.O_RDONLY), os.open(to, os.O_WRONLY))
    os.close(reading)
    line = [*CLRT.split(), "render", "ball.toml", *SMALL.split(), "-q", "--checkpoint", "a.ck"]
    done = subprocess.run([*line, "-o", "exr:-"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert done.returncode == 6 and done.stderr.count("\n") == 1 and done.stderr.startswith("error: -: cannot be ")
    (kept,) = folder.glob("image-*.exr")
    assert str(kept) in done.stderr and "a.ck holds the samples so far" in done.stderr
    assert subprocess.run([*line, "-o", "b.exr", "--resume"]).returncode == 0
    assert np.array_equal(read_image(kept), read_image(Path("b.exr")))


def test_ctrl_c_that_ends_the_reader_as_well(folder: Path) -> None:
    """Ctrl-C reaches every program of a pipeline: the render is interrupted, with its image in the working folder."""
    reading, writing = os.pipe()
    line = [*CLRT.split(), "render", "ball.toml", "--time", "600", "--progress", "json", "-o", "exr:-"]
    process = subprocess.Popen(line, stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert process.stderr is not None
    while "spp" not in json.loads(process.stderr.readline()):
        pass
    os.close(reading)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    (kept,) = folder.glob("image-*.exr")
    assert process.returncode == 130 and read_image(kept).shape == (64, 96, 3)
    (error,) = (each for each in told.splitlines() if not each.startswith("{"))
    assert error.startswith("error: -: cannot be ") and str(kept) in error
