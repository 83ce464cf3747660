"""Calls functions of the kernels on arrays: see clrt.study.probe."""

from clrt.study.probe import Probe, choices

__all__ = ["Probe", "choices"]
