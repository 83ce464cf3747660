"""Base class of the plugins."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from importlib import import_module
from operator import or_
from typing import Any

mi: Any = import_module("mitsuba")
dr: Any = import_module("drjit")
#: Avoids division by zero.
TINY = 1e-20


class PluginBsdf(mi.BSDF):  # type: ignore[misc]
    """A BSDF of which subclasses define the constructor, `sample` and `eval_pdf`."""

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval_pdf(ctx, si, wo, active)[1]

    def traverse(self, callback: Any) -> None:
        """Expose no parameters."""

    def to_string(self) -> str:
        return f"{type(self).__name__}[]"

    def have_components(self, flags: Sequence[Any]) -> None:
        """Declare the components of the BSDF by their flags."""
        self.m_components = list(flags)
        self.m_flags = reduce(or_, flags)

    def weighted(self, ctx: Any, si: Any, bs: Any, active: Any) -> tuple[Any, Any]:
        """Complete a sample with its density; return it and its weight."""
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        active &= bs.pdf > 0
        return bs, dr.select(active, value / dr.maximum(bs.pdf, TINY), 0)


def upwards(w: Any) -> Any:
    """Return the direction on the side of the normal."""
    return mi.Vector3f(w.x, w.y, dr.abs(w.z))


def glossy_type(through: Any) -> Any:
    """Return the type of a sample that is transmitted or reflected."""
    return dr.select(through, mi.UInt32(+mi.BSDFFlags.GlossyTransmission), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
