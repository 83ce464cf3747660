"""Scene files that come with clrt: the folder `scenes` of a source tree, or the package clrt.scenes."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).parents[2]


def shipped_scenes() -> list[Path]:
    """Return the scene files next to clrt in a source tree, else those of the installed package, by name."""
    beside = PACKAGE.parent / "scenes"
    folder = beside if (beside / "cornell.toml").is_file() else PACKAGE / "scenes"
    return sorted(folder.glob("*.toml"))
