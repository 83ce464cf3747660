"""Shared test configuration: check of the installed tree, test groups, skips, the `device` fixture, and caches."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from shutil import which
from typing import TYPE_CHECKING

import pytest

from .program_cache import remove_oldest
from .this_tree import other_file

if TYPE_CHECKING:
    from clrt.device.device_info import DeviceInfo
    from clrt.device.open import Device

#: Folder → the group of its tests (see setup.cfg).
FOLDERS = {"farm": "farm", "oracle": "statistics", "bench": "study", "window": "window"}
#: Limit on PoCL's cache of compiled programs between runs; one run of all tests adds about 200 MB.
MOST_KEPT_BYTES = 500_000_000
# With threads of its own in each of several test processes, OpenBLAS takes the time of all cores to wait.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
#: Variables that control terminal output. Tests set them themselves, regardless of the machine's environment.
DISPLAY_VARIABLES = ("CI", "COLUMNS", "FORCE_COLOR", "LINES", "NO_COLOR")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse to run if the installed clrt comes from another tree, and set PoCL's cache folder."""
    if not hasattr(config, "workerinput") and (name := other_file()) is not None:
        raise pytest.UsageError(
            f"the installed clrt is not this tree's ({name} differs): run `pip install --editable '.[test]'`"
        )
    # PoCL's programs are cached in pytest's cache, for all processes of this run and for later runs.
    assert config.cache is not None
    os.environ["POCL_CACHE_DIR"] = str(config.cache.mkdir("pocl"))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Limit the size of PoCL's cache after all workers have ended."""
    if not hasattr(config, "workerinput") and config.cache is not None:
        remove_oldest(config.cache.mkdir("pocl"), MOST_KEPT_BYTES)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark all tests of the folders in FOLDERS with their group; other tests have their own marks."""
    for item in items:
        if group := FOLDERS.get(item.path.parent.name):
            item.add_marker(group)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test if an optional package or program that it needs is missing."""
    for marker in item.iter_markers("needs"):
        for name in marker.args:
            if find_spec(name) is None and which(name) is None:
                pytest.skip(f"needs {name}")


@cache
def tested_devices() -> list[DeviceInfo]:
    """Return all usable devices, except simulators, which would take hours."""
    from clrt.device.discovery.discover import find_devices

    return [info for info, _ in find_devices() if info.usable and info.type != "simulator"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the `device` fixture on every tested device."""
    if "device" in metafunc.fixturenames:
        found = tested_devices()
        metafunc.parametrize(
            "device",
            [info.index for info in found],
            indirect=True,
            scope="session",
            ids=[f"{info.platform}-{info.name}".replace(" ", "_") for info in found],
        )


@pytest.fixture(scope="session", autouse=True)
def fresh_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a fresh clrt cache folder, device verdicts included, for each test process."""
    with pytest.MonkeyPatch.context() as patch:
        for name in DISPLAY_VARIABLES:
            patch.delenv(name, raising=False)
        patch.setenv("CLRT_CACHE_DIR", str(tmp_path_factory.mktemp("clrt")))
        yield


@pytest.fixture(scope="session")
def device(request: pytest.FixtureRequest) -> Device:
    """Return an opened device. Programs built for it stay in memory while the tests run."""
    from clrt.device.open import open_device

    return open_device(request.param)
