"""View transforms of OpenColorIO (opencolorio.org), as part of OpenImageIO: ACES, and those of the user's config."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError, did_you_mean

FloatArray = NDArray[np.float32]

#: A built-in config of OpenColorIO, and its view of ACES 2.0 for SDR displays.
ACES = ("ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5", "sRGB - Display/ACES 2.0 - SDR 100 nits (Rec.709)")
#: Used if $OCIO is not set.
DEFAULT = "ocio://default"
#: Names of linear Rec. 709 in configs.
REC709 = ("lin_rec709_scene", "lin_rec709", "lin_srgb", "Linear Rec.709", "Linear BT.709", "Utility - Linear - sRGB")


def ocio_view(config: str, view: str) -> Callable[[FloatArray], FloatArray]:
    """Return a view of a config: VIEW of its default display, DISPLAY/VIEW, or the default one if `view` is empty.

    config: a file or ocio://NAME; if empty, the one in the environment variable OCIO, or OpenColorIO's default.
    Raises UsageError if there is no such config or view, or it has no color space for linear Rec. 709.
    """
    import OpenImageIO as oiio

    config = config or os.environ.get("OCIO") or DEFAULT
    colors = _config(config)
    display, view = _display_view(config, colors, view)
    source = next((name for name in REC709 if colors.getColorSpaceIndex(colors.resolve(name)) >= 0), None)
    if source is None:
        raise UsageError(
            f"{config}: has no colour space called {', '.join(REC709)}; give its linear Rec. 709 space "
            f"the alias {REC709[1]}"
        )

    def shown(linear: FloatArray) -> FloatArray:
        buffer = oiio.ImageBufAlgo.ociodisplay(
            oiio.ImageBuf(np.ascontiguousarray(linear)), display, view, colors.resolve(source), colorconfig=config
        )
        if buffer.has_error:
            raise UsageError(f"{config}: OpenColorIO cannot show {display}/{view}: {buffer.geterror()}")
        return np.asarray(buffer.get_pixels(oiio.FLOAT))

    return shown


@lru_cache
def _config(config: str) -> Any:
    import OpenImageIO as oiio

    colors = oiio.ColorConfig(config)
    if problem := colors.geterror():
        remedy = (
            "install a newer OpenImageIO"
            if config.startswith("ocio:")
            else "set the environment variable OCIO to a valid one, or unset it"
        )
        raise UsageError(f"{config}: is not a usable OpenColorIO config ({problem.splitlines()[0]}); {remedy}")
    return colors


def _display_view(config: str, colors: Any, name: str) -> tuple[str, str]:
    """Return the display and view that `name` selects."""
    display = colors.getDefaultDisplayName()
    views = colors.getViewNames(display)
    if name in views or not name:
        return display, name or colors.getDefaultViewName(display)
    all_views = {
        f"{each}/{view}": (each, view) for each in colors.getDisplayNames() for view in colors.getViewNames(each)
    }
    if name in all_views:
        return all_views[name]
    meant = did_you_mean(name, [*views, *all_views], "ocio:{}".format)
    raise UsageError(
        f"{config}: view {name!r} is unknown; {display} has {', '.join(views)}, others are named "
        f"DISPLAY/VIEW for {', '.join(colors.getDisplayNames())}{meant}"
    )
