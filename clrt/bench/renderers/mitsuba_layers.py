"""Plugin for Mitsuba 3 of clearcoat and sheen over glTF's metallic-roughness, after docs/scene-format.md.

    film + min(film left)·fibres + min(T)·gloss + R(wi)·R(wo)/(pi·mean R)

T(c) is the fraction of light that clearcoat ("film") and sheen ("fibres") transmit at an angle, and
R = T·r + ∫ lobe·max(T(wo) − T(wi), 0) dwi for the specular lobe ("gloss"), and for sheen below the clearcoat. All
integrals are midpoint sums of its own. Parameters are numbers, not textures.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.microfacets import Doubles, albedos

#: Tabulated angles, uniform in the root of the cosine, and those of an integral in each dimension.
SIDE, POINTS = 128, 192
FILM_F0 = 0.04
#: Lower bound of the sheen roughness.
SMOOTHEST = 0.1
TINY = 1e-20
ROOTS = (np.arange(SIDE) + 0.5) / SIDE
MIDDLES = (np.arange(POINTS) + 0.5) / POINTS


def layer_table(values: dict[str, Any]) -> Doubles:
    """Return (SIDE, 6) at ROOTS: the film's transmission, T, the unbounded albedo of white sheen, and R by channel."""
    cosines, color, f0 = ROOTS**2, np.array(values["color"]), np.array(values["f0"])
    metallic, sheen = values["metallic"], np.array(values["sheen_color"])
    film_alpha, alpha = (max(values[name]**2, ALPHA_MIN) for name in ("clearcoat_roughness", "roughness"))
    whole, grazing = albedos(cosines, film_alpha, "height_correlated")
    film = 1 - values["clearcoat"] * (FILM_F0 * (whole - grazing) + grazing)
    cos_i, scattered, unbounded = fibres(max(values["sheen_roughness"], SMOOTHEST)**-2)
    left = film * (1 - sheen.max() * scattered.sum(axis=1))
    whole, grazing = (each[:, None] for each in albedos(cosines, alpha, "height_correlated"))
    body = (1 - metallic) * color * (1 - f0 * (whole - grazing) - grazing)
    mean, lost = (20 * color + 1) / 21, 1 - np.mean(4 * ROOTS**3 * whole[:, 0])
    body += values["multiple"] * metallic * mean**2 * (1 - lost) / (1 - mean * lost) * (1 - whole)
    both = f0 * (1 - metallic) + color * metallic
    facets_i, facets, schlick = gloss(alpha)
    taken = sum(taken_by(left, facets_i, facets * part)[:, None] * scale
                for part, scale in ((1 - schlick, both), (schlick, 1.0)))
    reflected = left[:, None] * body + taken + sheen * taken_by(film, cos_i, scattered)[:, None]
    return np.column_stack([film, left, unbounded, reflected])


def fibres(n: float) -> tuple[Doubles, Doubles, Doubles]:
    """Return cosines (1, POINTS), the bounded light (SIDE, POINTS) that white sheen scatters there from ROOTS, and its
    unbounded albedos (SIDE,). n: the power of sin θh.
    """
    def sent(o: Doubles) -> Doubles:
        i, phi = MIDDLES**2, np.pi * MIDDLES[:, None, None]
        along = np.sqrt((1 - o[:, None]**2) * (1 - i**2)) * np.cos(phi)
        cos2_h = (o[:, None] + i)**2 / (2 * (1 + o[:, None] * i + along))
        d = (2 + n) / (2 * np.pi) * np.mean(np.maximum(1 - cos2_h, 0)**(n / 2), axis=0)
        value = 2 * np.pi * d * i / (4 * (o[:, None] + i - o[:, None] * i))
        return np.asarray(value * 2 * MIDDLES / POINTS)    # dcos = 2·root·droot

    values, there = sent(ROOTS**2), sent(MIDDLES**2).sum(axis=1)
    unbounded = values.sum(axis=1)
    return MIDDLES[None]**2, values / np.maximum(np.maximum(unbounded[:, None], there), 1), unbounded


def gloss(alpha: float) -> tuple[Doubles, Doubles, Doubles]:
    """Return cosines (SIDE, POINTS²) of directions that GGX reflects from ROOTS, weights for F = 1, and (1 − wo·h)^5.

    Normals are sampled by their visible area: a disc, part of which is compressed according to the slant of wo (Heitz
    2018, "Sampling the GGX Distribution of Visible Normals").
    """
    o = (ROOTS**2)[:, None]
    radius, phi = (each.ravel() for each in np.meshgrid(np.sqrt(MIDDLES), 2 * np.pi * MIDDLES))
    x, z = alpha * np.sqrt(1 - o**2), o
    x, z = x / np.hypot(x, z), z / np.hypot(x, z)
    across, up = radius * np.sin(phi), radius * np.cos(phi)
    up = (1 - z) / 2 * np.sqrt(np.maximum(1 - across**2, 0)) + (1 + z) / 2 * up
    height = np.sqrt(np.maximum(1 - across**2 - up**2, 0))
    h = np.array([alpha * (height * x - up * z), alpha * np.broadcast_to(across, up.shape), height * z + up * x])
    h[2] = np.maximum(h[2], 0)
    h /= np.sqrt(np.sum(h**2, axis=0))
    cos_h = h[0] * np.sqrt(1 - o**2) + h[2] * o
    i = 2 * cos_h * h[2] - o
    lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / np.maximum(c, 1e-9)**2 - 1)) / 2 - 0.5 for c in (o, i))
    seen = np.where(i > 0, (1 + lambda_o) / (1 + lambda_o + lambda_i), 0)
    return i, seen / POINTS**2, np.clip(1 - cos_h, 0, 1)**5


def taken_by(left: Doubles, cos_i: Doubles, sent: Doubles) -> Doubles:
    """Return Σ sent·max(T(wo) − T(wi), 0), (SIDE,), for T (SIDE,) at ROOTS."""
    there = np.interp(np.sqrt(np.maximum(cos_i, 0)), ROOTS, left)
    return np.asarray(np.sum(sent * np.maximum(left[:, None] - there, 0), axis=1))


def register(mi: Any) -> None:
    """Register the plugin "gltf_layers" with `mi`, the Mitsuba module with its variant chosen.

    Its parameters are those of `layer_table`. A third of the directions each is sampled by the cosine, by the visible
    normals of the specular lobe, and by those of the film.
    """
    dr = import_module("drjit")

    class Layers(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            numbers = {name: props[name] for name in ("metallic", "roughness", "clearcoat", "clearcoat_roughness",
                                                      "sheen_roughness", "multiple")}
            colors = {name: mi.ScalarColor3f(props[name]) for name in ("color", "f0", "sheen_color")}
            table = layer_table(numbers | {name: list(value) for name, value in colors.items()})
            self.table = mi.Texture1f(mi.TensorXf(table.astype(np.float32)))
            self.mean = mi.ScalarColor3f(*np.mean(4 * ROOTS[:, None]**3 * table[:, 3:], axis=0))
            self.f0 = colors["f0"] * (1 - numbers["metallic"]) + colors["color"] * numbers["metallic"]
            self.clearcoat, self.sheen = numbers["clearcoat"], colors["sheen_color"]
            self.power = max(numbers["sheen_roughness"], SMOOTHEST)**-2
            self.film, self.facets = (
                mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
                for alpha in (max(numbers[name]**2, ALPHA_MIN) for name in ("clearcoat_roughness", "roughness")))
            reflects = mi.BSDFFlags.FrontSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | reflects, mi.BSDFFlags.DiffuseReflection | reflects]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            film, facets = (mi.reflect(si.wi, each.sample(si.wi, sample2)[0]) for each in (self.film, self.facets))
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(sample1 < 1 / 3, film, dr.select(
                sample1 < 2 / 3, facets, mi.warp.square_to_cosine_hemisphere(sample2)))
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
            i, o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active &= (i > 0) & (o > 0)
            h = dr.normalize(si.wi + wo)
            at, there = (self.table.eval([dr.sqrt(dr.maximum(cosine, 0))]) for cosine in (i, o))
            least = [dr.minimum(a, b) for a, b in zip(at[:2], there[:2])]
            value = self.clearcoat * self._reflected(self.film, mi.Color3f(FILM_F0), si.wi, wo, h)
            value += least[1] * self._reflected(self.facets, self.f0, si.wi, wo, h)
            value += least[0] * self.sheen * self._fibres(i, o, h.z, dr.maximum(at[2], there[2]))
            value += mi.Color3f(*at[3:]) * mi.Color3f(*there[3:]) / dr.maximum(self.mean, TINY) * o / dr.pi
            pdf = o / dr.pi + sum(each.pdf(si.wi, h) / (4 * dr.dot(wo, h)) for each in (self.film, self.facets))
            return dr.select(active, value, 0), dr.select(active, pdf / 3, 0)

        def _reflected(self, facets: Any, f0: Any, wi: Any, wo: Any, h: Any) -> Any:
            g_i, g_o = facets.smith_g1(wi, h), facets.smith_g1(wo, h)
            shadowing = g_i * g_o / dr.maximum(g_i + g_o - g_i * g_o, TINY)
            fresnel = f0 + (1 - f0) * (1 - dr.dot(wo, h)) ** 5
            return fresnel * facets.eval(h) * shadowing / dr.maximum(4 * mi.Frame3f.cos_theta(wi), TINY)

        def _fibres(self, i: Any, o: Any, cos_h: Any, albedo: Any) -> Any:
            """Evaluate f·cos wo of white sheen."""
            d = (2 + self.power) / (2 * dr.pi) * dr.maximum(1 - dr.square(cos_h), 0) ** (self.power / 2)
            return d * o / dr.maximum(4 * (i + o - i * o) * dr.maximum(albedo, 1), TINY)

        def traverse(self, callback: Any) -> None:
            """Expose no parameters."""

        def to_string(self) -> str:
            return "GltfLayers[]"

    mi.register_bsdf("gltf_layers", Layers)
