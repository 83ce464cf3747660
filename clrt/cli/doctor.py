"""`clrt doctor`: a report of everything needed to diagnose a device or driver problem."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from ..errors import UsageError

FORMS = (".txt", ".json", ".zip")


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the report there: .txt, .json, or .zip with both and the logs.",
)
@click.option("--force", is_flag=True, help="Replace a file that is read-only.")
def command(as_json: bool, output: Path | None, force: bool) -> None:
    """Report versions, drivers, devices, their checks, the cache and the last logs.

    The report does not contain home folders or the names of the user and the machine. It contains other paths, so read
    it before you publish it. Run `clrt devices --check` first: its results are part of the report.
    """
    if output is not None and output.suffix.lower() not in FORMS:
        raise UsageError(f"{output}: unknown report format; use {', '.join(FORMS[:-1])} or {FORMS[-1]}")
    from ..device.discovery.diagnosis import diagnosis
    from ..output.json_text import json_text

    if output is not None:
        from ..output.atomic_files import check_target, check_unprotected

        check_target(output)
        check_unprotected(output, force)
    found = diagnosis()
    found_json = json_text(found, indent=1)
    if output is not None:
        texts = {"report.txt": as_text(found), "report.json": found_json + "\n"}
        _write(output, texts | {f"last-{kind}.log": log for kind, log in found["logs"].items()})
        click.echo(str(output))
    else:
        click.echo(found_json if as_json else as_text(found), nl=as_json)


def as_text(found: dict[str, Any]) -> str:
    """Format the report as text: a heading for each part, followed by its entries."""
    return "".join(
        f"== {name}\n" + "".join(f"{line}\n" for line in _lines(value)) + "\n" for name, value in found.items()
    )


def _lines(value: Any, indent: str = "") -> Iterator[str]:
    if isinstance(value, dict):
        for name, item in value.items():
            if isinstance(item, dict | list) or "\n" in str(item):
                yield f"{indent}{name}:"
                yield from _lines(item, indent + "    ")
            else:
                yield f"{indent}{name}: {item}"
    elif isinstance(value, list):
        for item in value:
            first, *rest = [*_lines(item)] or [""]
            yield f"{indent}- {first}"
            yield from (f"{indent}  {line}" for line in rest)
    else:
        yield from (f"{indent}{line}" for line in str(value).splitlines())


def _write(path: Path, texts: dict[str, str]) -> None:
    from ..output.atomic_files import replacing

    with replacing(path) as temporary:
        if path.suffix.lower() == ".zip":
            with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as pack:
                for name, text in texts.items():
                    pack.writestr(name, text)
        else:
            temporary.write_text(texts[f"report{path.suffix.lower()}"], encoding="utf-8")
