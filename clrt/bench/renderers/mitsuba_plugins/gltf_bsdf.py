"""glTF's metallic-roughness: after docs/scene-format.md, with all its variants.

    film + min(film left)·fibres + min(T)·F·G·D/(4·cos wi·cos wo) + diffuse

T is the fraction of light that clearcoat ("film") and sheen ("fibres") transmit at an angle. With the albedo coupling
the diffuse part is R(wi)·R(wo)/(pi·mean R), where R = T·r + ∫ lobe·max(T(wo) − T(wi), 0) dwi for the lobes below the
layers. The directional albedos are interpolated between integrals (layer_tables.py), instead of the kernels' fits.
Directions are sampled by the cosine and by Mitsuba's own visible normals, in equal parts.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ....scene.materials.material import ALPHA_MIN
from .layer_tables import FILM_F0, PARTS, SMOOTHEST, angle_tables, fibres, film_albedo, means_of
from .plugin_bsdf import TINY, PluginBsdf, dr, glossy_type, mi, upwards

#: Tabulated roughnesses of a material without layers, at the midpoints of intervals.
ROWS = 128
COLORS = ("color", "f0", "sheen_color")
NUMBERS = ("metallic", "roughness", "specular", "clearcoat", "transmission")


class Gltf(PluginBsdf):
    """The plugin "gltf".

    COLORS and NUMBERS: see `MetallicRoughness`; colors, numbers or textures. f0: of the dielectric part, before
    `specular`. smith, coupling: see there; multiple: whether there is multiple scattering between microfacets;
    transmits: whether `transmission` is not 0. layered: whether there are layers, with clearcoat_roughness and
    sheen_roughness; `roughness` is then a number. bumps: in a normal map, whose bumps shadow the diffuse part; the
    unperturbed normal then replaces the geometric one (equal for flat meshes).
    """

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.textures = {name: props.get_texture(name) for name in COLORS + NUMBERS}
        self.smith, self.coupling, self.multiple, self.transmits, self.layered = (
            props[name] for name in ("smith", "coupling", "multiple", "transmits", "layered")
        )
        self.bumps = props.get("bumps", False)
        rough = [(np.arange(ROWS) + 0.5) / ROWS]
        if self.layered:
            rough = [np.array([props[f"{name}roughness"]]) for name in ("", "clearcoat_", "sheen_")]
            film_alpha = max(float(rough[1][0]) ** 2, ALPHA_MIN)
            self.film = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, film_alpha, film_alpha, True)
            self.power = max(float(rough[2][0]), SMOOTHEST) ** -2
            above = np.column_stack([film_albedo(float(rough[1][0])), fibres(float(rough[2][0]))[2]])
            self.above = mi.Texture1f(mi.TensorXf(above.astype(np.float32)))
        layers = (float(rough[1][0]), float(rough[2][0])) if self.layered else None
        corners = angle_tables(tuple(rough[0].tolist()), self.smith, layers)
        table = np.concatenate(list(corners), axis=-1)
        self.angles = mi.Texture2f(mi.TensorXf(table.astype(np.float32)))
        self.means = mi.Texture1f(mi.TensorXf(means_of(table).astype(np.float32)))
        sides = mi.BSDFFlags.FrontSide | (mi.BSDFFlags.BackSide if self.transmits else mi.BSDFFlags.Empty)
        kinds = [mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.DiffuseReflection]
        kinds += [mi.BSDFFlags.GlossyTransmission] if self.transmits else []
        self.have_components([kind | sides for kind in kinds])

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        wi, lobes = upwards(si.wi), self._lobes(si, active)
        place = sample1 * (len(lobes) + 1)
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        for number, each in enumerate(lobes):
            wo = dr.select(place < number + 1, wo, mi.reflect(wi, each.sample(wi, sample2)[0]))
        active &= wo.z > 0
        through = (place - dr.floor(place) < 0.5) & self.transmits
        wo.z = dr.select(through != (mi.Frame3f.cos_theta(si.wi) < 0), -wo.z, wo.z)
        bs = mi.BSDFSample3f()
        bs.wo = wo
        bs.eta, bs.sampled_component = 1.0, mi.UInt32(0)
        bs.sampled_type = glossy_type(through)
        return self.weighted(ctx, si, bs, active)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        m, lobes = self._material(si, active), self._lobes(si, active)
        through = mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(wo) < 0
        i, o = upwards(si.wi), upwards(wo)
        h = dr.normalize(i + o)
        at, there, mean = self._at(m, i.z), self._at(m, o.z), self._mean(m)
        least, cos_h = dr.minimum(at.left[0], there.left[0]), dr.dot(o, h)
        gloss = least * self._microfacets(lobes[0], i, o, h, self.smith)
        value = _schlick(m.both0, m.both90, cos_h) * gloss + self._diffuse(m, at, there, mean, cos_h, si, wo) * o.z
        if self.layered:
            value += (
                m.clearcoat * _schlick(FILM_F0, 1, cos_h) * self._microfacets(self.film, i, o, h, "height_correlated")
            )
            value += (
                dr.minimum(at.film, there.film)
                * m.sheen_color
                * self._fibres(i.z, o.z, h.z, dr.maximum(at.fibres, there.fibres))
            )
        pdf = (o.z / dr.pi + sum(each.pdf(i, h) / (4 * cos_h) for each in lobes)) / (len(lobes) + 1)
        active &= (i.z > 0) & (o.z > 0)
        if self.transmits:
            lost = at.lost * there.lost / dr.maximum(mean.lost, TINY) / dr.pi if self.multiple else 0
            passed = m.through * ((1 - _schlick(m.f0, m.f90, cos_h)) * gloss + lost * o.z)
            value, pdf = dr.select(through, passed, value), pdf / 2
        else:
            active &= ~through
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def _lobes(self, si: Any, active: Any) -> list[Any]:
        """Return the distributions of normals of the base, and of the film if there are layers."""
        alpha = dr.maximum(dr.square(self.textures["roughness"].eval_1(si, active)), ALPHA_MIN)
        base = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        return [base, self.film] if self.layered else [base]

    def _material(self, si: Any, active: Any) -> Any:
        """Return the parameters at a point, and F0 and F90 of the dielectric part and of both parts."""
        m = SimpleNamespace(
            **{name: self.textures[name].eval(si, active) for name in COLORS},
            **{name: self.textures[name].eval_1(si, active) for name in NUMBERS},
        )
        m.f0, m.f90 = dr.minimum(m.f0, 1) * m.specular, m.specular
        m.both0, m.both90 = dr.lerp(m.f0, m.color, m.metallic), dr.lerp(m.f90, 1, m.metallic)
        albedo = (1 - m.metallic) * m.color
        m.through, m.albedo = m.transmission * albedo, (1 - m.transmission) * albedo
        m.sheen = dr.maximum(dr.maximum(m.sheen_color.x, m.sheen_color.y), m.sheen_color.z)
        m.bounced = mi.Color3f(0)
        if self.multiple:
            lost = 1 - self.means.eval([m.roughness])[1]
            by_albedo = self.coupling == "albedo"
            f = (20 * (m.color if by_albedo else m.both0) + 1) / 21
            m.bounced = f * f * (1 - lost) / (1 - f * lost) * (m.metallic if by_albedo else 1)
        return m

    def _at(self, m: Any, cosine: Any) -> Any:
        """Return what layers and microfacets do to light at an angle."""
        root = dr.sqrt(dr.maximum(cosine, 0))
        at = self._energy(m, self.angles.eval([root, m.roughness]))
        at.cosine = cosine
        if self.layered:
            film, at.fibres = self.above.eval([root])
            at.film = 1 - m.clearcoat * film
        return at

    def _mean(self, m: Any) -> Any:
        return self._energy(m, self.means.eval([m.roughness]))

    def _energy(self, m: Any, parts: Any) -> Any:
        """Return `left` (PARTS, interpolated between the corners), T·lost, T·r and R."""
        c, s = m.clearcoat, m.sheen
        corners = zip(
            ((1 - c) * (1 - s), c * (1 - s), (1 - c) * s, c * s),
            (parts[k : k + PARTS] for k in range(0, len(parts), PARTS)),
        )
        left = (
            parts
            if not self.layered
            else [sum(each) for each in zip(*([weight * part for part in corner] for weight, corner in corners))]
        )
        at = SimpleNamespace(left=left, lost=left[0] - left[1])
        at.body = m.albedo * (left[0] - m.f0 * (left[1] - left[2]) - m.f90 * left[2])
        at.taken = (
            m.both0 * left[3]
            + m.both90 * left[4]
            + m.sheen_color * left[5]
            + m.through * ((1 - m.f0) * left[3] + (1 - m.f90) * left[4])
        )
        at.all = at.body + m.bounced * at.lost + at.taken
        return at

    def _microfacets(self, facets: Any, i: Any, o: Any, h: Any, smith: str) -> Any:
        """Evaluate G·D/(4·cos wi)."""
        g_i, g_o = facets.smith_g1(i, h), facets.smith_g1(o, h)
        g = g_i * g_o
        if smith == "height_correlated":
            g = g_i * g_o / dr.maximum(g_i + g_o - g_i * g_o, TINY)
        if smith.startswith("schlick"):
            alpha = facets.alpha()
            k = alpha / 2 if smith == "schlick_ibl" else dr.square(dr.sqrt(alpha) + 1) / 8
            g = i.z * o.z / dr.maximum((i.z * (1 - k) + k) * (o.z * (1 - k) + k), TINY)
        return facets.eval(h) * g / dr.maximum(4 * i.z, TINY)

    def _diffuse(self, m: Any, at: Any, there: Any, mean: Any, cos_h: Any, si: Any, wo: Any) -> Any:
        """Evaluate the diffuse lobe and multiple scattering: f; bumps shadow the former."""
        if self.coupling == "albedo":
            scaled = at.all / dr.maximum(mean.all, TINY) / dr.pi
            matte, whole = scaled * there.body, scaled * there.all
        else:
            crossing = 1 - _schlick(m.both0, m.both90, cos_h)
            if self.coupling == "fresnel":
                crossing = (1 - _schlick(m.both0, m.both90, at.cosine)) * (
                    1 - _schlick(m.both0, m.both90, there.cosine)
                )
            scale = at.left[0] * there.left[0] / dr.maximum(mean.left[0], TINY) / dr.pi
            lost = [1 - each.left[1] / dr.maximum(each.left[0], TINY) for each in (at, there)]
            lost.append(dr.maximum(1 - self.means.eval([m.roughness])[1], TINY))
            matte = scale * crossing * m.albedo
            whole = matte + scale * m.bounced * lost[0] * lost[1] / lost[2]
        return whole - matte * (1 - self._shadowing(si, wo)) if self.bumps else whole

    def _shadowing(self, si: Any, wo: Any) -> Any:
        up, bend = (dr.square(dr.dot(si.n, w)) for w in (si.sh_frame.to_world(wo), si.sh_frame.n))
        return 2 / (1 + dr.sqrt(1 + dr.minimum((1 / bend - 1) / 8, 1) * (1 / up - 1)))

    def _fibres(self, i: Any, o: Any, cos_h: Any, albedo: Any) -> Any:
        """Evaluate f·cos wo of white sheen."""
        d = (2 + self.power) / (2 * dr.pi) * dr.maximum(1 - dr.square(cos_h), 0) ** (self.power / 2)
        return d * o / dr.maximum(4 * (i + o - i * o) * dr.maximum(albedo, 1), TINY)


def _schlick(f0: Any, f90: Any, cosine: Any) -> Any:
    return f0 + (f90 - f0) * (1 - cosine) ** 5


mi.register_bsdf("gltf", Gltf)
