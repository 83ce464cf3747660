"""Writing of a render's report: as JSON, and in the headers of its images."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..file_names import printable
from ..scene.cryptomatte import header_entries
from .atomic_files import check_target, replacing
from .json_text import json_text


def write_report(path: Path, report: Mapping[str, Any]) -> Path:
    """Write `report` by `json_text`, in UTF-8 and atomically (see `replacing`). Returns `path`.

    Raises OutputError.
    """
    check_target(path)
    text = json_text(report, indent=1, ascii_only=False)
    with replacing(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def header_of(report: Mapping[str, Any]) -> dict[str, str]:
    """Return the report's scalar values, and Cryptomatte's manifests, for an image file's header."""
    scalars = {key: value for key, value in report.items() if isinstance(value, (str, int, float))}
    header = {f"clrt:{key}": printable(str(value)) for key, value in scalars.items()}
    for aov, manifest in report.get("cryptomatte", {}).items():
        header |= header_entries(aov, manifest)
    return header
