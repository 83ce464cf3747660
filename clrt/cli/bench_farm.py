"""`clrt bench farm`: whether a cluster renders the same image as a single process, and its overhead."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures
from .option_types import OneOf, Size

TRIALS = ("equality", "animation", "kills", "overhead", "huge")
SCENES = Path(__file__).parents[2] / "scenes"


@click.command("farm")
@click.argument("trials", nargs=-1, type=OneOf(TRIALS))
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Scene file; may be repeated. Default: cornell, glass and materials in a clone of the repository.",
)
@click.option("--spp", type=click.IntRange(min=1), help="Samples per pixel; default: 64, for kills 1024, for huge 1.")
@click.option("--every", default=4.0, show_default=True, metavar="SECONDS", help="kills: time between kills.")
@click.option(
    "--workers",
    default=64,
    show_default=True,
    type=click.IntRange(min=1),
    help="overhead: number of workers, which only sleep; the client's memory is measured.",
)
@click.option("--seconds", default=300.0, show_default=True, help="overhead: duration of the work itself.")
@click.option("--size", type=Size(), default="16384x16384", show_default=True, help="huge: image size.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default="huge.exr",
    show_default=True,
    metavar="FILE",
    help="huge: image file to write.",
)
@click.option("--quick", is_flag=True, help="Use small images and less of everything.")
@figures_options
def farm_command(
    trials: tuple[str, ...],
    scenes: tuple[Path, ...],
    spp: int | None,
    every: float,
    workers: int,
    seconds: float,
    size: tuple[int, int],
    out: Path,
    quick: bool,
    json_file: Path | None,
) -> None:
    """Test a render farm on this machine: whether its image equals that of one process bit for bit, even if workers
    are killed; how well it scales to 64 workers; how much memory the client needs for a 16k x 16k image."""
    from ..farm import trials as trial
    from ..formats.load_scene import load
    from ..output.images import check_writable
    from ..scene.model import Scene

    if "huge" in (trials or TRIALS):
        check_writable(out)
    paths = scenes or tuple(SCENES / f"{name}.toml" for name in ("cornell", "glass", "materials"))

    def picture(number: int) -> Scene:
        return trial.sized(load(paths[number]), (128, 128) if quick else (512, 512))

    rows: list[dict[str, Any]] = []

    def told(row: dict[str, Any]) -> None:
        rows.append(row)
        click.echo(
            "  ".join(
                f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}" for name, value in row.items()
            )
        )

    for name in trials or TRIALS:
        match name:
            case "equality":
                pictures = [picture(number) for number in range(len(paths))]
                for row in trial.equality(pictures, spp or (16 if quick else 64)):
                    told(row)
            case "animation":
                for row in trial.animation(trial.sized(picture(0), (96, 64)), 24, spp or 16):
                    told(row)
            case "kills":
                for row in trial.kills(picture(0), spp or (256 if quick else 1024), every):
                    told(row)
            case "overhead":
                told(trial.overhead(picture(0), 8 if quick else workers, 10 if quick else seconds))
            case _:
                told(trial.huge(picture(0), (2048, 4608) if quick else size, spp or 1, 2, out))
    write_figures(json_file, {"trials": rows})
