"""Renders every scene of scenes/ and composes the gallery of the README: python docs/make_gallery.py [SCENE...]

Pictures go to docs/images/SCENE.jpg, those named alone if any are; the gallery is made of all that are there.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
#: Rows of the gallery. A row is as wide as the gallery, its pictures equally high. (The furnace is an even grey.)
ROWS = [
    ["textures", "night", "instances"],
    ["spheres", "caustics", "cornell", "tree"],
    ["depth_of_field", "sunlit", "dragon", "spot"],
    ["mirrors", "materials", "local", "glass"],
]
#: Pixels: the gallery's width, the gap between its pictures, and the height of a picture of its own.
WIDTH, GAP, HEIGHT = 1280, 6, 320
#: Samples a pixel where the denoiser has little to do with fewer than a scene asks for, and what an eye sees best.
OPTIONS = {
    "caustics": ["--spp", "512"],
    "cornell": ["--exposure", "1.5"],
    "glass": ["--exposure", "1"],
    "local": ["--spp", "16"],
    "night": ["--view", "agx", "--exposure", "1"],
}
USUAL = ["--spp", "128"]
LARGEST = 300_000


def rendered(name: str, folder: Path) -> NDArray[np.uint8]:
    """The picture of a scene, HEIGHT high, denoised."""
    import clrt

    width, height = clrt.load(str(ROOT / "scenes" / f"{name}.toml")).render.size
    file = folder / f"{name}.png"
    command = [
        sys.executable,
        "-m",
        "clrt",
        "render",
        ROOT / "scenes" / f"{name}.toml",
        *USUAL,
        *OPTIONS.get(name, []),
        "--size",
        f"{round(HEIGHT * width / height)}x{HEIGHT}",
        "--denoise",
        "-q",
        "-o",
        file,
    ]
    subprocess.run(command, check=True)
    return np.asarray(iio.imread(file)[..., :3])


def resized(picture: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    """Means over the area of each new pixel, of light."""
    light: Any = (picture / 255.0) ** 2.2
    for axis, size in ((0, height), (1, width)):
        ends = np.linspace(0, light.shape[axis], size + 1)
        sums = np.concatenate([np.zeros_like(light.take([0], axis)), light.cumsum(axis)], axis)
        low = np.floor(ends).astype(int)
        rest = np.expand_dims(ends - low, [1, 2] if axis == 0 else [0, 2])
        at = sums.take(low, axis) + rest * light.take(low.clip(0, light.shape[axis] - 1), axis)
        light = np.diff(at, axis=axis) / (ends[1] - ends[0])
    return np.asarray(np.round(255 * light.clip(0, 1) ** (1 / 2.2)), np.uint8)


def gallery() -> NDArray[np.uint8]:
    lines = []
    for row in ROWS:
        pictures = [iio.imread(IMAGES / f"{name}.jpg") for name in row]
        widths = np.array([picture.shape[1] / picture.shape[0] for picture in pictures])
        height = round((WIDTH - GAP * (len(row) - 1)) / widths.sum())
        ends = np.round(np.cumsum([0, *widths]) / widths.sum() * (WIDTH - GAP * (len(row) - 1))).astype(int)
        gap = np.full((height, GAP, 3), 255, np.uint8)
        parts = [resized(picture, width, height) for picture, width in zip(pictures, np.diff(ends))]
        lines += [
            np.hstack([part for each in parts for part in (each, gap)][:-1]),
            np.full((GAP, WIDTH, 3), 255, np.uint8),
        ]
    return np.vstack(lines[:-1])


def save(file: Path, picture: NDArray[np.uint8]) -> None:
    """With the best quality that LARGEST leaves."""
    for quality in range(92, 40, -4):
        content = iio.imwrite("<bytes>", picture, extension=".jpg", quality=quality)
        if len(content) <= LARGEST:
            break
    file.write_bytes(content)
    print(f"{file.relative_to(ROOT)}  {len(content) // 1000} kB")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or sum(ROWS, []):
            save(IMAGES / f"{name}.jpg", rendered(name, Path(folder)))
    save(IMAGES / "gallery.jpg", gallery())


if __name__ == "__main__":
    main()
