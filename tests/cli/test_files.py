"""Files the command line never overwrites: devices, inputs, other outputs, unrelated files; only images go to pipes."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import CheckpointError, OutputError
from clrt.farm.manifest import Manifest
from clrt.formats.load_scene import load
from clrt.output.atomic_files import replacing
from clrt.output.images import write_image
from clrt.output.scenes import save_scene

from .test_checkpoints import SCENE
from .test_commands import RUNS, Run, clrt


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    "arguments",
    [
        ("render", "ball.toml", "--report", "pipe.json"),
        ("render", "ball.toml", "--plot", "pipe.png"),
        ("render", "ball.toml", "--checkpoint", "pipe.ck"),
        ("convert", "a.obj", "pipe.toml", "--force"),
        ("doctor", "-o", "pipe.txt"),
    ],
    ids=" ".join,
)
def test_pipes_are_no_targets(folder: Path, run: Run, arguments: tuple[str, ...]) -> None:
    pipe = folder / next(argument for argument in arguments if argument.startswith("pipe"))
    os.mkfifo(pipe)
    before = sorted(folder.iterdir())
    result = run(*arguments, cwd=folder)
    assert (result.returncode, result.stdout, result.stderr.count(f"{pipe.name}: is a device, a pipe")) == (6, "", 1)
    assert stat.S_ISFIFO(os.lstat(pipe).st_mode) and sorted(folder.iterdir()) == before


def test_devices_are_no_targets(folder: Path) -> None:
    try:
        os.mknod(folder / "null", stat.S_IFCHR | 0o666, os.makedev(1, 3))
    except OSError:
        pytest.skip("this user cannot make devices")
    result = clrt("render", "ball.toml", "--report", "null", cwd=folder)
    assert result.returncode == 6 and stat.S_ISCHR(os.lstat(folder / "null").st_mode)


def test_nothing_replaces_a_pipe_that_comes_later(folder: Path) -> None:
    """A pipe is not replaced through a link either; a scene is not written if one of its files would replace a pipe."""
    os.mkfifo(folder / "pipe")
    (folder / "link").symlink_to(folder / "pipe")
    for path in (folder / "pipe", folder / "link"):
        with pytest.raises(OutputError, match="is a device, a pipe"), replacing(path) as temporary:
            temporary.touch()
    with pytest.raises(OutputError, match="is a device, a pipe"):
        os.mkfifo(folder / "b.toml")
        save_scene(load(folder / "ball.toml"), folder / "b.toml")
    assert stat.S_ISFIFO(os.lstat(folder / "pipe").st_mode) and (folder / "link").is_symlink()


def test_links_to_themselves_are_replaced(folder: Path) -> None:
    for arguments in (("render", "ball.toml", "--spp", "1", "-o", "loop.png"), ("convert", "a.obj", "loop.toml")):
        (folder / arguments[-1]).symlink_to(arguments[-1])
        result = clrt(*arguments, cwd=folder)
        assert (result.returncode, result.stdout) == (0, f"{arguments[-1]}\n"), result.stderr
        assert (folder / arguments[-1]).is_file()


@pytest.mark.parametrize(("refusals", "replaced"), [(2, True), (99, False)])
def test_what_cannot_be_replaced_loses_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, refusals: int, replaced: bool
) -> None:
    """Windows cannot replace a file that a program has open: after retries, the new file stays next to it."""
    path, system, refused = folder / "a.png", os.replace, list[Path]()
    path.write_text("old")

    def replace(source: Path, target: Path) -> None:
        if target == path and len(refused) < refusals:
            refused.append(source)
            raise PermissionError(13, "Access is denied")
        system(source, target)

    monkeypatch.setattr(os, "replace", replace)
    if replaced:
        with replacing(path) as temporary:
            temporary.write_text("new")
    else:
        with pytest.raises(OutputError, match="open in another program"), replacing(path) as temporary:
            temporary.write_text("new")
    new = [file for file in folder.glob("*a*.png") if file.read_text() == "new"]
    assert len(new) == 1 and (new[0] == path) == replaced and not list(folder.glob(".clrt*"))
    assert path.read_text() == ("new" if replaced else "old")


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    "options",
    [
        ("--report", "ball.toml"),
        ("--checkpoint", "ball.toml"),
        ("--checkpoint", "ball"),
        ("--report", "./ball.toml"),
        ("--report", "w.exr"),
        ("--plot", "w.exr"),
        ("-o", "w.exr"),
        ("--report", "w.json", "--plot", "w.json"),
        ("--reference", "r.exr", "--report", "r.exr"),
        ("--reference", "r.exr", "--plot", "r.exr"),
        ("--turntable", "2", "--report", "w_####.exr"),
    ],
    ids=" ".join,
)
def test_no_file_is_named_twice(folder: Path, run: Run, options: tuple[str, ...]) -> None:
    (folder / "r.exr").write_text("a reference")
    (folder / "ball").write_text("somebody's file")
    before = {path: path.read_bytes() for path in folder.iterdir()}
    result = run("render", "ball.toml", "-o", "w.exr", *options, cwd=folder)
    code = 3 if "ball" in options else 2
    assert result.returncode == code and result.stdout == "" and "Traceback" not in result.stderr, result.stderr
    said = f"{Path(options[-1])}: {'is' if code == 2 else 'exists and is not a checkpoint'}".replace("####", "0000")
    assert said in result.stderr, result.stderr
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


MODEL = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    "arguments",
    [
        ("a.obj",),
        ("a.obj", "-o", "b.png", "--report", "a.mtl"),
        ("ball.toml", "-o", "sky.hdr"),
        ("ball.toml", "-o", "b.png", "--plot", "paint.png"),
        ("ball.toml", "--turntable", "2", "-o", "t_####.png"),
        ("ball.toml", "-o", "b.png", "--checkpoint", "a.obj"),
    ],
    ids=" ".join,
)
def test_no_file_of_the_scene_is_replaced(folder: Path, run: Run, arguments: tuple[str, ...]) -> None:
    """Scene files (models, .mtl, textures, maps) are checked before the render; a.obj's default output is a texture."""
    (folder / "a.obj").write_text(MODEL)
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    textured = 'type = "diffuse"\ncolor = { image = "%s" }\n'
    (folder / "ball.toml").write_text(
        '[environment]\nimage = "sky.hdr"\n[materials.a]\n'
        + textured % "paint.png"
        + "[materials.b]\n"
        + textured % "t_0001.png"
        + '[[sphere]]\nmaterial = "a"\n[[mesh]]\nfile = "a.obj"\nmaterial = "b"\n'
    )
    for name in ("a.png", "paint.png", "t_0001.png", "sky.hdr"):
        write_image(folder / name, np.ones((4, 8, 3), np.float32))
    before = {path: path.read_bytes() for path in folder.iterdir()}
    result = run("render", *arguments, "--spp", "1", cwd=folder)
    assert (result.returncode, result.stdout) == (2, "") and "is both a file of the scene and" in result.stderr
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_checkpoints_of_any_version_are_replaced(folder: Path) -> None:
    """Damaged checkpoints are replaced too, as far as they can be recognized."""
    for content in (b"clrt checkpoint 1\nold", b"clrt check", b""):
        (folder / "a.ck").write_bytes(content)
        result = clrt("render", "ball.toml", "--spp", "1", "--checkpoint", "a.ck", cwd=folder)
        assert result.returncode == 0 and "will be replaced" in result.stderr, result.stderr


def test_lists_of_bands_replace_their_own_kind_alone(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("somebody's file")
    with pytest.raises(CheckpointError, match="mine: exists and is not a checkpoint"):
        Manifest(tmp_path / "mine", {}, resume=False)
    assert (tmp_path / "mine").read_text() == "somebody's file"
    for _ in range(2):
        Manifest(tmp_path / "a.bands", {}, resume=False).close()
