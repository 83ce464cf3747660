"""Animation: of the camera, by keyframes or as a turntable, of a model, as its file defines it, and of both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal

from .fields.limits import Gt, Lt
from .fields.validated import Validated
from .materials.textures import NonNegative

if TYPE_CHECKING:
    from .materials.material import Material
    from .model import Model

#: What a turntable turns.
Turns = Literal["camera", "object"]
Vector = tuple[float, float, float]
Positive = Annotated[float, Gt(0)]


@dataclass(frozen=True, kw_only=True)
class Keyframe(Validated):
    """The camera's fields (see `Camera`) at a `time` in seconds.

    A field that is None is interpolated between the keyframes that set it, and keeps the camera's own value if none
    does.
    """

    time: float
    position: Vector | None = None
    look_at: Vector | None = None
    up: Vector | None = None
    fov_degrees: Annotated[float, Gt(0), Lt(180)] | None = None
    aperture_radius: NonNegative | None = None
    focus_distance: Positive | None = None
    view_height: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class Animation(Validated):
    """Animation of the camera. fps: frames per second. keyframes: at least two, ascending, frame 0 at the first.

    turntable_seconds: replaces keyframes; the camera goes once around its `look_at` point, about its `up`, seen from
    there counter-clockwise, or clockwise if below 0. The frame after the last would equal the first. turntable_turns:
    with "object" the environment and the lights go around with the camera, as if the objects turned in front of them.
    """

    fps: Positive = 24.0
    turntable_seconds: float | None = None
    turntable_turns: Turns = "camera"
    keyframes: tuple[Keyframe, ...] = ()

    @property
    def seconds(self) -> float:
        """Return the duration in seconds, at least 0."""
        if self.turntable_seconds is not None:
            return abs(self.turntable_seconds)
        return self.keyframes[-1].time - self.keyframes[0].time if self.keyframes else 0.0

    @property
    def frames(self) -> int:
        """Return the number of frames; a frame that falls on the last keyframe is included."""
        if self.turntable_seconds is not None:
            return max(1, round(self.seconds * self.fps))
        return frame_count(self.seconds, self.fps)


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelAnimation:
    """Animation of a model file. fps: frames per second; seconds: its duration.

    base: the model as it is in the scene; pose: returns the model at a time in seconds; own: if materials are animated,
    those of the base's parts (model_pose.own_materials), which users may replace.
    """

    name: str
    seconds: float
    base: Model
    pose: Callable[[float], Model]
    own: Sequence[Material | None] = ()
    fps: Positive = 24.0

    @property
    def frames(self) -> int:
        """Return the number of frames, frame 0 at time 0; a frame that falls on the end is included."""
        return frame_count(self.seconds, self.fps)


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneAnimation:
    """Animation of a scene file with moving models. fps: frames per second; camera: its animation, if it has one, whose
    fps is not used."""

    models: tuple[ModelAnimation, ...]
    camera: Animation | None = None
    fps: Positive = 24.0

    @property
    def seconds(self) -> float:
        """Return the duration of the camera's animation, else that of the longest model's."""
        return max(model.seconds for model in self.models) if self.camera is None else self.camera.seconds

    @property
    def frames(self) -> int:
        """Return the number of frames, as of the camera's animation."""
        return frame_count(self.seconds, self.fps) if self.camera is None else replace(self.camera, fps=self.fps).frames

    @property
    def start(self) -> float:
        """Return the time of frame 0, that of the first keyframe."""
        return self.camera.keyframes[0].time if self.camera and self.camera.keyframes else 0.0


def frame_count(seconds: float, fps: float) -> int:
    """Return the number of frames from 0 to `seconds`, both included."""
    return 1 + int(seconds * fps * (1 + 1e-9))
