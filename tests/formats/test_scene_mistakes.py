from __future__ import annotations

from pathlib import Path

import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load

BAD = """
mesch = 3
[camera]
position = [0, 1]
fov = 40
[render]
size = [512, 0]
spp = 2.5
integrator = "pth"
[environment]
image = "lost.hdr"
color = [1, 1, 1]
strength = nan
[materials.white]
type = "diffuse"
color = [0.73, 1.5, -0.1]
colour = [1, 1, 1]
[materials.ring]
type = "metalic_roughness"
[[mesh]]
name = "drgon"
file = "lost.ply"
material = "whit"
normals = "smoth"
[[mesh]]
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2], [0, 1, 3]]
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]]
[[instance]]
mesh = "dragon"
[[sphere]]
radius = 0
material = "ring"
[[light]]
type = "point"
position = [0, "one", inf]
[[light]]
type = "directional"
direction = [0, 0, 0]
irradiance = [1, 1, 1]
"""
MESH = '[[mesh]]\nname = "a"\nvertices = [[0, 0, 0], [9, 0, 0], [0, 9, 0]]\nfaces = [[0, 1, 2]]\n'
ROWS = "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
SENTENCES = [
    'key "mesch" is unknown; did you mean "mesh"?',
    'instance[0].mesh: "dragon" is unknown; did you mean "drgon"?',
    "camera.position: [0, 1] has 2 entries; write 3",
    'camera: key "fov" is unknown; did you mean "fov_degrees"?',
    "render.size[1]: 0 is below 1; write at least 1",
    "render.spp: 2.5 is not an integer; write one without quotes or decimal point",
    'render.integrator: "pth" is unknown; did you mean "path"?',
    "environment.image: {folder}/lost.hdr: no such picture file",
    "environment: has both a color and an image; keep one of them",
    "environment.strength: nan is not a finite number; write one",
    "materials.white.color[1]: 1.5 is above 1; write at most 1",
    "materials.white.color[2]: -0.1 is below 0; write at least 0",
    'materials.white: key "colour" is unknown; did you mean "color"?',
    'materials.ring.type: "metalic_roughness" is unknown; did you mean "metallic_roughness"?',
    "mesh[0].file: {folder}/lost.ply: no such model file",
    'mesh[0].material: "whit" is unknown; did you mean "white"?',
    'mesh[0].normals: "smoth" is unknown; did you mean "smooth"?',
    'mesh[1] "mesh": faces[1] uses vertex 3, but valid indices are 0 to 2; repair the mesh',
    "mesh[1].matrix[3]: [0, 0, 0, 2] is not affine; write [0, 0, 0, 1]",
    "sphere[0].radius: 0 is not above 0; write more than 0",
    'light[0].position[1]: "one" is not a number; write one without quotes',
    "light[0].position[2]: inf is not a finite number; write one",
    "light[0]: intensity is missing; add it",
    "light[1].direction: [0, 0, 0] is not a direction; write the one the light travels in",
]


def problems(folder: Path, text: str) -> list[str]:
    """Return the problems that load reports, without the file's name, with which every line must start."""
    path = folder / "box.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load(path)
    assert all(problem.startswith(f"{path}: ") for problem in caught.value.problems)
    return [problem.removeprefix(f"{path}: ") for problem in caught.value.problems]


def test_all_mistakes_come_at_once_and_no_others(folder: Path) -> None:
    assert sorted(problems(folder, BAD)) == sorted(line.format(folder=folder) for line in SENTENCES)


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("[materials.a]\ncolor = [1, 1, 1]", "materials.a: type is missing; write one of"),
        ('[materials.a]\ntype = "phnog"', 'materials.a.type: "phnog" is unknown; did you mean "phong"?'),
        (
            '[materials.a]\ntype = "dielectric"\nthin = true\nattenuation_distance = 1\n[[sphere]]\nmaterial = "a"',
            "attenuation_distance: a thin surface has no interior; leave it out, or remove thin",
        ),
        ('[materials.a]\ntype = "conductor"\nk = [1, 2, 3]', "materials.a.k: is given without eta; write both"),
        ('[materials.a]\ntype = "diffuse"\ncolor = { image = "a.png" }', "a.png: no such picture file"),
        (
            '[materials.a]\ntype = "diffuse"\ncolor = { image = "a.png", scal = 2 }',
            'color: key "scal" is unknown; did you',
        ),
        (
            '[materials.a]\ntype = "diffuse"\ncolor = { image = 3 }',
            "materials.a.color.image: 3 is not a string; write a file name in quotes",
        ),
        (
            '[materials.a]\ntype = "diffuse"\ncolor = { image = ["a.png"] }',
            'color.image: ["a.png"] is not a string; write',
        ),
        ('[materials.a]\ntype = "diffuse"\nnormal_map = 3', "normal_map: 3 is not of type Texture; write { image = "),
        (
            '[materials.a]\ntype = "diffuse"\ncolor = "red"',
            'materials.a.color: "red" is not a list; write the numbers in',
        ),
        ('[materials]\na = "diffuse"', 'materials.a: "diffuse" is not a table; write its keys below [materials.a]'),
        (
            '[render]\nintegrator = "raster"\n[camera]\nprojection = "orthographic"',
            'render.integrator: "raster" supports only pinhole cameras, and the camera has projection = "orthographic"',
        ),
        (
            '[render]\nintegrator = "raster"\n[camera]\naperture_radius = 0.1',
            'render.integrator: "raster" supports only pinhole cameras, and the camera has aperture_radius = 0.1',
        ),
        (
            '[camera]\nprojection = "ortographic"',
            'camera.projection: "ortographic" is unknown; did you mean "orthographic',
        ),
        (
            '[camera]\nprojection = "orthographic"\naperture_radius = 0.1',
            'camera.aperture_radius: 0.1 has no effect with projection = "orthographic"; leave it out',
        ),
        ('[camera]\nprojection = "equirectangular"\nfocus_distance = 2', "camera.focus_distance: 2 has no effect with"),
        (
            "[camera]\nview_height = 2",
            'camera.view_height: 2 has no effect with projection = "perspective"; leave it out',
        ),
        ("[camera]\naperture_radius = -0.1", "camera.aperture_radius: -0.1 is below 0; write at least 0"),
        ("[camera]\nfocus_distance = 0", "camera.focus_distance: 0 is not above 0; write more than 0"),
        ("[camera]\nlook_at = [0, 0, 5]", "camera.look_at: [0, 0, 5] is the camera's own position; move one of them"),
        ("[camera]\nup = [0, 0, 1]", "camera.up: [0, 0, 1] is parallel to the view"),
        ("[camera]\nposition = [1e39, 0, 0]", "camera.position: [1e+39, 0, 0] is outside the range of float32"),
        (f"[camera]\nposition = [1{'0' * 39}, 0, 0]", f"position: [1{'0' * 39}, 0, 0] is outside the range of float32"),
        (
            '[materials.m]\ntype = "metallic_roughness"\nmultiple_scattering = 1',
            "materials.m.multiple_scattering: 1 is not a boolean; write true or false",
        ),
        ("camera = 3", "camera: 3 is not a table; write [camera]"),
        ('[mesh]\nfile = "a.ply"', "mesh: is not a list of tables; write [[mesh]] in double brackets"),
        ("instance = [3]", "instance[0]: 3 is not a table; write [[instance]]"),
        ("[[instance]]\nmesh = { a = 1 }", "instance[0].mesh: { a = 1 } is unknown; none is defined"),
        (f"{MESH}[[instance]]\nmesh = [{{}}]", "instance[0].mesh: [{  }] is unknown; write one of a"),
        ("[[instance]]\ntranslate = [1, 0, 0]", "instance[0]: mesh is missing; add it"),
        (f'{MESH}[[instance]]\nmesh = "a"\nmaterial = "b"', 'instance[0].material: "b" is unknown; none is defined'),
        (f'{MESH}[[instance]]\nmesh = "a"\nscale = 0', "instance[0]: its transform flattens the mesh; write a nonzero"),
        (
            f'{MESH}[[instance]]\nmesh = "a"\nscale = 2\nmatrix = {ROWS}',
            "instance[0]: has both a matrix and translate,",
        ),
        (f'{MESH}{MESH}[[instance]]\nmesh = "a"', 'instance[0].mesh: "a" is the name of 2 meshes; rename them'),
        (f'{MESH}[[instance]]\nmesh = "a"\nscale = 1e38', " moves the mesh outside the range of float32"),
        (f'{MESH}[[instance]]\nmesh = "a"\nrepeat = 3', "instance[0].repeat: 3 is not a list of tables; write"),
        (
            f'{MESH}[[instance]]\nmesh = "a"\nrepeat = [{{ scale = 2 }}]',
            "instance[0].repeat[0]: count is missing; add it",
        ),
        (
            f'{MESH}[[instance]]\nmesh = "a"\nrepeat = [{{ count = 3000000 }}]',
            "instance[0].repeat[0].count: 3000000 is above 2000000; write at most 2000000",
        ),
        (
            f'{MESH}[[instance]]\nmesh = "a"\nrepeat = [{{ count = 2000 }}, {{ count = 2000 }}]',
            "instance[0].repeat: makes 4000000 copies; reduce the counts to at most 2000000 in all",
        ),
        (
            f'{MESH}[[instance]]\nmesh = "a"\nrepeat = [{{ count = 400, scale = 9 }}]',
            "its transform, of copy 324, is not finite",
        ),
        ("mesh = [3]", "mesh[0]: 3 is not a table; write [[mesh]]"),
        ('[[mesh]]\nname = "a"', "mesh[0]: file is missing; write a file, or vertices and faces"),
        ("[[mesh]]\nvertices = [[0, 0, 0]]", "mesh[0]: faces is missing; write a file, or vertices and faces"),
        (
            '[[mesh]]\nfaces = [[0, 0, 0]]\nfile = "a.ply"',
            "has both a file and vertices, faces or uv; keep one of them",
        ),
        ("[[mesh]]\nvertices = [[0, 0, 0]]\nfaces = []", 'mesh[0] "mesh": has no triangles'),
        ("[[mesh]]\nvertices = [[0, 1e39, 0]]\nfaces = [[0, 0, 0]]", "mesh[0].vertices: [[0, 1e+39, 0]] is outside"),
        ("[[mesh]]\nvertices = [[0, 0]]\nfaces = [[0, 0, 0]]", "mesh[0].vertices[0]: [0, 0] has 2 entries; write 3"),
        ("[[mesh]]\nvertices = [[0, 0, 0]]\nfaces = [[0, -1, 0]]", "mesh[0].faces[0][1]: -1 is below 0"),
        ('[[mesh]]\nfile = "models/triangle.obj"\nscale = 0', "mesh[0]: its transform collapses it to a point"),
        ('[[mesh]]\nfile = "models/triangle.obj"\nscale = "big"', 'mesh[0].scale: "big" is not a list'),
        ('[[mesh]]\nfile = "models/triangle.obj"\nscale = [1e39, 1, 1]', "mesh[0].scale: [1e+39, 1, 1] is outside"),
        (
            f'{MESH}materials = {{ x = "m" }}\n[materials.m]\ntype = "diffuse"',
            'mesh[0].materials: "x" is unknown, as the model has no named materials; write material = "NAME"',
        ),
        (
            '[[mesh]]\nfile = "models/triangle.obj"\nmaterials = { green = "y" }',
            'mesh[0].materials.green: "y" is unknown; none is defined',
        ),
        ('[[mesh]]\nfile = "models"', "models: a model must be one of .glb, .gltf"),
        ('[[sphere]]\nmaterial = "gold"', 'sphere[0].material: "gold" is unknown; none is defined'),
        (
            "[[light]]\ntype = { point = 1 }",
            "light[0].type: { point = 1 } is unknown; write one of directional, goniometric, point, ",
        ),
        (
            '[[light]]\ntype = "spot"\nposition = [0, 0, 0]\ndirection = [0, 0, 0]\nintensity = [1, 1, 1]',
            "light[0].direction: [0, 0, 0] is not a direction; write the one the light travels in",
        ),
        (
            '[[light]]\ntype = "spot"\nposition = [0, 0, 0]\ndirection = [0, 0, 1]\nintensity = [1, 1, 1]\n'
            "inner_degrees = 45",
            "light[0].inner_degrees: 45 is not below outer_degrees, 45; write a smaller",
        ),
        ("[environment]\nimage = 3", "environment.image: 3 is not a string; write a file name in quotes"),
        ("[sky]", "sky: has no sun; write time, latitude and longitude, or sun_direction"),
        ("sky = 3", "sky: 3 is not a table; write [sky]"),
        ("[sky]\nsun_direction = [0, 1, 0]\nturbidty = 3", 'sky: key "turbidty" is unknown; did you mean "turbidity"?'),
        (
            "[sky]\nsun_direction = [0, 1, 0]\n[environment]",
            "sky: the scene has both [sky] and [environment]; keep one",
        ),
        ('[sky]\ntime = "12:00"\nlatitude = 1\nlongitude = 2', 'sky.time: "12:00" is not a date and time; write one'),
        ("[sky]\ntime = 2026-06-21\nlatitude = 1\nlongitude = 2", "sky.time: 2026-06-21 is not a date and time; write"),
        (
            "[sky]\ntime = 2026-06-21T12:00:00\nlatitude = 1\nlongitude = 2",
            "sky.time: 2026-06-21T12:00:00 has no offset from UTC; write one, such as 2026-06-21T12:00:00+02:00",
        ),
        (
            "[sky]\ntime = 2026-12-21T16:00:00Z\nlatitude = 60\nlongitude = 0",
            "degrees below the horizon, where the model ends; write one when it is up",
        ),
        ("[backdrop]\nimage = 3", "backdrop.image: 3 is not a string; write a file name in quotes"),
        ('[backdrop]\nimage = "lost.jpg"', "backdrop.image: {folder}/lost.jpg: no such picture file"),
        ("[backdrop]\ncolour = [1, 1, 1]", 'backdrop: key "colour" is unknown; did you mean "color"?'),
        ("[backdrop]\ncolor = [1, -1, 1]", "backdrop.color[1]: -1 is below 0; write at least 0"),
        ("backdrop = 3", "backdrop: 3 is not a table; write [backdrop]"),
        (
            f'[render]\nintegrator = "local"\n[materials.m]\ntype = "mirror"\ncatcher = true\n{MESH}material = "m"',
            'render.integrator: "local" does not support catchers, which need light with and without the objects',
        ),
        (
            '[materials.m]\ntype = "diffuse"\nemission = [1, 1, 1]\ncatcher = true\n[[sphere]]\nmaterial = "m"',
            "materials.m.catcher: a catcher shows light that it receives, and this one emits",
        ),
        ("[camera\nposition = 3", "is not valid TOML: "),
        (f"[camera]\nposition = [1{'0' * 5000}, 0, 0]", "is not valid TOML: "),
        (f"[camera]\nposition = [0x1{'0' * 5000}, 0, 0]", "camera.position: [0x10000"),
    ],
)
def test_each_mistake(text: str, sentence: str, folder: Path) -> None:
    (problem,) = problems(folder, text)
    assert sentence.replace("{folder}", str(folder)) in problem


def test_syntax_error_names_the_line(folder: Path) -> None:
    assert "line 3" in problems(folder, "[camera]\nfov_degrees = 40\nup = [0 1]")[0]


def test_endless_mistakes_are_counted(folder: Path) -> None:
    rows = ", ".join(['["a", 0, 0]'] * 500)
    lines = problems(folder, f"[[mesh]]\nvertices = [{rows}]\nfaces = [[0, 1, 2]]")
    assert lines[-1] == f"mesh[0]: {500 - len(lines) + 1} more mistakes like these" and len(lines) < 20


def test_what_is_no_path_is_refused() -> None:
    with pytest.raises(SceneError, match="3 is not the path"):
        load(3)  # type: ignore[arg-type]
