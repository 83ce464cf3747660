"""Specifics of Windows: the loader's location, and drivers from pip that are not in the registry."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pyopencl as cl
import pytest

from clrt.device.discovery import loader
from clrt.device.discovery.drivers import Driver
from clrt.device.discovery.install_advice import no_device
from clrt.device.discovery.windows_drivers import installed_in, not_loaded, pip_drivers


def test_the_loader_that_the_wheel_bundles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loader lies next to pyopencl, with a digest in its name; without it, as in conda, the system's is used."""
    own = next((Path(cl.__file__).parent / ".libs").glob("libOpenCL*"))
    (tmp_path / "pyopencl.libs").mkdir()
    bundled = tmp_path / "pyopencl.libs" / "opencl-0123.dll"
    shutil.copy(own, bundled)
    monkeypatch.setattr(cl, "__file__", str(tmp_path / "pyopencl" / "__init__.py"))
    monkeypatch.setattr(sys, "platform", "win32")
    assert loader.library()._name == str(bundled) and loader.library().clGetDeviceInfo
    bundled.unlink()
    with pytest.raises(OSError, match="OpenCL.dll"):
        loader.library()


def test_drivers_of_pip(tmp_path: Path) -> None:
    """Drivers are found in Python's prefix and the user's, which may be the same."""
    own, user = str(tmp_path / "own"), str(tmp_path / "user")
    path = tmp_path / "user" / "Library" / "bin" / "intelocl64.dll"
    path.parent.mkdir(parents=True)
    path.touch()
    assert installed_in([own, user, user]) == [Driver(str(path), "pip")]
    assert sys.platform == "win32" or not pip_drivers()


def test_a_driver_that_is_not_loaded() -> None:
    """The message contains the registry command that lists the driver."""
    told = not_loaded(Driver(r"C:\py\Library\bin\intelocl64.dll", "pip"))
    assert told.endswith(
        r'reg add HKLM\SOFTWARE\Khronos\OpenCL\Vendors /v "C:\py\Library\bin\intelocl64.dll" '
        "/t REG_DWORD /d 0"
    )


@pytest.mark.parametrize("named", [None, "three"])
def test_added_to_all_others(monkeypatch: pytest.MonkeyPatch, named: str | None) -> None:
    """Drivers are added to those of the user; then the variable is restored. (Not all Linux loaders read it.)"""
    if named:
        monkeypatch.setenv(loader.FILENAMES, named)
    else:
        monkeypatch.delenv(loader.FILENAMES, raising=False)
    before, seen = dict(os.environ), list[str | None]()

    def platforms() -> list[cl.Platform]:
        seen.append(os.environ.get(loader.FILENAMES))
        return []

    monkeypatch.setattr(loader, "_platforms", platforms)
    loader.load_all(["one", "two"])
    loader.load_all([])
    assert seen == [os.pathsep.join(["one", "two", *filter(None, [named])]), named] and dict(os.environ) == before


@pytest.mark.parametrize(
    ("system", "machine", "told"),
    [
        ("linux", "x86_64", 'pip install "pyopencl[pocl]"'),
        ("linux", "aarch64", "pocl-opencl-icd"),
        ("win32", "AMD64", "pip install intel-opencl-rt msvc-runtime"),
        ("win32", "ARM64", "install your GPU vendor's driver"),
        ("darwin", "arm64", "conda install"),
        ("freebsd14", "amd64", "install your GPU vendor's driver"),
    ],
)
def test_what_to_install(system: str, machine: str, told: str) -> None:
    message = no_device(system, machine)
    assert message.startswith("no OpenCL device: ") and told in message
    assert ("pyopencl[pocl]" in message) == ((system, machine) == ("linux", "x86_64"))
