"""One-sentence summary of a pixel's paths: where its light comes from, or why it is black."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rendering.compile.lights.environment_map import LUMINANCE
from .names import SceneNames
from .outcomes import Outcome, outcomes
from .record import PathEnd
from .trace import PixelPaths, contributions

#: Maximum number of causes that are named.
MOST_NAMED = 3


def summary(paths: PixelPaths, names: SceneNames) -> str:
    """Return a summary of all samples of a pixel."""
    samples, dropped = len(paths.starts), int(np.count_nonzero(~paths.kept))
    facts = [f"{dropped} of {samples} samples are not finite and were dropped"] if dropped else []
    if paths.value.any():
        facts += [_sources(paths, names), _first(paths, names), *_light_samples(paths.rows, names, "light samples")]
    else:
        facts += _darkness(paths, names)
    title = "mean " + " ".join(f"{value:.4g}" for value in paths.value) if paths.value.any() else "black"
    return f"{title}: {'; '.join(facts)}"


def _first(paths: PixelPaths, names: SceneNames) -> str:
    """Return what the camera sees."""
    rows = paths.rows[paths.starts]
    rows = rows[rows["primitive"] >= 0]
    missed = len(paths.starts) - len(rows)
    behind = "" if rows["front"].any() else ", from behind"
    seen = [_listed(_hits(rows, names, names.object)) + behind] * (len(rows) > 0)
    seen += [f"no object in {missed} of {len(paths.starts)} samples"] * (missed > 0)
    return f"the camera sees {' and '.join(seen)}"


def _sources(paths: PixelPaths, names: SceneNames) -> str:
    """Return the shares of the light by source, and how much of it is indirect."""
    rows, kept = paths.rows, np.repeat(paths.kept, paths.lengths)
    shares: Counter[str] = Counter()
    indirect = 0.0
    for part, first in (("emission", 3), ("direct", 2)):
        light = np.where(kept, np.nan_to_num(contributions(rows, part).astype(np.float64)) @ LUMINANCE, 0)
        indirect += float(light[paths.depth >= first].sum())
        shares.update({name: float(light[own].sum()) for name, own in _by_source(rows, part, light, names).items()})
    total = shares.total()
    named = [f"{_percent(share / total)} from {name}" for name, share in shares.most_common(MOST_NAMED)]
    if len(shares) > MOST_NAMED:
        named.append(f"the rest from {len(shares) - MOST_NAMED} others")
    return f"{', '.join(named)}; {_percent(indirect / total)} of it indirect"


def _by_source(
    rows: NDArray[Any], part: str, light: NDArray[np.float64], names: SceneNames
) -> dict[str, NDArray[np.bool_]]:
    """Return which rows' light is from which source. An emissive mesh is one, however many triangle lights it has."""
    key = rows["emitter" if part == "emission" else "light"]
    found: dict[str, NDArray[np.bool_]] = {}
    for number in np.unique(key[light > 0]):
        name = names.infinite if number < 0 else names.light(int(number))
        own = (key == number) & (light > 0)
        found[name] = found[name] | own if name in found else own
    return found


def _darkness(paths: PixelPaths, names: SceneNames) -> list[str]:
    """Return what keeps light from reaching a pixel, as far as its paths show it."""
    rows, features = paths.rows, paths.compiled.features
    if not {"LIGHTS", "SKY"} & set(features):
        return ["nothing in this scene emits light"]
    escaped = rows["end"] == PathEnd.ESCAPED
    if escaped[paths.starts].all():
        return [f"all {len(paths.starts)} camera rays miss every object, and {_beyond(names)}"]
    facts = [_first(paths, names)]
    if paths.lengths.max() == 1 and (rows["end"] == PathEnd.DEPTH).any():
        facts.append("the depth limit of 1 shows emission alone")
    backs = rows[(rows["emitter"] >= 0) & (rows["front"] == 0) & ~rows["radiance"].any(axis=1)]
    if len(backs):
        seen = " and ".join(_hits(backs, names, names.object))
        facts.append(f"the emission of {seen} faces away (double_sided = true emits on both sides)")
    facts += _light_samples(rows[paths.depth == 1], names, "light samples there")
    facts += _light_samples(rows[paths.depth > 1], names, "light samples after that")
    if "LIGHTS" not in features and not escaped.any():
        facts.append(f"light comes from {names.infinite} alone, and no path escapes to it")
    return facts + _ends(paths, names)


def _light_samples(rows: NDArray[Any], names: SceneNames, title: str) -> list[str]:
    """Return the outcomes of the light samples, if some of them failed."""
    rows = rows[rows["light"] >= 0]
    found = np.array(outcomes(rows), object)
    facts = []
    for outcome, count in Counter(found).most_common():
        if outcome == Outcome.LIT:
            continue
        own = rows[found == outcome]
        number = f"all {count}" if count == len(rows) else f"{count} of {len(rows)}"
        facts.append(f"{number} {outcome}{_cause(outcome, own, names)}")
    return [f"{title}: {', '.join(facts)}"] if facts else []


def _cause(outcome: Outcome, rows: NDArray[Any], names: SceneNames) -> str:
    """Return the cause of an outcome, in brackets."""
    if outcome == Outcome.SHADOWED:
        return _bracketed(_hits(rows[rows["blocker"] >= 0], names, names.object, "blocker", "blocker_instance"), "by ")
    if outcome == Outcome.NO_BSDF:
        return _bracketed(_hits(rows, names, names.material), "on ")
    if outcome in (Outcome.NO_EMISSION, Outcome.BEHIND, Outcome.UNSAMPLED):
        return _bracketed(_counted(rows["light"], names.light))
    return ""


def _ends(paths: PixelPaths, names: SceneNames) -> list[str]:
    """Return why the paths end."""
    ends = Counter(PathEnd(end) for end in paths.rows["end"] if end != PathEnd.NONE)
    absorbing = paths.rows[paths.rows["end"] == PathEnd.ABSORBED]
    materials = _bracketed(_hits(absorbing, names, names.material), "by ")
    words = {
        PathEnd.ESCAPED: f"escape, but {_beyond(names)}",
        PathEnd.DEPTH: "end at the depth limit",
        PathEnd.ABSORBED: f"are absorbed{materials}",
        PathEnd.ROULETTE: "are ended by Russian roulette",
        PathEnd.SIDE: "are scattered to the wrong side of the surface",
    }
    listed = [f"{'all ' * (count == len(paths.starts))}{count} {words[end]}" for end, count in ends.most_common()]
    return [f"paths: {', '.join(listed)}"]


def _beyond(names: SceneNames) -> str:
    return f"no light comes from {names.infinite} there" if names.infinite else "the scene has no environment"


def _hits(
    rows: NDArray[Any],
    names: SceneNames,
    name: Callable[[int], str],
    primitive: str = "primitive",
    instance: str = "instance",
) -> Counter[str]:
    """Return how often each object was hit, keyed by what `name` returns for it."""
    return _counted(names.hits(rows[primitive], rows[instance])[0], name)


def _counted(numbers: NDArray[np.integer], name: Callable[[int], str]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for number, count in zip(*np.unique(numbers, return_counts=True)):
        counts[name(int(number))] += int(count)
    return counts


def _bracketed(counts: Counter[str], how: str = "") -> str:
    return f" ({_listed(counts, how)})" if counts else ""


def _listed(counts: Counter[str], how: str = "") -> str:
    """Return the most frequent names with their counts, or a single one without."""
    if len(counts) <= 1:
        return "".join(f"{how}{name}" for name in counts)
    most = counts.most_common(MOST_NAMED)
    others = counts.total() - sum(count for _, count in most)
    return ", ".join([f"{count} {how}{name}" for name, count in most] + [f"{others} {how}others"] * (others > 0))


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
