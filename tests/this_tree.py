"""Whether what the tests import as `clrt` has the files of the tree that they are in."""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

HOUSE = Path(__file__).parents[1]
#: The folders of each package in the tree, and the endings of what it is made of.
PACKAGES = {"clrt": HOUSE / "clrt", "clrt.kernels": HOUSE / "kernels"}
ENDINGS = (".py", ".cl", ".c")


def other_file() -> str | None:
    """The first file, named within its package, that the imported packages have otherwise than this tree, if any."""
    for package, folder in PACKAGES.items():
        try:
            imported = files(package)
        except ModuleNotFoundError:
            return package
        if name := differing(folder, imported, leave="kernels/"):
            return f"{package}: {name}"
    return None


def differing(one: Traversable, other: Traversable, leave: str = "/") -> str | None:
    """The first source file below two folders that is in one alone or has another content there.

    leave: how the names begin of those that do not count; installed, the kernels lie within the package.
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
