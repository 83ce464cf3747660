"""The compilers that must be installed: finding them, their versions, running them."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from ...errors import KernelError, UsageError

#: How to install each tool; names with a slash are files.
INSTALL = {
    "clang-19": "apt install clang-19",
    "llvm-size-19": "apt install llvm-19",
    "llvm-objcopy-19": "apt install llvm-19",
    "/usr/lib/clc/nvptx64--nvidiacl.bc": "apt install libclc-19",
    "/usr/lib/clc/amdgcn--amdhsa.bc": "apt install libclc-19",
    "ptxas": "pip install nvidia-cuda-nvcc",
    "ocloc": "apt install intel-opencl-icd",
}
#: The query for ocloc's version, which it writes to a file of that name.
OCLOC_VERSION = "OCL_DRIVER_VERSION"
#: Maximum number of lines of a compiler's output in a message.
MOST_LINES = 10


@cache
def find_tool(name: str) -> Path | None:
    """Return the path of a tool, or None: a file, a program, or one that pip installed for CUDA."""
    if "/" in name:
        return Path(name) if Path(name).exists() else None
    if found := which(name):
        return Path(found)
    spec = find_spec("nvidia")
    folders = [Path(folder) for folder in (spec.submodule_search_locations or [] if spec else [])]
    return next((path for folder in folders for path in sorted(folder.glob(f"*/bin/{name}"))), None)


def require_tools(names: Iterable[str]) -> None:
    """Raise UsageError, with the remedy, if any of these tools is missing."""
    if missing := [name for name in dict.fromkeys(names) if find_tool(name) is None]:
        raise UsageError(
            f"{', '.join(missing)} not found; use another --vendor, or install: "
            + "; ".join(dict.fromkeys(INSTALL[name] for name in missing))
        )


@cache
def tool_version(name: str) -> str:
    """Return what identifies the version of a tool: its own words, or a file's size."""
    path = find_tool(name)
    assert path is not None
    if "/" in name:
        return f"{path.resolve()} {path.stat().st_size}"
    with TemporaryDirectory() as folder:
        if name == "ocloc":
            run_tool(name, "query", OCLOC_VERSION, folder=Path(folder))
            return Path(folder, OCLOC_VERSION).read_text(encoding="utf-8")
        return run_tool(name, "--version", folder=Path(folder))


def run_tool(name: str, *arguments: str, folder: Path) -> str:
    """Run a tool in `folder` and return what it prints. Raises KernelError with the end of that if it fails."""
    path = find_tool(name)
    assert path is not None
    done = subprocess.run(
        [path, *arguments], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    if done.returncode:
        told = "\n".join(done.stdout.strip().splitlines()[-MOST_LINES:])
        raise KernelError(f"{name} {' '.join(arguments)} ended with {done.returncode}:\n{told}")
    return done.stdout
