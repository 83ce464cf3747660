"""Scene files that come with clrt: the folder `scenes` of a source tree, or the package clrt.scenes."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def shipped_scenes() -> list[Path]:
    """Return the scene files next to clrt in a source tree, else those of the installed package, by name."""
    beside = Path(__file__).parents[3] / "scenes"
    folder = beside if (beside / "cornell.toml").is_file() else Path(str(files("clrt.scenes")))
    return sorted(folder.glob("*.toml"))
