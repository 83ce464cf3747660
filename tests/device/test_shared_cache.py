"""The cache folder shared by several processes, and unwritable cache folders."""

from __future__ import annotations

import ctypes
import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from clrt.device import cache_files as cache, driver_caches
from clrt.device.driver_caches import ROOM
from clrt.device.programs import background_compile
from clrt.errors import KernelError
from clrt.output.images import read_image

pytestmark = pytest.mark.processes

SCENE = "[render]\nsize = [16, 8]\nspp = 2\n[environment]\ncolor = [1, 1, 1]\n[[sphere]]\n"
RENDER = (sys.executable, "-P", "-m", "clrt", "render", "scene.toml", "-q", "-o")
DROP_CAPABILITY, CAPABILITIES = 24, 64  # of prctl(2)


def surroundings(**more: str) -> dict[str, str]:
    """Return the environment without variables that set cache locations, plus these."""
    named = ("CLRT_CACHE_DIR", "XDG_CACHE_HOME", "POCL_CACHE_DIR", "HOME", "TMPDIR")
    return {name: value for name, value in os.environ.items() if name not in named} | more


def no_rights() -> None:
    """Drop root's capability to bypass file permissions; other users have nothing to drop."""
    for capability in range(CAPABILITIES):
        ctypes.CDLL(None).prctl(DROP_CAPABILITY, capability, 0, 0, 0)


def test_eight_processes_start_on_a_cold_cache(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    places = surroundings(HOME=str(tmp_path), CLRT_CACHE_DIR=str(tmp_path / "cache"))
    started = [
        subprocess.Popen([*RENDER, f"{number}.exr"], cwd=tmp_path, env=places, stderr=subprocess.PIPE)
        for number in range(8)
    ]
    told = [process.communicate(timeout=200)[1] for process in started]
    assert [process.returncode for process in started] == [0] * 8, told
    pictures = [read_image(tmp_path / f"{number}.exr") for number in range(8)]
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures) and pictures[0].max() > 0
    assert not list((tmp_path / "cache").glob("unfinished-*"))


@pytest.mark.parametrize(
    "home", ["a read-only home", "no home", "a home that cannot be told", "a cache of PoCL's that is read-only"]
)
def test_whatever_the_home_is(tmp_path: Path, home: str) -> None:
    """The image is written, and nothing is written into a folder named ~."""
    (tmp_path / "scene.toml").write_text(SCENE)
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o555)
    places = {
        "a read-only home": {"HOME": str(closed), "CLRT_CACHE_DIR": str(closed / "clrt")},
        "no home": {},
        "a home that cannot be told": {"HOME": "~"},
        "a cache of PoCL's that is read-only": {"HOME": str(tmp_path), "POCL_CACHE_DIR": str(closed)},
    }[home]
    result = subprocess.run(
        [*RENDER, "picture.png"],
        cwd=tmp_path,
        env=surroundings(TMPDIR=str(tmp_path), **places),
        capture_output=True,
        text=True,
        timeout=100,
        preexec_fn=no_rights,
    )
    assert (result.returncode, result.stdout) == (0, "picture.png\n"), result.stderr
    assert not (tmp_path / "~").exists() and not list(closed.iterdir())


@pytest.mark.parametrize("most", [0, 20_000, 100_000])
def test_where_no_file_can_be_written_the_cause_is_named(tmp_path: Path, most: int) -> None:
    """By every limit, whatever the driver does: it does not load, cannot build, or aborts."""
    (tmp_path / "scene.toml").write_text(SCENE)
    done = subprocess.run(
        [*RENDER, "-"],
        cwd=tmp_path,
        env=surroundings(HOME=str(tmp_path), TMPDIR=str(tmp_path)),
        capture_output=True,
        timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)),
    )
    told = done.stderr.decode()
    assert done.returncode in (4, 5) and f"no file of {ROOM >> 10} kB can be written in" in told, told
    assert "Traceback" not in told


def test_memory_is_taken_where_the_temporary_folder_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also by users to whom neither folder belongs, as is usual."""
    memory = tmp_path / "memory"
    memory.mkdir()
    monkeypatch.setattr(driver_caches, "MEMORY", str(memory))

    def has_room(folder: str) -> bool:
        Path(folder).mkdir(parents=True, exist_ok=True)
        return folder.startswith(str(memory))

    monkeypatch.setattr(driver_caches, "_has_room", has_room)
    monkeypatch.setattr(os, "getuid", lambda: os.stat(memory).st_uid + 1, raising=False)
    for name in ("XDG_CACHE_HOME", "POCL_CACHE_DIR"):
        monkeypatch.setenv(name, str(tmp_path))
    driver_caches.provide_cache_folders()
    assert os.environ["XDG_CACHE_HOME"].startswith(str(memory)) and not driver_caches.no_room()


def test_the_cause_is_not_named_where_there_is_room(tmp_path: Path) -> None:
    code = "from clrt.device.driver_caches import no_room; print(repr(no_room()))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=surroundings(TMPDIR=str(tmp_path), HOME="/nonexistent"),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "''\n"


@pytest.mark.parametrize("missing", [0, 1])
def test_a_folder_without_room_is_not_taken(tmp_path: Path, missing: int) -> None:
    """As on a full disk, or beyond a quota."""
    code = f"from clrt.device.driver_caches import _writable; print(_writable({str(tmp_path)!r}))"
    places = surroundings(TMPDIR=str(tmp_path), HOME=str(tmp_path))
    most = ROOM - missing
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=places,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)),
    )
    assert (done.returncode, done.stdout) == (0, f"{not missing}\n"), done.stderr


def test_a_compiler_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(background_compile, "SLOW", 0.1)
    monkeypatch.setattr(background_compile, "LIMIT", 0.4)
    comes_back, start = threading.Event(), time.monotonic()
    with pytest.raises(KernelError, match="Fake GPU has been compiling a kernel for 0.4 s"):
        background_compile.in_background("Fake GPU", comes_back.wait)
    assert 0.4 <= time.monotonic() - start < 100
    assert "Fake GPU has been compiling a kernel for 0.1 s" in caplog.text
    comes_back.set()


def test_what_a_compiler_gives_or_raises_comes_through() -> None:
    assert background_compile.in_background("Fake GPU", lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        background_compile.in_background("Fake GPU", lambda: 1 // 0)


def test_what_cannot_be_kept_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    (tmp_path / "a.bin").mkdir()
    assert not cache.write_file("a.bin", b"1234")
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


def test_everything_that_is_kept_is_of_a_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path / "cache"))
    names = [
        "0a.bin",
        "1.check.json",
        "1.bench.json",
        "1.tuning.json",
        "2.driver.json",
        "1.loops.json",
        "3.gpu.json",
        "reference-7.npz",
        "unfinished-1",
    ]
    for name in names:
        assert cache.write_file(name, b"1234")
    cache.keep_log("build", "all is well")
    assert cache.kept_logs()["build"].endswith("all is well\n")
    (tmp_path / "cache" / "2.bin").mkdir()
    sizes = cache.sizes()
    assert set(sizes) == set(cache.KINDS) and all(count >= 1 for count, _ in sizes.values())
    assert sizes["speeds of devices"] == (1, 4)
    assert sum(cache.clear(pattern) for pattern in cache.KINDS.values()) == len(names) + 1
    assert [path.name for path in (tmp_path / "cache").iterdir()] == ["2.bin"]
