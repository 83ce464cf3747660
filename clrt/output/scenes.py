"""Saving of scenes as scene files, with the files that they refer to."""

from __future__ import annotations

from pathlib import Path

from ..errors import OutputError
from ..file_names import StrPath
from ..formats.toml.writer import scene_files
from ..scene.fields.keywords import with_known_keywords
from ..scene.model import Scene
from .atomic_files import check_target, check_unprotected, replacing
from .images import write_image, write_texels


@with_known_keywords
def save_scene(scene: Scene, path: StrPath, *, force: bool = True) -> list[Path]:
    """Write the files that the scene needs (scene.writing), then the scene file `path`; return all these paths.

    Raises OutputError if one cannot be written, or is read-only, unless `force`.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise OutputError(f"{path}: a scene file's name must end in .toml; write {path.parent / path.stem}.toml")
    check_target(path)
    files = scene_files(scene, path)
    try:
        text = files.text.encode()
    except UnicodeEncodeError:
        raise OutputError(
            f"{path}: this file's name is not valid text, so a scene file cannot contain it; rename it"
        ) from None
    written = [path.with_name(name) for name in (*files.models, *files.texels, *files.pixels)]
    for other in written:
        check_target(other)
    for each in (*written, path):
        check_unprotected(each, force)
    for name, content in files.models.items():
        _write(path.with_name(name), content)
    for name, texels in files.texels.items():
        write_texels(path.with_name(name), texels)
    for name, pixels in files.pixels.items():
        write_image(path.with_name(name), pixels)
    _write(path, text)
    return [*written, path]


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(content)
