"""Objects of a scene are valid once they are made, whatever they are made of, and their arrays are read-only."""

from __future__ import annotations

import copy
import pickle
import re
from collections.abc import Callable
from dataclasses import MISSING, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

import clrt
from clrt.errors import ClrtError, ObjectError, SceneError
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.fields.field_types import array_fields, field_problems
from clrt.scene.fields.validated import Editable
from clrt.scene.lights import LIGHTS
from clrt.scene.materials.material_types import MATERIALS
from clrt.scene.model import MATRICES, Scene

from ..covering import others

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2]], np.int32)
UV = VERTICES[:, :2].copy()
PICTURE = clrt.Picture(np.full((2, 2, 4), 200, np.uint8))
IMAGE = np.ones((2, 4, 3), np.float32)
LIGHT_IMAGE = clrt.LightImage(pixels=IMAGE)
#: Values of fields that have no default, by name.
GIVEN: dict[str, Any] = {
    "position": (0.0, 3.0, 0.0),
    "direction": (0.0, -1.0, 0.1),
    "intensity": (1.0, 1.0, 1.0),
    "irradiance": (1.0, 1.0, 1.0),
}


def mesh(**values: Any) -> clrt.Mesh:
    return clrt.Mesh(**{"vertices": VERTICES, "faces": FACES, "uv": UV, "uv1": UV, "normals": VERTICES + 1, **values})


def light(kind: type) -> Callable[..., Any]:
    known = {field.name for field in fields(kind)}
    return lambda **values: kind(**{name: value for name, value in GIVEN.items() if name in known} | values)


#: Public dataclass: how one is made, and a scene with one.
MADE: dict[type, tuple[Callable[..., Any], Callable[[Any], Scene]]] = {
    clrt.Mesh: (mesh, lambda made: Scene(meshes=[made])),
    clrt.Instance: (lambda **values: clrt.Instance(**{"mesh": mesh(), **values}), lambda made: Scene(instances=[made])),
    clrt.Sphere: (clrt.Sphere, lambda made: Scene(spheres=[made])),
    clrt.Camera: (clrt.Camera, lambda made: Scene(camera=made)),
    clrt.Environment: (clrt.Environment, lambda made: Scene(environment=made)),
    clrt.Backdrop: (clrt.Backdrop, lambda made: Scene(backdrop=made)),
    clrt.RenderSettings: (clrt.RenderSettings, lambda made: Scene(render=made)),
    clrt.Picture: (
        lambda **values: clrt.Picture(**{"texels": PICTURE.texels, **values}),
        lambda made: Scene(meshes=[mesh(material=clrt.Diffuse(color=clrt.Texture(picture=made)))]),
    ),
    clrt.Texture: (
        lambda **values: clrt.Texture(**{"picture": PICTURE, **values}),
        lambda made: Scene(meshes=[mesh(material=clrt.Diffuse(color=made))]),
    ),
    clrt.LightImage: (
        lambda **values: clrt.LightImage(**{"pixels": IMAGE, **values}),
        lambda made: Scene(lights=[light(clrt.ProjectorLight)(image=made)]),
    ),
    clrt.Keyframe: (
        lambda **values: clrt.Keyframe(**{"time": 1.0, **values}),
        lambda made: Scene(animation=clrt.Animation(keyframes=(clrt.Keyframe(time=0.5), made))),
    ),
    clrt.Animation: (
        lambda **values: clrt.Animation(**{"turntable_seconds": 1.0, **values}),
        lambda made: Scene(animation=made),
    ),
    clrt.Sky: (
        lambda **values: clrt.Sky(**{"sun_direction": (0.3, 0.8, 0.2), **values}),
        lambda made: Scene(environment=made.environment(), lights=made.lights()),
    ),
    clrt.Scene: (clrt.Scene, lambda made: made),
    **{
        kind: (kind, lambda made: Scene(spheres=[clrt.Sphere(material=made)], meshes=[mesh(material=made)]))
        for kind in MATERIALS
    },
    **{kind: (light(kind), lambda made: Scene(lights=[made])) for kind in LIGHTS},
}
FIELDS = [(kind, field.name) for kind in MADE for field in fields(kind)]

NUMBERS = st.sampled_from([0, -1, 1, 0.5, 2, 3.7, -0.0, 1e-45, 1e39, 2**70, -(2**31)]) | st.floats() | st.integers()
ARRAYS = st.builds(
    lambda shape, dtype, value: np.full(shape, value).astype(dtype),
    st.lists(st.integers(0, 4), max_size=4).map(tuple),
    st.sampled_from(["f4", "f8", "i4", "i8", "u1", "?", "U3", "c8", "O"]),
    st.sampled_from([0, 1, 2, 255]),
)
OBJECTS = st.sampled_from(
    [mesh(), clrt.Sphere(), clrt.Diffuse(), clrt.Camera(), clrt.Texture(picture=PICTURE), PICTURE, LIGHT_IMAGE, Scene()]
)
PLAIN: SearchStrategy[Any] = (
    NUMBERS
    | st.text(max_size=5)
    | st.sampled_from([None, True, False, object(), b"gold", "ggx", "gold", "path", "fisheye", "beckmann", "repeat"])
    | NUMBERS.map(np.float32)
)
VALUES: SearchStrategy[Any] = (
    PLAIN
    | ARRAYS
    | OBJECTS
    | st.lists(PLAIN | OBJECTS | NUMBERS, max_size=4)
    | st.lists(NUMBERS, min_size=2, max_size=3).map(tuple)
    | st.lists(st.lists(NUMBERS, min_size=2, max_size=4), max_size=3)
    | st.dictionaries(st.text(max_size=2), PLAIN | OBJECTS, max_size=2)
)


@pytest.mark.filterwarnings("ignore:overflow encountered in cast", "ignore:invalid value encountered in cast")
@pytest.mark.parametrize("examples", [10, *others(40)])
@pytest.mark.parametrize(("kind", "name"), FIELDS, ids=lambda part: getattr(part, "__name__", part))
def test_what_can_be_made_can_be_rendered(kind: type, name: str, examples: int) -> None:
    """Any value of any field is refused with one of clrt's errors when the object is made, or when it becomes part of
    a scene; or else the scene is compiled without an error."""
    make, scene_of = MADE[kind]

    @settings(max_examples=examples, deadline=None, derandomize=True)
    @given(data=st.data())
    def check(data: DataObject) -> None:
        try:
            scene = scene_of(make(**{name: data.draw(VALUES, label=name)}))
        except ClrtError as refused:
            assert isinstance(refused, SceneError) and ": " in str(refused)
            return
        if scene.animation is not None:
            _, scene = next(clrt.frames(scene, [0]))
        compile_scene(scene, Choices())

    check()


def arrays_of(value: Any) -> list[np.ndarray[Any, Any]]:
    """Return the arrays that an object of a scene keeps, also within its parts."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, dict):
        return arrays_of(list(value.values()))
    if isinstance(value, list | tuple):
        return [array for each in value for array in arrays_of(each)]
    if not hasattr(value, "__dataclass_fields__"):
        return []
    return arrays_of([getattr(value, field.name) for field in fields(value)])


KEEPING: dict[str, Callable[[], Any]] = {
    "mesh": lambda: mesh(colors=VERTICES, tangents=np.ones((3, 4), np.float32), uv1=UV),
    "instance": lambda: clrt.Instance(mesh(), np.eye(4)),
    "picture": lambda: clrt.Texture(picture=PICTURE),
    "light": lambda: light(clrt.SpotLight)(image=LIGHT_IMAGE),
    "environment": lambda: clrt.Environment(image=IMAGE),
    "sky": lambda: clrt.Sky(sun_direction=(0, 1, 0)).environment(),
    "backdrop": lambda: clrt.Backdrop(image=IMAGE),
    "image": lambda: clrt.Image(IMAGE, {}, IMAGE, {"depth": IMAGE[..., 0]}, IMAGE[..., 0], IMAGE),
    "light map": lambda: clrt.LightMap(IMAGE, IMAGE, IMAGE[..., 0] > 0, {}),
    "scene": lambda: Scene(meshes=[mesh()], environment=clrt.Environment(image=IMAGE)),
}
COPIES: dict[str, Callable[[Any], Any]] = {
    "itself": lambda made: made,
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda made: pickle.loads(pickle.dumps(made)),
    "replace": replace,
}


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", KEEPING)
def test_arrays_are_read_only(name: str, way: str) -> None:
    """Those of copies, too; the caller's own arrays stay writable."""
    arrays = arrays_of(COPIES[way](KEEPING[name]()))
    assert arrays
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    assert all(each.flags.writeable for each in (VERTICES, FACES, UV, IMAGE))


def test_arrays_are_not_copied() -> None:
    """Of the right dtypes they share the caller's memory; meshes and images made of others' arrays keep these."""
    made = mesh()
    assert np.shares_memory(made.vertices, VERTICES) and np.shares_memory(made.faces, FACES)
    again = replace(made, material=clrt.Mirror())
    assert again.vertices is made.vertices and again.faces is made.faces
    made.normals = VERTICES + 1
    assert not made.normals.flags.writeable


def test_the_caller_s_changed_arrays_are_validated_again() -> None:
    """Only read-only arrays count as known to be valid."""
    points = VERTICES.copy()
    mesh(vertices=points)
    points[1, 2] = np.nan
    with pytest.raises(SceneError, match=r"vertices\[1\] = \[1.0, 0.0, nan\] is not finite"):
        mesh(vertices=points)


def test_defaults_are_valid() -> None:
    """Fields at their defaults are not checked."""
    for kind in MADE:
        if kind is not Scene:
            made = MADE[kind][0]()
            values = {field.name: getattr(made, field.name) for field in fields(kind)}
            assert field_problems(kind, values, "") == []


def test_unknown_fields_are_named_with_the_closest_one() -> None:
    for kind in MADE:
        known = fields(kind)[-1].name
        with pytest.raises(SceneError, match=f'^{kind.__name__}: the field "{known}x" is unknown; did you mean "'):
            kind(**{f"{known}x": 1})


@pytest.mark.parametrize("kind", [Scene, *[kind for kind in MADE if issubclass(kind, Editable)]])
def test_fields_that_do_not_exist_cannot_be_assigned(kind: type) -> None:
    made = Scene() if kind is Scene else MADE[kind][0]()
    for name in (field.name for field in fields(kind)):
        setattr(made, name, getattr(made, name))
        with pytest.raises(ObjectError, match=f'the field "{name}_" is unknown; did you mean "{name}"'):
            setattr(made, f"{name}_", 3)


ARRAY_FIELDS = [(kind, name) for kind in MADE for name in array_fields(kind)]


@pytest.mark.parametrize(("kind", "name"), ARRAY_FIELDS, ids=lambda part: getattr(part, "__name__", part))
def test_arrays_may_be_lists_or_of_other_dtypes(kind: type, name: str) -> None:
    """They are converted, also when they are assigned later, if their numbers fit; pictures' integers are not light."""
    make, form = MADE[kind][0], {"tangents": (3, 4), "image": (2, 4, 3), "to_world_end": (3, 4), "pivot": (3, 4)}
    own = getattr(make(), name)
    array = np.eye(4)[:3] if name in MATRICES else np.ones(form.get(name, (3, 3))) if own is None else own
    wide = array.astype(np.float64 if array.dtype.kind == "f" else np.int64)
    for values in (array, array.tolist(), wide, tuple(map(tuple, array.tolist()))):
        made = make(**{name: values})
        stored = getattr(made, name)
        assert stored.dtype == array_fields(kind)[name] and not stored.flags.writeable
        np.testing.assert_array_equal(stored, array)
        if isinstance(made, Editable):
            setattr(made, name, values)
            assert getattr(made, name).dtype == array_fields(kind)[name]
    if array.dtype.kind != "f":
        with pytest.raises(SceneError, match=f"{name}.*float64"):
            make(**{name: array + 0.5})
    elif array.ndim == 3:
        with pytest.raises(SceneError, match=f"{name}: is uint8"):
            make(**{name: array.astype(np.uint8)})


def test_fields_without_names_or_missing() -> None:
    """As many fields as have places may be given without their names, and all without a default must be given."""
    for kind in MADE:
        places = [field.name for field in fields(kind) if not field.kw_only]
        with pytest.raises(SceneError, match=f"^{kind.__name__}: 7 has no name; write [a-z_]+=..."):
            kind(*[7] * (len(places) + 1))
        needed = [each.name for each in fields(kind) if each.default is MISSING and each.default_factory is MISSING]
        for name in needed:
            with pytest.raises(SceneError, match=f"^{kind.__name__}: {name} is missing; add it$"):
                kind(**{other: 7 for other in needed if other != name})


MESSAGES: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
    (Scene, {"camera": clrt.Camera}, "camera: Camera is a class; write an object of it, clrt.Camera(...)"),
    (clrt.Sphere, {"material": clrt.Mirror}, "Sphere.material: Mirror is a class; write an object of it"),
    (clrt.Diffuse, {"color": PICTURE}, "Diffuse.color: is a Picture; write a clrt.Texture(picture=...)"),
    (clrt.Dielectric, {"ior": (1, 1, 1)}, "Dielectric.ior: [1, 1, 1] is not a number; write one"),
    (clrt.Sphere, {"radius": "1"}, 'Sphere.radius: "1" is not a number; write one without quotes'),
    (clrt.Sky, {"time": "noon", "latitude": 1, "longitude": 2}, "or in Python a datetime"),
    (clrt.RenderSettings, {"samples": 4}, 'RenderSettings: the field "samples" is unknown; did you mean "spp"?'),
    (mesh, {"faces": [[0.0, 1.0, 2.0]]}, "faces has dtype float64; write integers"),
]


@pytest.mark.parametrize(("make", "values", "message"), MESSAGES)
def test_messages_name_the_remedy(make: Callable[..., Any], values: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=re.escape(message)):
        make(**values)


def test_errors_are_pickled() -> None:
    with pytest.raises(SceneError) as caught:
        clrt.Sphere(radius=-1)
    copied = pickle.loads(pickle.dumps(caught.value))
    assert copied.problems == caught.value.problems and copied.named("sphere[3]")[0].startswith("sphere[3].radius: -1")
