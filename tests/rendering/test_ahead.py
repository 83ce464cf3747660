"""Programs that are compiled beside a tree's builder: the ones that the scene will need, and once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyopencl
import pytest

import clrt
from clrt.device.open import Device
from clrt.output.images import read_image
from clrt.rendering.ahead import outline
from clrt.rendering.choices import Choices
from clrt.rendering.compile import compile_scene

SCENES = Path(__file__).parents[2] / "scenes"
MODEL = SCENES / "models" / "dragon.ply"
POCL = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))     # which pip brings


@pytest.mark.parametrize("name", ["dragon", "depth_of_field", "sunlit", "night", "spot", "mirrors", "local", "tree"])
def test_an_outline_has_the_scene_s_program(device: Device, name: str) -> None:
    """Also with lamps, textures, lenses, and spheres."""
    scene = clrt.load(SCENES / f"{name}.toml")
    choices = Choices(device.lanes, layout="bvh8", builder="ploc")
    whole, outlined = (compile_scene(each, choices, device=device) for each in (scene, outline(scene)))
    assert outlined.source == whole.source
    assert outlined.counts["triangles"] < whole.counts["triangles"]


def test_each_program_is_compiled_once(tmp_path: Path) -> None:
    """The tree's builder and the scene's, that is."""
    places = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "CLRT_CACHE_DIR": str(tmp_path / "cache"),
              "POCL_CACHE_DIR": str(tmp_path / "kept"), "OCL_ICD_VENDORS": str(POCL)}
    for picture in ("cold.exr", "warm.exr"):
        subprocess.run([sys.executable, "-m", "clrt", "render", str(MODEL), "-q", "--size", "32x18", "--spp", "2", "-o",
                        picture], cwd=tmp_path, env=places, check=True, capture_output=True, timeout=200)
        assert len(list((tmp_path / "kept").rglob("program.bc"))) == 2
    assert np.array_equal(read_image(tmp_path / "cold.exr"), read_image(tmp_path / "warm.exr"))
