"""Programs of all scenes compiled ahead, on all processors, for the parts that render them."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import get_args

from ...device.device_info import Paths
from ...errors import ClrtError
from .compiles import compile_in_process
from .request import Request, Row

#: Fewer processors would gain little over compiling each program when it is needed.
FEWEST = 4


def compile_ahead(request: Request) -> Row:
    """Compile every scene for the device, with each of `Paths`, and for the other device; failures show later."""
    orders: list[tuple[str, str, Paths | None]] = [
        (file, request.device, paths) for paths in get_args(Paths) for file in request.scenes
    ]
    if request.other is not None:
        orders = [*((file, request.other, None) for file in request.scenes), *orders]
    processors, start = os.cpu_count() or 1, time.perf_counter()
    if processors < FEWEST:
        return {"programs": 0}

    def compile_one(order: tuple[str, str, Paths | None]) -> None:
        file, device, paths = order
        with suppress(ClrtError):
            compile_in_process(Path(file), device, request.seconds / 2, paths=paths)

    with ThreadPoolExecutor(processors) as pool:
        list(pool.map(compile_one, orders))
    return {"programs": len(orders), "program_seconds": time.perf_counter() - start}
