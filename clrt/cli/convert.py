"""`clrt convert`: a model to a scene file to start from."""

from __future__ import annotations

import os
from pathlib import Path

import click

from ..errors import OutputError, UsageError


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("scene", type=click.Path(path_type=Path), metavar="SCENE.toml")
@click.option("--camera", metavar="NAME", help="The camera in the model file to begin with; see `clrt info`.")
@click.option("--force", is_flag=True, help="Replace SCENE.toml if there is one.")
def command(model: Path, scene: Path, camera: str | None, force: bool) -> None:
    """Write SCENE.toml, which shows MODEL as `clrt render MODEL` does: camera, sky, lights and materials to change."""
    from ..output.files import check_target, replacing
    from ..scene.file import load
    from ..scene.writing import scene_text

    if scene.suffix.lower() != ".toml":
        raise UsageError(f"{scene}: a scene file ends in .toml; write {scene.with_suffix('.toml')}")
    if model.suffix.lower() == ".toml":
        raise UsageError(f"{model}: is a scene file already; name a model")
    if scene.exists() and not force:
        raise UsageError(f"{scene}: exists already; name another file, or replace it with --force")
    check_target(scene)
    text = scene_text(load(model, camera), _beside(model, scene))
    with replacing(scene) as temporary:
        try:
            temporary.write_text(text, encoding="utf-8", newline="\n")
        except UnicodeEncodeError:
            raise OutputError(f"{model}: its name is no text, so no scene file can name it; rename it") from None
    click.echo(str(scene))


def _beside(model: Path, scene: Path) -> str:
    """How the scene file names the model: relative to its own folder, where there is a way."""
    try:
        return Path(os.path.relpath(model.resolve(), scene.resolve().parent)).as_posix()
    except ValueError:  # on another drive
        return model.resolve().as_posix()
