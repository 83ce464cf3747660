"""Tests of the rendering room and of the kernels."""
