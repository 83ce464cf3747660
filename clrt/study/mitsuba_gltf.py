"""glTF's metallic-roughness as a plugin of Mitsuba 3, which has none: after docs/scene-format.md, for all of its ways.

    f = F(wi·h)·G·D/(4·cos wi·cos wo) + (1 − F(cos wi))(1 − F(cos wo))·albedo/pi

It draws half of its directions by their cosine, and half from Mitsuba's own visible normals.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..scene.material import ALPHA_MIN


def register(mi: Any) -> None:
    """Makes the plugin "gltf" known to `mi`, the module of Mitsuba with its variant chosen.

    color, metallic, roughness: colours or textures; f0: of what is no metal; separable: Smith's G1·G1, else the
    height-correlated G2; bumps: within a normal map, whose bumps shadow what is matte. There the unbent normal is taken
    for the geometric one, which it is on flat meshes.
    """
    dr = import_module("drjit")

    class Gltf(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.color, self.metallic, self.roughness = (
                props.get_texture(name) for name in ("color", "metallic", "roughness"))
            self.f0 = mi.Color3f(props["f0"])
            self.separable = props.get("separable", False)
            self.bumps = props.get("bumps", False)
            reflects = mi.BSDFFlags.FrontSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | reflects, mi.BSDFFlags.DiffuseReflection | reflects]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def _microfacets(self, si: Any, active: Any) -> Any:
            alpha = dr.maximum(dr.square(self.roughness.eval_1(si, active)), ALPHA_MIN)
            return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            normal, _ = self._microfacets(si, active).sample(si.wi, sample2)
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(sample1 < 0.5, mi.reflect(si.wi, normal), mi.warp.square_to_cosine_hemisphere(sample2))
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            bs.eta, bs.sampled_component = 1.0, mi.UInt32(0)
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            active &= bs.pdf > 0
            return bs, dr.select(active, value / bs.pdf, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            facets, color, metallic = self._microfacets(si, active), self.color.eval(si, active), \
                self.metallic.eval_1(si, active)
            f0 = dr.lerp(self.f0, color, metallic)
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            h = dr.normalize(si.wi + wo)
            g_i, g_o = facets.smith_g1(si.wi, h), facets.smith_g1(wo, h)
            shadowing = g_i * g_o if self.separable else 1 / (1 / g_i + 1 / g_o - 1)
            gloss = _schlick(f0, dr.dot(wo, h)) * facets.eval(h) * shadowing / (4 * cos_i * cos_o)
            body = (1 - _schlick(f0, cos_i)) * (1 - _schlick(f0, cos_o)) * (1 - metallic) * color / dr.pi
            if self.bumps:
                body *= self._shadowing(si, wo)
            pdf = 0.5 * facets.pdf(si.wi, h) / (4 * dr.dot(wo, h)) + 0.5 * cos_o / dr.pi
            active &= (cos_i > 0) & (cos_o > 0)
            return dr.select(active, (gloss + body) * cos_o, 0), dr.select(active, pdf, 0)

        def _shadowing(self, si: Any, wo: Any) -> Any:
            up, bend = (dr.square(dr.dot(si.n, w)) for w in (si.sh_frame.to_world(wo), si.sh_frame.n))
            return 2 / (1 + dr.sqrt(1 + dr.minimum((1 / bend - 1) / 8, 1) * (1 / up - 1)))

        def traverse(self, callback: Any) -> None:
            """Nothing of it changes."""

        def to_string(self) -> str:
            return "Gltf[]"

    def _schlick(f0: Any, cosine: Any) -> Any:
        return f0 + (1 - f0) * (1 - cosine) ** 5

    mi.register_bsdf("gltf", Gltf)
