"""Thin sheets of glass that are rough or colored."""

from __future__ import annotations

from typing import Any

import numpy as np

from .glass_losses import fresnel, sheet_losses
from .plugin_bsdf import TINY, PluginBsdf, dr, mi, upwards

#: Fraction of the samples for the diffuse part.
LATER = 0.3


class Sheet(PluginBsdf):
    """The plugin "sheet". ior, alpha (0: smooth), color, the transmittance from face to face, and multiple: whether
    there is multiple scattering."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.color, self.ior, self.alpha = props.get_texture("color"), props["ior"], props["alpha"]
        kinds = [mi.BSDFFlags.DeltaReflection, mi.BSDFFlags.Null]
        multiple = props["multiple"]
        if self.alpha:
            self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)
            table, self.m = sheet_losses(self.alpha)
            self.table = mi.Texture1f(mi.TensorXf((table * multiple).astype(np.float32)))
            kinds = [mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission]
            cosines = (np.arange(1000) + 0.5) / 1000
            self.mean_f = float(
                np.mean(2 * cosines * fresnel(cosines, np.sqrt(1 - (1 - cosines**2) / self.ior**2), self.ior))
            )
        self.have_components([kind | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide for kind in kinds])

    def _divided(self, f: Any, si: Any, active: Any) -> Any:
        """Return what a sheet reflects and transmits in all, for the Fresnel term of one face."""
        c = self.color.eval(si, active)
        passed = dr.square(1 - f) * c / (1 - dr.square(c * f))
        return f + passed * c * f, passed

    def _fresnel(self, cosine: Any) -> Any:
        return mi.fresnel(cosine, self.ior)[0]

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        wi = upwards(si.wi)
        bs = mi.BSDFSample3f()
        through = sample1 < 0.5
        if self.alpha:
            place = 2 * sample1 - dr.floor(2 * sample1)
            wo = dr.select(
                place < LATER,
                mi.warp.square_to_cosine_hemisphere(sample2),
                mi.reflect(wi, self.facets.sample(wi, sample2)[0]),
            )
        else:
            wo = mi.reflect(wi)
        active &= wo.z > 0
        bs.wo = mi.Vector3f(wo.x, wo.y, dr.select(through != (si.wi.z < 0), -wo.z, wo.z))
        kinds = [
            mi.UInt32(+(component & (mi.BSDFFlags.Reflection | mi.BSDFFlags.Transmission)))
            for component in self.m_components
        ]
        bs.sampled_type, bs.eta = dr.select(through, kinds[1], kinds[0]), 1.0
        bs.sampled_component = dr.select(through, mi.UInt32(1), mi.UInt32(0))
        if self.alpha:
            return self.weighted(ctx, si, bs, active)
        back, on = self._divided(self._fresnel(wi.z), si, active)
        bs.pdf = 0.5
        return bs, dr.select(active, dr.select(through, on, back) / bs.pdf, 0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        if not self.alpha:
            return mi.Color3f(0), mi.Float(0)
        i, o = upwards(si.wi), upwards(wo)
        h = dr.normalize(i + o)
        cos_h = dr.dot(i, h)
        g_i, g_o = self.facets.smith_g1(i, h), self.facets.smith_g1(o, h)
        single = self.facets.eval(h) * g_i * g_o / dr.maximum((g_i + g_o - g_i * g_o) * 4 * i.z, TINY)
        (loss_i, rest_i), (loss_o, rest_o) = (self.table.eval([dr.sqrt(w.z)]) for w in (i, o))
        later = rest_i * rest_o * o.z / (dr.pi * self.m)
        value = [
            divided * single / (1 - dr.minimum(loss_i, loss_o)) + diffuse * later
            for divided, diffuse in zip(
                self._divided(self._fresnel(cos_h), si, active), self._divided(self.mean_f, si, active)
            )
        ]
        pdf = (1 - LATER) * self.facets.pdf(i, h) / (4 * cos_h) + LATER * o.z / dr.pi
        active &= (i.z > 0) & (o.z > 0)
        through = si.wi.z * wo.z < 0
        return dr.select(active, dr.select(through, value[1], value[0]), 0), dr.select(active, pdf / 2, 0)


mi.register_bsdf("sheet", Sheet)
