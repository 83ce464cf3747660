"""`clrt bench combinations`: test identities that hold for all images over random scenes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import click

from .bench_files import figures_options, write_figures
from .option_types import OneOf

if TYPE_CHECKING:
    from ..bench.combinations.combinations import Verdict

PROPERTIES = (
    "additivity",
    "groups",
    "strategies",
    "choice",
    "integrators",
    "brightness",
    "similarity",
    "partition",
    "bystanders",
    "guiding",
)
HEADER = (
    f"{'':16}{'scenes':>8}{'off':>6}{'2 rounds':>10}{'3 rounds':>10}{'4 rounds':>10}{'least p':>10}{'noise':>9}"
    f"{'dropped':>9}"
)
LEGEND = """  off: violations; rounds: suspicious scenes are rendered again with new seeds and more samples
  least p: smallest p-value of a scene's last round, corrected; dropped: samples that were not finite
  noise: median standard error of the relative difference of whole images"""


@click.command("combinations")
@click.option(
    "--property",
    "names",
    multiple=True,
    type=OneOf(PROPERTIES),
    help="Test this property only; may be repeated. Default: all.",
)
@click.option("--scenes", type=click.IntRange(min=1), help="Number of random scenes; default: 500, with --quick 4.")
@click.option("--first", default=0, show_default=True, type=click.IntRange(min=0), help="Number of the first scene.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0, 2**32 - 1), help="Seed of the scenes.")
@click.option(
    "--keep",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Save the scenes that violate a property there, as scene files.",
)
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@click.option("--quick", is_flag=True, help="Test few scenes.")
@figures_options
def combinations_command(
    names: tuple[str, ...],
    scenes: int | None,
    first: int,
    seed: int,
    keep: Path | None,
    device: str | None,
    quick: bool,
    json_file: Path | None,
) -> None:
    """Test identities of rendered images on random scenes.

    The scenes combine all materials, lights, cameras and textures at random. Properties: the image with all lights is
    the sum of the images with one light each (additivity); a light group's layer is the image with its lights alone
    (groups); BSDF sampling, light sampling and both together have the same mean (strategies), and so has choosing
    lights uniformly (choice); path at depth 2 agrees with direct, local and raster (integrators); brighter light makes
    a proportionally brighter image (brightness); the image stays the same if a scene and its camera are moved, rotated,
    mirrored or scaled (similarity), if meshes are split or instanced (partition), and if objects out of view are added
    (bystanders). The exit code is 1 if a scene violates a property significantly.
    """
    from ..bench.combinations.combinations import keep_scenes, verdicts
    from ..device.open import open_device

    count = scenes or (4 if quick else 500)
    opened, chosen = open_device(device), names or PROPERTIES
    click.echo(f"device {opened.info.index}: {opened.info.name}; seed {seed}, scenes {first} to {first + count - 1}")
    click.echo(HEADER)
    results: list[Verdict] = []
    for name in chosen:
        found = []
        for each in verdicts(opened, [name], seed, range(first, first + count)):
            found.append(each)
            if each.is_off(count * len(chosen)):
                click.echo(_line(each))
                if keep is not None:
                    click.echo("\n".join(map(str, keep_scenes(each, seed, keep))))
        click.echo(_row(name, found, count * len(chosen)))
        results += found
    click.echo(LEGEND)
    off = [each.is_off(count * len(chosen)) for each in results]
    write_figures(
        json_file,
        {
            "seed": seed,
            "first": first,
            "scenes": count,
            "verdicts": [asdict(each) | {"off": wrong} for each, wrong in zip(results, off)],
        },
    )
    if any(off):
        raise SystemExit(1)


def _line(each: Verdict) -> str:
    return (
        f"  off: {each.property}, scene {each.number}: {each.side}: image {each.mean - 1:+.2%} ± {each.noise:.2%}"
        f", one block {each.difference:+.2%}, p {each.p:.1e}"
    )


def _row(name: str, found: list[Verdict], tests: int) -> str:
    longer = "".join(f"{sum(each.rounds >= rounds for each in found):10}" for rounds in (2, 3, 4))
    return (
        f"{name:16}{len(found):8}{sum(each.is_off(tests) for each in found):6}{longer}"
        f"{min(each.p for each in found):10.1e}{median(each.noise for each in found):9.2%}"
        f"{sum(each.dropped for each in found):9}"
    )
