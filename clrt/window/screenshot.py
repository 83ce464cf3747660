"""Screenshots of the window."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray


def screenshot() -> NDArray[np.float32]:
    """Return (height, width, 3) float32 in [0, 1], row 0 on top: what this frame has drawn, before it is displayed."""
    from OpenGL import GL

    io = imgui.get_io()
    width, height = (round(size * scale) for size, scale in zip(io.display_size, io.display_framebuffer_scale))
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    levels = np.frombuffer(GL.glReadPixels(0, 0, width, height, GL.GL_RGB, GL.GL_UNSIGNED_BYTE), np.uint8)
    return levels.reshape(height, width, 3)[::-1].astype(np.float32) / np.float32(255)
