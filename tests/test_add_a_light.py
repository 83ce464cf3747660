"""The light that docs/add-a-light.md adds to a copy of clrt illuminates as its closed form says."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
PAGE = HOUSE / "docs" / "add-a-light.md"
#: A white floor below the light of the page's scene file; prints its radiance below the center of the disk.
PROGRAM = """
import clrt, sys
from dataclasses import replace
scene = clrt.load(sys.argv[1])
floor = clrt.Mesh(vertices=[[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], faces=[[0, 1, 2], [0, 2, 3]],
                  material=clrt.Diffuse(color=(1, 1, 1)))
camera = clrt.Camera(position=(0, 1, 0), look_at=(0, 0, 0), up=(0, 0, 1), fov_degrees=0.01)
print(clrt.render(replace(scene, meshes=[floor], camera=camera), size=(1, 1), spp=4096, max_depth=2).pixels.mean())
"""


def piece(text: str, language: str) -> str:
    """Return the only code block of a language, without its indentation."""
    (code,) = re.findall(rf"^ *```{language}\n(.*?)```", text, re.DOTALL | re.MULTILINE)
    return re.sub("^   ", "", str(code), flags=re.MULTILINE)


@pytest.mark.programs
def test_the_steps_make_a_light(tmp_path: Path) -> None:
    """On the axis of a disk of radius r at the distance d, E = pi·L·r²/(r² + d²), and a white floor reflects E/pi."""
    shutil.copytree(HOUSE / "clrt", tmp_path / "clrt")
    shutil.copytree(HOUSE / "kernels", tmp_path / "clrt" / "kernels")
    text = PAGE.read_text(encoding="utf-8")
    (tmp_path / "clrt/kernels/light/disk.cl").write_text(piece(text, "c"), "utf-8")
    file = tmp_path / "clrt/scene/lights.py"
    above, listed, below = file.read_text(encoding="utf-8").partition("#: Every type of light.\nLight = ")
    file.write_text(f"{above}{piece(text, 'python')}\n\n{listed}DiskLight | {below}", "utf-8")
    (tmp_path / "disk.toml").write_text(piece(text, "toml"), "utf-8")
    done = subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM, tmp_path / "disk.toml"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == pytest.approx(10 * 0.5**2 / (0.5**2 + 4**2), rel=1e-4)
