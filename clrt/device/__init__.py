"""Where it runs: devices, programs, bounded launches. The only room, with accel and render, that imports pyopencl."""

from . import environment as environment  # before anything here imports pyopencl
