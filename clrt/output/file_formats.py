"""Formats of image files that are written: their samples, and the settings of the library's writers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError
from .view_transform import Level

#: Prefix of the description that holds the metadata where a format has no fields of its own.
DESCRIPTION, PREFIX = "ImageDescription", "clrt "


@dataclass(frozen=True)
class FileFormat:
    """A format. levels: type of the samples of an image through a view transform; None for linear float samples.

    attributes: of OpenImageIO's writer. described: whether the description holds the metadata, not fields of their own.
    alpha: whether it can hold an alpha channel.
    """

    levels: Level | None = np.uint8
    attributes: Mapping[str, str | int] = field(default_factory=dict)
    described: bool = False
    alpha: bool = True

    def header(self, metadata: Mapping[str, str]) -> dict[str, str | int]:
        """Return the attributes of a file with this metadata."""
        return {**({DESCRIPTION: description_of(metadata)} if self.described else metadata), **self.attributes}


@dataclass(frozen=True)
class EncodedFormat(FileFormat):
    """A format that Pillow encodes in memory, as OpenImageIO's writers end the process if the disk is full.

    The metadata is in the description. encoder, options: of Pillow's `Image.save`.
    """

    encoder: str = ""
    options: Mapping[str, int | bool] = field(default_factory=dict)

    def encoded(self, path: Path, levels: NDArray[Any], metadata: Mapping[str, str]) -> bytes:
        """Return the file's content. Raises OutputError if the format cannot hold the image."""
        from io import BytesIO

        from PIL import Image, TiffImagePlugin

        content, about = BytesIO(), Image.Exif()
        about[TiffImagePlugin.IMAGEDESCRIPTION] = description_of(metadata)
        try:
            Image.fromarray(levels).save(content, self.encoder, **self.options, exif=about)
        except (OSError, ValueError) as error:
            raise OutputError(f"{path}: cannot be written ({error}); use .png, .tif or .exr") from error
        return content.getvalue()

    def metadata(self, path: Path) -> dict[str, str]:
        """Return the metadata of a file of this format; OpenImageIO 3.1 does not read a .webp's description."""
        from PIL import Image, TiffImagePlugin

        with Image.open(path) as opened:
            return described(opened.getexif().get(TiffImagePlugin.IMAGEDESCRIPTION))


#: A .png at level 1 with differences to the row above (libpng's filter 32) takes 0.12 s for a noisy 1920x1080 image,
#: level 3 with the library's choice of filters 0.22 s, for a 3 % smaller file. A .jpg without chroma subsampling, since
#: colored edges are frequent in rendered images. OpenImageIO 3.2 fails to write an Exif folder into a .tif.
PNG = FileFormat(attributes={"png:compressionLevel": 1, "png:filter": 32})
JPEG = EncodedFormat(alpha=False, encoder="JPEG", options={"quality": 95, "subsampling": 0})
TIFF = FileFormat(np.uint16, {"compression": "zip", "tiff:write_exif": 0}, described=True)
FORMATS: dict[str, FileFormat] = {
    ".png": PNG,
    ".exr": FileFormat(None, {"compression": "zip"}),
    ".hdr": FileFormat(None, alpha=False),
    ".jpg": JPEG,
    ".jpeg": JPEG,
    ".tif": TIFF,
    ".tiff": TIFF,
    ".webp": EncodedFormat(encoder="WEBP", options={"lossless": True}),
}


def format_of(path: Path) -> FileFormat:
    """Return the format of a file whose extension is known."""
    return FORMATS[path.suffix.lower()]


def is_shown(path: Path) -> bool:
    """Return whether a file of this name holds the image through a view transform."""
    return path.suffix.lower() in FORMATS and format_of(path).levels is not None


def description_of(metadata: Mapping[str, str]) -> str:
    """Return the metadata as a description."""
    return PREFIX + json.dumps(dict(metadata))


def described(description: str | None) -> dict[str, str]:
    """Return the metadata in a file's description; empty if it holds none."""
    try:
        found = json.loads((description or "").removeprefix(PREFIX))
        return {str(name): str(value) for name, value in found.items()}
    except (ValueError, AttributeError):
        return {}
