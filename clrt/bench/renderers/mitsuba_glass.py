"""Plugins for Mitsuba 3 of glass that it lacks, after docs/scene-format.md: with multiple scattering between
microfacets, and thin sheets that are rough or colored.

Light that single scattering loses returns in two steps: its term is divided by 1 − min(loss(wo), loss(wi)), and the
rest leaves diffusely, by rest(wo)·rest(wi)/(pi·m), where m = Σ n²·∫ rest·2c dc over n² of the side that light arrives
on. Losses are sums over visible normals, instead of the kernels' tables.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from ...scene.materials.microfacets import Doubles
from .mitsuba_layers import ROOTS, gloss, means_of, normals

#: Avoids division by zero.
TINY = 1e-20
#: Fraction of the samples for the diffuse part.
LATER = 0.3


def losses(ior: float, alpha: float) -> tuple[Doubles, Doubles]:
    """Return (SIDE, 4) at ROOTS: loss and rest outside, loss and rest inside; and the m of both sides."""
    single = [scattered(eta, alpha) for eta in (ior, 1 / ior)]
    loss = [1 - sum(weight.sum(axis=1) for weight, _ in parts) for parts in single]
    rest = []
    for side, parts in enumerate(single):
        kept = sum(
            np.sum(weight / (1 - np.minimum(loss[side][:, None], _at(loss[there], cosine))), axis=1)
            for (weight, cosine), there in zip(parts, (side, 1 - side))
        )
        rest.append(np.maximum(1 - kept, 0))
    table = np.column_stack([loss[0], rest[0], loss[1], rest[1]])
    means = means_of(table)
    return table, (means[1] + ior**2 * means[3]) / np.array([1, ior**2])


def sheet_losses(alpha: float) -> tuple[Doubles, float]:
    """Return (SIDE, 2), loss and rest, and m of a thin sheet, which loses as much as a mirror of the same roughness."""
    cos_i, weight, _ = gloss(alpha, "height_correlated")
    loss = 1 - weight.sum(axis=1)
    rest = 1 - np.sum(weight / (1 - np.minimum(loss[:, None], _at(loss, cos_i))), axis=1)
    table = np.column_stack([loss, np.maximum(rest, 0)])
    return table, float(means_of(table)[1])


def scattered(eta: float, alpha: float, roots: Doubles = ROOTS) -> list[tuple[Doubles, Doubles]]:
    """Return fractions of light and their cosines, (n, points) each, reflected and refracted in one bounce from
    `roots` (n,) of cosines."""
    o = (roots**2)[:, None]
    h, cos_h = normals(alpha, roots)
    cos_t = np.sqrt(np.maximum(1 - (1 - cos_h**2) / eta**2, 0))
    f = np.where(cos_t > 0, _fresnel(cos_h, cos_t, eta), 1)
    parts = []
    for share, cosine in ((f, 2 * cos_h * h - o), (1 - f, o / eta - (cos_h / eta - cos_t) * h)):
        lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / np.maximum(c, 1e-9) ** 2 - 1)) / 2 - 0.5 for c in (o, cosine))
        seen = np.where(cosine > 0, (1 + lambda_o) / (1 + lambda_o + lambda_i), 0)
        parts.append((share * seen / h.shape[1], cosine))
    return parts


def _fresnel(cos_o: Any, cos_t: Any, eta: float) -> Any:
    parallel, perpendicular = ((a * cos_o - b * cos_t) / (a * cos_o + b * cos_t) for a, b in ((eta, 1), (1, eta)))
    return (parallel * parallel + perpendicular * perpendicular) / 2


def _at(values: Doubles, cosines: Doubles) -> Doubles:
    return np.asarray(np.interp(np.sqrt(np.maximum(cosines, 0)), ROOTS, values))


def register(mi: Any) -> None:
    """Register the plugins "all_bounces" and "sheet" with `mi`, the Mitsuba module with its variant chosen.

    all_bounces: alpha, ior, and color of `bsdf`, a rough dielectric with single scattering. sheet: ior, alpha (0:
    smooth), color, the transmittance from face to face, and multiple: whether there is multiple scattering.
    """
    dr = import_module("drjit")

    class AllBounces(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.single, self.color, self.ior = props["bsdf"], props.get_texture("color"), props["ior"]
            table, self.m = losses(self.ior, props["alpha"])
            self.table = mi.Texture1f(mi.TensorXf(table.astype(np.float32)))
            self.m_components = [self.single.flags(i) for i in range(self.single.component_count())]
            self.m_flags = self.single.flags()

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            later = sample1 < LATER
            bs, weight = self.single.sample(ctx, si, (sample1 - LATER) / (1 - LATER), sample2, active & ~later)
            active &= later | dr.any(weight > 0)  # others go to the wrong side of the surface
            inside = sample1 < LATER * self._inside
            spread = mi.warp.square_to_cosine_hemisphere(sample2)
            spread.z = dr.select(inside, -spread.z, spread.z)
            bs.wo = dr.select(later, spread, bs.wo)
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            crosses = bs.wo.z * si.wi.z < 0
            bs.eta = dr.select(crosses, dr.select(si.wi.z > 0, self.ior, 1 / self.ior), 1)
            bs.sampled_component = dr.select(crosses, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_type = dr.select(
                crosses, mi.UInt32(+mi.BSDFFlags.GlossyTransmission), mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            )
            active &= bs.pdf > 0
            return bs, dr.select(active, value / dr.maximum(bs.pdf, TINY), 0)

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

        def traverse(self, callback: Any) -> None:
            """Expose no parameters."""

        def to_string(self) -> str:
            return "AllBounces[]"

    class Sheet(mi.BSDF):  # type: ignore[misc]
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
                    np.mean(2 * cosines * _fresnel(cosines, np.sqrt(1 - (1 - cosines**2) / self.ior**2), self.ior))
                )
            self.m_components = [kind | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide for kind in kinds]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def _divided(self, f: Any, si: Any, active: Any) -> Any:
            """Return what a sheet reflects and transmits in all, for the Fresnel term of one face."""
            c = self.color.eval(si, active)
            passed = dr.square(1 - f) * c / (1 - dr.square(c * f))
            return f + passed * c * f, passed

        def _fresnel(self, cosine: Any) -> Any:
            return mi.fresnel(cosine, self.ior)[0]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
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
                value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            else:
                back, on = self._divided(self._fresnel(wi.z), si, active)
                value, bs.pdf = dr.select(through, on, back), 0.5
            active &= bs.pdf > 0
            return bs, dr.select(active, value / dr.maximum(bs.pdf, TINY), 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if not self.alpha:
                return mi.Color3f(0), mi.Float(0)
            i, o = (mi.Vector3f(w.x, w.y, dr.abs(w.z)) for w in (si.wi, wo))
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

        def traverse(self, callback: Any) -> None:
            """Expose no parameters."""

        def to_string(self) -> str:
            return "Sheet[]"

    mi.register_bsdf("all_bounces", AllBounces)
    mi.register_bsdf("sheet", Sheet)
