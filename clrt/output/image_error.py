"""Error measures of an image against a reference."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError, UsageError
from ..file_names import StrPath
from ..float_errors import with_default_errors
from ..formats.images.image_reader import read_layers
from ..scene.fields.keywords import with_known_keywords
from .image import Image

FloatArray = NDArray[np.float32]
AnyImage = FloatArray | Image | StrPath
#: Keeps relMSE finite where the reference is dark.
RELMSE_FLOOR = 0.01
#: Limit for HDR-FLIP, the largest float16: the brighter the reference, the more exposures it evaluates.
FLIP_MAX = 65504.0
#: If the reference's maximum is below this, HDR-FLIP finds no exposure for it and terminates the process.
FLIP_MIN = 1e-5


def compare_files(image: Path, reference: Path) -> dict[str, Any]:
    """Run `compare` on two image files, with HDR-FLIP if either is .exr or .hdr. Raises SceneError naming the files."""
    ours, theirs = read_layers(image), read_layers(reference)
    check_sizes(ours[0], theirs[0], str(image), str(reference))
    hdr = bool({image.suffix.lower(), reference.suffix.lower()} & {".exr", ".hdr"})
    return _measures(ours[0], theirs[0], hdr) | _alpha_measure(ours[1], theirs[1])


@with_known_keywords
@with_default_errors
def compare(image: AnyImage, reference: AnyImage, *, hdr: bool = True) -> dict[str, Any]:
    """Return how much an image x differs from a reference r, by several measures.

    Both are (h, w, 3) float32 linear, an `Image`, or the path of an image file; computed in float64:

    - relmse: mean((x − r)² / (r² + 0.01)); rmse: √mean((x − r)²); max_abs: max |x − r|
    - mean_ratio: mean(x) / mean(r) of each channel; None if mean(r) is 0
    - flip: mean HDR-FLIP (if `hdr`) or LDR-FLIP; None if flip-evaluator is not installed or HDR-FLIP's reference black
    - nonfinite, nonfinite_reference: the number of values of x and of r that are NaN or Inf. Where either is, the value
      is excluded from all the measures above (for FLIP it is 0 in both); a measure without any value left is None.
    - alpha_max_abs: if one of them has alpha, the largest difference, where an image without has 1; colors are compared
      premultiplied

    Raises SceneError if a file cannot be read or the sizes differ, and UsageError if an argument is not an image.
    """
    (x, covered), (r, of_reference) = _layers(image, "the image"), _layers(reference, "the reference")
    check_sizes(x, r, "the image", "the reference")
    return _measures(x, r, hdr) | _alpha_measure(covered, of_reference)


def _alpha_measure(alpha: FloatArray | None, reference: FloatArray | None) -> dict[str, Any]:
    """Return the measure of alpha, if an image has it."""
    if alpha is None and reference is None:
        return {}
    one, other = (np.ones((1, 1)) if each is None else each.astype(np.float64) for each in (alpha, reference))
    return {"alpha_max_abs": float(np.nanmax(np.abs(one - other)))}


def _layers(picture: AnyImage, name: str) -> tuple[FloatArray, FloatArray | None]:
    """Return the pixels (h, w, 3) of an image in any of the accepted forms, and its alpha, if it is transparent."""
    if isinstance(picture, str | PathLike):
        return read_layers(Path(picture))
    if isinstance(picture, Image) and picture.layers.shape[2] == 4:
        return picture.pixels, picture.alpha
    pixels = picture.pixels if isinstance(picture, Image) else picture
    if not isinstance(pixels, np.ndarray) or pixels.ndim != 3 or pixels.shape[2] != 3:
        raise UsageError(
            f"{name} is {type(pixels).__name__} {getattr(pixels, 'shape', '')}, not (height, width, 3) "
            "pixels; give such an array, a clrt.Image or the path of an image"
        )
    return pixels, None


def _measures(image: FloatArray, reference: FloatArray, hdr: bool) -> dict[str, Any]:
    """See `compare`."""
    valid = np.isfinite(image) & np.isfinite(reference)
    x, r = image[valid].astype(np.float64), reference[valid].astype(np.float64)
    return {
        "relmse": relmse(image, reference),
        "rmse": float(np.sqrt(np.mean((x - r) ** 2))) if x.size else None,
        "mean_ratio": mean_ratios(image, reference),
        "flip": _flip(np.where(valid, image, 0), np.where(valid, reference, 0), hdr),
        "max_abs": float(np.abs(x - r).max()) if x.size else None,
        "nonfinite": int(np.count_nonzero(~np.isfinite(image))),
        "nonfinite_reference": int(np.count_nonzero(~np.isfinite(reference))),
    }


def relmse(image: FloatArray, reference: FloatArray) -> float | None:
    """Compute the relmse of `compare` alone, fast enough to use during a render; both arrays of one shape."""
    valid = np.isfinite(image) & np.isfinite(reference)
    x, r = image[valid].astype(np.float64), reference[valid].astype(np.float64)
    return float(np.mean((x - r) ** 2 / (r**2 + RELMSE_FLOOR))) if x.size else None


def mean_ratios(image: FloatArray, reference: FloatArray) -> list[float | None]:
    """Compute the mean_ratio of `compare` alone; both arrays of one shape."""
    valid = np.isfinite(image) & np.isfinite(reference)
    means = [np.where(valid, picture, 0).mean((0, 1), np.float64) for picture in (image, reference)]
    return [float(x) / float(r) if r else None for x, r in zip(*means)]


def _flip(image: FloatArray, reference: FloatArray, hdr: bool) -> float | None:
    """Compute mean FLIP at 67 pixels per degree (Andersson et al. 2020, 2021); negative values count as 0."""
    try:
        import flip_evaluator
    except ImportError:
        return None
    if hdr and reference.max(initial=0.0) < FLIP_MIN:
        return None
    bound = FLIP_MAX if hdr else 1.0
    x, r = (np.ascontiguousarray(picture.clip(0, bound), np.float32) for picture in (image, reference))
    _, mean, _ = flip_evaluator.evaluate(r, x, "HDR" if hdr else "LDR", inputsRGB=False, applyMagma=False)
    return float(mean) if np.isfinite(mean) else None


def check_sizes(image: FloatArray, reference: FloatArray, image_name: str, reference_name: str) -> None:
    """Raise SceneError, by these names, unless both images have the same size."""
    if image.shape != reference.shape:
        (h, w), (height, width) = image.shape[:2], reference.shape[:2]
        raise SceneError(
            f"sizes differ: {image_name} has {w}x{h} pixels, {reference_name} {width}x{height}; "
            "only images of the same size can be compared"
        )
