"""Fixtures of all rooms: every OpenCL device there is, and a cache of programs that no other run has touched."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from .this_tree import other_file

if TYPE_CHECKING:
    from clrt.device.open import Device


def pytest_configure(config: pytest.Config) -> None:
    """Tests of another tree than the one they are in would tell nothing about this one."""
    if not hasattr(config, "workerinput") and (name := other_file()) is not None:
        raise pytest.UsageError(f"the installed clrt is not this tree's ({name} differs): "
                                "run `pip install --editable '.[test]'`")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that asks for `device` runs on every usable device; a simulator of one would take hours."""
    if "device" in metafunc.fixturenames:
        from clrt.device.discover import find_devices

        found = [info for info, _ in find_devices() if info.usable and info.type != "simulator"]
        metafunc.parametrize("device", [info.index for info in found], indirect=True, scope="session",
                             ids=[f"{info.platform}-{info.name}".replace(" ", "_") for info in found])


@pytest.fixture(scope="session", autouse=True)
def fresh_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Programs are cached in a folder of this run's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CLRT_CACHE_DIR", str(tmp_path_factory.mktemp("programs")))
        yield


@pytest.fixture(scope="session")
def device(request: pytest.FixtureRequest) -> Device:
    """An opened device. Programs built for it stay in memory while the tests run."""
    from clrt.device.open import open_device

    return open_device(request.param)
