"""`clrt bench agree`: whether another renderer produces the same images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures
from .option_types import Size


@click.command("agree")
@click.argument("scenes", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="SCENE...")
@click.option("--size", type=Size(), help="Image size in pixels; default: the scene's.")
@click.option("--depth", type=click.IntRange(1, 1024), help="Maximum path depth; default: the scene's.")
@click.option("--spp", type=click.IntRange(min=1), default=64, show_default=True, help="Samples per pixel.")
@click.option("--seeds", type=click.IntRange(min=2), default=16, show_default=True, help="Images per renderer.")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@figures_options
def agree_command(
    scenes: tuple[Path, ...],
    size: tuple[int, int] | None,
    depth: int | None,
    spp: int,
    seeds: int,
    device: str | None,
    json_file: Path | None,
) -> None:
    """Test whether clrt and Mitsuba (pip install mitsuba) render the same image of each SCENE.

    The means of each block of 16 x 16 pixels are compared, given their spread over the seeds. The exit code is 1 if a
    block differs by more than chance, or the mean of an image by more than 0.5 %.
    """
    from ..bench.renderers.agreement import agreement
    from ..formats.load_scene import load

    results = []
    for number, path in enumerate(scenes):
        scene = load(path)
        settings = scene.render
        settings = replace(settings, size=size or settings.size, max_depth=depth or settings.max_depth)
        result = agreement(replace(scene, render=settings), spp, seeds, device)
        for line in ([] if number else HEAD) + [agreement_line(result)]:
            click.echo(line)
        results.append(result)
    write_figures(json_file, {"scenes": results})
    if not all(result["agree"] for result in results):
        raise SystemExit(1)


HEAD = [
    f"{'':22}{'pixels':>10}  {'mean over Mitsuba’s, ± standard error':48}{'blocks':>7}{'noise':>9}{'most':>9}"
    f"{'largest':>9}{'p':>8}  agree",
    "  noise, most: median and maximum standard error of a block's relative difference; largest: of these",
    "  differences; p: p-value of the least likely block and channel, corrected for multiple tests",
]


def agreement_line(result: Mapping[str, Any]) -> str:
    """Return the table row of a result of `agreement`."""
    means = " ".join(f"{ratio:.5f}±{error:.5f}" for ratio, error in zip(result["mean_ratio"], result["mean_error"]))
    return (
        f"{result['scene']:22}{'x'.join(map(str, result['size'])):>10}  {means:48}{result['blocks']:7}"
        + "".join(f"{value:9.3%}" for value in (*result["noise"], result["difference"]))
        + f"{result['p']:8.2g}  "
        + ("yes" if result["agree"] else f"no: {result['rejected']} blocks differ")
    )
