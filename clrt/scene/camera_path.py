"""Static scenes of an animation, frame by frame: a turntable, keyframes of the camera, or a model's animation."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from typing import Any, get_args

import numpy as np

from ..errors import SceneError, UsageError, check_choice
from .animation import Animation, Keyframe, ModelAnimation, SceneAnimation, Turns
from .fields.field_types import field_problems, show, value_problems
from .fields.keywords import with_known_keywords
from .frame_model import frame_turning
from .geometry.transform import rotation, transform_light, translation
from .model import Camera, Scene
from .model_pose import posed
from .pose_motion import moving_between
from .sky.sky import moving_sky, with_sky
from .splines import Doubles, smooth

#: Upper limit on the number of frames; more are assumed to be a typing error.
MOST_FRAMES = 1_000_000


@with_known_keywords
def turntable(scene: Scene, frames: int, fps: float = Animation.fps, turns: Turns = "camera") -> Scene:
    """Return the scene with the camera going once around in this number of frames, while a scene file's models move.

    It goes around its look_at point. A camera that still frames a bare model, as `load` placed it, goes around the
    model's center instead, at a distance at which the model stays inside an image of the scene's size. turns: with
    "object", environment and lights go around with the camera, as if the objects turned instead. Raises UsageError
    unless `frames` is at least 1, `fps` is above 0 and finite, and `turns` is known.
    """
    if not frames >= 1:
        raise UsageError(f"frames is {frames}; it must be at least 1")
    if not 0 < fps < np.inf:
        raise UsageError(f"fps is {fps}; it must be above 0 and finite")
    check_choice("turns", turns, get_args(Turns))
    around = Animation(fps=fps, turntable_seconds=frames / fps, turntable_turns=turns)
    framing = scene.source.framing if scene.source else None
    if framing is not None and scene.camera == framing.camera:
        width, height = scene.render.size
        camera = frame_turning(framing.meshes, framing.instances, scene.camera, width / height)
        scene = replace(scene, camera=camera)
    if isinstance(scene.animation, SceneAnimation):
        return replace(scene, animation=replace(scene.animation, camera=around, fps=fps))
    return replace(scene, animation=around)


@with_known_keywords
def frames(scene: Scene, chosen: Iterable[int] | None = None) -> Iterator[tuple[int, Scene]]:
    """Return the number and the static scene of all frames, or of the `chosen` ones.

    If neither a model nor the sun moves, the scenes differ in their camera alone. If the camera's shutter is open for
    some time, it and what moves do so during the exposure (see `moving_between`). Raises SceneError if the scene has no
    animation or an invalid one, or if the sun is below the horizon in a frame; UsageError for an invalid number.
    """
    animation = scene.animation
    if animation is None:
        raise SceneError(
            f"{scene.name}: has no animation; write [[keyframe]] tables or the animation of a [[mesh]], or use a "
            "turntable (--turntable, clrt.turntable)"
        )
    if problems := _problems(scene.camera, animation):
        raise SceneError(problems)
    count = animation.frames
    numbers = range(count) if chosen is None else list(chosen)
    for i, number in enumerate(numbers):
        if problems := value_problems(float, number, f"frames.chosen[{i}]"):
            raise UsageError("\n".join(problems))
        if not 0 <= number < count:
            raise UsageError(f"{scene.name} has no frame {number}; its frames are 0 to {count - 1}")
    if isinstance(animation, ModelAnimation):
        animation = SceneAnimation(models=(animation,), fps=animation.fps)
    moving: Iterator[tuple[int, Scene]] = zip(numbers, _exposures(scene, animation, np.array(numbers, np.float64)))
    if (sky := moving_sky(scene)) is not None:
        skies = [sky.after(number / animation.fps) for number in numbers]  # all are valid before the first is rendered
        moving = ((number, with_sky(still, sky, now)) for (number, still), now in zip(moving, skies))
    path = animation.camera if isinstance(animation, SceneAnimation) else animation
    if path is None or path.turntable_seconds is None or path.turntable_turns == "camera":
        return moving
    turn = 360 / count if path.turntable_seconds > 0 else -360 / count
    return ((number, _lit_from(still, scene.camera, turn * number)) for number, still in moving)


def _lit_from(scene: Scene, camera: Camera, degrees: float) -> Scene:
    """Return the scene with its environment and lights turned about the vertical axis through the camera's look_at."""
    x, y, z = camera.look_at
    turn = translation((x, y, z)) @ rotation((0.0, degrees, 0.0)) @ translation((-x, -y, -z))
    around = replace(scene.environment, rotation_degrees=scene.environment.rotation_degrees + degrees)
    return replace(scene, environment=around, lights=[transform_light(light, turn) for light in scene.lights])


def _exposures(scene: Scene, animation: Animation | SceneAnimation, numbers: Doubles) -> Iterator[Scene]:
    """Yield frames, in which everything moves if the camera's shutter is open for some time."""
    camera = scene.camera
    if not camera.exposure > 0:
        return _stills(scene, animation, numbers)
    starts = numbers + camera.shutter[0] * animation.fps
    stills = _stills(scene, animation, starts), _stills(scene, animation, starts + camera.exposure * animation.fps)
    return map(moving_between, *stills)


def _stills(scene: Scene, animation: Animation | SceneAnimation, numbers: Doubles) -> Iterator[Scene]:
    """Yield the static scenes of frames, between frames where a number is not whole."""
    if isinstance(animation, SceneAnimation):
        return _moving_stills(scene, animation, numbers)
    return (replace(scene, camera=each, animation=None) for each in _cameras(scene.camera, animation, numbers))


def _moving_stills(scene: Scene, animation: SceneAnimation, numbers: Doubles) -> Iterator[Scene]:
    """Yield the frames of moving models. A camera without an animation moves if it is a model's."""
    path = None if animation.camera is None else replace(animation.camera, fps=animation.fps)
    cameras = None if path is None else _cameras(scene.camera, path, numbers)
    for time in (animation.start + numbers / animation.fps).tolist():
        still = scene
        for model in animation.models:
            still = posed(still, model, time)
        yield still if cameras is None else replace(still, camera=next(cameras))


def _problems(camera: Camera, animation: Animation | ModelAnimation | SceneAnimation) -> list[str]:
    if isinstance(animation, SceneAnimation) and animation.camera is not None:
        animation = replace(animation.camera, fps=animation.fps)
    if not isinstance(animation, Animation):
        return field_problems(Animation, {"fps": animation.fps}, "animation") or _length_problems(animation)
    return field_problems(Animation, vars(animation), "animation") or animation_problems(camera, animation)


def _length_problems(animation: Animation | ModelAnimation | SceneAnimation) -> list[str]:
    """Return a problem if there are too many frames."""
    if animation.seconds * animation.fps < MOST_FRAMES:
        return []
    return [
        f"animation: would have {animation.seconds * animation.fps:.9g} frames, more than {MOST_FRAMES}; "
        "check the times, in seconds, and fps"
    ]


def animation_problems(camera: Camera, animation: Animation) -> list[str]:
    """Return what is wrong with an animation whose fields are within their limits, one sentence per problem."""
    keys, around = animation.keyframes, animation.turntable_seconds
    if around is not None and keys:
        return ["animation: has both turntable_seconds and keyframes; keep one of them"]
    if around is None and len(keys) < 2:
        return [
            f"animation: has {len(keys) or 'no'} keyframe{'s' * (not keys)} and no turntable_seconds; write two or "
            "more [[keyframe]] tables"
        ]
    if around == 0:
        return ["animation.turntable_seconds: is 0; write the duration of one turn"]
    if around is not None and animation.turntable_turns == "object" and not _is_upright(camera):
        return [
            f"animation.turntable_turns: objects turn about +Y only, and the camera's up is {show(camera.up)}; write "
            'up = [0, 1, 0] in [camera], or turntable_turns = "camera"'
        ]
    times = [key.time for key in keys]
    problems = [
        f"keyframe[{i + 1}].time: {times[i + 1]:g} is not after the previous one, {times[i]:g}; write them "
        "in ascending order"
        for i in range(len(times) - 1)
        if times[i + 1] <= times[i]
    ]
    return (
        problems
        or _unread_problems(camera, animation)
        or _length_problems(animation)
        or _view_problems(camera, animation)
    )


def _unread_problems(camera: Camera, animation: Animation) -> list[str]:
    """Return a problem for each field that keyframes set and the camera's projection does not read."""
    return [
        f'keyframe.{name}: has no effect with projection = "{camera.projection}"; leave it out'
        for name in camera.unread_fields()
        if any(getattr(key, name, None) is not None for key in animation.keyframes)
    ]


def _is_upright(camera: Camera) -> bool:
    x, y, z = camera.up
    return x == z == 0 and y > 0


def _view_problems(camera: Camera, animation: Animation) -> list[str]:
    """Return a problem for the first frame whose camera has no valid view direction."""
    moving = _moving(camera, animation, np.arange(animation.frames, dtype=np.float64))
    position, look_at, up = (
        moving.get(name, np.array([getattr(camera, name)], np.float64)) for name in ("position", "look_at", "up")
    )
    forward = look_at - position
    length, height = np.linalg.norm(forward, axis=1), np.linalg.norm(up, axis=1)
    bad = np.linalg.norm(np.cross(forward, up), axis=1) <= 1e-6 * length * height
    if not bad.any():
        return []
    frame = int(bad.argmax())
    what = "look_at equals its position" if not length[frame % len(length)] else "it looks along its up vector"
    return [
        f"animation: in frame {frame}, {frame / animation.fps:g} s after the first, the camera has no orientation: "
        f"{what}; move a keyframe, or add one in between"
    ]


def _cameras(camera: Camera, animation: Animation, numbers: Doubles) -> Iterator[Camera]:
    moving = {name: rows.tolist() for name, rows in _moving(camera, animation, numbers).items()}
    for i in range(len(numbers)):
        values: dict[str, Any] = {name: rows[i] if len(rows[i]) > 1 else rows[i][0] for name, rows in moving.items()}
        yield replace(camera, **values)


def _moving(camera: Camera, animation: Animation, numbers: Doubles) -> dict[str, Doubles]:
    """Compute the animated fields: name to an array with a row per frame."""
    if animation.turntable_seconds is not None:
        turn = np.copysign(2 * np.pi / animation.frames, animation.turntable_seconds)
        return {"position": _around(camera, turn * numbers)}
    keys, moving = animation.keyframes, {}
    at = keys[0].time + numbers / animation.fps
    for name in [field.name for field in fields(Keyframe) if field.name != "time"]:
        known = [(key.time, np.atleast_1d(getattr(key, name))) for key in keys if getattr(key, name) is not None]
        if known:
            times, values = zip(*known)
            moving[name] = smooth(times, values, at)
    return moving


def _around(camera: Camera, angles: Doubles) -> Doubles:
    """Compute (n, 3) positions of the camera rotated by these angles about the axis `up` through its look_at point."""
    center, axis = np.array(camera.look_at, np.float64), np.array(camera.up, np.float64)
    axis /= np.linalg.norm(axis)
    arm = camera.position - center
    along = axis * (axis @ arm)
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(center + along + cos * (arm - along) + sin * np.cross(axis, arm))
