"""`clrt bench render-fidelity`: Khronos' glTF scenarios against the images of other path tracers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("render-fidelity")
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option(
    "--scenario",
    "scenarios_",
    multiple=True,
    metavar="TEXT",
    help="Only scenarios whose name contains this; may be repeated.",
)
@click.option(
    "--width",
    type=click.IntRange(min=16),
    help="Image width; the other renderers' images are scaled down to it. Default: their own width.",
)
@click.option("--spp", type=click.IntRange(min=1), default=32, show_default=True, help="Samples per pixel.")
@click.option("--denoise", is_flag=True, help="Denoise clrt's images, as Cycles' were.")
@click.option(
    "--pictures",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write clrt's and the other renderers' images there, side by side, as PNG.",
)
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@figures_options
def render_fidelity_command(
    folder: Path,
    scenarios_: tuple[str, ...],
    width: int | None,
    spp: int,
    denoise: bool,
    pictures: Path | None,
    device: str | None,
    json_file: Path | None,
) -> None:
    """Render the glTF models in DIR, a checkout of github.com/KhronosGroup/glTF-Render-Fidelity with its submodules,
    and compare the images with those of Cycles, V-Ray, Stellar, dspbr and three-gpu-pathtracer.

    A scenario is inside if clrt's mean FLIP difference from the others is at most the largest of theirs from each
    other, and its means over the whole image and each material are within 5 % of their range. Scenarios with missing
    files are listed.
    """
    from ..bench.renderers.fidelity_suite import scenarios
    from ..bench.renderers.render_fidelity import judge
    from ..errors import UsageError
    from ..output.image import save_side_by_side

    chosen = [each for each in scenarios(folder) if not scenarios_ or any(text in each.name for text in scenarios_)]
    if not chosen:
        raise UsageError(f"--scenario {scenarios_[0]}: no scenario's name contains it; leave it out to see all")
    rows = []
    click.echo(f"{'':36}{'result':10}{'FLIP':>6}{'spread':>8}{'whole':>8}  regions outside the range of the others")
    for judged in judge(chosen, width, spp, denoise, device):
        click.echo(_line(judged.row))
        rows.append(judged.row)
        if pictures is not None and judged.images:
            save_side_by_side(pictures / f"{judged.row['scenario']}.png", judged.images.values())
    results = [row["result"] for row in rows]
    click.echo("  " + ", ".join(f"{results.count(word)} {word}" for word in dict.fromkeys(results)))
    write_figures(json_file, {"width": width, "spp": spp, "denoise": denoise, "scenarios": rows})


def _line(row: Mapping[str, Any]) -> str:
    start = f"{row['scenario']:36}{row['result']:10}"
    if "flip" not in row:
        return f"{start}{', '.join(row['problems'])}"
    if "spread" not in row:
        return f"{start}{', '.join(row['flip'])} alone"
    means = row["means"]
    strayed = ", ".join(f"{name} {means[name]['beyond']:.2f}" for name in row["strayed"] if name)
    return f"{start}{row['mean_flip']:6.3f}{row['spread']:8.3f}{means['']['beyond']:8.3f}  {strayed}" + "".join(
        f"  ({warning})" for warning in row["warnings"]
    )
