"""File names that are not UTF-8 are read, written and shown by every command, in any locale."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from clrt.file_names import SHOWN, printable, utf8_path
from clrt.formats.load_scene import load
from clrt.formats.models import SUFFIXES, USD
from clrt.output.images import EXTENSIONS, metadata_of, read_image, write_image

from ..formats.threemf_files import painted
from ..formats.usd_files import mesh, usda, usdz
from .test_commands import SCENE

NAME = os.fsdecode(b"sc\xe8ne")
LOCALES = {
    "C": {"LC_ALL": "C"},
    "ASCII": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "UTF-8": {"LC_ALL": "C.UTF-8"},
}
MODEL = "mtllib \xe9.mtl\nusemtl \xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
SMALL = ("--size", "8x8", "--spp", "1", "-q")
#: Calls, and the suffixes of the files that they write.
CALLS: dict[str, tuple[tuple[str, ...], set[str]]] = {
    "render": (
        (
            "render",
            f"{NAME}.toml",
            *SMALL,
            "-o",
            f"{NAME}1.exr",
            "-o",
            f"{NAME}1.png",
            "-o",
            f"{NAME}1.hdr",
            "--aov",
            "depth",
            "--report",
            f"{NAME}1.json",
            "--plot",
            f"{NAME}1.svg",
            "--checkpoint",
            f"{NAME}1.ck",
        ),
        {"1.exr", "1.png", "1.depth.png", "1.hdr", "1.json", "1.svg", "1.ck"},
    ),
    "by default": (("render", f"{NAME}.toml", *SMALL), {".png"}),
    "textured": (("render", f"{NAME}.obj", *SMALL, "-o", f"{NAME}2.png"), {"2.png"}),
    "frames": (("render", f"{NAME}.toml", *SMALL, "--turntable", "2", "-o", f"{NAME}_#.gif"), {"_#.gif"}),
    "info": (("info", f"{NAME}.toml", "--json"), set()),
    "debug": (("debug", f"{NAME}.obj", "--pixel", "3,3", "--json"), set()),
    "convert": (("convert", "model.obj", f"{NAME}3.toml"), {"3.toml"}),
    "compare": (("compare", f"{NAME}.exr", f"{NAME}.exr", "--json"), set()),
    "relight": (("relight", f"{NAME}.exr", "-o", f"{NAME}5.png"), {"5.png"}),
    "doctor": (("doctor", "-o", f"{NAME}4.json"), {"4.json"}),
    "devices": (("devices", "--json"), set()),
    "cache": (("cache",), set()),
    "view": (("view", "--help"), set()),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a non-UTF-8 name, with a scene, a textured model, and an image."""
    path = tmp_path / os.fsdecode(b"f\xf6lder")
    try:
        path.mkdir()
    except OSError:
        pytest.skip("file names are text here")
    (path / f"{NAME}.toml").write_text(SCENE)
    (path / f"{NAME}.obj").write_text(MODEL, encoding="latin-1")
    (path / "model.obj").write_text(MODEL.replace("\xe9", "m"))
    (path / os.fsdecode(b"\xe9.mtl")).write_text("newmtl \xe9\nmap_Kd \xe9.png\n", encoding="latin-1")
    for name in (f"{NAME}.exr", os.fsdecode(b"\xe9.png")):
        grey = np.full((4, 4, 3), 0.25, np.float32)
        write_image(path / name, grey, aovs={"light_group.key": grey} if name.endswith(".exr") else None)
    return path


def clrt(*arguments: str, cwd: Path, **variables: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-P", "-m", "clrt", *arguments],
        cwd=cwd,
        capture_output=True,
        env=os.environ | {"CLRT_CACHE_DIR": f"{cwd}/{NAME}.cache"} | variables,
    )


def is_text(value: object) -> bool:
    """Return whether a parsed JSON value can be written as UTF-8."""
    return bool(json.dumps(value, ensure_ascii=False).encode())


@given(st.binary(max_size=20))
def test_what_is_shown(name: bytes) -> None:
    """Bytes are shown as Python's escapes, also in streams that cannot encode the characters."""
    shown = name.decode("utf-8", "backslashreplace")
    assert printable(os.fsdecode(name)) == shown
    assert os.fsdecode(name).encode("ascii", SHOWN) == shown.encode("ascii", "backslashreplace")


def test_surrogates_that_are_no_bytes() -> None:
    """Such surrogates can occur in Windows file names."""
    assert printable("a\ud800b") == "a\\ud800b"


@pytest.mark.parametrize("suffix", EXTENSIONS)
def test_pictures(folder: Path, suffix: str) -> None:
    path, pixels = folder / f"{NAME}{suffix}", np.full((2, 3, 3), 0.5, np.float32)
    write_image(path, pixels, metadata={"clrt:a": "b"})
    assert np.allclose(read_image(path), pixels, atol=1 / 255) and path.is_file()
    assert metadata_of(path, "clrt:a") == (None if suffix == ".hdr" else "b")
    with utf8_path(path) as other:
        assert str(other).isascii() and other.read_bytes() == path.read_bytes()


@pytest.mark.needs("lib3mf", "pxr")
def test_models_that_libraries_read(tmp_path: Path, folder: Path) -> None:
    """Their readers need a path in UTF-8, and USD's the suffix, too."""
    sdf = pytest.importorskip("pxr.Sdf")
    painted().write(tmp_path / "a.3mf")
    text = usda(tmp_path, mesh())
    sdf.Layer.FindOrOpen(str(text)).Export(str(tmp_path / "a.usdc"))
    usdz(tmp_path / "a.usdz", {"a.usda": text.read_bytes()})
    text.with_suffix(".usd").write_bytes(text.read_bytes())
    for suffix in (".3mf", *USD):
        (tmp_path / f"a{suffix}").rename(folder / f"{NAME}{suffix}")
    for suffix in (".3mf", *USD):
        assert load(folder / f"{NAME}{suffix}").name == "sc\\xe8ne"


@pytest.mark.parametrize("suffix", sorted(set(SUFFIXES) - {".gltf", ".3mf", *USD}))
def test_models(folder: Path, suffix: str) -> None:
    import trimesh

    path = folder / f"{NAME}{suffix}"
    path.write_bytes(
        trimesh.creation.box().export(file_type=suffix[1:]).encode()
        if suffix in (".obj", ".off")
        else trimesh.creation.box().export(file_type=suffix[1:])
    )
    assert load(path).name == "sc\\xe8ne" and sum(len(mesh.faces) for mesh in load(path).meshes) == 12


@pytest.mark.programs
@pytest.mark.parametrize(
    ("name", "locale"),
    [
        *((name, list(LOCALES)[number % 3]) for number, name in enumerate(CALLS)),
        ("by default", "C"),
        ("by default", "UTF-8"),
    ],
)
def test_every_command(folder: Path, name: str, locale: str) -> None:
    """Files have exactly the given names; JSON is UTF-8."""
    arguments, endings = CALLS[name]
    before = {*folder.iterdir()}
    done = clrt(*arguments, cwd=folder, **LOCALES[locale])
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr
    assert {*folder.iterdir()} - before - {folder / f"{NAME}.cache"} == {folder / f"{NAME}{end}" for end in endings}
    if "--json" in arguments:
        assert is_text(json.loads(done.stdout.decode()))
    for path in folder.glob("*.json"):
        assert is_text(json.loads(path.read_bytes().decode()))
    if name == "render":
        assert json.loads((folder / f"{NAME}1.json").read_text())["scene"] == "sc\\xe8ne"
    if name == "by default":
        assert done.stdout == b"sc\xe8ne.png\n", "the name itself, for other programs"


@pytest.mark.parametrize(
    ("locale", "arguments"),
    [
        *zip(
            cycle(LOCALES),
            [
                ("render", f"{NAME}0.toml"),
                ("render", f"{NAME}.toml", "-o", f"{NAME}.pgn"),
                ("info", f"{NAME}0.obj"),
                ("convert", f"{NAME}.obj", f"{NAME}.toml"),
                ("compare", f"{NAME}0.exr", f"{NAME}.exr"),
                (f"{NAME}",),
                ("debug", f"{NAME}0.toml", "--pixel", "1,1"),
                ("doctor", "-o", f"{NAME}.exe"),
            ],
        )
    ],
)
def test_messages(folder: Path, locale: str, arguments: tuple[str, ...]) -> None:
    done = clrt(*arguments, cwd=folder, **LOCALES[locale])
    told = done.stderr.decode("ascii")
    assert done.returncode in {2, 3, 6} and "sc\\xe8ne" in told and "Traceback" not in told


@pytest.mark.processes
def test_warnings_in_json(folder: Path) -> None:
    """Each line of progress is a JSON object, also if it names a file."""
    (folder / os.fsdecode(b"\xe9.png")).unlink()
    done = clrt("render", f"{NAME}.obj", "--size", "8x8", "--spp", "1", "--progress", "json", cwd=folder)
    told = [json.loads(line) for line in done.stderr.decode().splitlines()]
    assert done.returncode == 0 and is_text(told)
    assert any("\\xe9.png: no such picture file" in line.get("warning", "") for line in told)
