"""Writing of views as a dataset."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal, Protocol, get_args

from ...errors import UsageError, check_choice
from ...file_names import StrPath
from ...scene.cameras import CALIBRATED, Camera
from ...scene.exposure import camera_at
from ...scene.fields.field_types import show
from ...scene.fields.keywords import with_known_keywords
from ...scene.model import Scene
from ...scene.numbered_objects import object_names
from ...scene.view import View
from ..atomic_files import make_folder
from .coco import CocoWriter
from .colmap import ColmapWriter
from .layer_files import SavedView, save_view
from .nerf import NerfWriter

DatasetFormat = Literal["nerf", "colmap", "coco"]


class Writer(Protocol):
    """Writer of what a format has beside the images."""

    def add(self, view: SavedView) -> None:
        """Add a view."""

    def finish(self) -> None:
        """Write what is left."""


WRITERS: dict[str, Callable[[Path, Scene], Writer]] = {
    "nerf": lambda folder, scene: NerfWriter(folder),
    "colmap": lambda folder, scene: ColmapWriter(folder),
    "coco": lambda folder, scene: CocoWriter(folder, object_names(scene)),
}


@with_known_keywords
def save_views(
    folder: StrPath, scene: Scene, views: Iterable[View], formats: DatasetFormat | Iterable[DatasetFormat] = "nerf"
) -> Path:
    """Write the views of `each_view`, as they come, to a folder; return it.

    Each view's "rgb", with its "alpha", is images/view_00000.png, through the view transform srgb, and its other layers
    are channels of layers/view_00000.exr. formats, one or several:

    - "nerf": transforms.json, as instant-ngp and nerfstudio read it
    - "colmap": sparse/0/cameras.txt, images.txt and points3D.txt, whose points are of the layers "position" and "rgb"
    - "coco": annotations.json, masks as run lengths and boxes of the objects, from the layer "instance_id"; its
      categories are the objects' names

    Poses of cameras that move during the exposure are those at its middle. Cameras may have lens distortion: as OPENCV
    and OPENCV_FISHEYE, in COLMAP's model FULL_OPENCV, too. Raises OutputError, and UsageError for another format, for a
    camera that is neither perspective nor fisheye or has skew, for distortion that a format lacks, and for layers that
    it lacks.
    """
    chosen = (formats,) if isinstance(formats, str) else tuple(formats)
    for each in chosen:
        check_choice("format", each, get_args(DatasetFormat))
    path = Path(folder)
    for part in (path, path / "images", path / "layers"):
        make_folder(part)
    writers = [WRITERS[each](path, scene) for each in chosen]
    for number, view in enumerate(views):
        if not isinstance(view, View):
            raise UsageError(f"views[{number}] is {show(view)}; give the views of clrt.each_view")
        _check_calibrated(view, number)
        saved = save_view(path, f"view_{number:05}", _in_the_middle(view), view.layers)
        for writer in writers:
            writer.add(saved)
    for writer in writers:
        writer.finish()
    return path


def _check_calibrated(view: View, number: int) -> None:
    camera = view.camera
    if camera.projection not in CALIBRATED or camera.skew:
        what = f"skew {camera.skew:g}" if camera.skew else f"projection {camera.projection!r}"
        raise UsageError(f"view {number} has {what}; datasets hold perspective and fisheye cameras without skew")


def _in_the_middle(view: View) -> Camera:
    """Return the camera at the middle of its exposure, to which the layers of geometry belong."""
    camera = view.camera
    return camera_at(camera, 0.5) if camera.moves else camera
