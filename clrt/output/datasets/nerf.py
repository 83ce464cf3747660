"""Views as transforms.json: the format of instant-ngp and nerfstudio."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..json_text import json_text
from .layer_files import SavedView


class NerfWriter:
    """Collects the cameras, and writes them to transforms.json at the end."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "transforms.json"
        self._frames: list[dict[str, Any]] = []

    def add(self, view: SavedView) -> None:
        """Add a view with the files that were written for it."""
        K, pose = view.camera.matrix(view.size), np.linalg.inv(view.camera.world_to_camera)
        frame: dict[str, Any] = {"file_path": view.file}
        frame |= {"layers_path": view.layers_file} if view.layers_file not in ("", view.file) else {}
        frame |= {"w": view.size[0], "h": view.size[1], "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
        # OpenGL's axes: x right, y up, z back.
        self._frames.append({**frame, "transform_matrix": (pose * [1, -1, -1, 1]).tolist()})

    def finish(self) -> None:
        """Write the file; what all frames share stands once, where all readers look for it."""
        shared = {
            name: self._frames[0][name]
            for name in ("w", "h", "fl_x", "fl_y", "cx", "cy")
            if self._frames and all(frame[name] == self._frames[0][name] for frame in self._frames)
        }
        frames = [{key: value for key, value in frame.items() if key not in shared} for frame in self._frames]
        text = json_text({"camera_model": "OPENCV", **shared, "frames": frames}, indent=2)
        self._path.write_text(text + "\n", encoding="utf-8")
