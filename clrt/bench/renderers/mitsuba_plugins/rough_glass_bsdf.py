"""Rough glass with multiple scattering between microfacets, around Mitsuba's own with single scattering."""

from __future__ import annotations

from typing import Any

import numpy as np

from .glass_losses import losses
from .plugin_bsdf import TINY, PluginBsdf, dr, glossy_type, mi

#: Fraction of the samples for the diffuse part.
LATER = 0.3


class AllBounces(PluginBsdf):
    """The plugin "all_bounces". alpha, ior, and color of `bsdf`, a rough dielectric with single scattering."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.single, self.color, self.ior = props["bsdf"], props.get_texture("color"), props["ior"]
        table, self.m = losses(self.ior, props["alpha"])
        self.table = mi.Texture1f(mi.TensorXf(table.astype(np.float32)))
        self.have_components([self.single.flags(i) for i in range(self.single.component_count())])

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        later = sample1 < LATER
        bs, weight = self.single.sample(ctx, si, (sample1 - LATER) / (1 - LATER), sample2, active & ~later)
        active &= later | dr.any(weight > 0)  # others go to the wrong side of the surface
        inside = sample1 < LATER * self._inside
        spread = mi.warp.square_to_cosine_hemisphere(sample2)
        spread.z = dr.select(inside, -spread.z, spread.z)
        bs.wo = dr.select(later, spread, bs.wo)
        crosses = bs.wo.z * si.wi.z < 0
        bs.eta = dr.select(crosses, dr.select(si.wi.z > 0, self.ior, 1 / self.ior), 1)
        bs.sampled_component = dr.select(crosses, mi.UInt32(1), mi.UInt32(0))
        bs.sampled_type = glossy_type(crosses)
        return self.weighted(ctx, si, bs, active)

    @property
    def _inside(self) -> float:
        """The fraction of diffuse samples inside."""
        return float(self.ior**2 / (1 + self.ior**2))

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        from_loss, from_rest = self._lost(si.wi)
        to_loss, to_rest = self._lost(wo)
        m = dr.select(si.wi.z > 0, float(self.m[0]), float(self.m[1]))
        later = from_rest * to_rest * dr.abs(wo.z) / dr.pi / dr.maximum(m, TINY)
        tint = dr.select(si.wi.z * wo.z < 0, self.color.eval(si, active), 1)
        single = self.single.eval(ctx, si, wo, active) / (1 - dr.minimum(from_loss, to_loss))
        return dr.select(active, single + tint * later, 0)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        side = dr.select(wo.z < 0, self._inside, 1 - self._inside)
        return (1 - LATER) * self.single.pdf(ctx, si, wo, active) + LATER * side * dr.abs(wo.z) / dr.pi

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def _lost(self, w: Any) -> Any:
        """Return the loss of single scattering and the rest, on the side of w."""
        outside, inside = (self.table.eval([dr.sqrt(dr.abs(w.z))])[k : k + 2] for k in (0, 2))
        return [dr.select(w.z > 0, a, b) for a, b in zip(outside, inside)]


mi.register_bsdf("all_bounces", AllBounces)
