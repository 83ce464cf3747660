"""The grid of materials used by all tests of BSDFs and by `clrt bench numerics`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest

from clrt.bench.numerics.bsdf_cases import COSINES, plain_variants, view, views, worded_variants
from clrt.scene.fields.limits import Ge, Le
from clrt.scene.materials.material_types import Albedo, Diffuse, Material, MetallicRoughness


@dataclass(frozen=True, kw_only=True)
class Glass(Material):
    """Material as a later version may define it, with a field of each kind."""

    kernel: ClassVar[str] = "glass"
    tint: Albedo = (1.0, 1.0, 1.0)
    weight: Annotated[float, Ge(1), Le(3)] = 1.5
    thin: bool = False
    form: Literal["smith", "schlick"] | None = None


def test_a_new_material_is_tried_with_all_its_numbers_flags_and_words() -> None:
    plain, worded = plain_variants(Glass), worded_variants(Glass)
    assert all(isinstance(material, Glass) for material in plain + worded)
    assert {(glass.weight, glass.thin) for glass in plain if isinstance(glass, Glass)} == {
        (weight, thin) for weight in (1, 2, 3) for thin in (False, True)
    }
    assert {(glass.form, glass.thin) for glass in worded if isinstance(glass, Glass)} == {
        (form, thin) for form in ("smith", "schlick") for thin in (False, True)
    }


@pytest.mark.parametrize("roughness, most", [(0.0, 2.0**-7), (0.1, 2.0**-13), (1.0, 2.0**-13)])
def test_views_go_as_near_to_grazing_as_lobes_are_wide_enough_for_float32(roughness: float, most: float) -> None:
    assert min(views(MetallicRoughness(roughness=roughness))) == most
    assert views(Diffuse()) == list(COSINES)


def test_views_are_unit_vectors_that_float32_holds() -> None:
    for cosine in COSINES:
        wo = view(cosine)
        assert np.array_equal(wo, wo.astype(np.float32)) and wo[2] == np.float32(cosine)
        assert np.linalg.norm(wo) == pytest.approx(1, abs=1e-7)
