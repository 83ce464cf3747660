"""Worker check: before it gets any work, each worker renders a few tiles, which must agree with those of the others."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .worker_states import BadResult, WorkerState

#: Relative difference of values allowed between devices that round differently, and the fraction of pixels that may
#: exceed it.
TOLERANCE, MOST_DIFFERING = 1e-2, 0.05
#: Devices for which these facts are equal must render identical bits.
KIND = ("name", "platform", "platform_version", "driver")
_log = logging.getLogger(__name__)


class WorkerCheck:
    """The first worker's proof, and one for each kind of device."""

    def __init__(self) -> None:
        self._first: tuple[WorkerState, NDArray[Any]] | None = None
        self._kinds: dict[tuple[str, ...], tuple[WorkerState, NDArray[Any]]] = {}

    def compare(self, member: WorkerState) -> None:
        """Raise BadResult if a worker's proof differs from that of its kind, or too much from that of the first worker.

        Warns if its kind rounds differently: then the image's last bits depend on which worker renders what.
        """
        facts: dict[str, Any] = member.facts or {}
        proof, kind = facts["proof"], tuple(str(facts[name]) for name in KIND)
        if not all(np.isfinite(proof[name]).all() for name in ("sum", "square")):
            raise BadResult("its first pixels are not finite; run `clrt devices --check` there")
        if self._first is None:
            self._first = member, proof
        if kind in self._kinds:
            other, expected = self._kinds[kind]
            if proof.tobytes() != expected.tobytes():
                raise BadResult(
                    f"its first pixels differ from those of {other.name}, which has the same device and "
                    "driver; one of them is broken: run `clrt devices --check` on both"
                )
            return
        self._kinds[kind] = member, proof
        other, expected = self._first
        if (differing := _differing(proof, expected)) > MOST_DIFFERING:
            raise BadResult(
                f"{differing:.0%} of its first pixels differ from those of {other.name}; one of them is "
                "broken: run `clrt devices --check` on both"
            )
        if proof.tobytes() != expected.tobytes():
            _log.warning(
                "%s (%s) rounds differently from %s (%s): the image is equally accurate, but its last bits "
                "depend on which worker renders what",
                member.name,
                facts["name"],
                other.name,
                (other.facts or {}).get("name"),
            )


def _differing(found: NDArray[Any], expected: NDArray[Any]) -> float:
    """Return the fraction of pixels that differ by more than rounding."""
    a, b = found["sum"].astype(np.float64), expected["sum"].astype(np.float64)
    return float(np.mean((np.abs(a - b) > TOLERANCE * (np.abs(a) + np.abs(b)) + 1e-6).any(axis=-1)))
