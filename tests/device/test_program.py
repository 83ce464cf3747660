"""Programs from files: what is included, what is built, and that no cache_files, however broken, is in the way."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import get_args

import numpy as np
import pyopencl as cl
import pytest

import clrt
from clrt.accel import refit
from clrt.accel.device_builder import SHAPES, program_source
from clrt.accel.traversal_kernels import BOX_TESTS, SPHERE_TESTS, TRIANGLE_TESTS, HitTests
from clrt.bench.numerics.bsdf_cases import variants
from clrt.check import kernel_calls
from clrt.debug.record import vertex_preamble
from clrt.device import cache_files
from clrt.device.device_info import Paths
from clrt.device.launches.driver_loop_limits import turns_source
from clrt.device.open import Device
from clrt.device.programs.program import BuiltProgram, build, compose, files_of, make_kernel
from clrt.errors import KernelError
from clrt.rendering.accumulation.first_hits import first_hit_program
from clrt.rendering.aovs import AOVS
from clrt.rendering.compile.choices import OFFSETS, Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry import instancing
from clrt.scene.materials.material_types import MATERIALS
from clrt.scene.model import Environment, Scene, Sphere
from clrt.scene.ray_list import Measured, RayList
from clrt.scene.render_settings import Filter, Sampler

from ..covering import others
from ..rendering.lamps import lamps
from ..rendering.test_variants import everything, painted, planted, shelf, sights
from ..rendering.test_wavefront import catching

KERNELS = Path(str(files("clrt.kernels")))
FILES = sorted(str(path.relative_to(KERNELS)) for path in KERNELS.rglob("*.cl"))
DOUBLE = "kernel void twice(global float *x) { x[get_global_id(0)] *= 2.0f; }"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of three kernel files that include each other."""
    (tmp_path / "a.cl").write_text('#include "b.cl"\n#include CHOSEN\nint a;\n')
    (tmp_path / "b.cl").write_text("int b;\n")
    (tmp_path / "c.cl").write_text('#include "b.cl"\nint c;\n')
    return tmp_path


def test_a_file_is_included_once(folder: Path) -> None:
    """A file is included at its first mention; #line names the file that follows."""
    text = compose("int first;", "a.cl", {"CHOSEN": ["c.cl", "b.cl"]}, folder)
    assert re.findall(r"int (\w+);", text) == ["first", "b", "c", "a"]
    assert re.findall(r'#line 1 "(.+)"', text) == ["a.cl", "b.cl", "c.cl"]
    lines = text.splitlines()
    assert lines[lines.index("int a;") - 1] == '#line 3 "a.cl"'


def test_a_choice_may_be_no_file(folder: Path) -> None:
    assert "int c;" not in compose("", "a.cl", {"CHOSEN": []}, folder)


@pytest.mark.parametrize(("choices", "error"), [({}, KeyError), ({"CHOSEN": ["d.cl"]}, FileNotFoundError)])
def test_unknown_includes_are_errors(folder: Path, choices: dict[str, list[str]], error: type[Exception]) -> None:
    with pytest.raises(error, match="CHOSEN|d.cl"):
        compose("", "a.cl", choices, folder)


def test_includes_stand_outside_conditions() -> None:
    """Includes are resolved before the preprocessor runs, so one inside #if would always take effect."""
    for name in FILES:
        check_includes(name)


def check_includes(name: str) -> None:
    depth = 0
    for number, line in enumerate((KERNELS / name).read_text(encoding="utf-8").splitlines(), start=1):
        word = re.match(r"\s*#\s*(\w+)", line)
        if word and word[1].startswith("if"):
            depth += 1
        elif word and word[1] == "endif":
            depth -= 1
        elif word and word[1] == "include":
            assert depth == 0, f"{name}:{number} includes inside #if"
            assert re.match(r'#include ("[^"]+"|\w+)$', line), f"{name}:{number} is not understood by compose()"
    assert depth == 0


def test_a_kernel_file_opens_with_what_it_is() -> None:
    assert not [name for name in FILES if not re.match(r"// \S", (KERNELS / name).read_text(encoding="utf-8"))]


def used_without_scenes(device: Device) -> set[str]:
    """Return the files of ray queries, builders, refits and device checks."""
    corners = np.zeros((3, 3), np.float32)
    sources = [
        turns_source(),
        *(refit.program_source(layout) for layout in refit.RECIPES),
        *(kernel_calls.source(file, device.lanes) for file in kernel_calls.FILES),
        *(compose("", entry, {}) for entry in ("check/turns.cl", "core/fma.cl")),
        *(program_source(shape, True, True, True) for shape in SHAPES.values()),
    ]
    for layout, traversal in (("bvh8", "pool"), ("bvh8", "packet"), ("bvh2", "single")):
        query = clrt.InstancedRayQuery(
            [(corners, [[0, 1, 2]])], [0], [np.eye(3, 4)], device=device.info.index, layout=layout
        )
        sources.append(query.source("closest_hit", traversal))
    return {name for source in sources for name in files_of(source)}


def test_every_kernel_file_is_used(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each file is used by a scene or choice, ray queries, the builder, refits, device checks or studies."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    used = used_without_scenes(device)
    for layout in ("bvh8", "bvh2", "cwbvh", "list"):
        for i in range(len(TRIANGLE_TESTS)):
            tests = HitTests(*(list(known)[i % len(known)] for known in (TRIANGLE_TESTS, BOX_TESTS, SPHERE_TESTS)))
            choices = Choices(layout=layout, tests=tests, offset=list(OFFSETS)[i % len(OFFSETS)])
            for environment in (everything().environment, Environment(color=(1.0, 1.0, 1.0))):
                scene = everything()
                scene.environment = environment
                used |= set(compile_scene(scene, choices).files)
    used |= set(compile_scene(everything(), Choices(layout="packs")).files)
    for paths in get_args(Paths):
        used |= set(compile_scene(everything(), Choices(paths=paths)).files)
    used |= set(compile_scene(Scene(spheres=[Sphere()]), Choices(paths="queues")).files)  # no microfacets
    for sampler, name in zip(get_args(Sampler), get_args(Filter)):
        scene = everything()
        scene.render = replace(scene.render, sampler=sampler, filter=name)
        used |= set(compile_scene(scene, Choices()).files)
    for count in (1, 40):
        used |= set(compile_scene(lamps(count), Choices()).files)
    for scene in (
        painted(everything()),
        planted(everything()),
        catching(everything()),
        shelf(),
        *(sight for _, sight in sights(everything())),
    ):
        used |= set(compile_scene(scene, Choices()).files)
    used |= set(compile_scene(everything(), Choices(light_groups=True)).files)
    used |= set(files_of(compile_scene(everything(), Choices(guiding="on")).source_of("guiding/record.cl")))
    used |= set(files_of(first_hit_program(compile_scene(everything(), Choices()), AOVS)[0]))
    for entry in (
        "aov/denoiser_guides.cl",
        "integrator/debug.cl",
        "raster/outline.cl",
        "bench/probe.cl",
        "bench/raster_hits.cl",
    ):
        used |= set(compile_scene(everything(), Choices(), entry).files)
    for name, file in (
        ("MIS_WEIGHTS", "bsdf_sampling"),
        ("MIS_WEIGHTS", "light_sampling"),
        ("LIGHT_CHOICE", "uniform_choice"),
    ):
        compiled = compile_scene(everything(), Choices())
        used |= set(replace(compiled, chosen_files=compiled.chosen_files | {name: [f"bench/{file}.cl"]}).files)
    for measured in get_args(Measured):
        place = np.ones((1, 3), np.float32)
        rays = RayList(origins=place, directions=place, surface_normals=place, measures=measured)
        used |= set(compile_scene(replace(everything(), camera=rays), Choices(paths="lanes")).files)
    assert sorted(used) == FILES


@pytest.mark.programs
@pytest.mark.parametrize(
    "entry", ["the picture's", *others("aov/denoiser_guides.cl", "first hits", "integrator/debug.cl")]
)
def test_programs_build_without_a_warning(
    device: Device, entry: str, capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Warnings would interrupt the progress bar on the terminal. Other messages of drivers are ignored."""
    scene = everything()
    scene.spheres = scene.spheres + [
        type(scene.spheres[0])(material=material) for kind in MATERIALS for material in variants(kind)
    ]
    compiled = compile_scene(scene, Choices(device.lanes, device.layout, direct_light=True, light_groups=True))
    sources = {
        "the picture's": compiled.source,
        "aov/denoiser_guides.cl": compiled.source_of("aov/denoiser_guides.cl"),
        "first hits": first_hit_program(compiled, AOVS)[0],
        "integrator/debug.cl": compiled.source_of("integrator/debug.cl", vertex_preamble()),
    }
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    build(device, f"{sources[entry]}\n// its own text, so that no cache has it")
    log = cache_files.kept_logs()["build"]
    assert "\nbuilt in " in log and not re.findall(r".*\.cl:\d+:\d+: warning.*", log)
    assert "warning" not in capfd.readouterr().err


def test_compiler_errors_are_told(device: Device) -> None:
    with pytest.raises(KernelError, match="(?s)cannot build the kernel:.*undeclared"):
        build(device, "kernel void broken() { undeclared = 1; }")


@pytest.mark.parametrize(
    "state", ["absent", "stored", "corrupt", "truncated", "empty", "no folder", "not a binary", "a folder in its place"]
)
def test_a_program_is_built_whatever_the_cache_holds(
    device: Device, state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "cache"
    monkeypatch.setenv("CLRT_CACHE_DIR", str(folder))
    source = f"{DOUBLE} // {state}"
    build(device, source)
    stored = list(folder.glob("*.bin"))
    assert len(stored) == 1
    content = stored[0].read_bytes()
    device.shared.programs.clear()
    if state == "absent":
        cache_files.clear()
    elif state == "corrupt":
        stored[0].write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    elif state == "truncated":
        stored[0].write_bytes(content[:20])
    elif state == "empty":
        stored[0].write_bytes(b"")
    elif state == "no folder":
        shutil.rmtree(folder)
        folder.write_text("a file where the folder should be")
    elif state == "a folder in its place":
        stored[0].unlink()
        stored[0].mkdir()
    elif state == "not a binary":
        cache_files.write_binary(stored[0].stem, b"of another driver")
    built = build(device, source)
    assert built.cached == (state == "stored")
    if state == "not a binary":
        assert stored[0].read_bytes() == content, "what is refused is replaced"
    assert run_twice(device, built) == [2.0, 4.0, 6.0]


def run_twice(device: Device, built: BuiltProgram) -> list[float]:
    x = np.array([1, 2, 3], np.float32)
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=x)
    kernel = make_kernel(device, built, "twice")
    kernel.set_args(buffer)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (3,), None)
    cl.enqueue_copy(device.queue, x, buffer)
    return [float(value) for value in x]


def test_a_binary_comes_back_only_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLRT_CACHE_DIR", str(tmp_path))
    cache_files.write_binary("key", b"binary")
    assert cache_files.read_binary("key") == b"binary" and cache_files.read_binary("other") is None
    assert cache_files.clear() == 1 and cache_files.read_binary("key") is None
    assert not list(tmp_path.iterdir())


def test_programs_of_a_process_are_kept(device: Device) -> None:
    first, second = build(device, DOUBLE), build(device, DOUBLE)
    assert second.program is first.program and second.cached


KEPT_CALLS = """
import sys, clrt
query = clrt.RayQuery([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], device=int(sys.argv[1]))
print(query.any_hit([0.2, 0.2, 1], [0, 0, -1]))
"""


def test_what_pyopencl_keeps_is_damaged(device: Device, tmp_path: Path) -> None:
    """A damaged cache of pyopencl is ignored silently."""
    for damaged in (False, True):
        done = subprocess.run(
            [sys.executable, "-c", KEPT_CALLS, str(device.info.index)],
            capture_output=True,
            text=True,
            env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "[ True]\n", ""), damaged
        kept = list(tmp_path.glob("pytools/*.sqlite"))
        assert kept
        for file in kept:
            file.write_bytes(b"damaged" * 1000)
