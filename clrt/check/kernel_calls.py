"""Run the kernels of kernels/check over arrays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..device.launches.data_parallel import DataParallel
from ..device.open import Device
from ..device.programs.preamble import defines, typedefs
from ..device.programs.program import compose
from ..rendering.compile.records import PIXEL

FILES = ("floats", "integers", "words", "masks", "memory", "samples")


def source(file: str, lanes: int, rows: Iterable[str] = ()) -> str:
    """Return the program of one of FILES, whose kernels number their rows of results in the order of `rows`."""
    values = {"LANES": lanes} | {f"ROW_{row}": number for number, row in enumerate(rows)}
    return compose(
        "\n".join([defines(values), typedefs({"Pixel": PIXEL})]),
        f"check/{file}.cl",
        {"SAMPLER": ["sampler/independent.cl"]},
    )


class CheckProgram:
    """The program of one of FILES on a device."""

    def __init__(self, device: Device, file: str, lanes: int = 1, rows: Sequence[str] = ()) -> None:
        self.work = DataParallel(device, source(file, lanes, rows))
        self._rows = rows

    def run(
        self, kernel: str, count: int, *arguments: NDArray[Any] | int, out: Sequence[tuple[DTypeLike, int]]
    ) -> list[NDArray[Any]]:
        """Run `kernel` over `count` items; return its output arrays, zero before, with the dtypes and sizes in `out`.

        The kernel's parameters are count and block, then `arguments`, then the output arrays.
        """
        given = [self.work.upload(argument) if isinstance(argument, np.ndarray) else argument for argument in arguments]
        made = [self.work.zeros(dtype, size) for dtype, size in out]
        self.work.run(kernel, count, *given, *made)
        return [self.work.download(array, dtype, size) for array, (dtype, size) in zip(made, out)]

    def rows(self, kernel: str, lanes: int, inputs: NDArray[Any]) -> dict[str, NDArray[np.uint32]]:
        """Return the (n,) results of `kernel` by row name, as bits; inputs: (k, n), n a multiple of `lanes`."""
        n = inputs.shape[1]
        (out,) = self.run(kernel, n // lanes, inputs, out=[(np.uint32, len(self._rows) * n)])
        return dict(zip(self._rows, out.reshape(-1, n)))
