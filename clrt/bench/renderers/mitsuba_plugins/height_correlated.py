"""Height-correlated Smith term for those of Mitsuba's microfacet BSDFs that use the separable one.

Both follow from G1 of the two directions, and so does their quotient: G2 = g·g'/(g + g' − g·g') over g·g' (Heitz 2014,
"Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", eq. 98 and 99).
"""

from __future__ import annotations

from typing import Any

from .plugin_bsdf import PluginBsdf, dr, mi


class HeightCorrelated(PluginBsdf):
    """The plugin "height_correlated". alpha: of GGX; bsdf: a roughconductor or roughdielectric with this alpha, whose
    values are multiplied by the quotient. Sampling is unchanged."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.alpha, self.separable = props["alpha"], props["bsdf"]
        self.have_components([self.separable.flags(i) for i in range(self.separable.component_count())])

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        bs, weight = self.separable.sample(ctx, si, sample1, sample2, active)
        return bs, weight * self._quotient(si.wi, bs.wo)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.separable.eval(ctx, si, wo, active) * self._quotient(si.wi, wo)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.separable.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def _quotient(self, wi: Any, wo: Any) -> Any:
        g_i, g_o = (2 / (1 + dr.sqrt(1 + self.alpha**2 * mi.Frame3f.tan_theta_2(w))) for w in (wi, wo))
        return dr.select(g_i + g_o > 0, 1 / (g_i + g_o - g_i * g_o), 0)


mi.register_bsdf("height_correlated", HeightCorrelated)
