"""`python -m clrt.check.check_process ID`: check one device, and print JSON lines for each part of the check.

{"begins": NAME} precedes a part, {"failures": […], "figures": {…}} follows it. This is a separate process because a
broken driver can crash or hang it; see run_check.py. Output of drivers goes to standard error.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict
from typing import Any, TextIO

from .findings import Findings


def main() -> None:
    """Check the device that the first argument names."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as results:
        os.dup2(2, 1)
        _tell(results, begins="opening the device")
        from ..device.open import open_device
        from .check_parts import PARTS

        device = open_device(sys.argv[1])
        for name, part in PARTS.items():
            _tell(results, begins=name)
            findings = Findings()
            try:
                part(device, findings)
            except Exception as error:  # any error of a kernel that works elsewhere is a finding
                findings.failures.append(_summary(error))
            _tell(results, **asdict(findings))


def _summary(error: Exception) -> str:
    """Return the error's type and first line and, from a compiler's log, the first error."""
    first, *rest = str(error).strip().splitlines() or [""]
    wrong = next((f" {line.strip()}" for line in rest if "error:" in line), "")
    return f"{type(error).__name__}: {first}{wrong}"


def _tell(results: TextIO, **content: Any) -> None:
    print(json.dumps(content), file=results, flush=True)


if __name__ == "__main__":
    main()
