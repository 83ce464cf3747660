"""A scene file written for a model renders like the model."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.toml.writer import scene_files, started
from clrt.output.images import write_image
from clrt.output.scenes import save_scene
from clrt.rendering.checkpoint.identity import facts_of
from clrt.rendering.compile.choices import Choices
from clrt.scene.animation import Animation, Keyframe
from clrt.scene.editing import materials_of, with_material
from clrt.scene.lights import Light, PointLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, MetallicRoughness, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Backdrop, Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.sky.sky import Sky

from ..covering import others
from .glb import Gltf, ball
from .test_gltf import cameras

SCENES = Path(__file__).parents[2] / "scenes"
GALLERY = [path.stem for path in sorted(SCENES.glob("*.toml"))]
OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0.1\nv 0 0.7 0\nf 1 2 3\n" + "".join(
    f"usemtl {name}\nf 1 2 3\n" for name in ("red", 'odd "name" \\ # é', "lost", "model", "lamp")
)
MTL = """newmtl red
Kd 0.9 0.1 0.05
newmtl odd "name" \\ # é
Kd 0.1 0.2 0.3
Ks 1 1 1
Ns 1234.5
newmtl model
Kd 1 0 0
newmtl lamp
Ke 1e-7 12 1e20
"""


def shaded() -> Gltf:
    """Return four balls: two materials with one name, one without a material, and one without a material name."""
    gltf = ball()
    gltf.document["materials"] = [
        {"name": "twin", "pbrMetallicRoughness": {"metallicFactor": 0.1}},
        {"name": "twin"},
        {"pbrMetallicRoughness": {"roughnessFactor": 1 / 3}, "emissiveFactor": [1, 0, 0]},
    ]
    primitive = gltf.document["meshes"][0]["primitives"][0]
    for material in (0, 1, 2):
        gltf.mesh(**primitive, material=material)
    return gltf


@pytest.mark.parametrize("kind", ["obj", "glb", "cameras", "off"])
def test_round_trip(kind: str, tmp_path: Path) -> None:
    """The scene read back equals the model's in everything that affects the image."""
    model = tmp_path / "my models é" / f"a.{'glb' if kind == 'cameras' else kind}"
    model.parent.mkdir()
    (model.parent / "a.mtl").write_text(MTL)
    if kind == "obj":
        model.write_text(OBJ)
    elif kind == "off":
        model.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0.3\n3 0 1 2\n")
    else:
        (shaded() if kind == "glb" else cameras()).write(model)
    scene = load(model)
    text = scene_files(started(scene), tmp_path / "a.toml").text
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    again = load(tmp_path / "a.toml")
    assert facts_of(again, Choices()) == facts_of(scene, Choices())
    assert again.cameras == scene.cameras
    if kind == "obj":
        assert set(tomllib.loads(text)["materials"]) == {"red", 'odd "name" \\ # é', "lost", "model", "lamp"}
        assert '# The file\'s materials: "model"' in text
    if kind == "cameras":
        assert '# or, instead of the lines above: name = "side 2"' in text


def test_some_of_a_file_s_materials_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "a.mtl").write_text(MTL)
    scene = tmp_path / "a.toml"
    head = '[materials.white]\ntype = "diffuse"\ncolor = [1, 1, 1]\n[[mesh]]\nfile = "a.obj"\n'
    scene.write_text(head + 'materials = { red = "white" }\n')
    found = {mesh.name: mesh.material for mesh in load(scene).meshes}
    assert found["red"] == Diffuse(color=(1, 1, 1)) and found["model"] == Diffuse(color=(1, 0, 0))
    scene.write_text(head + 'material = "white"\nmaterials = { read = "white", red = "whit" }\n')
    with pytest.raises(SceneError) as caught:
        load(scene)
    assert caught.value.problems == [
        f"{scene}: mesh[0]: has both a material and materials; keep one of them",
        f'{scene}: mesh[0].materials: "read" is unknown; did you mean "red"?',
        f'{scene}: mesh[0].materials.red: "whit" is unknown; did you mean "white"?',
    ]
    scene.write_text(head + "materials = 3\n[environment]\nsky = 1\ncolor = [1, 1, 1]\n")
    with pytest.raises(SceneError) as caught:
        load(scene)
    assert caught.value.problems == [
        f"{scene}: environment.sky: 1 is unknown; write one of default, studio",
        f"{scene}: environment: has both a sky and color; keep one of them",
        f'{scene}: mesh[0].materials: 3 is not a table; write {{ "name in the file" = "NAME" }}',
    ]


def edited(scene: Scene) -> Scene:
    """Return the scene with changed values, another camera, and a ball with an unnamed material."""
    materials = list(materials_of(scene).values())
    for material in materials[:2]:
        scene = with_material(scene, material, replace(material, emission=(0.125, 1 / 3, 2.0)))
    ball = Sphere(center=(0.1, 0.2, 0.3), material=Dielectric(ior=1.25), name='a "ball"')
    keyframes = Keyframe(time=0.5, position=(1.0, 2.0, 3.0)), Keyframe(time=2.0, fov_degrees=12.5)
    return replace(
        scene,
        animation=Animation(fps=12.5, keyframes=keyframes),
        spheres=[*scene.spheres, ball],
        camera=replace(scene.camera, fov_degrees=33.3),
        cameras={**scene.cameras, "from the side": Camera(position=(9.0, 1.0, 0.0))},
        environment=replace(scene.environment, strength=0.3),
        lights=[*scene.lights, PointLight(position=(1.0, 2.0, 3.0), intensity=(1.0, 0.0, 1e-7))],
        render=replace(scene.render, integrator="direct", seed=7),
    )


def again(scene: Scene, path: Path) -> Scene:
    save_scene(scene, path)
    return load(path)


def check_same(scene: Scene, other: Scene) -> None:
    """Assert that scenes are equal in everything that affects the image, and in names."""
    assert facts_of(other, Choices()) == facts_of(scene, Choices())
    assert other.cameras == scene.cameras and other.render == scene.render and other.animation == scene.animation
    plain = {name: material for name, material in scene.materials.items() if not material.textures()}
    assert plain.items() <= other.materials.items() and scene.materials.keys() <= other.materials.keys()
    assert [each.name for each in other.spheres] == [each.name for each in scene.spheres]
    assert [each.name for each in other.meshes] == [each.name for each in scene.meshes]
    assert [each.name for each in other.instances] == [each.name for each in scene.instances]


@pytest.mark.parametrize("name", [*(name for name in GALLERY if name != "instances"), *others("instances")])
def test_scene_files_are_written_again(name: str, tmp_path: Path) -> None:
    """All scenes of the repository, unchanged and edited, in another folder; files that they refer to stay in place."""
    scene = load(SCENES / f"{name}.toml")
    for number, each in enumerate((scene, edited(scene), edited(edited(scene)))):
        check_same(each, again(each, tmp_path / f"{number}.toml"))
    assert not [path for path in tmp_path.iterdir() if path.suffix != ".toml"]
    moved = again(again(edited(scene), tmp_path / "there.toml"), tmp_path / "back.toml")
    check_same(edited(scene), moved)


def test_changed_models_are_written(tmp_path: Path) -> None:
    """Materials are assigned by the file's names; if these are ambiguous, meshes are written next to the scene."""
    (tmp_path / "a.mtl").write_text(MTL)
    (tmp_path / "a.obj").write_text(OBJ)
    twins = ball()
    twins.mesh(**twins.document["meshes"][0]["primitives"][0])
    twins.write(tmp_path / "twins.glb")
    blue = Diffuse(color=(0.1, 0.2, 0.3))
    scene = load(tmp_path / "a.obj")
    scene = with_material(scene, scene.meshes[1].material, blue)
    check_same(scene, again(scene, tmp_path / "a.toml"))
    scene = load(tmp_path / "twins.glb")
    scene = replace(scene, meshes=[scene.meshes[0], replace(scene.meshes[1], material=blue)])
    check_same(scene, again(scene, tmp_path / "twins.toml"))
    beside = {path.name for path in tmp_path.iterdir() if path.name not in ("a.mtl", "a.obj", "twins.glb")}
    assert beside == {"a.toml", "twins.toml", "twins.mesh_0.glb", "twins.mesh_1.glb"}


def test_what_no_scene_file_can_say_is_written_beside_it(tmp_path: Path) -> None:
    """A mesh with all attributes, instances of a hidden mesh, an environment map, a backdrop and a texture, made in
    Python."""
    rng = np.random.default_rng(0)
    directions = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0]], np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    picture = Picture(rng.integers(0, 256, (3, 5, 4), np.uint8), "some/wood")
    wood = Diffuse(color=Texture(picture=picture, scale=(2.0, 3.0), wrap=("mirror", "clamp"), factor=0.7))
    mesh = Mesh(
        rng.random((3, 3), np.float32),
        faces,
        wood,
        normals=directions,
        name="all of it",
        tangents=np.column_stack([directions[[1, 2, 0]], np.ones(3, np.float32)]),
        uv=rng.random((3, 2), np.float32),
        uv1=rng.random((3, 2), np.float32),
        colors=rng.random((3, 4), np.float32),
    )
    coated = MetallicRoughness(clearcoat=0.5, clearcoat_normal_map=Texture(picture=picture, factor=0.25))
    hidden = Mesh(rng.random((3, 3), np.float32), faces, Mirror(), name="all of it")
    places = [rng.random((3, 4)) for _ in range(2)]
    scene = Scene(
        meshes=[mesh],
        spheres=[Sphere(material=coated)],
        instances=[Instance(hidden, place, name=f"{i}") for i, place in enumerate(places)],
        environment=Environment(image=rng.random((4, 8, 3), np.float32), camera_visible=False),
        backdrop=Backdrop(image=rng.random((3, 5, 3), np.float32)),
    )
    written = again(scene, tmp_path / "scene.toml")
    check_same(scene, written)
    assert {path.name for path in tmp_path.iterdir()} == {
        "scene.toml",
        "scene.all_of_it.glb",
        "scene.all_of_it_2.glb",
        "scene.some_wood.png",
        "scene.sky.exr",
        "scene.backdrop.exr",
    }
    check_same(written, again(written, tmp_path / "again.toml"))


def test_files_that_are_still_shown_stay(tmp_path: Path) -> None:
    """New objects with existing names get files of their own; a scene saved over itself stays complete."""
    dark, light = (Picture(np.full((2, 2, 4), value, np.uint8), "wood") for value in (10, 200))
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    faces, uv = np.array([[0, 1, 2]], np.int32), np.zeros((3, 2), np.float32)

    def mesh(picture: Picture) -> Mesh:
        return Mesh(triangle, faces, Diffuse(color=Texture(picture=picture)), uv=uv, name="part")

    path = tmp_path / "x.toml"
    save_scene(Scene(meshes=[mesh(dark)]), path)
    first = load(path)
    old = {file: file.read_bytes() for file in tmp_path.iterdir() if file != path}
    save_scene(replace(first, meshes=[*first.meshes, mesh(light)]), path)
    assert {file: file.read_bytes() for file in old} == old and len(old) == 2
    again = [each.material.parameters()["color"] for each in load(path).meshes]
    assert [each.picture.texels[0, 0, 0] for each in again if isinstance(each, Texture)] == [10, 200]


def test_skies_are_written_as_parameters_unless_they_were_changed(tmp_path: Path) -> None:
    """Also of scenes made in Python. A sky that was edited, or whose sun was, is written as what it is now."""
    sky = Sky(sun_direction=(1, 2, 3), turbidity=2.5, sun_angle_degrees=1.0)
    lamp = PointLight(position=(0, 1, 2), intensity=(1, 1, 1))
    scene = Scene(environment=sky.environment(), lights=[*sky.lights(), lamp])
    read = again(scene, tmp_path / "sky.toml")
    check_same(scene, read)
    text = (tmp_path / "sky.toml").read_text()
    assert tomllib.loads(text)["sky"] == {"sun_direction": [1, 2, 3], "turbidity": 2.5, "sun_angle_degrees": 1.0}
    assert "[environment]" not in text and text.count("[[light]]") == 1 and len(list(tmp_path.iterdir())) == 1
    time = datetime(2026, 6, 21, 3, 34, 56, tzinfo=UTC)
    placed = Sky(time=time, latitude=-30, longitude=130 + 1 / 3, sun_strength=0)
    check_same(other := Scene(environment=placed.environment()), again(other, tmp_path / "placed.toml"))
    assert tomllib.loads((tmp_path / "placed.toml").read_text())["sky"]["time"] == time
    changes: list[tuple[str, Environment, list[Light]]] = [
        ("turned", replace(sky.environment(), rotation_degrees=9.0), sky.lights()),
        ("brighter", replace(sky.environment(), strength=2.0), sky.lights()),
        ("sunless", sky.environment(), []),
        ("later", sky.environment(), [lamp, *sky.lights()]),
    ]
    for name, environment, lights in changes:
        changed = Scene(environment=environment, lights=lights)
        check_same(changed, again(changed, tmp_path / f"{name}.toml"))
        assert "[sky]" not in (tmp_path / f"{name}.toml").read_text() and (tmp_path / f"{name}.sky.exr").exists()


def test_numbers_of_numpy_are_written(tmp_path: Path) -> None:
    center = tuple(np.array([1.5, 2, 3]))
    scene = Scene(
        spheres=[Sphere(center=center)],
        render=RenderSettings(spp=np.int64(7)),  # type: ignore[arg-type]
        environment=Environment(strength=np.float32(2.5)),  # type: ignore[arg-type]
    )
    save_scene(scene, tmp_path / "a.toml")
    again = load(tmp_path / "a.toml")
    assert (again.spheres[0].center, again.render.spp, again.environment.strength) == ((1.5, 2, 3), 7, 2.5)


def test_many_materials_are_named_at_once() -> None:
    """Each gets a name of its own, in linear time."""
    scene = Scene(spheres=[Sphere(material=Diffuse()) for _ in range(30_000)])
    named = materials_of(scene)
    assert len(named) == 30_000 and list(named)[:3] == ["sphere", "sphere 2", "sphere 3"]


def test_backdrops_and_catchers_round_trip(tmp_path: Path) -> None:
    """A backdrop's color, or its file by name, and what the camera does not see, or sees the shadow of."""
    picture = tmp_path / "photo.png"
    write_image(picture, np.full((2, 3, 3), 0.5, np.float32))
    text = "[render]\ntransparent_glass = true\n[environment]\ncamera_visible = false\n[backdrop]\n{}\n"
    text += '[materials.m]\ntype = "mirror"\ncatcher = true\n[[sphere]]\nmaterial = "m"\n'
    for line in ("color = [0.1, 2.0, 3.0]", 'image = "photo.png"', ""):
        (tmp_path / "a.toml").write_text(text.format(line))
        scene = load(tmp_path / "a.toml")
        assert scene.backdrop is not None and (scene.backdrop.image is None) == ("image" not in line)
        written = again(scene, tmp_path / "b.toml")
        check_same(scene, written)
        assert "image" not in line or 'image = "photo.png"' in (tmp_path / "b.toml").read_text()
        assert written.spheres[0].material.catcher and not written.environment.camera_visible
