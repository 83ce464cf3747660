"""Window test of changing the device, run in a process in which PoCL has two devices.

POCL_DEVICES="pthread basic" python -c "from tests.window.two_devices import main; main('folder')"
"""

from __future__ import annotations

from pathlib import Path

from .driver import Driver, drive
from .scenes import two_balls


def main(folder: str) -> None:
    """Run the test; raises AssertionError if it fails."""

    def test(window: Driver) -> None:
        first = window.rest()
        before, devices = window.picture(), [info for info in window.app.editor.devices if info.type == "cpu"]
        assert len(devices) == 2
        other = next(info for info in devices if info.name != first.device)
        window.panel("Render")
        window.choose("render/device", f"{other.name} ({other.platform})")
        second = window.rest()
        assert second.device == other.name and second.settings.device == other.id
        assert abs(before - window.picture()).max() <= 1, "it computes the same"

    drive(two_balls(spp=1, integrator="normals"), test, Path(folder))
