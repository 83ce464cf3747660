"""Replaced files keep their mode, and read-only ones need --force."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from clrt.output.atomic_files import replacing
from clrt.rendering.checkpoint.checkpoint_file import write_checkpoint

from ..covering import others
from .test_checkpoints import SCENE
from .test_commands import clrt

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="its files have no such modes")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


def mode(path: Path) -> int:
    """Return the permission bits of a file."""
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("checkpoint", [False, True], ids=["any", "checkpoint"])
def test_modes_are_kept(tmp_path: Path, checkpoint: bool) -> None:
    """Any mode is kept, also through a link. A new file gets the mode that the umask leaves."""
    random, path, link = Random(5), tmp_path / "a.txt", tmp_path / "link.txt"
    link.symlink_to(path)
    for each in [None, *(random.randrange(0o1000) for _ in range(40))]:
        if each is not None:
            path.chmod(each)
        name = random.choice((path, link))
        if checkpoint:
            write_checkpoint(name, {}, {})
        else:
            with replacing(name) as temporary:
                temporary.write_text("new")
        mask = os.umask(0)
        os.umask(mask)
        assert mode(path) == (0o666 & ~mask if each is None else each) and link.is_symlink()


def test_file_systems_without_modes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On file systems that refuse to set modes, the file is written nevertheless."""
    path = tmp_path / "a.txt"
    path.touch()

    def refuse(*arguments: object, **options: object) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(os, "chown", refuse)
    monkeypatch.setattr(os, "chmod", refuse)
    with replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give files away")
def test_owners_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.touch()
    os.chown(path, 1234, 2345)
    with replacing(path) as temporary:
        temporary.touch()
    assert (path.stat().st_uid, path.stat().st_gid) == (1234, 2345)


def test_rights_are_not_given_to_another_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the user is not in the file's group, group permissions are removed."""
    path = tmp_path / "a.txt"
    path.touch(0o600)
    path.chmod(0o664)

    def refuse(*arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    before = path.stat()
    monkeypatch.setattr(os, "chown", refuse)
    with replacing(path) as temporary:
        temporary.touch()
    assert mode(path) == 0o664
    monkeypatch.setattr(Path, "stat", _in_group(before.st_gid + 1, path))
    with replacing(path) as temporary:
        temporary.touch()
    monkeypatch.undo()
    assert mode(path) == 0o604


def _in_group(group: int, path: Path) -> Callable[..., os.stat_result]:
    """Return a replacement of Path.stat that reports another group for one file."""
    known = Path.stat

    def found(self: Path, *, follow_symlinks: bool = True) -> os.stat_result:
        result = known(self, follow_symlinks=follow_symlinks)
        if self != path:
            return result
        return os.stat_result((*result[:5], group, *result[6:]))

    return found


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("a.png", ("render", "ball.toml", "-o", "a.png")),
        ("a.ck~", ("render", "ball.toml", "--checkpoint", "a.ck")),
        ("a.toml", ("convert", "a.obj", "a.toml")),
        *others(
            ("a.raw.exr", ("render", "ball.toml", "-o", "a.exr", "--denoise")),
            ("a.depth.png", ("render", "ball.toml", "-o", "a.png", "--aov", "depth")),
            ("a.json", ("render", "ball.toml", "--report", "a.json")),
            ("p.png", ("render", "ball.toml", "--plot", "p.png")),
            ("a.ck", ("render", "ball.toml", "--checkpoint", "a.ck")),
            ("t_0001.png", ("render", "ball.toml", "--turntable", "2", "-o", "t.png")),
            ("t.gif", ("render", "ball.toml", "--turntable", "2", "-o", "t.gif")),
            ("d.txt", ("doctor", "-o", "d.txt")),
        ),
    ],
)
def test_read_only_files(folder: Path, name: str, arguments: tuple[str, ...]) -> None:
    """Nothing is written, and the error names the file; with --force it is replaced and stays read-only."""
    (folder / name).touch()
    (folder / name).chmod(0o444)
    before = sorted(folder.iterdir())
    options = ("--spp", "1", "--size", "16x12") if arguments[0] == "render" else ()
    result = clrt(*arguments, *options, cwd=folder)
    assert result.returncode in {2, 6} and result.stdout == "", result.stderr
    errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1 and errors[0].startswith(f"error: {name}: ") and "--force" in errors[0]
    assert sorted(folder.iterdir()) == before and not (folder / name).stat().st_size
    forced = clrt(*arguments, *options, "--force", cwd=folder)
    assert forced.returncode == 0, forced.stderr
    if name != "a.ck~":
        assert (folder / name).stat().st_size and mode(folder / name) == 0o444


def test_frames_that_are_not_made_again_may_be_read_only(folder: Path) -> None:
    frames = ("render", "ball.toml", "--spp", "1", "--turntable", "2", "-o", "t.png", "--resume")
    assert clrt(*frames, cwd=folder).returncode == 0
    for path in folder.glob("t_*.png"):
        path.chmod(0o444)
    result = clrt(*frames, cwd=folder)
    assert (result.returncode, result.stdout) == (0, ""), result.stderr
