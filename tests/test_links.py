"""Links between documents are valid, comments name files that exist, and the index lists every document."""

from __future__ import annotations

import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
DOCUMENTS = sorted([*HOUSE.glob("*.md"), *(HOUSE / "docs").rglob("*.md"), *(HOUSE / "scenes").glob("*.md")])


def anchors(document: Path) -> set[str]:
    """Return the anchors of a document's headings, as GitHub generates them."""
    text = re.sub(r"```.*?```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
    return {
        re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    }


def test_links_lead_to_files_and_headings() -> None:
    broken = []
    for document in DOCUMENTS:
        for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text(encoding="utf-8")):
            if "://" in target:
                continue
            name, _, anchor = target.partition("#")
            file = (document.parent / name).resolve() if name else document
            if not file.exists() or (anchor and anchor not in anchors(file)):
                broken.append(f"{document.relative_to(HOUSE)}: {target}")
    assert not broken


def comments(file: Path) -> Iterator[str]:
    """Yield the comments of a file, with its strings, docstrings included, if it is in Python."""
    if file.suffix == ".cl":
        yield from re.findall("//.*", file.read_text(encoding="utf-8"))
    else:
        with file.open("rb") as source:
            kinds = tokenize.COMMENT, tokenize.STRING
            yield from (token.string for token in tokenize.tokenize(source.readline) if token.type in kinds)


def test_comments_name_files_that_exist() -> None:
    names = {file.name for folder in ("clrt", "kernels", "tests") for file in (HOUSE / folder).rglob("*.*")}
    gone = [
        f"{file.relative_to(HOUSE)}: {name}"
        for folder in ("clrt", "kernels")
        for file in sorted((HOUSE / folder).rglob("*.*"))
        if file.suffix in (".py", ".cl")
        for comment in comments(file)
        for name in re.findall(r"[a-z_0-9]+\.(?:py|cl)\b", comment)
        if name not in names
    ]
    assert not gone


@pytest.mark.parametrize("folder", ["docs", "docs/measurements"])
def test_the_index_lists_every_document(folder: str) -> None:
    index = (HOUSE / folder / "README.md").read_text(encoding="utf-8")
    assert [
        path.name
        for path in (HOUSE / folder).glob("*.md")
        if path.name != "README.md" and f"({path.name})" not in index
    ] == []
