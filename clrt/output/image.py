"""A finished image."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..aov_types import OF_GROUP
from ..file_names import StrPath
from ..float_errors import with_default_errors
from ..scene.fields.field_types import show
from ..scene.fields.keywords import with_known_keywords
from ..scene.fields.number_arrays import read_only
from ..scene.fields.validated import Validated
from .data_images import shown_data
from .file_formats import is_shown
from .images import write_image
from .report import header_of


@dataclass(frozen=True)
class Image(Validated):
    """Rendered image. Its arrays are read-only: change a copy, such as `image.pixels.copy()`.

    - pixels: (height, width, 3) float32, linear Rec. 709
    - report: how it was rendered, as in docs/report.md
    - raw: the pixels before denoising, with the alpha of a transparent image as a fourth channel; None if not denoised
    - aovs: AOVs by name, see docs/aovs.md
    - alpha: (height, width) float32, the fraction of each pixel that the scene covers, if it is transparent or has a
      backdrop; else None. The pixels are premultiplied (associated alpha).
    - backdrop: (height, width, 3) or (1, 1, 3), what the pixels have behind the scene; None if it is transparent there
    """

    pixels: NDArray[np.float32]
    report: dict[str, Any] = field(default_factory=dict)
    raw: NDArray[np.float32] | None = None
    aovs: dict[str, NDArray[np.generic]] = field(default_factory=dict)
    alpha: NDArray[np.float32] | None = None
    backdrop: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "aovs", {name: read_only(array) for name, array in self.aovs.items()})

    def conflicts(self) -> list[str]:
        given = {name: getattr(self, name) for name in ("report", "aovs")}
        faults = [
            f"{name}: {show(value)} is not a dict" for name, value in given.items() if not isinstance(value, dict)
        ]
        form: Any = self.pixels
        if not (isinstance(form, np.ndarray) and form.ndim == 3 and form.shape[2] == 3 and form.dtype.kind == "f"):
            faults.append(f"pixels: {show(form)} is not an image; give an array (height, width, 3) of float32")
        return faults

    @property
    def layers(self) -> NDArray[np.float32]:
        """The pixels, (height, width, 3), or with the alpha channel of a transparent image, (height, width, 4)."""
        if self.alpha is None or self.backdrop is not None:
            return self.pixels
        return np.concatenate([self.pixels, self.alpha[..., None]], axis=2)

    @property
    def light_groups(self) -> dict[str, NDArray[np.float32]]:
        """The light of each light group by its name, (height, width, 3), if the AOV light_groups was requested.

        Their sum is the image, or if that is denoised, the raw one (docs/light-groups.md).
        """
        return {
            name.removeprefix(OF_GROUP): layer.astype(np.float32, copy=False)
            for name, layer in self.aovs.items()
            if name.startswith(OF_GROUP)
        }

    @with_known_keywords
    @with_default_errors
    def save(self, path: StrPath, *, view: str | None = None, exposure: float = 0.0) -> Path:
        """Write .exr or .hdr (linear), or .png, .jpg, .webp, .tif (through `view`, after multiplication by 2^exposure).

        view: by default that of the scene, `report["view"]`, or srgb.
        The AOVs become layers of an .exr, and separate files for formats with a view. Alpha is associated in an .exr,
        and unassociated in the others that have it; a .jpg and an .hdr show the scene over black. Raises OutputError
        if that fails.
        """
        pixels, view = self.layers, view or self.report.get("view", "srgb")
        if is_shown(Path(path)) and (data := self._shown_data()) is not None:
            pixels, view, exposure = data, "raw", 0.0
        write_image(Path(path), pixels, metadata=self.metadata(), view=view, exposure=exposure, aovs=self.aovs)
        return Path(path)

    def _shown_data(self) -> NDArray[np.float32] | None:
        """Return what formats with a view show of data, with its alpha; None for images of light."""
        integrator, alpha = self.report.get("integrator", "path"), self.layers[..., 3:]
        if not alpha.size:
            return shown_data(integrator, self.pixels)
        straight = np.divide(self.pixels, alpha, out=np.zeros_like(self.pixels), where=alpha > 0)
        data = shown_data(integrator, straight)
        return None if data is None else np.concatenate([data * alpha, alpha], axis=2)

    def metadata(self) -> dict[str, str]:
        """Return the report's scalar values, for the file's header."""
        return header_of(self.report)

    def _repr_png_(self) -> bytes:
        """Return the image as notebooks display it."""
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            return self.save(Path(folder) / "image.png").read_bytes()


def save_side_by_side(path: Path, images: Iterable[NDArray[np.float32]]) -> None:
    """Write images (height, width, 3) of one height, float32, linear Rec. 709, as one; creates the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image(np.concatenate([*images], axis=1)).save(path)
