"""Objects of views as COCO annotations: a mask and a box of each object in each view."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ..json_text import json_text
from .layer_files import SavedView

#: Layers that hold the numbers of objects.
OBJECTS = ("instance_id", "object")


class CocoWriter:
    """Collects the annotations, and writes them to annotations.json at the end.

    names: of the objects to annotate, by number; the ground of a bare model is not among them.
    """

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self._path, self._names = folder / "annotations.json", names
        self._categories = {name: number for number, name in enumerate(dict.fromkeys(names), start=1)}
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []

    def add(self, view: SavedView) -> None:
        """Add a view, with an annotation for each object in it."""
        layer = next((view.layers[name] for name in OBJECTS if name in view.layers), None)
        if layer is None:
            raise UsageError(f"annotations need one of the layers {', '.join(OBJECTS)}; add it")
        image = len(self._images) + 1
        width, height = view.size
        self._images.append({"id": image, "file_name": view.file, "width": width, "height": height})
        numbers = layer[..., 0].astype(np.int64)
        for number in np.unique(numbers[(numbers >= 0) & (numbers < len(self._names))]).tolist():
            mask = numbers == number
            self._annotations.append(
                {
                    "id": len(self._annotations) + 1,
                    "image_id": image,
                    "category_id": self._categories[self._names[number]],
                    "object": number,
                    "bbox": box(mask),
                    "area": int(mask.sum()),
                    "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
                    "iscrowd": 0,
                }
            )

    def finish(self) -> None:
        """Write the file."""
        categories = [{"id": number, "name": name} for name, number in self._categories.items()]
        content = {"images": self._images, "annotations": self._annotations, "categories": categories}
        self._path.write_text(json_text(content) + "\n", encoding="utf-8")


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Return the lengths of the runs of pixels outside and inside, in turn and column by column, the first outside."""
    flat = mask.ravel(order="F")
    ends = np.append(np.flatnonzero(flat[1:] != flat[:-1]) + 1, flat.size)
    lengths: list[int] = np.diff(ends, prepend=0).tolist()
    return [0, *lengths] if flat[0] else lengths


def box(mask: NDArray[np.bool_]) -> list[int]:
    """Return x, y, width, height of the pixels of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x, y = int(columns[0]), int(rows[0])
    return [x, y, int(columns[-1]) - x + 1, int(rows[-1]) - y + 1]
