"""Run a part in child processes: an item that crashes or hangs its driver is recorded, and the others follow."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from queue import Empty

from ...awake import AwakeClock
from ...device.programs.child_process import end_group, last_line, start_child, told_end
from ...device.programs.child_results import child_results
from .request import Request, Row

#: An item that takes this share of the part's seconds, and at least so many, has not finished.
MOST, LEAST = 0.8, 20.0
#: Seconds for a child to exit after its last result.
EXIT = 10.0
CHILD = f"{__package__}.part_process"


class PartRun:
    """Run of a part. rows: by item, which may have some from before; failure: why it ended before its last item.

    An item that took too long is `late`: another run, on a machine that may be less busy, tries it again.
    """

    def __init__(
        self,
        name: str,
        request: Request,
        rows: dict[str, Row],
        on_item: Callable[[str], None] = lambda item: None,
        module: str = CHILD,
    ) -> None:
        self.rows, self.failure = rows, ""
        for item in [item for item, row in rows.items() if row.get("late")]:
            del rows[item]
        self._name, self._request, self._on_item, self._module = name, request, on_item, module
        self._clock = AwakeClock()
        self._item, self._began = "", 0.0

    def run(self) -> bool:
        """Measure the items that `rows` lacks; return whether no item is left, nor late."""
        while self._clock.look() < self._request.seconds:
            before = len(self.rows)
            if self._run_child():
                return not any(row.get("late") for row in self.rows.values())
            if len(self.rows) == before:
                return bool(self.failure)
        return False

    @property
    def seconds(self) -> float:
        """Return how long it has run."""
        return self._clock.seconds

    def _run_child(self) -> bool:
        """Return whether the child reached the last item; else record what happened to the one that it was at."""
        self._item, self._began = "", self._clock.look()
        argument = {"part": self._name, "request": asdict(self._request), "done": list(self.rows)}
        with tempfile.TemporaryFile() as errors:
            child = start_child(self._module, json.dumps(argument), subprocess.PIPE, errors, own_group=True)
            try:
                for told in child_results(child, self._is_over):
                    self._note(told)
                if not child.wait(EXIT):
                    return True
                self._record(f"{told_end(child.returncode)}{last_line(errors)}")
            except (Empty, subprocess.TimeoutExpired):
                if self._clock.seconds - self._began >= self._longest:
                    self._record(f"it did not finish in {self._longest:.0f} s", late=True)
            finally:
                end_group(child)
        return False

    def _note(self, told: dict[str, Row | str]) -> None:
        if isinstance(item := told.get("begins"), str):
            self._item, self._began = item, self._clock.look()
            self._on_item(item)
        elif isinstance(row := told["row"], dict):
            self.rows[self._item] = row | {"item_seconds": round(self._clock.look() - self._began, 2)}
            self._item, self._began = "", self._clock.look()

    def _record(self, failure: str, late: bool = False) -> None:
        """Record the failure of the item in progress, or between items of the part itself."""
        if self._item:
            self.rows[self._item] = {"error": failure, **({"late": True} if late else {})}
        else:
            self.failure = failure

    @property
    def _longest(self) -> float:
        return max(LEAST, MOST * self._request.seconds)

    def _is_over(self) -> bool:
        now = self._clock.look()
        return now >= self._request.seconds or now - self._began >= self._longest
