"""The container files refer to existing files and run as a non-root user; they are not built here."""

from __future__ import annotations

import configparser
import re
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
FILES = sorted((HOUSE / "containers").glob("*.Containerfile"))


def steps(path: Path) -> list[tuple[str, str]]:
    """Return instructions and their arguments, with continuation lines joined."""
    text = re.sub(r"\\\n", " ", path.read_text())
    return [
        (word, rest)
        for word, _, rest in (line.partition(" ") for line in text.splitlines() if line and not line.startswith("#"))
    ]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_container_file(path: Path) -> None:
    found = steps(path)
    assert {word for word, _ in found} <= {"FROM", "ENV", "RUN", "COPY", "USER", "WORKDIR", "ENTRYPOINT"}
    assert found[0][0] == "FROM" and re.fullmatch(r"[\w./-]+:[\w.-]+", found[0][1]), "an image with a tag"
    assert found[-3:] == [("USER", "1000:1000"), ("WORKDIR", "/work"), ("ENTRYPOINT", '["clrt"]')]
    for names in (rest.split()[:-1] for word, rest in found if word == "COPY"):
        assert all((HOUSE / name).exists() for name in names)
    assert f"-f containers/{path.name} " in path.read_text() and path.name in (HOUSE / "docs/devices.md").read_text()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_what_is_installed_is_copied(path: Path) -> None:
    """The image copies everything that setup.cfg and pyproject.toml name, and nothing else of the tree."""
    copied = {name for word, rest in steps(path) if word == "COPY" for name in rest.split()[:-1]}
    config = configparser.ConfigParser()
    config.read(HOUSE / "setup.cfg")
    needs = {
        "setup.cfg",
        "pyproject.toml",
        *(name for name in config["metadata"]["license_files"].split() if not name.startswith("clrt/")),
        config["metadata"]["long_description"].removeprefix("file:").strip(),
        *(line.partition("=")[2].strip() for line in config["options"]["package_dir"].strip().splitlines()),
        "clrt",
    }
    assert copied == needs


def test_there_is_one_for_a_cpu_and_one_for_a_vendor() -> None:
    assert {"pocl", "nvidia"} <= {path.stem for path in FILES}
