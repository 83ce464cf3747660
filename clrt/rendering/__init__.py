"""Rendering: scene packing, program assembly, kernel launches, sample accumulation and error estimation."""
