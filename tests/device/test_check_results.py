"""Verdicts of checks are stored for the device, driver, kernels and version checked, and affect the selection."""

from __future__ import annotations

import copy
import json
import logging
from dataclasses import replace
from pathlib import Path

import pytest

from clrt.device import cache_files
from clrt.device.device_info import DeviceInfo, Speed, Verdict
from clrt.device.discovery import check_results, discover
from clrt.device.discovery.check_results import forget_verdicts, keep_verdict, kept_verdict
from clrt.device.discovery.discover import as_dict, choose, find_devices
from clrt.device.programs.kernel_files import kernel_digest
from clrt.errors import DeviceError

PASSED = Verdict(True, [], "2026-11-21T20:00:00+00:00", 9.5, kernel_digest(), {"sqrt, ulp": 0.5, "denormals": "kept"})
FAILED = Verdict(False, ["sums: 3 of 8 wrong", "room: dark"], "2026-11-21T20:00:00+00:00", 9.5, kernel_digest(), {})


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a cache folder of the test's own."""
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("CLRT_DEVICE", raising=False)
    return tmp_path


@pytest.fixture
def info() -> DeviceInfo:
    return find_devices()[0][0]


def test_devices_have_hashes(info: DeviceInfo) -> None:
    """Hashes agree with equality, verdict and speed included."""
    several = [
        replace(info, check=check, bench=bench) for check in (None, PASSED, FAILED) for bench in (None, Speed(1, 2, 3))
    ]
    copies = [copy.deepcopy(each) for each in several]
    assert {each: i for i, each in enumerate(several)} == {each: i for i, each in enumerate(copies)}
    assert len(set(several + copies)) == 6


@pytest.mark.parametrize("verdict", [PASSED, FAILED])
def test_a_verdict_comes_back(info: DeviceInfo, verdict: Verdict) -> None:
    assert kept_verdict(info) is None
    assert keep_verdict(info, verdict)
    assert kept_verdict(info) == verdict
    assert find_devices()[0][0].check == verdict
    assert forget_verdicts() == 1 and kept_verdict(info) is None


def test_another_driver_is_not_checked(info: DeviceInfo) -> None:
    keep_verdict(info, FAILED)
    for other in (replace(info, driver="2"), replace(info, platform_version="2"), replace(info, id="2")):
        assert kept_verdict(other) is None


@pytest.mark.parametrize("changed", ["discovery.check_results.kernel_digest", "device_info.version"])
def test_other_kernels_are_not_checked(info: DeviceInfo, changed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_verdict(info, FAILED)
    monkeypatch.setattr(f"clrt.device.{changed}", lambda *_: "another")
    assert kept_verdict(info) is None


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"verdict": 1}',
        "swapped",
        "no failures",
        "no figures",
        "nested figures",
        "no time",
    ],
)
def test_whatever_the_file_holds(info: DeviceInfo, folder: Path, content: bytes | str) -> None:
    keep_verdict(info, FAILED)
    (file,) = folder.iterdir()
    if isinstance(content, str):
        kept = json.loads(file.read_bytes())
        changes = {
            "swapped": {"passed": True},
            "no failures": {"failures": 3},
            "no figures": {"figures": None},
            "nested figures": {"figures": {"a": [1]}},
            "no time": {"seconds": 10**400},
        }
        kept["verdict"] |= changes[content]
        content = json.dumps(kept).encode()
    file.write_bytes(content)
    assert kept_verdict(info) is None
    assert find_devices()[0][0].chosen


def test_a_folder_that_cannot_be_used(info: DeviceInfo, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "file").write_text("")
    monkeypatch.setenv("CLRT_CACHE_DIR", str(folder / "file"))
    assert not keep_verdict(info, FAILED) and kept_verdict(info) is None and forget_verdicts() == 0
    monkeypatch.setenv("CLRT_CACHE_DIR", str(folder))
    (folder / f"{info.id}.{check_results.KIND}").mkdir()
    assert not keep_verdict(info, FAILED) and kept_verdict(info) is None
    assert forget_verdicts() == 0 and cache_files.clear() == 0


def test_a_device_that_failed_is_used_only_if_named(info: DeviceInfo, caplog: pytest.LogCaptureFixture) -> None:
    """If no other device is available, the error says what to do."""
    for other, _ in find_devices():
        keep_verdict(other, FAILED)
    failed = find_devices()[0][0]
    assert failed.usable and not failed.chosen and "sums: 3 of 8 wrong (and 1 more)" in failed.why
    with pytest.raises(DeviceError, match=r"(?s)Update the driver .*--check.*select a device.*failed its check"):
        choose()
    with caplog.at_level(logging.WARNING):
        for selector in (failed.id, 0, "0", failed.type):
            assert choose(selector)[0].type == failed.type
    assert len(caplog.records) == 4 and "sums: 3 of 8 wrong" in caplog.text
    keep_verdict(info, PASSED)
    assert choose()[0].id == info.id
    assert as_dict(choose()[0])["check"]["passed"] is True


def test_the_next_best_is_used(info: DeviceInfo, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the first of three equal devices failed, the second is used, also if only the type is given."""
    own = next(device for each, device in find_devices() if each.id == info.id)
    monkeypatch.setattr(discover, "load_platforms", lambda again: ([None], {}))
    monkeypatch.setattr(discover, "devices_of", lambda platform: 3 * [own])
    infos = [info for info, _ in find_devices()]
    assert len({info.id for info in infos}) == 3
    keep_verdict(infos[0], FAILED)
    keep_verdict(infos[2], FAILED)
    assert [info.chosen for info, _ in find_devices()] == [False, True, False]
    assert choose()[0].index == choose(info.type)[0].index == 1
