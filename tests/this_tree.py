"""Checks that the imported `clrt` has the same files as the tree that contains the tests."""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

HOUSE = Path(__file__).parents[1]
#: Folder in the tree of each package, and the suffixes of source files.
PACKAGES = {"clrt": HOUSE / "clrt", "clrt.kernels": HOUSE / "kernels"}
ENDINGS = (".py", ".cl", ".c")


def other_file() -> str | None:
    """Return the first file, named within its package, that differs between imported packages and tree, or None."""
    for package, folder in PACKAGES.items():
        try:
            imported = files(package)
        except ModuleNotFoundError:
            return package
        if name := differing(folder, imported, leave="kernels/"):
            return f"{package}: {name}"
    return None


def differing(one: Traversable, other: Traversable, leave: str = "/") -> str | None:
    """Return the first source file that only one of two folders has or whose content differs, or None.

    leave: prefix of names to ignore; once installed, the kernels lie within the package.
    """
    names = sorted(name for name in _sources(one) | _sources(other) if not name.startswith(leave))
    return next((name for name in names if _content(one, name) != _content(other, name)), None)


def _sources(folder: Traversable, path: str = "") -> set[str]:
    found = set[str]()
    for entry in folder.iterdir():
        name = path + entry.name
        if entry.is_dir():
            found |= _sources(entry, f"{name}/")
        elif name.endswith(ENDINGS):
            found.add(name)
    return found


def _content(folder: Traversable, name: str) -> bytes | None:
    file = folder.joinpath(*name.split("/"))
    return file.read_bytes() if file.is_file() else None
