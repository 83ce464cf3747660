"""What every material has, whatever it is (scene.materials)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Literal, Self

from .limits import Ge, Le
from .textures import NonNegative, Texture

Unit = Annotated[float, Ge(0), Le(1)]
Albedo = tuple[Unit, Unit, Unit]
Radiance = tuple[NonNegative, NonNegative, NonNegative]
Parameter = float | tuple[float, ...] | Texture
#: Which rays back faces are invisible to (`RenderSettings.back_face_culling`).
Culling = Literal["none", "camera", "all"]

#: GGX below this alpha is beyond float32 (D ~ 1/(pi alpha²)), in the kernel too; use `Mirror` for a perfect one.
ALPHA_MIN = 1e-4


def tuples_for_lists(record: Any) -> None:
    """Makes tuples of a dataclass's lists and arrays of numbers, so that it can be written either way and hashed."""
    for field in fields(record):
        value = getattr(record, field.name)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, list):
            object.__setattr__(record, field.name, tuple(value))


@dataclass(frozen=True, kw_only=True)
class Material:
    """What every material has.

    emission: radiance in W·sr⁻¹·m⁻² that its front side sends out. double_sided: its back side does so, too, and
    back-face culling leaves it alone (glTF's doubleSided). normal_map: bends the shading normal (glTF's convention:
    linear, x to the right and y up in the picture); its factor scales how far. opacity: what part of light it stops;
    the rest goes straight through. With an alpha_cutoff it stops all where the opacity reaches that, and nothing
    elsewhere. one_sided: from behind it is not there.
    """

    kernel: ClassVar[str]
    #: Those of its features that have a kernel file of their own, bsdf/<name>.cl: `#include <NAME>_FILE`.
    parts: ClassVar[tuple[str, ...]] = ()
    emission: Radiance | Texture = (0.0, 0.0, 0.0)
    normal_map: Texture | None = None
    opacity: Unit | Texture = 1.0
    alpha_cutoff: Unit | None = None
    one_sided: bool = False
    double_sided: bool = False

    def __post_init__(self) -> None:
        tuples_for_lists(self)

    def parameters(self) -> dict[str, Parameter]:
        """The values its kernel reads: numbers, triples, rows of a multiple of four, or a texture for a field of these.

        What only some materials of a type have is what their field says for the others, or 0 where there is none.
        """
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in SHARED}

    def surface_parameters(self, culling: Culling) -> dict[str, Parameter]:
        """Those of the fields above that the surface reads, as far as they say anything.

        one_sided, of the kernels: 1 where no ray meets it from behind, 0.5 where no camera ray does.
        """
        parameters: dict[str, Parameter] = {}
        if self.normal_map is not None:
            parameters["normal_map"] = self.normal_map
        one_sided = 1.0 if self.one_sided or culling == "all" and self.is_culled else 0.0
        if culling == "camera" and self.is_culled:
            one_sided = max(one_sided, 0.5)
        if self.opacity != 1 or one_sided:
            cutoff = -1.0 if self.alpha_cutoff is None else self.alpha_cutoff
            # No field's name: materials without one have 0, and stop all light whatever the alpha of vertex colours is.
            parameters["cutoff"] = 0.0 if self.opacity == 1 else cutoff
            parameters |= {"opacity": self.opacity, "one_sided": one_sided}
        return parameters

    @property
    def is_culled(self) -> bool:
        """Whether back-face culling is of its back faces: not of those that light inside it has to meet."""
        return not (self.double_sided or "TRANSMISSION" in self.features())

    @property
    def radiance(self) -> Radiance:
        """What it sends out, at most where that is a texture."""
        return as_color(self.emission.factor) if isinstance(self.emission, Texture) else self.emission

    def conflicts(self) -> list[str]:
        """What is wrong with its fields together: "FIELD: fault; remedy"."""
        return []

    def without_textures(self: Self) -> Self:
        """Itself with the factors of its textures alone."""
        colors = {field.name for field in fields(self) if isinstance(field.default, tuple)}
        maps = {field.name for field in fields(self) if field.default is None}
        plain: dict[str, Any] = {name: as_color(value.factor) if name in colors else value.factor
                                 for name, value in vars(self).items() if isinstance(value, Texture)}
        return replace(self, **plain | dict.fromkeys(maps & plain.keys()))

    @property
    def bent_by(self) -> Texture | None:
        """The normal map whose coordinates its tangents follow, if it has one."""
        return self.normal_map

    def textures(self) -> list[Texture]:
        """All that it reads."""
        values = (getattr(self, field.name) for field in fields(self))
        return [value for value in values if isinstance(value, Texture)]

    @property
    def is_specular(self) -> bool:
        """Whether it has single directions alone, which no light sample finds."""
        return False

    def in_unit(self, unit: float) -> Material:
        """The same where all lengths are multiplied by `unit`."""
        return self

    def features(self) -> frozenset[str]:
        """Names to define while compiling, for parts of the kernel that only some materials of this type need."""
        return frozenset()


#: The fields that do not belong to a material's own kernel file.
SHARED = frozenset(field.name for field in fields(Material))


def as_color(factor: float | Radiance) -> Radiance:
    """One number for all channels, or three."""
    return factor if isinstance(factor, tuple) else (factor, factor, factor)
