"""The Phong models.

    f = min(color, 1 − specular)/pi + specular·N·cos^n

Phong's, with the cosine between wo and the mirrored wi, is normalized by N = (n + 2)/2pi (Lafortune and Willems 1994,
"Using the modified Phong reflectance model for physically based rendering"); Blinn's, with that between the normal and
the half vector, by N = (n + 2)(n + 4)/(8pi(2^(−n/2) + n)) (Giesen 2009, "Phong and Blinn–Phong normalization").
"""

from __future__ import annotations

from typing import Any

from .plugin_bsdf import PluginBsdf, dr, mi


class Phong(PluginBsdf):
    """The plugin "phong". color, specular: colors or textures; shininess: n; half_vector: whether the cosine is
    Blinn's."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.color, self.specular = (props.get_texture(name) for name in ("color", "specular"))
        self.n, self.half_vector = props["shininess"], props["half_vector"]
        kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.DiffuseReflection
        self.have_components([kind | mi.BSDFFlags.FrontSide for kind in kinds])

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        z, turn = sample2.x ** (1 / (self.n + 1)), 2 * dr.pi * sample2.y
        r = dr.sqrt(dr.maximum(1 - z * z, 0))
        lobe = mi.Vector3f(r * dr.cos(turn), r * dr.sin(turn), z)
        glossy = mi.reflect(si.wi, lobe) if self.half_vector else mi.Frame3f(mi.reflect(si.wi)).to_world(lobe)
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(sample1 < 0.5, glossy, mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta, bs.sampled_component = 1.0, mi.UInt32(0)
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        return self.weighted(ctx, si, bs, active)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        n, color, specular = self.n, self.color.eval(si, active), self.specular.eval(si, active)
        h = dr.normalize(si.wi + wo)
        if self.half_vector:
            cosine, spread = h.z, 1 / (4 * dr.dot(wo, h))
            scale = (n + 2) * (n + 4) / (4 * (2 ** (-n / 2) + n))
        else:
            cosine, spread, scale = dr.dot(mi.reflect(si.wi), wo), 1, n + 2
        lobe = dr.maximum(cosine, 0) ** n / (2 * dr.pi)
        value = dr.minimum(color, 1 - specular) / dr.pi + specular * scale * lobe
        pdf = (wo.z / dr.pi + (n + 1) * lobe * spread) / 2
        active &= (si.wi.z > 0) & (wo.z > 0)
        return dr.select(active, value * wo.z, 0), dr.select(active, pdf, 0)


mi.register_bsdf("phong", Phong)
