"""The material that docs/add-a-material.md adds to a copy of clrt reflects what its formula says."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HOUSE = Path(__file__).parents[1]
PAGE = HOUSE / "docs" / "add-a-material.md"
COLOR, ROUGHNESS = 0.6, 0.8
#: A plane under a sky of radiance 1, seen from the top and from the side; prints its radiance.
PROGRAM = f"""
import clrt, numpy
from clrt.scene.materials.material_types import OrenNayar
plane = clrt.Mesh(vertices=[[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], faces=[[0, 1, 2], [0, 2, 3]],
                  material=OrenNayar(color=({COLOR},) * 3, roughness={ROUGHNESS}))
for degrees in (0, 75):
    angle = numpy.radians(degrees)
    camera = clrt.Camera(position=(0, numpy.cos(angle), numpy.sin(angle)), up=(0, 0.6, -0.8),
                         projection="orthographic", view_height=0.1)
    scene = clrt.Scene(meshes=[plane], camera=camera, environment=clrt.Environment(color=(1, 1, 1)))
    print(clrt.render(scene, size=(32, 32), spp=256, max_depth=2).pixels.mean())
"""


def reflected(cosine: float) -> float:
    """Return the integral of f·cos over the hemisphere by the midpoint rule: radiance towards a view at this cosine."""
    a = 1 / (np.pi + (np.pi / 2 - 2 / 3) * ROUGHNESS)
    steps = 1000
    z = np.sqrt((np.arange(steps) + 0.5) / steps)[:, None]  # equal steps of z² are equal projected solid angles
    phi = (np.arange(steps) + 0.5) / steps * 2 * np.pi
    s = np.sqrt(1 - z**2) * np.sqrt(1 - cosine**2) * np.cos(phi)
    t = np.where(s > 0, np.maximum(z, cosine), 1)
    return float(COLOR * np.pi * (a + a * ROUGHNESS * s / t).mean())


@pytest.mark.programs
def test_the_steps_make_a_material(tmp_path: Path) -> None:
    shutil.copytree(HOUSE / "clrt", tmp_path / "clrt")
    shutil.copytree(HOUSE / "kernels", tmp_path / "clrt" / "kernels")
    text = PAGE.read_text(encoding="utf-8")
    (kernel,) = re.findall(r"^ *```c\n(.*?)```", text, re.DOTALL | re.MULTILINE)
    (record,) = re.findall(r"^ *```python\n(.*?)```", text, re.DOTALL | re.MULTILINE)
    (tmp_path / "clrt/kernels/bsdf/oren_nayar.cl").write_text(re.sub("^   ", "", kernel, flags=re.MULTILINE))
    file = tmp_path / "clrt/scene/materials/material_types.py"
    above, listed, below = file.read_text(encoding="utf-8").partition("MATERIALS: tuple[type[Material], ...] = (")
    file.write_text(f"{above}{re.sub('^   ', '', record, flags=re.MULTILINE)}\n\n{listed}OrenNayar, {below}", "utf-8")
    done = subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    expected = [reflected(np.cos(np.radians(degrees))) for degrees in (0, 75)]
    assert json.loads(f"[{','.join(done.stdout.split())}]") == pytest.approx(expected, rel=1e-3)
