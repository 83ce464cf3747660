"""Plugin for Mitsuba 3 of glTF's metallic-roughness, which it lacks: after docs/scene-format.md, with all its variants.

    f = F(wi·h)·G·D/(4·cos wi·cos wo) + coupling·albedo/pi, and multiple scattering between microfacets

The directional albedos are interpolated between integrals, instead of the kernels' fits. Half of the directions are
sampled by the cosine, half by Mitsuba's own visible normals.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.metallic_roughness import Smith
from ...scene.materials.microfacets import Doubles, albedos

#: Tabulated roughnesses, and tabulated roots of cosines.
SIDE = 128
#: Avoids division by zero.
TINY = 1e-20


@cache
def albedo_grid(smith: Smith) -> Doubles:
    """Return `albedos` (SIDE, SIDE, 2) by roughness and √cos, at the midpoints of SIDE intervals each."""
    middles = (np.arange(SIDE) + 0.5) / SIDE
    return np.array([np.transpose(albedos(middles**2, max(roughness**2, ALPHA_MIN), smith)) for roughness in middles])


def register(mi: Any) -> None:
    """Register the plugin "gltf" with `mi`, the Mitsuba module with its variant chosen.

    color, metallic, roughness: colors or textures; f0: of the dielectric part; smith, coupling: see
    `MetallicRoughness`; multiple: whether there is multiple scattering between microfacets; bumps: in a normal map,
    whose bumps shadow the diffuse part; the unperturbed normal then replaces the geometric one (equal for flat meshes).
    """
    dr = import_module("drjit")

    class Gltf(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.color, self.metallic, self.roughness = (
                props.get_texture(name) for name in ("color", "metallic", "roughness"))
            self.f0 = mi.Color3f(props["f0"])
            self.smith, self.coupling, self.multiple = (props[name] for name in ("smith", "coupling", "multiple"))
            grid, roots = albedo_grid(self.smith), (np.arange(SIDE) + 0.5) / SIDE
            self.albedos = mi.Texture2f(mi.TensorXf(grid.astype(np.float32)))
            means = np.mean(4 * roots[:, None]**3 * grid, axis=1)    # ∫ 2·cos·E dcos
            self.means = mi.Texture1f(mi.TensorXf(means.astype(np.float32)))
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
            return bs, dr.select(active, value / dr.maximum(bs.pdf, TINY), 0)

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
            shadowing = g_i * g_o if self.smith == "separable" else g_i * g_o / dr.maximum(g_i + g_o - g_i * g_o, TINY)
            gloss = _schlick(f0, dr.dot(wo, h)) * facets.eval(h) * shadowing / dr.maximum(4 * cos_i * cos_o, TINY)
            body = self._body(si, cos_o, dr.dot(wo, h), f0, color, metallic, active) / dr.pi
            if self.bumps:
                body *= self._shadowing(si, wo)
            pdf = 0.5 * facets.pdf(si.wi, h) / (4 * dr.dot(wo, h)) + 0.5 * cos_o / dr.pi
            active &= (cos_i > 0) & (cos_o > 0)
            return dr.select(active, (gloss + body) * cos_o, 0), dr.select(active, pdf, 0)

        def _shadowing(self, si: Any, wo: Any) -> Any:
            up, bend = (dr.square(dr.dot(si.n, w)) for w in (si.sh_frame.to_world(wo), si.sh_frame.n))
            return 2 / (1 + dr.sqrt(1 + dr.minimum((1 / bend - 1) / 8, 1) * (1 / up - 1)))

        def _body(self, si: Any, cos_o: Any, cos_h: Any, f0: Any, color: Any, metallic: Any, active: Any) -> Any:
            """Evaluate the part below the specular lobe, and multiple scattering: f·pi."""
            cos_i, roughness = mi.Frame3f.cos_theta(si.wi), self.roughness.eval_1(si, active)
            albedo = (1 - metallic) * color
            angles = [self.albedos.eval([dr.sqrt(dr.maximum(cosine, 0)), roughness]) for cosine in (cos_i, cos_o)]
            angles.append(self.means.eval([roughness]))
            lost = [1 - whole for whole, _ in angles]
            bounced = mi.Color3f(0)
            if self.multiple:
                mean = (20 * (color if self.coupling == "albedo" else f0) + 1) / 21
                bounced = mean * mean * (1 - lost[2]) / (1 - mean * lost[2])
                bounced *= metallic if self.coupling == "albedo" else 1
            if self.coupling == "albedo":
                left = [albedo * (1 - self.f0 * (whole - grazing) - grazing) + bounced * (1 - whole)
                        for whole, grazing in angles]
                return left[0] * left[1] / dr.maximum(left[2], TINY)
            crossing = (1 - _schlick(f0, cos_i)) * (1 - _schlick(f0, cos_o))
            if self.coupling == "half_vector":
                crossing = 1 - _schlick(f0, cos_h)
            return crossing * albedo + bounced * lost[0] * lost[1] / dr.maximum(lost[2], TINY)

        def traverse(self, callback: Any) -> None:
            """Expose no parameters."""

        def to_string(self) -> str:
            return "Gltf[]"

    def _schlick(f0: Any, cosine: Any) -> Any:
        return f0 + (1 - f0) * (1 - cosine) ** 5

    mi.register_bsdf("gltf", Gltf)
