"""Reported faults of drivers are shown for the versions that have them, and rusticl's variable is named."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pyopencl as cl
import pytest

from clrt.cli.devices import _lines
from clrt.device.discovery.describe_device import describe_empty
from clrt.device.discovery.discover import as_dict, find_devices
from clrt.device.discovery.known_faults import known_faults, reported_faults, version_of

TABLE = [{"platform": "Some CL", "from": "470.57", "before": "515.43", "fault": "it halts", "source": "example.org/1"}]


@pytest.mark.parametrize(
    ("driver", "has"),
    [("470.57", True), ("470.57.02", True), ("515.42.99", True), ("515.43", False), ("470.9", False), ("1000", False)],
)
def test_faults_have_versions(driver: str, has: bool) -> None:
    assert known_faults("some cl ", driver, TABLE) == (("it halts (example.org/1)",) if has else ())
    assert known_faults("Some CLX", driver, TABLE) == ()


def test_faults_without_versions_are_of_all() -> None:
    table = [{"platform": "Some CL", "fault": "it halts", "source": "example.org/1"}]
    assert known_faults("Some CL", "3.0-rc2", table) == known_faults("Some CL", "", table) != ()


def test_versions_are_compared_by_their_numbers() -> None:
    assert version_of("3.0-rc2") == (3, 0) and version_of("26.14.37833.4") == (26, 14, 37833, 4)
    assert version_of("3581.0 (HSA1.1,LC)") == (3581, 0) and version_of("unknown") == ()
    assert version_of("9.10") > version_of("9.9")


def test_every_reported_fault_has_its_source_and_ordered_versions() -> None:
    for each in reported_faults():
        assert re.fullmatch(r"github\.com/[\w.-]+/[\w.-]+/issues/\d+", each["source"]) and each["fault"][0].islower()
        assert set(each) <= {"platform", "from", "before", "fault", "source"}
        assert version_of(each.get("from", "0")) < version_of(each.get("before", "9999"))


def test_faults_are_listed() -> None:
    info = find_devices()[0][0]
    faulty = replace(info, known_faults=("it halts (example.org/1)",))
    assert "     known fault of this driver: it halts (example.org/1)" in list(_lines(faulty))
    assert as_dict(faulty)["known_faults"] == ("it halts (example.org/1)",)
    assert not any("known fault" in line for line in _lines(replace(info, known_faults=())))


@pytest.mark.parametrize(
    ("name", "enabled", "told"),
    [
        ("rusticl", "", "the variable RUSTICL_ENABLE names. Set it to radeonsi for AMD"),
        ("rusticl", "iris", "RUSTICL_ENABLE is 'iris'. Is that the hardware's Mesa driver"),
        ("Some CL", "", "does the driver need an environment variable?"),
    ],
)
def test_a_platform_without_devices_says_why(
    monkeypatch: pytest.MonkeyPatch, name: str, enabled: str, told: str
) -> None:
    monkeypatch.setenv("RUSTICL_ENABLE", enabled)
    info = describe_empty(cast(cl.Platform, SimpleNamespace(name=name, version="OpenCL 3.0 ")))
    assert told in info.why and not info.usable and info.why.endswith("If you do not need it, remove it")
