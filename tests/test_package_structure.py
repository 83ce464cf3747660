"""Package structure: the allowed imports between packages, and those that may use OpenCL."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

HOUSE = Path(__file__).parents[1]
SOURCES = sorted((HOUSE / "clrt").rglob("*.py"))

#: In order: a room imports only from itself and those before it. `clrt` itself is the public names alone.
ROOMS = [
    "errors",
    "option_fields",
    "threads",
    "awake",
    "float_errors",
    "file_mode",
    "file_names",
    "aov_types",
    "scene",
    "formats",
    "device",
    "accel",
    "queries",
    "trimesh",
    "rendering",
    "check",
    "output",
    "baking",
    "bench",
    "debug",
    "api",
    "live",
    "window",
    "farm",
    "views",
    "clrt",
    "cli",
    "__main__",
]
KNOW_OPENCL = {"device", "accel", "queries", "rendering"}
#: Beyond the order: trees know nothing of scenes, and pictures are written without any device.
NEVER = {"accel": {"scene"}, "output": {"device", "accel", "queries", "trimesh", "rendering"}}


def room(module: str) -> str:
    """Return the package of a module given by its full name."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else parts[0]


def name(path: Path) -> str:
    """Return the module name, e.g. clrt.scene.model for clrt/scene/model.py; a package is named like its folder."""
    parts = path.relative_to(HOUSE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path: Path) -> Iterator[str]:
    """Yield the full name of each module that a file imports anywhere; `from . import x` counts as x."""
    package = name(path) if path.name == "__init__.py" else name(path).rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join(above + ([node.module] if node.module else []))
            yield from ([base] if node.module else [f"{base}.{alias.name}" for alias in node.names])


def may_import(own: str, module: str) -> bool:
    """Return whether the files of package `own` may import a module of clrt or a third party."""
    package = module.split(".")[0]
    if package == "clrt":
        return ROOMS.index(room(module)) <= ROOMS.index(own) and room(module) not in NEVER.get(own, set())
    return package != "pyopencl" or own in KNOW_OPENCL


def test_rooms_are_entered_in_order_and_only_some_know_opencl() -> None:
    assert not [
        f"{name(path)} imports {module}"
        for path in SOURCES
        for module in imported(path)
        if not may_import(room(name(path)), module)
    ]


def circle(imports: Iterable[tuple[str, str]]) -> list[str]:
    """Return folders that import each other in a circle, empty if none do."""
    graph: dict[str, set[str]] = {}
    for importing, module in imports:
        graph.setdefault(importing, set()).add(module)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_folders_import_in_one_direction() -> None:
    """Also for types alone, and within functions; a folder and those in it may import each other."""
    modules = {name(path): path for path in SOURCES}

    def folder(module: str) -> str:
        return module if modules[module].name == "__init__.py" else module.rpartition(".")[0]

    pairs = [(own, module) for own, path in modules.items() for module in imported(path) if module in modules]
    folders = {(folder(own), folder(module)) for own, module in pairs}
    apart = [pair for pair in folders if not any(f"{a}.".startswith(f"{b}.") for a, b in (pair, pair[::-1]))]
    assert not circle(apart)
    assert circle([*apart, ("clrt.device", "clrt.rendering")])


def test_imports_that_are_wrong_are_found() -> None:
    assert not may_import("scene", "clrt.rendering.renderer") and not may_import("accel", "clrt.scene.model")
    assert not may_import("output", "pyopencl") and may_import("rendering", "pyopencl.array")


def test_every_room_is_in_the_list() -> None:
    assert {room(name(path)) for path in SOURCES} == set(ROOMS)


def test_scenes_load_without_opencl(tmp_path: Path) -> None:
    """Both kinds of scene file are read and validated, and images written, if pyopencl cannot be imported."""
    (tmp_path / "scene.toml").write_text(
        '[materials.red]\ntype = "diffuse"\ncolor = [1, 0, 0]\n'
        '[[mesh]]\nfile = "model.obj"\nmaterial = "red"\n'
        '[[sphere]]\nmaterial = "red"\n'
    )
    (tmp_path / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    program = f"""
import sys
sys.modules["pyopencl"] = None
import clrt, numpy
from clrt.formats.load_scene import load
from clrt.scene.validation.validate import validate
from pathlib import Path
folder = Path({str(tmp_path)!r})
for file in ("scene.toml", "model.obj"):
    validate(load(folder / file))
clrt.Image(numpy.zeros((2, 3, 3), numpy.float32), {{}}).save(folder / "black.png")
try:
    import clrt.device.open
except ImportError:
    pass
else:
    raise SystemExit("pyopencl was not blocked")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=HOUSE)
    assert done.returncode == 0, done.stderr
