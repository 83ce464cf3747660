"""`clrt devices --check` end to end, with kernels that are correct, wrong, crash or never end."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import clrt
from clrt.check.run_check import LIMIT, check_device
from clrt.cli import devices
from clrt.device.discovery.discover import find_devices
from clrt.device.open import open_device
from clrt.errors import DeviceError

from ..check.sabotage import sabotaged

pytestmark = pytest.mark.processes

Broken = tuple[str, ...]
#: Start of the kernel in kernels/check/floats.cl, which the first part of the check runs.
IN_FLOATS = r"kernel void floats\(.*\{"


@pytest.fixture(scope="module")
def best() -> str:
    """Return the id of the default device."""
    return open_device().info.id


def run(folder: Path, *arguments: str, broken: Broken = ()) -> subprocess.CompletedProcess[str]:
    """Run `clrt` with a cache in `folder`, optionally with a copy of the package whose kernels are `broken`."""
    environment = {**os.environ, "CLRT_CACHE_DIR": str(folder / "cache")}
    if broken:
        package = Path(clrt.__file__).parent
        if not (folder / "copy").exists():
            shutil.copytree(package, folder / "copy" / "clrt", ignore=shutil.ignore_patterns("kernels", "__pycache__"))
            (sabotaged(folder / "copy" / "clrt" / "kernels", *broken) / "__init__.py").touch()
        environment["PYTHONPATH"] = str(folder / "copy")
    command = [sys.executable, "-P", "-m", "clrt", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)


def listed(result: subprocess.CompletedProcess[str], device: str) -> dict[str, Any]:
    """Return the device's entry in the JSON on standard output."""
    entry: dict[str, Any] = next(entry for entry in json.loads(result.stdout) if entry["id"] == device)
    return entry


def test_a_device_that_computes_right(best: str, tmp_path: Path) -> None:
    assert "check" not in listed(run(tmp_path, "devices", "--json"), best)
    result = run(tmp_path, "devices", "--check", "--device", best, "--json")
    assert result.returncode == 0, result.stderr
    assert [entry["id"] for entry in json.loads(result.stdout)] == [best]
    check = listed(result, best)["check"]
    assert check["passed"] and check["failures"] == [] and check["figures"]["sqrt, ulp"] <= 3
    assert "arithmetic" in result.stderr and "room" in result.stderr
    shown = run(tmp_path, "devices").stdout
    assert f"checked {check['when']}" in shown and "passed" in shown
    assert re.search(r"checks of devices .* 1 deleted", run(tmp_path, "cache", "--clear").stdout)
    assert "check" not in listed(run(tmp_path, "devices", "--json"), best)


def test_a_device_that_computes_wrong(best: str, tmp_path: Path) -> None:
    """Exit code 4 and the part are reported, the verdict is stored and obeyed; the correct kernels are unaffected."""
    broken = (r"\batomic_max\(", "SET(", "#define SET(place, value) (*(place) = (value))")
    result = run(tmp_path, "devices", "--check", "--device", best, broken=broken)
    assert result.returncode == 4 and "Traceback" not in result.stderr
    assert "FAILED" in result.stdout and "memory: atomic_max" in result.stdout
    assert "failed the check" in result.stderr and "update the driver" in result.stderr
    entry = listed(run(tmp_path, "devices", "--json", broken=broken), best)
    assert not entry["check"]["passed"] and all(f.startswith("memory: ") for f in entry["check"]["failures"])
    assert entry["usable"] and not entry["chosen"] and "atomic_max" in entry["why"]

    (tmp_path / "dark.toml").write_text("[render]\nsize = [4, 4]\nspp = 1\n[[sphere]]\n")
    named = run(tmp_path, "render", "dark.toml", "--device", best, broken=broken)
    assert named.returncode == 0 and "its check failed: memory: atomic_max" in named.stderr
    unnamed = run(tmp_path, "render", "dark.toml", broken=broken)
    others = [info for info, _ in find_devices() if info.usable and info.id != best and info.type != "simulator"]
    assert unnamed.returncode == (0 if others else 4) and "Traceback" not in unnamed.stderr
    assert listed(run(tmp_path, "devices", "--json"), best)["chosen"]


def test_a_driver_that_crashes(best: str, tmp_path: Path) -> None:
    result = run(
        tmp_path,
        "devices",
        "--check",
        "--device",
        best,
        "--json",
        broken=(IN_FLOATS, r"\g<0>\n    *(volatile global int *)8 = 1;"),
    )
    assert result.returncode == 4 and "Traceback" not in result.stderr
    (failure,) = listed(result, best)["check"]["failures"]
    assert failure.startswith("arithmetic: ") and "the driver crashed with signal 11" in failure


def test_a_kernel_that_never_ends(best: str, tmp_path: Path) -> None:
    """A limit below the default gives no verdict, since a busy machine may be as slow."""
    broken = (IN_FLOATS, r"\g<0>\n    volatile int ended = 0; while (!ended);")
    result = run(tmp_path, "devices", "--check", "--device", best, "--limit", "6", "--json", broken=broken)
    assert result.returncode == 4 and "Traceback" not in result.stderr
    assert "arithmetic did not finish in 6 s; raise --limit (300 is" in result.stderr
    assert "check" not in listed(run(tmp_path, "devices", "--json", broken=broken), best)


def test_a_check_that_runs_out_of_the_default_limit_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    info = open_device().info
    with pytest.raises(DeviceError, match=r"did not finish in 0\.01 s; raise --limit"):
        check_device(info, 0.01)
    monkeypatch.setattr("clrt.check.run_check.LIMIT", 0.01)
    verdict = check_device(info, 0.01)
    assert not verdict.passed and [failure.partition(": ")[2] for failure in verdict.failures] == [
        "it did not finish in 0.01 s"
    ]


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("nan", "'nan' is not a finite number"),
        ("inf", "'inf' is not a finite number"),
        ("0.5", "0.5 is not in the range"),
    ],
)
def test_limits_that_are_none(limit: str, words: str) -> None:
    refused = CliRunner().invoke(devices.command, ["--limit", limit])
    assert refused.exit_code == 2 and words in refused.output and "--limit" in refused.output


def test_the_limit_is_the_one_that_is_enough() -> None:
    """The default is written out so that --help loads nothing."""
    assert {option.name: option.default for option in devices.command.params}["limit"] == LIMIT


def test_a_device_that_is_not_there(tmp_path: Path) -> None:
    result = run(tmp_path, "devices", "--check", "--device", "nonesuch")
    assert result.returncode == 4 and result.stdout == "" and "nonesuch" in result.stderr
