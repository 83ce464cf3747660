"""Views as transforms.json: the format of instant-ngp and nerfstudio."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import UsageError
from ...scene.model import Camera
from ..json_text import json_text
from .layer_files import SavedView

#: camera_model of fisheye cameras, and the keys of intrinsics and distortion.
FISHEYE = "OPENCV_FISHEYE"
INTRINSICS = ("w", "h", "fl_x", "fl_y", "cx", "cy")
DISTORTION = ("is_fisheye", "k1", "k2", "p1", "p2", "k3", "k4")


class NerfWriter:
    """Collects the cameras, and writes them to transforms.json at the end."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "transforms.json"
        self._model = ""
        self._frames: list[dict[str, Any]] = []

    def add(self, view: SavedView) -> None:
        """Add a view with the files that were written for it."""
        model, coefficients = _lens(view.camera)
        if self._model not in ("", model):
            raise UsageError(
                "transforms.json has one camera_model, and both perspective and fisheye cameras are given; write one "
                "folder for each"
            )
        self._model = model
        K, pose = view.camera.matrix(view.size), np.linalg.inv(view.camera.world_to_camera)
        frame: dict[str, Any] = {"file_path": view.file}
        frame |= {"layers_path": view.layers_file} if view.layers_file not in ("", view.file) else {}
        frame |= {"w": view.size[0], "h": view.size[1], "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
        frame |= coefficients
        # OpenGL's axes: x right, y up, z back.
        self._frames.append({**frame, "transform_matrix": (pose * [1, -1, -1, 1]).tolist()})

    def finish(self) -> None:
        """Write the file; what all frames share stands once, where all readers look for it."""
        shared = {
            name: self._frames[0][name]
            for name in (*INTRINSICS, *DISTORTION)
            if self._frames and all(frame.get(name) == self._frames[0].get(name) is not None for frame in self._frames)
        }
        frames = [{key: value for key, value in frame.items() if key not in shared} for frame in self._frames]
        text = json_text({"camera_model": self._model or "OPENCV", **shared, "frames": frames}, indent=2)
        self._path.write_text(text + "\n", encoding="utf-8")


def _lens(camera: Camera) -> tuple[str, dict[str, float]]:
    """Return the camera_model and its coefficients. Raises UsageError for a rational model."""
    if camera.projection == "fisheye":
        # nerfstudio reads the model's name, instant-ngp is_fisheye next to the coefficients.
        return FISHEYE, {"is_fisheye": True, **dict(zip(("k1", "k2", "k3", "k4"), camera.distortion or [0.0] * 4))}
    if any(camera.distortion[5:]):
        raise UsageError(
            f"the camera's distortion is {list(camera.distortion)}, and transforms.json has no k4, k5, k6 of OpenCV's "
            "rational model; write the format colmap"
        )
    return "OPENCV", dict(zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion))
