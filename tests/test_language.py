"""Documents, docstrings, comments and messages use the field's words: lists of those that were used in their place."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
#: Pattern → what to write.
WORDS = {
    r"(samples?|rays|frames?|bytes) an? (pixel|ray|second|work-item)\b": "per pixel, per ray, per second",
    r"\bshin(es|ing)\b|\bglow(s|ing)\b": "emits, emissive, area light",
    r"\bround-about\b": "equirectangular",
    r"\bphotographed sk(y|ies)\b": "environment map",
    r"\bedge by edge\b|\bpath edges?\b": "wavefront; path depth",
    r"\billumination of old\b": "classic local shading",
    r"\bask what stands before\b": "shadow rays",
    r"\bevery ray meets\b": "brute force",
    r"\bsums that do not stall\b": "compensated summation",
    r"\b(is|are) told (too )?(low|high|right)\b": "underestimated, overestimated, accurate",
    r"\bnoise that is told\b": "estimated error",
    r"\bbegins? anew\b": "start afresh",
}
#: The same for error messages, warnings, printed tables and help texts.
MESSAGE_WORDS = WORDS | {
    r"(?<!there )\b(is|are) no (?!longer\b|such\b)|\bhas not (\d|three)": "is not a …, does not have …",
    r"\bis there (and|without)\b": "exists, is given",
    r"\b(goes|go|going) on\b|\banew\b": "resume, continue, start afresh",
    r"\bbeside\b": "next to, compared with",
    r"\btells?\b|\btold\b|\bsays (of|what|that)\b": "show, report, estimate",
    r"\bpictures?\b": "image",
    r"\b(ms|bits|paths|million rays|times as long) an? (pixel|ray|second|frame|channel|work-item|mesh)\b": "per …",
    r"\bin turns\b": "in interleaved runs",
    r"\b(build|builds|building) (the|a) tree\b|\btree (builder|layout)\b|\b(is|are) (a|no) tree\b": "BVH",
    r"\bmeets? (first|all)\b": "intersect, hit",
    r"\bmakes no sense\b": "is invalid",
    r"\btake (another|the|one of)\b": "use",
    r"\bcut short\b": "truncated",
    r"\bpainted\b": "textured",
    r"\bballs?\b": "sphere",
    r"\b(as|like) no other\b|\bwhoever\b|\bso many\b|\bof no use to\b": "plain words",
}


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (line, text) of a document, or of a source file's docstrings and comments."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from enumerate(text.splitlines(), 1)
    elif path.suffix == ".cl":
        yield from ((number, line.partition("//")[2]) for number, line in enumerate(text.splitlines(), 1))
    else:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                yield token.start[0], token.string
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
                yield getattr(node, "lineno", 1), ast.get_docstring(node) or ""


def messages(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (line, text) of strings of three words or more, … in place of values, and of the help of click commands."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    statements = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    parts = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        if isinstance(node, ast.FunctionDef) and any("command" in ast.unparse(each) for each in node.decorator_list):
            yield node.lineno, ast.get_docstring(node) or ""
        elif isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in statements | parts:
            values = node.values if isinstance(node, ast.JoinedStr) else [node]
            text = "".join(str(each.value) if isinstance(each, ast.Constant) else "…" for each in values)
            if len(text.split()) >= 3:
                yield node.lineno, text


def found(text: str, words: Mapping[str, str] = WORDS) -> list[str]:
    """Return what to write in place of the words in a text."""
    flat = " ".join(text.split())
    return [better for pattern, better in words.items() if re.search(pattern, flat, re.IGNORECASE)]


def test_prose_uses_the_words_of_the_field() -> None:
    paths = [
        *HOUSE.glob("*.md"),
        *(HOUSE / "docs").rglob("*.md"),
        *(HOUSE / "scenes").glob("*.md"),
        *(HOUSE / "clrt").rglob("*.py"),
        *(HOUSE / "kernels").rglob("*.cl"),
    ]
    wrong = [
        f"{path.relative_to(HOUSE)}:{line}: write {better}"
        for path in sorted(paths)
        for line, text in prose(path)
        for better in found(text)
    ]
    assert not wrong, "\n".join(wrong)


def test_messages_use_the_words_of_the_field() -> None:
    wrong = [
        f"{path.relative_to(HOUSE)}:{line}: write {better}"
        for path in sorted((HOUSE / "clrt").rglob("*.py"))
        for line, text in messages(path)
        for better in found(text, MESSAGE_WORDS)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "sentence",
    [
        "16 samples a pixel",
        "rays a second",
        "a lamp that shines on both sides",
        "the round-about camera",
        "lanes follow paths edge by edge",
        "the local illumination of old",
        "the noise that is told",
        "it begins anew",
    ],
)
def test_old_sentences_are_found(sentence: str) -> None:
    assert found(sentence)


@pytest.mark.parametrize(
    "sentence",
    [
        '"x" is no path of a scene; name a file',
        "the picture is black",
        "leave out --resume to begin anew",
        "others do again what it was at, as it is told",
        "take another --device",
        "--resume goes on from a.ck",
        "the same rays through clrt and other libraries, in turns",
        "a.ck: is there and is no checkpoint",
        "Tree builder; default: sah",
        "Pictures beside it: layers of an .exr",
        "building the tree",
    ],
)
def test_old_messages_are_found(sentence: str) -> None:
    assert found(sentence, MESSAGE_WORDS)


@pytest.mark.parametrize(
    "source",
    [
        'raise SceneError(f"{path}: the file is cut short")',
        'log.warning("%s goes on from there", path)',
        'problems = [f"{x}: {y} is no texture"] if x else []',
        'option("--tree", help="Which tree builder to use.")',
        '@click.command()\ndef command():\n    """Begin a render, or go on."""',
    ],
)
def test_messages_are_found_in_sources(tmp_path: Path, source: str) -> None:
    (tmp_path / "a.py").write_text(source)
    assert [better for _, text in messages(tmp_path / "a.py") for better in found(text, MESSAGE_WORDS)]
