"""`clrt bench mitsuba-data`: Mitsuba's own test scenes against their references."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("mitsuba-data")
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option(
    "--scene", "scenes", multiple=True, metavar="TEXT", help="Only scenes whose name contains this; may be repeated."
)
@click.option(
    "--samples",
    type=click.IntRange(min=1),
    default=2_000_000,
    show_default=True,
    help="Samples per image, as in Mitsuba's tests.",
)
@click.option(
    "--pictures",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write clrt's image, the reference and 4 times their difference there, side by side, as PNG.",
)
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@figures_options
def mitsuba_data_command(
    folder: Path,
    scenes: tuple[str, ...],
    samples: int,
    pictures: Path | None,
    device: str | None,
    json_file: Path | None,
) -> None:
    """Render the test scenes in DIR, a checkout of github.com/mitsuba-renderer/mitsuba-data, and test them against
    their references by Mitsuba's own Z-tests.

    Scenes with unsupported features are listed with those features. The exit code is 1 if a scene fails.
    """
    from ..bench.renderers.mitsuba_data import cases, judge
    from ..errors import UsageError

    chosen = [case for case in cases(folder) if not scenes or any(text in case.name for text in scenes)]
    if not chosen:
        raise UsageError(f"--scene {scenes[0]}: no scene's name contains it; leave it out to see all")
    rows = []
    for line in HEAD:
        click.echo(line)
    for judged in judge(chosen, samples, device):
        click.echo(_line(judged.row))
        rows.append(judged.row)
        if pictures is not None and judged.ours is not None:
            _write_pictures(pictures / f"{judged.row['scene'].replace('/', '.')}.png", judged.ours, judged.theirs)
    results = [row["result"] for row in rows]
    click.echo("  " + ", ".join(f"{results.count(word)} {word}" for word in dict.fromkeys(results)))
    write_figures(json_file, {"scenes": rows})
    if {"failed", "not read"} & {*results}:
        raise SystemExit(1)


HEAD = [
    f"{'':67}{'result':10}{'rejected':>10}  {'mean over the reference’s':26}{'noise':>8}{'blocks':>9}{'p':>9}",
    "  rejected: pixels and channels that differ by more than chance, at most 0.25 % for a pass;",
    "  noise: standard error of a block of 8x8 pixels; blocks: those that differ by more than chance, of all;",
    "  p: p-value of the least likely block, corrected for multiple tests",
]


def _line(row: Mapping[str, Any]) -> str:
    if "tests" not in row:
        return f"{row['scene']:67}{row['result']}: {', '.join(row['missing'])}"
    means = " ".join(f"{ratio:.5f}" for ratio in row["mean_ratio"])
    blocks = f"{row['blocks_rejected']}/{row['blocks']}"
    missing = f"  {row['judged']:.0%} of the pixels, without {', '.join(row['missing'])}" if row["missing"] else ""
    differences = dict.fromkeys(each.partition(": ")[2] for each in row["differences"])
    return (
        f"{row['scene']:67}{row['result']:10}{row['rejected'] / row['tests']:10.3%}  {means:26}{row['noise']:8.3%}"
        f"{blocks:>9}{row['block_p']:9.2g}{missing}" + "".join(f"  {each}" for each in differences)
    )


def _write_pictures(path: Path, ours: Any, theirs: Any) -> None:
    import numpy as np

    from ..output.image import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    Image(np.concatenate([ours, theirs, 4 * np.abs(ours - theirs)], axis=1), {}).save(path)
