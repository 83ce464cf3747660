"""Integrator, depth, exposure and device are changed while the window runs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clrt.output.view_transform import to_display

from .driver import Driver, at, changed, drive, halves
from .scenes import SKY, two_balls


@pytest.mark.programs
def test_integrators_are_switched(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        local = window.picture()
        window.panel("Render")
        window.choose("render/integrator", "normals")
        window.rest()
        normals = window.picture()
        assert at(normals, 80, 5) == [0, 0, 0], "the sky has no normal"
        assert at(normals, 80, 110) == pytest.approx([128, 255, 128], abs=1), "the floor's is +y"
        towards = [127.5 * (1 + part / np.hypot(1.2, 5)) for part in (-1.2, 0, 5)]
        assert at(normals, 119.6, 60) == pytest.approx(towards, abs=3), "the middle of a ball's is towards the camera"

        window.choose("render/integrator", "raster")
        window.rest()
        raster = window.picture()
        assert changed(local, raster).mean() < 0.02, "rays see the same, but for edges"

        window.choose("render/integrator", "path")
        window.rest()
        path = window.picture()
        assert min(halves(changed(local, path))) > 0.2
        assert not changed(local, path)[:20].any(), "the sky is the same"
        assert at(path, 92, 98)[0] > at(local, 92, 98)[0], "between the balls falls red light"

        window.context.item_input_value("render/max_depth", 1)
        window.rest()
        dark = window.picture()
        assert at(dark, 80, 110) == at(dark, 44, 60) == [0, 0, 0], "nothing but what glows"
        assert not changed(path, dark)[:20].any()

        window.context.item_input_value("render/exposure", 1.0)
        window.until(lambda: window.app.viewport.shown.look.exposure == 1, "a lighter picture")  # type: ignore
        expected = to_display(np.array([[SKY]], np.float32), exposure=1)[0, 0]
        assert at(window.picture(), 80, 5) == pytest.approx(expected.tolist(), abs=1)

    drive(two_balls(), test, tmp_path)


@pytest.mark.programs
def test_devices_are_switched(tmp_path: Path) -> None:
    program = f"import sys; sys.path.append('.'); from tests.window.two_devices import main; main({str(tmp_path)!r})"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        env=os.environ | {"POCL_DEVICES": "pthread basic"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
