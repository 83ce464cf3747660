"""The small work as a program for Oclgrind, with workarounds for what Oclgrind 21.10 takes for uninitialised.

    python -c 'from tests.oclgrind_program import main; main("cpu", "answers.npz")'

works with the device as with a CPU, and stores what came out, and which kernel files were compiled.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl

from clrt.device import contexts
from clrt.device.launches import data_parallel
from clrt.device.open import Device, open_device
from clrt.device.programs import program
from clrt.rendering.accumulation import scene_on_device
from clrt.scene.geometry import instancing

from .small_work import work

#: How a device is worked with, whatever its type.
DEVICES: dict[str, dict[str, Any]] = {"cpu": {"lanes": 8, "local_size": 1, "layout": "bvh8"},
                                      "gpu": {"lanes": 1, "local_size": 4, "layout": "cwbvh", "fuses": False}}
#: Shares so small that even here several work-items get one.
SHARES = {"SMALLEST_BLOCK": {"cpu": 4, "gpu": 4}, "SCAN_ITEMS": 4, "SCAN_PART": 256}
ENQUEUE_COPY = cl.enqueue_copy


class KeptBuffer(cl.Buffer):
    """Is never released. What a released buffer had not, Oclgrind takes for never written in the next of its number."""

    kept: list[cl.Buffer] = []

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.kept.append(self)

    def release(self) -> None:
        """Not now."""


def copy_whole(queue: cl.CommandQueue, to: Any, source: Any, **options: Any) -> Any:
    """enqueue_copy, but all the rest of the buffer is written, too: Oclgrind takes it for never written otherwise."""
    if not isinstance(to, cl.Buffer):
        return ENQUEUE_COPY(queue, to, source, **options)
    whole, first = np.empty(to.size, np.uint8), options.get("dst_offset", 0)
    part = np.empty(options.get("byte_count") or source.nbytes, np.uint8)
    ENQUEUE_COPY(queue, whole, to)
    if isinstance(source, cl.Buffer):
        ENQUEUE_COPY(queue, part, source)
    else:
        part = np.frombuffer(source, np.uint8)
    whole[first:first + part.size] = part
    return ENQUEUE_COPY(queue, to, whole)


def at_once(where: str, work: Callable[[], Any]) -> Any:
    """in_background, but in this thread: what Oclgrind is asked to look for here makes it crash in any other."""
    return work()


def compiled_files() -> list[str]:
    """The kernel files of all programs that this process has built."""
    return sorted({file for shared in contexts._shared.values() for built in shared.programs.values()
                   for file in program.files_of(built.source)})


def main(form: str, path: str) -> None:
    """Works with the device as with a `form` of DEVICES; writes the answers to `path`, an .npz file."""
    workarounds = {"Buffer": KeptBuffer, "enqueue_copy": copy_whole}
    instancing.FEW_TRIANGLES = 0   # instances of small meshes, too
    contexts.MOST_COMPILED = program.MOST_KEPT = sys.maxsize    # see compiled_files
    alone = {"in_background": at_once}
    for owner, values in ((Device, DEVICES[form]), (data_parallel, SHARES), (cl, workarounds), (program, alone),
                          (scene_on_device, alone)):
        for name, value in values.items():
            setattr(owner, name, value)
    answers = {f"{way}/{name}": array for way, found in work(open_device("oclgrind")) for name, array in found.items()}
    np.savez(path, compiled_files=compiled_files(), **answers)  # type: ignore[arg-type]
