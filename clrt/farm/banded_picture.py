"""Images too large for the client's memory: each band is rendered by one worker, and stored in a file until all exist.

The client holds only the band that it just received. The file has the image's rows, 4 bytes per channel, each at its
offset; a manifest next to it lists the finished bands, so that an interrupted render can be resumed.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError
from ..output.row_writer import BLOCK_ROWS, write_rows
from ..rendering.checkpoint.identity import facts_of
from ..rendering.compile.features import biased_by
from ..rendering.film.tiles import TILE, tiles_of
from ..rendering.render_warnings import DARK, bias_warnings, black_warnings, nonfinite_warnings
from ..rendering.renderer_options import beyond
from ..scene.validation.validate import validate
from .cluster import Cluster
from .manifest import Manifest
from .orders import PictureOrder
from .whole_pictures import WholePictures

#: Pixels from which on an image is rendered in bands: smaller ones fit the client, including film and estimates (some
#: 350 bytes per pixel).
HUGE = 1 << 23
#: Approximate pixels per band. A worker has the band's film, with as many bytes per pixel.
BAND_PIXELS = 1 << 20
BYTES = 4
#: Fields of a band's report that do not apply to the image.
OF_ONE = {
    "seconds",
    "samples_per_second",
    "rays_per_second",
    "stop_reason",
    "tile_noise",
    "clamped_part",
    "brightest",
    "light",
}
#: Fields of an order that are separate facts, or differ from band to band.
COMMON = {"scene", "options", "camera", "band"}


@dataclass
class BandedPicture:
    """An image in bands. order: for the whole image; path: of the manifest, next to which the rows are stored."""

    order: PictureOrder
    path: Path
    band_pixels: int = BAND_PIXELS
    reports: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def size(self) -> tuple[int, int]:
        """Return (width, height)."""
        return self.order.settled.render.size

    @property
    def channels(self) -> int:
        """Return the channels of a pixel: with alpha, four."""
        return 3 + self.order.settled.render.transparent

    @property
    def rows_path(self) -> Path:
        """Return the path of the file with the rows."""
        return Path(f"{self.path}.rows")

    def render(self, cluster: Cluster, resume: bool = False) -> Iterator[tuple[int, int]]:
        """Render all missing bands; yield the number of finished bands and of all, at least every tenth of a second.

        Raises ClrtErrors.
        """
        validate(self.order.settled)
        bands = self._bands()
        manifest = Manifest(self.path, self._facts(), resume)
        try:
            flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | (0 if manifest.done else os.O_TRUNC)
            file = open(os.open(self.rows_path, flags, 0o600), "r+b", buffering=0)
        except OSError as error:
            raise OutputError(f"{self.rows_path}: cannot be written ({error.strerror})") from error
        try:
            self.reports = {
                name: about["report"]
                for name, about in manifest.done.items()
                if name in bands and self._is_there(file, bands[name], about)
            }
            names = [name for name in bands if name not in self.reports]
            pictures = WholePictures(
                cluster,
                names,
                lambda name: replace(self.order, band=bands[name]),
                tuple(self.order.options.get("device") or ()),
            )
            for result in pictures.results():
                if result is not None:
                    self._keep(file, manifest, bands[result[0]], *result)
                yield len(self.reports), len(bands)
        finally:
            file.close()
            manifest.close()

    def save(self, path: Path, view: str, exposure: float, metadata: dict[str, str]) -> Path:
        """Write the image once all bands are there. Raises OutputError."""
        write_rows(
            path,
            self.size,
            self._pieces(),
            channels=self.channels,
            metadata=metadata,
            view=view,
            exposure=exposure,
        )
        return path

    def forget(self) -> None:
        """Remove the stored rows and the manifest."""
        self.rows_path.unlink(missing_ok=True)
        self.path.unlink(missing_ok=True)

    def summary(self) -> dict[str, Any]:
        """Combine the reports of all bands: samples, rays and noise; time is the sum of the workers'."""
        reports = list(self.reports.values())
        added = {
            name: sum(report[name] for report in reports)
            for name in ("samples", "rays", "nonfinite_samples", "seconds")
        }
        squares = [report["samples"] / report["spp"] * report["noise"] ** 2 for report in reports if report["noise"]]
        pixels = self.size[0] * self.size[1]
        first = {name: value for name, value in (reports[0] if reports else {}).items() if name not in OF_ONE}
        reasons = {report["stop_reason"] for report in reports}
        if len(reasons) == 1:
            first["stop_reason"] = reasons.pop()
        if biased_by(self.order.settled.render):
            first["clamped_part"] = _clamped_part(reports)
        if len(reports) > 1:
            first["warnings"] = [*first["warnings"], *self._warnings(reports)]
        return {
            **first,
            "width": self.size[0],
            "height": self.size[1],
            "bands": len(reports),
            "samples": added["samples"],
            "rays": added["rays"],
            "nonfinite_samples": added["nonfinite_samples"],
            "worker_seconds": added["seconds"],
            "spp": round(added["samples"] / pixels),
            "noise": float(np.sqrt(sum(squares) / pixels)) if len(squares) == len(reports) else None,
        }

    def _warnings(self, reports: list[dict[str, Any]]) -> list[str]:
        """Return warnings about the whole image; each band's report already has those about the scene."""
        settings = self.order.settled.render
        dropped, samples = (sum(report[name] for report in reports) for name in ("nonfinite_samples", "samples"))
        return [
            *nonfinite_warnings(dropped, samples),
            *bias_warnings(settings, _clamped_part(reports)),
            *black_warnings(
                settings, reports[0]["kernel"]["features"], max(report["brightest"] for report in reports), DARK
            ),
        ]

    def _bands(self) -> dict[str, tuple[int, int]]:
        """Return the tile rows of each band by name; all begin at a block of an .exr file."""
        rows, each = tiles_of(self.size)[0], BLOCK_ROWS // TILE
        step = each * max(1, self.band_pixels // (self.size[0] * BLOCK_ROWS))
        return {
            f"rows {first * TILE} to {min((first + step) * TILE, self.size[1])}": (first, min(rows, first + step))
            for first in range(0, rows, step)
        }

    def _facts(self) -> dict[str, str]:
        """Return the facts that identify the render, including its stopping criteria, as each band stops by itself."""
        order = self.order
        others = {
            "band_pixels": self.band_pixels,
            **beyond(order.options),
            **{each.name: getattr(order, each.name) for each in fields(order) if each.name not in COMMON},
        }
        return {
            **facts_of(order.settled, order.choices),
            **{name: str(value) for name, value in others.items() if name != "device"},
        }

    def _span(self, band: tuple[int, int]) -> tuple[int, int]:
        """Return a band's offset in the file, and its size in bytes."""
        width, height = self.size
        first, end = band[0] * TILE, min(band[1] * TILE, height)
        row = width * self.channels * BYTES
        return first * row, (end - first) * row

    def _keep(self, file: FileIO, manifest: Manifest, band: tuple[int, int], name: str, result: dict[str, Any]) -> None:
        at, _ = self._span(band)
        layers = [result["pixels"]] + ([result["alpha"][..., None]] if self.channels == 4 else [])
        content = np.concatenate(layers, axis=2, dtype=np.float32).tobytes()
        try:
            file.seek(at)
            if file.write(content) != len(content):
                raise OSError(0, "the disk is full")
            os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"{self.rows_path}: cannot be written ({error.strerror})") from error
        report = {key: value for key, value in result["report"].items() if key != "history"}
        report["brightest"] = float(np.max(result["pixels"]))
        report["light"] = float(np.sum(result["pixels"], dtype=np.float64))
        manifest.add(name, {"sha256": hashlib.sha256(content).hexdigest(), "report": report})
        self.reports[name] = report

    def _is_there(self, file: FileIO, band: tuple[int, int], about: dict[str, Any]) -> bool:
        """Return whether the file has the rows that the manifest lists."""
        at, count = self._span(band)
        file.seek(at)
        return hashlib.sha256(file.read(count) or b"").hexdigest() == about.get("sha256")

    def _pieces(self) -> Iterator[NDArray[np.float32]]:
        width, _ = self.size
        with open(self.rows_path, "rb") as file:
            for band in self._bands().values():
                content = file.read(self._span(band)[1])
                yield np.frombuffer(content, np.float32).reshape(-1, width, self.channels)


def _clamped_part(reports: list[dict[str, Any]]) -> float:
    """Return the fraction of all light that clamping removed, from the bands' fractions and remaining light."""
    removed = sum(
        report["light"] * part / (1 - part) for report in reports if (part := report.get("clamped_part", 0.0))
    )
    light = sum(report["light"] for report in reports)
    return removed / (removed + light) if removed else 0.0
