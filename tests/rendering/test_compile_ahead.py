"""Compiling ahead while the BVH is built: the programs are those that the scene needs, each compiled once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyopencl
import pytest

import clrt
from clrt.device.open import Device
from clrt.device.programs.program import build, compile_ahead
from clrt.errors import UsageError
from clrt.output.images import read_image
from clrt.rendering.compile import compile_ahead as ahead
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_ahead import outline
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.threads import beside

SCENES = Path(__file__).parents[2] / "scenes"
MODEL = SCENES / "models" / "dragon.ply"
POCL = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))  # the copy that pip installs


@pytest.mark.parametrize("name", ["dragon", "depth_of_field", "sunlit", "night", "spot", "mirrors", "local", "tree"])
def test_an_outline_has_the_scene_s_program(device: Device, name: str) -> None:
    """The outline compiles to the scene's program, also with lights, textures, lenses and spheres."""
    scene = clrt.load(SCENES / f"{name}.toml")
    choices = Choices(device.lanes, layout="bvh8", builder="ploc")
    whole, outlined = (compile_scene(each, choices, device=device) for each in (scene, outline(scene)))
    assert outlined.source == whole.source
    assert outlined.counts["triangles"] < whole.counts["triangles"]


@pytest.mark.programs
def test_each_program_is_compiled_once(tmp_path: Path) -> None:
    """A render compiles two programs, the BVH builder's and the scene's, and a second render none."""
    places = {
        "PATH": os.environ["PATH"],
        "HOME": str(tmp_path),
        "CLRT_CACHE_DIR": str(tmp_path / "cache"),
        "POCL_CACHE_DIR": str(tmp_path / "kept"),
        "OCL_ICD_VENDORS": str(POCL),
    }
    for picture in ("cold.exr", "warm.exr"):
        subprocess.run(
            [sys.executable, "-m", "clrt", "render", str(MODEL), "-q", "--size", "32x18", "--spp", "2", "-o", picture],
            cwd=tmp_path,
            env=places,
            check=True,
            capture_output=True,
            timeout=200,
        )
        assert len(list((tmp_path / "kept").rglob("program.bc"))) == 2
    assert np.array_equal(read_image(tmp_path / "cold.exr"), read_image(tmp_path / "warm.exr"))


def test_what_is_refused_is_refused_as_without(device: Device) -> None:
    """Errors are the same as without compiling ahead: two triangles need no BVH, but a scene with instances does."""
    one = clrt.Mesh(np.eye(4, 3, dtype=np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    scene = clrt.Scene(meshes=[one], instances=[clrt.Instance(one, np.eye(3, 4) * (2 + i)) for i in range(40)])
    compiled = compile_scene(scene, Choices(device.lanes, builder="ploc"), device=device, ahead=True)
    assert compiled.tree.name == device.layout
    with pytest.raises(UsageError, match="the builder ploc builds"):
        compile_scene(
            clrt.Scene(meshes=[one]), Choices(device.lanes, layout="list", builder="ploc"), device=device, ahead=True
        )


def test_without_a_temporary_folder_it_is_compiled_here(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    source = "kernel void without_a_folder(global int *x) { x[0] = 1; }"
    with monkeypatch.context() as none:
        none.setattr("tempfile.tempdir", "/no/such/folder")
        compile_ahead(device, source)
    assert build(device, source).program.num_kernels == 1 and not device.shared.ahead


@pytest.mark.parametrize("size, begun", [(16, 1), (2048, 0)])
def test_large_scenes_are_left_alone(device: Device, monkeypatch: pytest.MonkeyPatch, size: int, begun: int) -> None:
    """Nothing is compiled ahead for a scene with a large environment map, whose cost would be paid twice."""
    asked, waits = list[str](), list[Callable[[], None]]()
    monkeypatch.setattr(ahead, "compile_ahead", lambda device, source: asked.append(source))
    monkeypatch.setattr(ahead, "is_kept", lambda device, source: False)
    monkeypatch.setattr(ahead, "_processors", lambda: 2)
    monkeypatch.setattr(ahead, "beside", lambda work, **_: waits.append(beside(work)))
    scene = clrt.load(MODEL)
    scene.environment = clrt.Environment(image=np.ones((size, 2 * size, 3), np.float32))
    compiled = compile_scene(scene, Choices(device.lanes, device.layout), device=device, ahead=True)
    for wait in waits:
        wait()
    assert asked == [compiled.source] * begun
