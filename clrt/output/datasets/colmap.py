"""Views as COLMAP's text model: cameras.txt, images.txt, points3D.txt."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.model import Camera
from ..view_transform import to_levels
from .layer_files import Layers, SavedView

#: Points taken from each view that has the layers "position" and "rgb": what 3D Gaussian splatting starts from.
POINTS_PER_VIEW = 1000


class ColmapWriter:
    """Writes images.txt and points3D.txt line by line, and the distinct cameras at the end."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / "sparse" / "0"
        self._folder.mkdir(parents=True, exist_ok=True)
        self._images, self._points = (
            (self._folder / name).open("w", encoding="utf-8") for name in ("images.txt", "points3D.txt")
        )
        self._cameras: dict[str, int] = {}
        self._views = self._count = 0

    def add(self, view: SavedView) -> None:
        """Add a view, and some of the points that it sees."""
        pose, (width, height) = view.camera.world_to_camera, view.size
        model, parameters = camera_model(view.camera, view.size)
        intrinsics = f"{model} {width} {height} {' '.join(f'{value:.17g}' for value in parameters)}"
        number = self._cameras.setdefault(intrinsics, len(self._cameras) + 1)
        self._views += 1
        values = " ".join(f"{value:.17g}" for value in (*quaternion(pose[:3, :3]), *pose[:3, 3]))
        self._images.write(f"{self._views} {values} {number} {Path(view.file).name}\n\n")
        if {"position", "rgb"} <= view.layers.keys():
            self._add_points(view.layers)

    def _add_points(self, layers: Layers) -> None:
        points = layers["position"].reshape(-1, 3)
        levels = to_levels(layers["rgb"].astype(np.float32), "srgb", 0.0, np.uint8).reshape(-1, 3)
        seen = np.flatnonzero(np.any(points != 0, axis=1))
        for place in seen[:: max(1, len(seen) // POINTS_PER_VIEW)]:
            self._count += 1
            (x, y, z), (red, green, blue) = points[place].astype(np.float64), levels[place]
            self._points.write(f"{self._count} {x:.9g} {y:.9g} {z:.9g} {red} {green} {blue} 0\n")

    def finish(self) -> None:
        """Write the cameras and close the files."""
        self._images.close()
        self._points.close()
        lines = [f"{number} {text}\n" for text, number in self._cameras.items()]
        (self._folder / "cameras.txt").write_text("".join(lines), encoding="utf-8")


def camera_model(camera: Camera, size: tuple[int, int]) -> tuple[str, list[float]]:
    """Return COLMAP's camera model and its parameters: focal lengths, center and distortion."""
    K, distortion = camera.matrix(size), list(camera.distortion)
    parameters = [K[0, 0], K[1, 1], K[0, 2], K[1, 2]]
    if camera.projection == "fisheye":
        return "OPENCV_FISHEYE", parameters + (distortion or [0.0] * 4)
    if not any(distortion):
        return "PINHOLE", parameters
    if not any(distortion[4:]):
        return "OPENCV", parameters + distortion[:4]
    return "FULL_OPENCV", parameters + distortion + [0.0] * (8 - len(distortion))


def quaternion(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (w, x, y, z), w >= 0, of a rotation matrix, as an eigenvector (Bar-Itzhack 2000)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    symmetric = np.array(
        [
            [xx - yy - zz, 0, 0, 0],
            [yx + xy, yy - xx - zz, 0, 0],
            [zx + xz, zy + yz, zz - xx - yy, 0],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    _, vectors = np.linalg.eigh(symmetric)
    x, y, z, w = vectors[:, -1]
    found = np.array([w, x, y, z])
    return found if w >= 0 else -found
