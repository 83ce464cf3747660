"""Tests of the rendering package and of the kernels."""
