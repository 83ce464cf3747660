"""The file with the results, a zip of gpu.json and the page gpu.html, which is also read to resume."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile

from ...errors import UsageError
from ...output.atomic_files import replacing
from ...output.json_text import json_text

DATA, PAGE = "gpu.json", "gpu.html"


def write_archive(path: Path, results: Mapping[str, Any], page: str | None = None) -> Path:
    """Write the results and, if given, the page, atomically (see `replacing`). Returns the path; raises OutputError."""
    with replacing(path) as temporary, ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
        archive.writestr(DATA, json_text(results, indent=1))
        if page is not None:
            archive.writestr(PAGE, page)
    return path


def read_archive(path: Path) -> dict[str, Any] | None:
    """Return the results of an earlier run, or None if there is no such file. Raises UsageError for other files."""
    try:
        with ZipFile(path) as archive:
            results: dict[str, Any] = json.loads(archive.read(DATA))
            return results
    except FileNotFoundError:
        return None
    except (OSError, BadZipFile, KeyError, ValueError) as error:
        raise UsageError(f"{path}: is not a file of `clrt bench gpu` ({error}); choose another one") from error
