"""Tables of `clrt bench converge`."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from statistics import median
from typing import Any

LEGEND = [
    "  relMSE: mean over seeds, minus the reference's own; ratio: relMSE·s (CPU: processor time) to the first's",
    "  slope: of log relMSE over log samples; mean ratio: to the reference, by channel; z: by how many standard",
    "  errors it is above 1",
]


def scene_lines(result: Mapping[str, Any], on_cpu: bool) -> list[str]:
    """Return the lines for a result of `measure_convergence`; on_cpu: include processor time."""
    from ..bench.convergence.converge import AGREES

    (width, height), reference, rows = result["size"], result["reference"], result["contestants"]
    told = f"of {reference['spp']} samples per pixel, relMSE {reference['relmse']:.1e}" if reference["spp"] else "given"
    lines = [
        f"{result['scene']}: {width}x{height}, max_depth {result['max_depth']}; reference {told}",
        f"  {'':28}{'spp':>7}{'seconds':>9}{'Msamples/s':>12}{'relMSE':>10}{'relMSE·s':>10}{'ratio':>7}"
        + " (  CPU)" * on_cpu
        + f"{'slope':>7}  {'mean ratio':20}      z",
    ]
    lines += [_line(name, row, on_cpu) for name, row in rows.items()]
    lines += [f"  {name}: {why}" for name, why in result["missing"].items()]
    lines += [
        f"  {name}: more than {AGREES:.1%} off in the mean: too few samples, or a different scene"
        for name, row in rows.items()
        if not row["agrees"]
    ]
    lines += [
        f"  {name}: biased; p-values, corrected for multiple tests: " + " ".join(f"{p:.1g}" for p in row["p"])
        for name, row in rows.items()
        if row["biased"]
    ]
    return lines + LEGEND + _noise_lines(rows)


def _line(name: str, row: Mapping[str, Any], on_cpu: bool) -> str:
    last = row["last"]
    return (
        f"  {name:28}{row['spp'][last]:7}{row['seconds'][last]:9.3g}{row['msamples']:12.3g}"
        f"{row['relmse'][last]:10.3g}{row['relmse_seconds']:10.3g}{row['ratio']:7.2f}"
        + f" ({row['cpu_ratio']:5.2f})" * on_cpu
        + f"{row['slope']:7.2f}  "
        + " ".join(f"{ratio:.4f}" for ratio in row["mean_ratio"])
        + "".join(f"{z:6.1f}" for z in row["z"])
    )


def _noise_lines(rows: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the median over seeds for each number of samples that has an estimate."""
    lines = []
    for name, row in rows.items():
        known = [
            (spp, [ratio for ratio in ratios if isfinite(ratio)]) for spp, ratios in zip(row["spp"], row["noise_ratio"])
        ]
        lines += [
            f"  {name:28}" + " ".join(f"{spp}: {median(ratios):.2f}" for spp, ratios in known if ratios)
            for _ in range(any(ratios for _, ratios in known))
        ]
    return ["  estimated error over true error, by samples per pixel, median over seeds:", *lines] if lines else []


def calibration_lines(told: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the lines for the result of `calibrations`."""
    from ..bench.convergence.calibration import RIGHT

    lines = [
        f"  {name:28}{row['pictures']:9}{row['within']:9.1%}{row['median']:9.2f}{row['worst']:9.2f}"
        for name, row in told.items()
    ]
    title = "estimated error over true error, all scenes and numbers of samples"
    return [title, f"  {'':28}{'images':>9}{f'to {RIGHT}x':>9}{'median':>9}{'worst':>9}", *lines, ""] if lines else []
