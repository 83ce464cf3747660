"""Cameras of Mitsuba and pbrt whose image is not centered on the optical axis: rays through points of the image."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.rendering.compile.camera_kernel import launch_record

from .pbrt_files import scene

SIZE = (60, 40)
RNG = np.random.default_rng(11)
PLACES = RNG.uniform(0, 1, (20, 2))


def rays(camera: clrt.Camera) -> NDArray[np.float64]:
    """Return unit directions (20, 3) through PLACES, fractions of the image from its upper left corner."""
    record: Any = launch_record(camera, SIZE)[0]
    right, up, forward = (record[name].astype(np.float64) for name in ("right", "up", "forward"))
    sx, sy = 2 * PLACES[:, :1] - 1, 2 * PLACES[:, 1:] - 1
    found = sx * right - sy * up + forward
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


@pytest.mark.needs("mitsuba")
def test_mitsubas_principal_point(tmp_path: Path) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for across, down in RNG.uniform(-0.4, 0.4, (5, 2)):
        text = f"""<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="50"/>
            <float name="principal_point_offset_x" value="{across}"/>
            <float name="principal_point_offset_y" value="{down}"/>
            <transform name="to_world"><lookat origin="1, 2, 3" target="0, -1, 0.5" up="0, 1, 0.2"/></transform>
            <film type="hdrfilm"><integer name="width" value="60"/><integer name="height" value="40"/></film></sensor>
            <shape type="sphere"/></scene>"""
        (tmp_path / "a.xml").write_text(text)
        sensor = mi.load_string(text).sensors()[0]
        wanted = [sensor.sample_ray(0, 0.5, mi.Point2f(*place), mi.Point2f(0.5, 0.5))[0].d for place in PLACES.tolist()]
        np.testing.assert_allclose(rays(clrt.load(tmp_path / "a.xml").camera), np.array(wanted), atol=2e-6)


def test_pbrts_screen_window(tmp_path: Path) -> None:
    """A point of the screen at z = 1 is the window's, times the tangent of half of `fov`; the view is along +z, and the
    camera mirrors, so that the image's right is −x."""
    for left, low in RNG.uniform(-2, -0.5, (5, 2)):
        right, top = RNG.uniform(0.5, 2, 2)
        read = scene(
            tmp_path,
            'Shape "sphere"',
            f'Film "rgb" "integer xresolution" 60 "integer yresolution" 40\n'
            f'Scale -1 1 1 Camera "perspective" "float fov" 70 "float screenwindow" [{left} {right} {low} {top}]\n',
        )
        screen = np.array([left, top]) + PLACES * [right - left, low - top]
        wanted = np.column_stack([screen * np.tan(np.radians(35)) * [-1, 1], np.ones(len(PLACES))])
        np.testing.assert_allclose(rays(read.camera), wanted / np.linalg.norm(wanted, axis=1, keepdims=True), atol=2e-6)
