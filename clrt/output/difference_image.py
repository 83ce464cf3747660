"""Images of where two images differ, and whether a comparison makes sense."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..formats.images.image_reader import read_layers
from .file_formats import is_shown
from .image_error import RELMSE_FLOOR, check_sizes
from .images import check_writable, write_image

FloatArray = NDArray[np.float32]
#: Quantile of the errors that is drawn white: single bright pixels would leave the rest black.
WHITE = 0.99
#: Fraction of values at the upper end of an 8-bit or 16-bit file from which on it counts as clipped.
CLIPPED = 1e-3


def write_difference(path: Path, image: Path, reference: Path) -> float:
    """Write where two image files differ; return the error that is white, of formats with a view.

    Of an .exr or .hdr: image − reference, signed (an .hdr holds its magnitude). Of others: the root of the relative
    squared error, √(mean over channels of (x − r)² / (r² + 0.01)), from black to white; NaN and Inf are red. Raises
    OutputError, and SceneError naming the files if they cannot be read or compared.
    """
    check_writable(path)
    (x, _), (r, _) = read_layers(image), read_layers(reference)
    check_sizes(x, r, str(image), str(reference))
    with np.errstate(invalid="ignore", over="ignore"):
        difference = x - r
    if not is_shown(path):
        write_image(path, np.abs(difference) if path.suffix.lower() == ".hdr" else difference)
        return 0.0
    valid = np.isfinite(difference).all(axis=2)
    errors = np.zeros(valid.shape)
    squares = difference[valid].astype(np.float64) ** 2 / (r[valid].astype(np.float64) ** 2 + RELMSE_FLOOR)
    errors[valid] = np.sqrt(squares.mean(axis=1))
    white = float(np.quantile(errors[valid], WHITE)) if valid.any() else 0.0
    shown = np.repeat((errors / (white or 1.0)).clip(0, 1)[..., None], 3, axis=2)
    shown[~valid] = 1.0, 0.0, 0.0
    write_image(path, shown.astype(np.float32), view="raw")
    return white


def clipping(image: Path, reference: Path) -> str | None:
    """Return a remark if one file is clipped at white and the other is linear and brighter there."""
    for clipped, linear in ((image, reference), (reference, image)):
        if not is_shown(clipped) or is_shown(linear):
            continue
        (levels, _), (radiance, _) = read_layers(clipped), read_layers(linear)
        at_white = levels >= levels.dtype.type(1)
        beyond = at_white & (radiance > 1) if levels.shape == radiance.shape else np.zeros(1, bool)
        if np.mean(beyond) >= CLIPPED:
            return (
                f"{clipped}: {100 * np.mean(beyond):.2g} % of its values are clipped at white, where {linear} is up to "
                f"{radiance[beyond].max():.3g}: the measures include that; compare .exr files, or two files of one view"
            )
    return None
