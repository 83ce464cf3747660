"""A baked image."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..file_names import StrPath
from ..float_errors import with_default_errors
from ..output.images import write_image
from ..output.report import header_of
from ..scene.fields.validated import Validated


@dataclass(frozen=True, eq=False)
class LightMap(Validated):
    """Baked image of a mesh. Its arrays are read-only: change a copy.

    - pixels: (height, width, 3) float32, linear; 0 where the mesh covers no texel, beyond the padding
    - standard_error: of the pixels, likewise
    - covered: (height, width), the texels that the mesh covers at least partly
    - report: what was baked and how; mean and standard_error are averages over covered texels and channels
    """

    pixels: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    covered: NDArray[np.bool_]
    report: dict[str, Any]

    @with_default_errors
    def save(self, path: StrPath, *, view: str | None = None, exposure: float = 0.0) -> Path:
        """Write .exr or .hdr (linear), or .png, .jpg, .webp, .tif (through `view`, after multiplication by 2^exposure).

        view: by default srgb, or raw for ambient occlusion, which is no color. Raises OutputError if that fails.
        """
        chosen = view or ("raw" if self.report["what"] == "occlusion" else "srgb")
        write_image(path, self.pixels, metadata=header_of(self.report), view=chosen, exposure=exposure)
        return Path(path)
