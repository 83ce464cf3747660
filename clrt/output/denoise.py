"""Denoising with Intel Open Image Denoise (Áfra et al., openimagedenoise.org), by the package pyoidn.

Its network was trained on images, and returns a likely image given the noisy one and auxiliary features of the first
hits. That is biased; the report gives an estimate of the bias, and the raw image is kept.
"""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DeviceError, UsageError
from ..float_errors import with_default_errors
from ..scene.fields.keywords import with_known_keywords
from ..scene.fields.number_arrays import real_array
from .data_images import check_denoisable
from .image import Image
from .image_error import mean_ratios, relmse

FloatArray = NDArray[np.float32]
#: Distance in pixels up to which coverage of other pixels matters for that of one.
NEAR = 3


class Denoiser:
    """Open Image Denoise on all cores, initialized. `name`: its version and device.

    Raises UsageError if it is not installed, DeviceError if it fails.
    """

    def __init__(self) -> None:
        try:
            import pyoidn
        except ImportError as error:
            raise UsageError(
                "denoising needs the package pyoidn, which is not installed: "
                "pip install pyoidn (not available for Linux on ARM), or render without "
                "denoising"
            ) from error
        try:
            self._device = pyoidn.Device()
        except OSError as error:
            raise DeviceError(f"Open Image Denoise cannot be loaded: {error}") from error
        weakref.finalize(self, self._device.release)
        self._device.commit()
        self._check()
        major, minor, patch = (self._device.get_int(f"version{part}") for part in ("Major", "Minor", "Patch"))
        self.name = f"Open Image Denoise {major}.{minor}.{patch}, CPU"

    def __call__(
        self, color: FloatArray, albedo: FloatArray | None = None, normal: FloatArray | None = None
    ) -> FloatArray:
        """Return the denoised image. All arrays are (height, width, 3) float32.

        color: linear, in any unit; values that are not finite count as 0. albedo in [0, 1] and normal in [-1, 1], which
        needs an albedo, are assumed to be noise-free. Raises DeviceError if it fails, for example for lack of memory.
        """
        finite = np.nan_to_num(color, nan=0, posinf=0, neginf=0)
        # Values below 1e-8 count as black, so the image is scaled by a power of two to a mean near 1.
        exponent = -int(np.frexp(np.mean(finite, dtype=np.float64))[1])
        return np.asarray(np.ldexp(self._filtered(np.ldexp(finite, exponent), albedo, normal, hdr=True), -exponent))

    def coverage(
        self, alpha: FloatArray, albedo: FloatArray | None = None, normal: FloatArray | None = None
    ) -> FloatArray:
        """Return the denoised coverage (height, width) in [0, 1]; it stays as it is where nothing around a pixel is
        covered, or everything. Raises DeviceError if it fails."""
        grey = np.repeat(alpha[..., None], 3, axis=2)
        smooth = self._filtered(grey, albedo, normal, hdr=False).mean(axis=2).clip(0, 1)
        return np.where(_around(alpha, np.maximum) == _around(alpha, np.minimum), alpha, smooth)

    def _filtered(
        self, color: FloatArray, albedo: FloatArray | None, normal: FloatArray | None, hdr: bool
    ) -> FloatArray:
        import pyoidn

        images = {
            name: np.ascontiguousarray(image, np.float32)
            for name, image in {"color": color, "albedo": albedo, "normal": normal}.items()
            if image is not None
        }
        images["output"] = np.empty_like(images["color"])
        with pyoidn.Filter(self._device) as network:
            for name, image in images.items():
                network.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
            network.set_bool("hdr", hdr)
            network.set_bool("cleanAux", albedo is not None)
            network.set_quality(pyoidn.OIDN_QUALITY_HIGH)
            network.commit()
            network.execute()
            self._check()
        return images["output"]

    def _check(self) -> None:
        if problem := self._device.get_error():
            raise DeviceError(f"Open Image Denoise failed: {problem}")


@overload
def denoise(image: Image, albedo: ArrayLike | None = None, normal: ArrayLike | None = None) -> Image: ...


@overload
def denoise(image: ArrayLike, albedo: ArrayLike | None = None, normal: ArrayLike | None = None) -> FloatArray: ...


@with_known_keywords
@with_default_errors
def denoise(
    image: Image | ArrayLike, albedo: ArrayLike | None = None, normal: ArrayLike | None = None
) -> Image | FloatArray:
    """Denoise a rendered image, or an array of linear radiance, by Open Image Denoise (docs/denoise.md).

    image: an `Image`, which is returned with denoised pixels, its `raw` ones, and `denoise` in its report; or an array
    (height, width, 3), or (height, width, 4) with associated alpha, of any unit, for which an array of this shape is
    returned, float32. Pixels that are not finite count as black.

    albedo: (height, width, 3), from 0 to 1, the fraction of light that the first surfaces reflect; normal: likewise,
    from −1 to 1, their normals, which need an albedo. Both are assumed to be free of noise; the more detail they show,
    the more is preserved. By default those among an image's AOVs.

    Raises UsageError for arrays of other shapes, for images that are not colors or denoised already, and if pyoidn is
    not installed; DeviceError if it fails.
    """
    made = image if isinstance(image, Image) else _image_of(image)
    if made.raw is not None:
        raise UsageError("image is denoised already; give the one before, whose pixels are its `raw`")
    check_denoisable(made.report.get("integrator", "path"))
    given = {"albedo": albedo, "normal": normal}
    guides = {
        name: _colors(name, value, made.pixels.shape)
        for name, own in given.items()
        if (value := made.aovs.get(name) if own is None else own) is not None
    }
    if "normal" in guides and "albedo" not in guides:
        raise UsageError("normal is given without albedo, which it needs; give both, or albedo alone")
    smooth = denoised(made, Denoiser(), guides)
    return smooth if isinstance(image, Image) else smooth.layers


def _image_of(array: ArrayLike) -> Image:
    """Return the image of an array with 3 or 4 channels."""
    pixels = real_array("image", array)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or 0 in pixels.shape:
        raise UsageError(
            f"image {pixels.shape} must have the shape (height, width, 3), or (height, width, 4) with alpha"
        )
    layers = np.nan_to_num(pixels.astype(np.float32), nan=0, posinf=0, neginf=0)
    return Image(layers[..., :3], alpha=layers[..., 3] if layers.shape[2] == 4 else None)


def _colors(name: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return a guide as an array of the image's shape."""
    array = real_array(name, values)
    if array.shape != shape:
        raise UsageError(f"{name} {array.shape} must have the image's shape, {shape}")
    return np.nan_to_num(array.astype(np.float32), nan=0, posinf=0, neginf=0)


def denoised(
    image: Image, denoiser: Denoiser, guides: Mapping[str, FloatArray], reference: FloatArray | None = None
) -> Image:
    """Return the image with denoised pixels, the original ones as `raw`, and `denoise` in its report (docs/report.md).

    guides: `albedo` and `normal`, or the first alone, or none; reference: the ground truth; all of the image's shape.
    Alpha is denoised, too, and a backdrop is not.
    """
    start = time.perf_counter()
    pixels, alpha = denoised_layers(image.pixels, image.alpha, image.backdrop, denoiser, guides)
    done: dict[str, Any] = {
        "seconds": time.perf_counter() - start,
        "device": denoiser.name,
        "bias": _bias(pixels, image.pixels),
    }
    if reference is not None:
        done |= {"relmse": relmse(pixels, reference), "reference_bias": _bias(pixels, reference)}
    raw = image.layers
    return replace(image, pixels=pixels, alpha=alpha, report={**image.report, "denoise": done}, raw=raw)


def denoised_layers(
    pixels: FloatArray,
    alpha: FloatArray | None,
    backdrop: FloatArray | None,
    denoiser: Denoiser,
    guides: Mapping[str, FloatArray],
) -> tuple[FloatArray, FloatArray | None]:
    """Return denoised pixels (height, width, 3) and coverage (height, width), see `Image`, whose scene is denoised by
    itself."""
    if alpha is None:
        return denoiser(pixels, **guides), None
    behind = np.zeros((1, 1, 3), np.float32) if backdrop is None else backdrop
    raw = pixels - (1 - alpha[..., None]) * behind
    scene = denoiser(raw, **guides)
    smooth = denoiser.coverage(alpha, **guides)
    empty = ((smooth == 0) & ~raw.any(axis=2))[..., None]
    return np.where(empty, 0, scene) + (1 - smooth[..., None]) * behind, smooth


def _around(values: FloatArray, choose: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """Return the largest or smallest value within NEAR pixels of each pixel (height, width)."""
    for axis in (0, 1):
        padded = np.pad(values, [(NEAR, NEAR) if axis == each else (0, 0) for each in (0, 1)], "edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEAR + 1, axis)
        values = reduce(choose, np.moveaxis(windows, -1, 0))
    return values


def raw_path(path: Path) -> Path:
    """Return the path of the raw image next to the denoised one at `path`: <stem>.raw<suffix>."""
    return path.with_name(f"{path.stem}.raw{path.suffix}")


def _bias(pixels: FloatArray, expected: FloatArray) -> list[float | None]:
    return [None if ratio is None else ratio - 1 for ratio in mean_ratios(pixels, expected)]
