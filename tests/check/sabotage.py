"""Kernels that are wrong: a copy of their folder in which a text is replaced.

They compute what a broken driver might, and everything else is the real thing.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from clrt.device.programs.kernel_files import kernel_folder


def sabotaged(folder: Path, pattern: str, wrong: str, head: str = "") -> Path:
    """A new folder `folder` of all kernel files, where what `pattern` (a regular expression) matches is `wrong`.

    head: a line before every file in which something was replaced.
    """
    shutil.copytree(str(kernel_folder()), folder)
    replaced = 0
    for file in folder.rglob("*.cl"):
        text, count = re.subn(pattern, wrong, file.read_text(encoding="utf-8"))
        if count:
            file.write_text(f"{head}\n{text}", encoding="utf-8")
            replaced += count
    assert replaced, f"no kernel file has {pattern!r} any more"
    return folder
