"""Of all tests: which tree they are about, their groups and needs, every OpenCL device there is, and caches."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec
from shutil import which
from typing import TYPE_CHECKING

import pytest

from .program_cache import remove_oldest
from .this_tree import other_file

if TYPE_CHECKING:
    from clrt.device.open import Device

#: Folder → the group of its tests (see setup.cfg).
FOLDERS = {"farm": "farm", "oracle": "statistics", "study": "study", "window": "window"}
#: Of compiled programs kept between runs: one run of all tests makes some 200 MB.
MOST_KEPT_BYTES = 500_000_000
#: Those that decide what a terminal is shown: tests set them themselves, whatever the machine has.
DISPLAY_VARIABLES = ("CI", "COLUMNS", "FORCE_COLOR", "LINES", "NO_COLOR")


def pytest_configure(config: pytest.Config) -> None:
    """Tests of another tree than the one they are in would tell nothing about this one."""
    if not hasattr(config, "workerinput") and (name := other_file()) is not None:
        raise pytest.UsageError(f"the installed clrt is not this tree's ({name} differs): "
                                "run `pip install --editable '.[test]'`")
    # What PoCL compiles is kept in pytest's cache, for all processes of this run and for later ones.
    assert config.cache is not None
    os.environ["POCL_CACHE_DIR"] = str(config.cache.mkdir("pocl"))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Bounds what PoCL keeps, when all workers have ended."""
    if not hasattr(config, "workerinput") and config.cache is not None:
        remove_oldest(config.cache.mkdir("pocl"), MOST_KEPT_BYTES)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The tests of these folders are groups as a whole; others have marks of their own."""
    for item in items:
        if group := FOLDERS.get(item.path.parent.name):
            item.add_marker(group)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test is skipped where a package or a program is missing that it needs and that not every machine can have."""
    for marker in item.iter_markers("needs"):
        for name in marker.args:
            if find_spec(name) is None and which(name) is None:
                pytest.skip(f"needs {name}")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that asks for `device` runs on every usable device; a simulator of one would take hours."""
    if "device" in metafunc.fixturenames:
        from clrt.device.discovery.discover import find_devices

        found = [info for info, _ in find_devices() if info.usable and info.type != "simulator"]
        metafunc.parametrize("device", [info.index for info in found], indirect=True, scope="session",
                             ids=[f"{info.platform}-{info.name}".replace(" ", "_") for info in found])


@pytest.fixture(scope="session", autouse=True)
def fresh_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What clrt keeps, verdicts on devices among them, is kept in a folder of this process's own."""
    with pytest.MonkeyPatch.context() as patch:
        for name in DISPLAY_VARIABLES:
            patch.delenv(name, raising=False)
        patch.setenv("CLRT_CACHE_DIR", str(tmp_path_factory.mktemp("clrt")))
        yield


@pytest.fixture(scope="session")
def device(request: pytest.FixtureRequest) -> Device:
    """An opened device. Programs built for it stay in memory while the tests run."""
    from clrt.device.open import open_device

    return open_device(request.param)
