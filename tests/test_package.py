"""The wheel contains what the tree holds, and importing the package loads nothing heavy."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from configparser import ConfigParser
from pathlib import Path

import clrt

ROOT = Path(__file__).parent.parent


def test_wheel_holds_every_module_kernel_and_scene(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.mkdir()
    for name in ("setup.cfg", "pyproject.toml", "README.md", "LICENSE", "clrt", "kernels", "scenes"):
        subprocess.run(["cp", "-r", ROOT / name, source], check=True)
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path, source],
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    modules = {
        str(file.relative_to(ROOT))
        for pattern in ("*.py", "*.c", "*.csv", "*.json", "*.npz", "*.toml", "*.txt", "py.typed")
        for file in (ROOT / "clrt").rglob(pattern)
    }
    kernels = {
        f"clrt/{file.relative_to(ROOT)}"
        for pattern in ("*.cl", "__init__.py")
        for file in (ROOT / "kernels").rglob(pattern)
    }
    scenes = {
        f"clrt/{file.relative_to(ROOT)}"
        for file in (ROOT / "scenes").rglob("*")
        if file.is_file() and file.suffix not in (".md", ".py")
    }
    assert packed == modules | kernels | scenes
    zipfile.ZipFile(wheel).extractall(tmp_path / "installed")
    names = "print(*(path.stem for path in shipped_scenes()))"
    result = subprocess.run(
        [sys.executable, "-c", f"from clrt.bench.gpu.shipped_scenes import shipped_scenes; {names}"],
        cwd=tmp_path / "installed",
        check=True,
        capture_output=True,
        text=True,
    )
    assert set(result.stdout.split()) == {path.stem for path in (ROOT / "scenes").glob("*.toml")}


def test_version_is_the_package_s() -> None:
    setup = ConfigParser()
    setup.read(ROOT / "setup.cfg")
    assert clrt.__version__ == setup["metadata"]["version"]


HEAVY = "print(*sorted({'numpy', 'pyopencl', 'pydantic', 'trimesh'} & set(sys.modules)))"


def test_import_loads_nothing_heavy() -> None:
    result = subprocess.run(
        [sys.executable, "-c", f"import sys, clrt; {HEAVY}"], check=True, capture_output=True, text=True
    )
    assert result.stdout.strip() == ""


def test_the_process_that_watches_a_render_loads_nothing_heavy() -> None:
    """The renderer is forked from this process and copies its memory page by page."""
    code = f"import sys, clrt.cli.render as r; r.guarded = lambda advice: sys.exit({HEAVY}); r.command"
    result = subprocess.run(
        [sys.executable, "-c", f"{code}; from clrt.cli import main; main(['render', 'a.toml'])"],
        check=True,
        capture_output=True,
        text=True,
    )
    assert result.stdout.strip() == ""
