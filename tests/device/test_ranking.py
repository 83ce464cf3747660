"""Device ids, ranking and descriptions, tested with fake drivers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ..covering import others
from .fake_drivers import listed, make_driver, run

pytestmark = pytest.mark.needs("gcc")

#: Stores a speed for devices by name, and prints the resulting device list.
MEASURED = """
import clrt, json, sys
from clrt.device.discovery.discover import find_devices
from clrt.device.device_info import Speed
from clrt.device.discovery.measured_speeds import keep_speed
speeds = json.loads(sys.argv[1])
for info, _ in find_devices():
    if info.name in speeds:
        assert keep_speed(info, Speed(speeds[info.name], speeds[info.name], speeds[info.name]))
print(json.dumps(clrt.devices()))
"""


def measured(folder: Path, **speeds: float) -> list[dict[str, Any]]:
    """Return the devices after storing these speeds in Mrays/s by device name."""
    result = run(folder, "-c", MEASURED, json.dumps(speeds))
    assert result.returncode == 0, result.stderr
    rows: list[dict[str, Any]] = json.loads(result.stdout)
    return rows


@pytest.mark.parametrize("uuids", ["1", *others("0")])
def test_two_equal_gpus(tmp_path: Path, uuids: str) -> None:
    """Equal GPUs have different ids; if the driver reports UUIDs, they stay the same when the order is reversed."""
    ids = []
    for reversed_ in ("0", "1"):
        make_driver(tmp_path / "vendors", "twins", COUNT="2", UUIDS=uuids, REVERSED=reversed_)
        rows = [row for row in listed(tmp_path) if row["platform"] == "twins"]
        ids.append({row["compute_units"]: row["id"] for row in rows})
        assert len(set(ids[-1].values())) == 2 and rows[0]["chosen"]
        assert "same hardware" not in rows[1]["why"]
    if uuids == "1":
        assert ids[0] == ids[1]
        assert {row["compute_units"]: row["hardware"] for row in rows} == {
            100: ["UUID ab" + 30 * "0", "PCI 0000:65:00.0"],
            99: ["UUID ab01" + 28 * "0", "PCI 0000:66:00.0"],
        }


def test_a_device_through_two_platforms(tmp_path: Path) -> None:
    """Equal hardware is recognized by UUID, or else by name; a translation layer ranks after the native driver."""
    for name, choices in {
        "alayer": {"PLATFORM": '"clvk"', "UUIDS": "1"},
        "driver": {"UUIDS": "1"},
        "unlike": {"NAME": '"Other GPU"', "UNITS": "50"},
    }.items():
        make_driver(tmp_path / "vendors", name, **choices)
    first, second, third = [row for row in listed(tmp_path) if row["type"] == "gpu"]
    assert (first["platform"], first["chosen"]) == ("driver", True) and "chosen as the largest gpu" in first["why"]
    assert second["platform"] == "clvk" and "same hardware as device 0" in second["why"] and "Vulkan" in second["why"]
    assert third["platform"] == "unlike" and "same hardware" not in third["why"]


def test_the_fastest_measured_is_chosen(tmp_path: Path) -> None:
    """Measured devices are reordered by speed; one that was not measured keeps its rank by size."""
    for name, units in {"big": "30", "middle": "20", "small": "10"}.items():
        make_driver(tmp_path / "vendors", name, NAME=f'"{name}"', UNITS=units)

    def order(rows: list[dict[str, Any]]) -> list[str]:
        return [row["name"] for row in rows if row["type"] == "gpu"]

    rows = listed(tmp_path)
    assert order(rows) == ["big", "middle", "small"] and rows[0]["why"] == "chosen as the largest gpu, not measured"
    assert order(measured(tmp_path, small=50)) == ["big", "middle", "small"]
    rows = measured(tmp_path, big=40)
    assert order(rows) == ["small", "middle", "big"] and rows[0]["chosen"]
    assert rows[0]["why"] == "chosen as the fastest measured, 50 Mrays/s"
    assert rows[0]["bench"] == {"mrays_primary": 50, "mrays_bounce": 50, "mrays_shadow": 50}
    assert order(measured(tmp_path, middle=45)) == ["small", "middle", "big"]
    for file in (tmp_path / "cache").glob("*.bench.json"):
        file.write_bytes(file.read_bytes().replace(b'"kernels": "', b'"kernels": "0'))
    assert order(listed(tmp_path)) == ["big", "middle", "small"]
