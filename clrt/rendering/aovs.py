"""AOVs (arbitrary output variables) of a render: the choice of names, and their computation (see clrt.aov_types)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..aov_types import AOV_TYPES, LIGHT_GROUPS, aovs_from, layer_names
from ..errors import UsageError, did_you_mean
from ..float_errors import with_default_errors
from ..scene.light_groups import light_groups
from ..scene.model import Scene
from .accumulation.accumulation import Accumulation
from .compile.features import WITH_LIGHT
from .film.film import Film
from .film.group_layers import group_layers

AOVS = tuple(AOV_TYPES)
#: AOVs that make the film accumulate direct light separately.
LIGHT = ("direct", "indirect")


class Aovs:
    """AOVs of one render, by name in the requested order, a layer for each light group. Raises UsageError like
    `chosen_aovs` and `check_light`."""

    def __init__(self, names: str | Iterable[str] | None, integrator: str) -> None:
        self._names = chosen_aovs(names)
        check_light(self._names, integrator)
        self.first_hits = dict[str, NDArray[np.generic]]()
        self._groups: tuple[str, ...] = ()

    def begin(self, picture: Accumulation, scene: Scene) -> None:
        """Render the first-hit AOVs, so that an interrupted render has them, too."""
        seen = seen_first(self._names)
        self.first_hits = picture.first_hits(scene, seen) if seen else {}
        self._groups = light_groups(scene) if LIGHT_GROUPS in self._names else ()

    def of(self, film: Film) -> dict[str, NDArray[np.generic]]:
        """Return all requested AOVs, given this film."""
        made = self.first_hits | film_aovs(film, self._names)
        if self._groups:
            made |= zip(layer_names([LIGHT_GROUPS], self._groups), group_layers(film, self._groups))
        return {name: made[name] for name in layer_names(self._names, self._groups)}


def chosen_aovs(names: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return the names without duplicates; a string holds names separated by commas. Raises UsageError for names not in
    AOVS."""
    if names is None:
        return ()
    if not isinstance(names, Iterable):
        raise UsageError(f"aovs is {names!r}; give names, in a list or with commas between")
    given = names.split(",") if isinstance(names, str) else list(names)
    if not all(isinstance(name, str) for name in given):
        raise UsageError(f"aovs is {names!r}; give names, in a list or with commas between")
    chosen = tuple(dict.fromkeys(name.strip() for name in given))
    for name in chosen:
        if name not in AOVS:
            raise UsageError(f"AOV {name!r} is unknown; choose from {', '.join(AOVS)}{did_you_mean(name, AOVS)}")
    return chosen


def needs_direct_light(names: Iterable[str]) -> bool:
    """Return whether the film must accumulate direct light separately for these AOVs."""
    return not set(LIGHT).isdisjoint(names)


def needs_light_groups(names: Iterable[str]) -> bool:
    """Return whether the film must accumulate the light of each light group separately for these AOVs."""
    return LIGHT_GROUPS in names


def check_light(names: Iterable[str], integrator: str) -> None:
    """Raise UsageError if AOVs of light are requested from an integrator that does not compute light transport."""
    asked = [name for name in (*LIGHT, LIGHT_GROUPS) if name in names]
    if asked and integrator not in WITH_LIGHT:
        one = len(asked) == 1
        raise UsageError(
            f"the AOV{'s' * (not one)} {' and '.join(asked)} store{'s' * one} light, and the integrator is "
            f"{integrator}; choose {' or '.join(WITH_LIGHT)}"
        )


def seen_first(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the first-hit AOVs among them (`first_hits`)."""
    return tuple(name for name in names if name in aovs_from("mean", "center", "hits", "coverage"))


@with_default_errors
def film_aovs(film: Film, names: Iterable[str]) -> dict[str, NDArray[np.generic]]:
    """Return the AOVs from the film in `names`: (height, width, 3) float32, but samples (height, width) uint32.

    variance is that of a pixel's mean for independent samples; NaN below two samples.
    """
    wanted, pictures = set(names), dict[str, NDArray[np.generic]]()
    if "variance" in wanted:
        pictures["variance"] = film.variance.astype(np.float32)
    if "samples" in wanted:
        pictures["samples"] = film.pixels["count"].copy()
    if needs_direct_light(wanted):
        pictures |= {name: picture for name, picture in zip(LIGHT, split_light(film)) if name in wanted}
    return pictures


def split_light(film: Film) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return direct and indirect light (height, width, 3), rounded so that their sum equals the image exactly.

    One of p − d and p − (p − d), where 0 <= d <= p, is exact (Sterbenz 1974).
    """
    picture = film.picture()
    indirect = picture - np.minimum(film.direct.astype(np.float32), picture)
    return picture - indirect, indirect
