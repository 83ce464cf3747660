"""The device: what its driver reports, and the result of its check."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from ...check.run_check import check_device
from ...device.discovery.check_results import keep_verdict
from ...device.discovery.discover import choose
from ...device.discovery.driver_facts import driver_facts
from ..rays.device_speed import measure
from .request import Item, Request, Row


def items(request: Request) -> Iterator[Item]:
    """Yield what the driver reports, the check, and the speeds that rank devices."""
    yield Item("driver", lambda: driver_facts(choose(request.device)[1]))
    yield Item("check", lambda: _check(request))
    yield Item("speed", lambda: asdict(measure(request.device)))


def _check(request: Request) -> Row:
    info, _ = choose(request.device)
    verdict = check_device(info, max(1.0, request.seconds))
    keep_verdict(info, verdict)
    return {"passed": verdict.passed, "failures": "; ".join(verdict.failures), **verdict.figures}
