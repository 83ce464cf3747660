"""OpenCL devices, programs and bounded launches. Only this package, accel and render import pyopencl."""

from . import driver_caches as environment  # must come before the first import of pyopencl
