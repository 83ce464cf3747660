"""pbrt's directives: transformations, attributes, objects, files, and what is said of mistakes."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.pbrt.reader import read_pbrt
from clrt.formats.pbrt.tokens import Tokens
from clrt.formats.scene_parts.notes import UnsupportedError
from clrt.scene.materials.material_types import Diffuse, Mirror

from .pbrt_files import TRIANGLE, problem, scene


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6, width=32), min_size=1, max_size=1500), st.booleans())
def test_arrays_of_any_length_keep_their_numbers(values: list[float], commented: bool) -> None:
    between = " # a comment ] \n" if commented else "\n"
    text = f'"float x" [{between.join(map(repr, values))}] 7'
    tokens = Tokens(text.encode(), "")
    assert tokens.take("a name") == ("float x", True, 0)
    np.testing.assert_array_equal(tokens.values("x"), values)
    np.testing.assert_array_equal(tokens.values("y"), [7])


def test_words_strings_and_lines() -> None:
    tokens = Tokens(b'# first\nShape "a \\"b\\" \\n\\\\" [ "one" "two" ] true [false true]\nEnd', "part.pbrt ")
    word = tokens.take("a word")
    assert word.text == "Shape" and tokens.place(word) == "part.pbrt line 2"
    assert tokens.take("a string").text == 'a "b" \n\\'
    assert tokens.values("x") == ["one", "two"] and tokens.values("y") == [True] and tokens.values("z") == [False, True]
    assert tokens.place(tokens.take("a word")) == "part.pbrt line 3" and tokens.peek() is None


def test_the_last_transformation_is_applied_first(folder: Path) -> None:
    """A point through each transformation by itself, by scipy's rotations."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        axis, offset, factors = rng.normal(size=(3, 3))
        angle = rng.uniform(-360, 360)
        linear = np.eye(4)
        linear[:3] = rng.normal(size=(3, 4))
        texts = {
            "Rotate": f"Rotate {angle} {' '.join(map(str, axis))}",
            "Translate": f"Translate {' '.join(map(str, offset))}",
            "Scale": f"Scale {' '.join(map(str, factors))}",
            "ConcatTransform": f"ConcatTransform [{' '.join(map(str, linear.T.ravel()))}]",
        }
        turn = Rotation.from_rotvec(np.radians(angle) * axis / np.linalg.norm(axis))
        does = {
            "Rotate": turn.apply,
            "Translate": lambda p, by=offset: p + by,
            "Scale": lambda p, by=factors: p * by,
            "ConcatTransform": lambda p, by=linear: by[:3] @ [*p, 1],
        }
        order = [str(name) for name in rng.permutation([*texts])]
        points = rng.normal(size=(3, 3))
        expected = points
        for name in reversed(order):
            expected = np.array([does[name](point) for point in expected])
        shape = f'Shape "trianglemesh" "point3 P" [{" ".join(map(str, points.ravel()))}] "integer indices" [0 1 2]'
        mesh = scene(folder, "\n".join(texts[name] for name in order) + f"\n{shape}").meshes[0]
        np.testing.assert_allclose(mesh.vertices, expected, rtol=1e-5, atol=1e-5)


def test_objects_and_instances(folder: Path) -> None:
    """A sphere and a mesh, of which only the instances are rendered, without emission."""
    read = scene(
        folder,
        f"""ObjectBegin "group" AreaLightSource "diffuse" {TRIANGLE} Translate 1 0 0 Shape "sphere" "float radius" .5
        ObjectEnd
        AttributeBegin Scale 2 2 2 Rotate 90 0 0 1 ObjectInstance "group" AttributeEnd ObjectInstance "group"
        AttributeBegin Scale 1 2 1 ObjectInstance "group" AttributeEnd""",
    )
    assert len(read.instances) == 3 and read.instances[0].mesh is read.instances[1].mesh
    assert not any(read.instances[0].mesh.material.radiance)
    np.testing.assert_allclose(read.spheres[0].center, [0, 2, 0], atol=1e-12)
    assert read.spheres[0].radius == pytest.approx(1) and read.spheres[1].radius == pytest.approx(0.5)
    (stretched,) = read.meshes
    np.testing.assert_allclose(np.ptp(stretched.vertices, axis=0), [1, 2, 1], rtol=1e-3)


def test_attributes_are_saved_and_restored(folder: Path) -> None:
    read = scene(
        folder,
        f"""Attribute "shape" "float radius" 3
        MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [1 0 0]
        AttributeBegin Translate 1 2 3 NamedMaterial "red" Shape "sphere" AttributeEnd
        TransformBegin Translate 7 7 7 NamedMaterial "red" TransformEnd Shape "sphere"
        CoordinateSystem "here" Translate 5 5 5 CoordSysTransform "here" Material "mirror" Shape "sphere" {TRIANGLE}""",
    )
    first, second, third = read.spheres
    assert first.radius == 3 and first.center == pytest.approx((1, 2, 3)) and first.material == Diffuse(color=(1, 0, 0))
    assert second.center == pytest.approx((0, 0, 0)) and second.material is first.material
    assert third.center == pytest.approx((0, 0, 0)) and isinstance(third.material, Mirror)


def test_files_of_meshes_spectra_and_includes(folder: Path) -> None:
    (folder / "parts").mkdir()
    ply = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    ply += (
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    )
    (folder / "parts" / "a.ply.gz").write_bytes(gzip.compress(ply))
    (folder / "parts" / "eta.spd").write_text("# nm\n300 1.5\n900 1.5\n")
    inner = 'Material "dielectric" "spectrum eta" "eta.spd"\nShape "plymesh" "string filename" "a.ply.gz"\n'
    (folder / "parts" / "inner.pbrt.gz").write_bytes(gzip.compress(inner.encode()))
    read = scene(folder, 'Include "parts/inner.pbrt.gz"')
    assert len(read.meshes[0].faces) == 2 and read.meshes[0].material.ior == pytest.approx(1.5)  # type: ignore[attr-defined]
    (folder / "whole.pbrt.gz").write_bytes(gzip.compress((folder / "scene.pbrt").read_bytes()))
    assert len(load(folder / "whole.pbrt.gz").meshes) == 1


@pytest.mark.parametrize(
    ("world", "words"),
    [
        ('Shape "torus"', ['line 4: Shape "torus"', "use sphere", "--approximate"]),
        ('\nShape "sphere" "float radius" "wide"', ["line 5", "radius", "float"]),
        ('Shape "sphere" "float girth" 2', ["girth", "leave it out"]),
        ('Shape "sphere" "length radius" 2', ["length radius", "types are"]),
        ('Shape "sphere" "rgb radius" [1 1 1]', ["radius", "of type rgb", "float radius"]),
        ('Shape "trianglemesh" "point3 P" [0 0 0 1] "integer indices" [0 1 2]', ["P", "4 numbers", "multiple of 3"]),
        (TRIANGLE.replace("0 1 2]", "0 1 7]"), ["indices", "7", "0 to 2"]),
        ('Shape "trianglemesh" "integer indices" [0 1 2]', ["P", "missing"]),
        ('Material "velvet" Shape "sphere"', ['"velvet"', "diffuse", "--approximate"]),
        ('NamedMaterial "gone" Shape "sphere"', ['"gone"', "define it"]),
        ('Material "diffuse" "texture reflectance" "gone" Shape "sphere"', ['"gone"', "define it"]),
        ('ObjectInstance "gone"', ['"gone"', "define it"]),
        ('CoordSysTransform "gone"', ['"gone"', "define it"]),
        ('MediumInterface "gone" "" Shape "sphere"', ['"gone"', "define it"]),
        ('Shape "plymesh" "string filename" "gone.ply"', ["gone.ply", "no such model file"]),
        ('Include "gone.pbrt"', ["gone.pbrt", "no such scene file"]),
        ('Include "models/scene.pbrt"', ["models/scene.pbrt", "no such scene file"]),
        ('Include "scene.pbrt"', ["scene.pbrt", "included more than"]),
        ('LightSource "laser"', ['"laser"', "point", "--approximate"]),
        ('LightSource "infinite" "spectrum L" [500 1 400 2]', ["L", "increasing"]),
        ('LightSource "infinite" "spectrum L" "stdillum-X"', ["stdillum-X"]),
        ('LightSource "infinite" "blackbody L" 0', ["L", "kelvin"]),
        ("AttributeEnd", ["AttributeEnd", "did not begin"]),
        ("AttributeBegin", ["AttributeBegin", "no matching end"]),
        ("AttributeBegin " * 300, ["nested more than"]),
        ("Transform [1 2 3]", ["Transform", "3 numbers", "16"]),
        ("Translate 1 2", ["ends", "number 3 of 3 of Translate"]),
        ("Scale 1e300 1e300 1e300 Scale 1e300 1 1", ["Scale", "not finite"]),
        ("Sphere 1", ["Sphere", "not a directive", "Shape"]),
        ('Shape "sphere', ["string without an end"]),
        ("Translate 1 2 nan", ["nan", "not a number"]),
        ('Shape "loopsubdiv" "integer levels" 12 "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]', ["levels"]),
    ],
    ids=lambda value: str(value)[:40],
)
def test_mistakes_are_named(folder: Path, world: str, words: list[str]) -> None:
    """By file, line, object, value and remedy."""
    said = problem(folder, world)
    assert str(folder / "scene.pbrt") in said and all(word in said for word in words), said


def test_all_that_is_unsupported_is_listed(folder: Path) -> None:
    world = """Shape "curve" LightSource "laser" Material "hair" Shape "sphere" AreaLightSource "diffuse"
    "string filename" "a.exr" Material "diffuse" Shape "sphere" """
    (folder / "scene.pbrt").write_text(f'Integrator "ao"\nWorldBegin\n{world}')
    with pytest.raises(UnsupportedError) as error:
        read_pbrt(folder / "scene.pbrt")
    assert error.value.features == [
        "Integrator ao",
        "Shape curve",
        "Material hair",
        "emission by an image",
        "LightSource laser",
    ]
    read, differences = read_pbrt(folder / "scene.pbrt", approximate=True)
    assert len(read.spheres) == 2 and len(differences) == 5


def test_bombs_end_in_one_message(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "zeros.pbrt.gz").write_bytes(gzip.compress(b" " * (1 << 27)))
    with pytest.raises(SceneError, match="unpack to more than"):
        load(folder / "zeros.pbrt.gz")
    (folder / "a.pbrt").write_text('Include "b.pbrt"\nInclude "b.pbrt"\n')
    (folder / "b.pbrt").write_text('Include "a.pbrt"\nInclude "a.pbrt"\n')
    with pytest.raises(SceneError, match="included more than"):
        load(folder / "a.pbrt")
    monkeypatch.setattr("clrt.formats.pbrt.shapes.MOST_INSTANCES", 999)
    many = 'ObjectBegin "o"\n' + f"{TRIANGLE}\n" * 50 + "ObjectEnd\n" + 'ObjectInstance "o"\n' * 20
    assert "999 instances" in problem(folder, many)
    mix = 'MakeNamedMaterial "m" "string type" "mix" "string materials" ["m" "m"]\nNamedMaterial "m" Shape "sphere"'
    assert "mixes itself" in problem(folder, mix)
    loop = 'Texture "t" "float" "scale" "texture tex" "t"\nMaterial "diffuse" "texture reflectance" "t" Shape "sphere"'
    assert "contain each other" in problem(folder, loop)
