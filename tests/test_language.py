"""Documents, docstrings and comments use the field's words: a list of those that were used in their place."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
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


def found(text: str) -> list[str]:
    """Return what to write in place of the words in a text."""
    flat = " ".join(text.split())
    return [better for pattern, better in WORDS.items() if re.search(pattern, flat, re.IGNORECASE)]


def test_prose_uses_the_words_of_the_field() -> None:
    paths = [*HOUSE.glob("*.md"), *(HOUSE / "docs").glob("*.md"), *(HOUSE / "scenes").glob("*.md"),
             *(HOUSE / "clrt").rglob("*.py"), *(HOUSE / "kernels").rglob("*.cl")]
    wrong = [f"{path.relative_to(HOUSE)}:{line}: write {better}" for path in sorted(paths)
             for line, text in prose(path) for better in found(text)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("sentence", [
    "16 samples a pixel", "rays a second", "a lamp that shines on both sides", "the round-about camera",
    "lanes follow paths edge by edge", "the local illumination of old", "the noise that is told", "it begins anew"])
def test_old_sentences_are_found(sentence: str) -> None:
    assert found(sentence)
