"""`python -m clrt.bench.gpu.part_process JSON`: measure items of one part, and print JSON lines.

{"begins": ITEM} precedes an item, {"row": {…}} follows it. This is a separate process because a broken driver can crash
or hang it; see run_part.py. Output of drivers goes to standard error.
"""

from __future__ import annotations

import os
import sys
from typing import Any, TextIO

from ...errors import ClrtError, HungError, UsageError
from ...output.json_text import json_text
from .request import Item, Request, Row


def main() -> None:
    """Measure the items of the part that the first argument names, except for those that it lists as done."""
    import json

    with os.fdopen(os.dup(1), "w", encoding="utf-8") as results:
        os.dup2(2, 1)
        from .parts import PARTS

        order = json.loads(sys.argv[1])
        done = set(order["done"])
        for item in PARTS[order["part"]].items(Request(**order["request"])):
            if item.name not in done:
                _tell(results, begins=item.name)
                _tell(results, row=row_of(item))


def row_of(item: Item) -> Row:
    """Return the figures of an item; `skipped` or `error`, if the device cannot do it or fails.

    A device that hangs ends this process, as it answers no other item.
    """
    try:
        return item.measure()
    except UsageError as error:
        return {"skipped": str(error)}
    except HungError:
        raise
    except ClrtError as error:
        return {"error": str(error)}
    except Exception as error:  # any error of what works elsewhere is a finding
        return {"error": f"{type(error).__name__}: {error}"}


def _tell(results: TextIO, **content: Any) -> None:
    print(json_text(content), file=results, flush=True)


if __name__ == "__main__":
    main()
