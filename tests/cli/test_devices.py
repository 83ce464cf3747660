"""`clrt devices --check` from end to end, with kernels that are right, wrong, crash and never end."""

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

import clrt
from clrt.device.discover import find_devices
from clrt.device.open import open_device

from ..check.sabotage import sabotaged

Broken = tuple[str, ...]
#: Of kernels/check/floats.cl, whose part of the check is the first.
IN_FLOATS = r"kernel void floats\(.*\{"


@pytest.fixture(scope="module")
def best() -> str:
    """The id of the device that is used when none is named."""
    return open_device().info.id


def run(folder: Path, *arguments: str, broken: Broken = ()) -> subprocess.CompletedProcess[str]:
    """`clrt` with a cache in `folder`, and where asked for with a copy of the package whose kernels are `broken`."""
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
    """What the JSON on standard output says of the device."""
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
    """Exit code 4, the part named, the verdict kept and obeyed, and the right kernels none the worse."""
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


@pytest.mark.parametrize(("statement", "limit", "words"), [
    ("*(volatile global int *)8 = 1;", "300", "the driver crashed with signal 11"),
    ("volatile int ended = 0; while (!ended);", "6", "it did not finish in 6 s"),
], ids=["crash", "hang"])
def test_a_driver_that_does_not_come_back(best: str, tmp_path: Path, statement: str, limit: str, words: str) -> None:
    result = run(tmp_path, "devices", "--check", "--device", best, "--limit", limit, "--json",
                 broken=(IN_FLOATS, rf"\g<0>\n    {statement}"))
    assert result.returncode == 4 and "Traceback" not in result.stderr
    failure, = listed(result, best)["check"]["failures"]
    assert failure.startswith("arithmetic: ") and words in failure


def test_a_device_that_is_not_there(tmp_path: Path) -> None:
    result = run(tmp_path, "devices", "--check", "--device", "nonesuch")
    assert result.returncode == 4 and result.stdout == "" and "nonesuch" in result.stderr
