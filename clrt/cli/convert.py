"""`clrt convert`: a model to a scene file as a starting point."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import UsageError
from .options import CAMERA


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("scene", type=click.Path(path_type=Path), metavar="SCENE.toml")
@click.option("--camera", metavar="NAME", help=CAMERA)
@click.option("--force", is_flag=True, help="Replace files that are there, also read-only ones.")
def command(model: Path, scene: Path, camera: str | None, force: bool) -> None:
    """Write SCENE.toml, which shows MODEL as `clrt render MODEL` does: camera, sky, lights and materials to change."""
    from ..formats.load_scene import load
    from ..formats.toml.writer import started
    from ..output.atomic_files import check_target
    from ..output.scenes import save_scene

    if scene.suffix.lower() != ".toml":
        raise UsageError(f"{scene}: a scene file ends in .toml; write {scene.with_suffix('.toml')}")
    if model.suffix.lower() == ".toml":
        raise UsageError(f"{model}: is a scene file already; name a model")
    if scene.exists() and not force:
        raise UsageError(f"{scene}: exists already; name another file, or replace it with --force")
    check_target(scene)
    save_scene(started(load(model, camera)), scene, force=force)
    click.echo(str(scene))
