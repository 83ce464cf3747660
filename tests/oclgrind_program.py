"""Program that runs the small work in Oclgrind, with workarounds for Oclgrind 21.10's false uninitialized reads.

    python -c 'from tests.oclgrind_program import main; main("cpu", "answers.npz")'

uses the device as if it were a CPU, and stores the results and the names of the kernel files that were compiled.
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
from clrt.rendering.accumulation import path_queues, scene_on_device
from clrt.scene.geometry import instancing

from .small_work import work

#: Execution settings by device type, which override those of the device.
DEVICES: dict[str, dict[str, Any]] = {
    "cpu": {"lanes": 8, "local_size": 1, "group_size": 1, "layout": "bvh8", "packs": True},
    "gpu": {"lanes": 1, "local_size": 4, "group_size": 4, "layout": "cwbvh", "fuses": False},
}
#: Block sizes so small that even this work gives several work-items a block each.
SHARES = {"SMALLEST_BLOCK": {"cpu": 4, "gpu": 4}, "SCAN_ITEMS": 4, "SCAN_PART": 256}
#: So few work-items of the queues that each takes several entries.
WORK_ITEMS = {"WORK_ITEMS": 16, "LATE_WORK_ITEMS": 8}
ENQUEUE_COPY = cl.enqueue_copy


class KeptBuffer(cl.Buffer):
    """Buffer that is never released: Oclgrind carries the uninitialized state of a released one over to a reused id."""

    kept: list[cl.Buffer] = []

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.kept.append(self)

    def release(self) -> None:
        """Do nothing."""


def copy_whole(queue: cl.CommandQueue, to: Any, source: Any, **options: Any) -> Any:
    """Copy like enqueue_copy, but write the whole buffer: Oclgrind treats the rest as uninitialized otherwise."""
    if not isinstance(to, cl.Buffer):
        return ENQUEUE_COPY(queue, to, source, **options)
    whole, first = np.empty(to.size, np.uint8), options.get("dst_offset", 0)
    part = np.empty(options.get("byte_count") or source.nbytes, np.uint8)
    ENQUEUE_COPY(queue, whole, to)
    if isinstance(source, cl.Buffer):
        ENQUEUE_COPY(queue, part, source)
    else:
        part = np.frombuffer(source, np.uint8)
    whole[first : first + part.size] = part
    return ENQUEUE_COPY(queue, to, whole)


def at_once(where: str, work: Callable[[], Any]) -> Any:
    """Replace in_background by a call in this thread: with these checks, Oclgrind crashes in any other thread."""
    return work()


def compiled_files() -> list[str]:
    """Return the kernel files of all programs that this process has built."""
    return sorted(
        {
            file
            for shared in contexts._shared.values()
            for built in shared.programs.values()
            for file in program.files_of(built.source)
        }
    )


def main(form: str, path: str) -> None:
    """Run the small work with the settings DEVICES[form]; write the answers to `path`, an .npz file."""
    workarounds = {"Buffer": KeptBuffer, "enqueue_copy": copy_whole}
    instancing.FEW_TRIANGLES = 0  # instance small meshes, too
    contexts.MOST_COMPILED = program.MOST_KEPT = sys.maxsize  # see compiled_files
    alone = {"in_background": at_once}
    for owner, values in (
        (Device, DEVICES[form]),
        (data_parallel, SHARES),
        (path_queues, WORK_ITEMS),
        (cl, workarounds),
        (program, alone),
        (scene_on_device, alone),
    ):
        for name, value in values.items():
            setattr(owner, name, value)
    answers = {f"{way}/{name}": array for way, found in work(open_device("oclgrind")) for name, array in found.items()}
    np.savez(path, compiled_files=compiled_files(), **answers)  # type: ignore[arg-type]
