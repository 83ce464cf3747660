"""Device speeds are cached per device, driver and kernels, robust to damaged files; `devices --bench` measures them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from clrt.device.device_info import DeviceInfo, Speed
from clrt.device.discovery import kept_results
from clrt.device.discovery.discover import find_devices
from clrt.device.discovery.measured_speeds import keep_speed, kept_speed

from .fake_drivers import make_driver, run

SPEED = Speed(30.0, 10.0, 15.0)


@pytest.fixture
def info(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DeviceInfo:
    """Return a device of this machine, with a cache of the test's own."""
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    return find_devices()[0][0]


def test_a_speed_comes_back(info: DeviceInfo, monkeypatch: pytest.MonkeyPatch) -> None:
    """A speed is valid until driver or kernels change. With equal ray counts: 3 / (1/30 + 1/10 + 1/15) = 15."""
    assert kept_speed(info) is None and keep_speed(info, SPEED)
    assert kept_speed(info) == SPEED and SPEED.mrays == pytest.approx(15)
    assert kept_speed(replace(info, driver="2")) is None
    monkeypatch.setattr(kept_results, "kernel_digest", lambda: "another")
    assert kept_speed(info) is None


@pytest.mark.parametrize("bench", [None, {}, {"mrays_primary": 1}, [1, 2, 3], "", 0.0, -1.0, float("nan"), "x"])
def test_whatever_the_file_holds(info: DeviceInfo, tmp_path: Path, bench: object) -> None:
    """Replaces all of the figures or one of them by a malformed value."""
    keep_speed(info, SPEED)
    (file,) = tmp_path.glob("*.bench.json")
    kept = json.loads(file.read_bytes())
    one = isinstance(bench, float | str)
    file.write_text(json.dumps(kept | {"result": kept["result"] | {"mrays_bounce": bench} if one else bench}))
    assert kept_speed(info) is None
    file.write_bytes(b"\xff[")
    assert kept_speed(info) is None


@pytest.mark.programs
@pytest.mark.needs("gcc")
def test_measuring(tmp_path: Path) -> None:
    """The best device is measured and then ranked by its speed; one that cannot compute gives exit code 4."""
    make_driver(tmp_path / "vendors", "fake", TYPE="2", UNITS="1")
    bench = run(tmp_path, "-m", "clrt", "devices", "--bench", "--json")
    assert bench.returncode == 4 and "Fake GPU cannot be measured" in bench.stderr and "Traceback" not in bench.stderr
    rows = {row["name"]: row for row in json.loads(bench.stdout)}
    assert "bench" not in rows["Fake GPU"]
    best = next(row for row in rows.values() if row["chosen"])
    assert set(best["bench"]) == {"mrays_primary", "mrays_bounce", "mrays_shadow"}
    assert all(0.01 < mrays < 1e5 for mrays in best["bench"].values())
    assert best["why"].startswith("chosen as the fastest measured, ")
    assert json.loads(run(tmp_path, "-m", "clrt", "devices", "--json").stdout)[0]["bench"] == best["bench"]
