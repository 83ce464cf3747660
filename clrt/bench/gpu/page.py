"""The results as one HTML page, which needs no other files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from importlib.util import find_spec
from typing import Any

from .columns import COLUMNS, Column, rows_of
from .parts import PARTS
from .summary import summary_line

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; font-size: 13px; margin: 0.8rem 0; }
th, td { padding: 0.15rem 0.6rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
td.note { text-align: left; white-space: normal; color: #a33; }
td.text { text-align: left; white-space: normal; }
svg { max-width: 100%; height: auto; }
nav a { margin-right: 1rem; }
"""


def page_of(results: Mapping[str, Any]) -> str:
    """Return the page: the device, a line about each part, then each part's plot and table."""
    device, system, identity = (results[key] for key in ("device", "system", "identity"))
    name, parts = escape(device["name"]), {name: each for name, each in results["parts"].items() if name in PARTS}
    other = results["other"]
    about = [
        f"{device['platform']}, {device['platform_version']}, driver {device['driver']}; "
        f"{device['compute_units']} compute units, {device['global_bytes'] / 2**30:.1f} GiB",
        f"{system['begun']}, {system['system']}, Python {system['python']}; clrt {identity['clrt']}, "
        f"kernels {identity['kernels'][:12]}{', quick: figures of speed mean nothing' if identity['quick'] else ''}",
        *(f"known fault of this driver: {fault}" for fault in device.get("known_faults", ())),
        f"compared with {other['name']} ({other['platform']})" if other else "no other device to compare with",
    ]
    return "\n".join(
        [
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{name}</title><style>{STYLE}</style>',
            f"<h1>{name}</h1>",
            *(f"<p>{escape(line)}</p>" for line in about),
            "<ul>",
            *(f'<li><a href="#{key}">{escape(summary_line(key, part))}</a></li>' for key, part in parts.items()),
            "</ul>",
            *(line for key, part in parts.items() for line in _part(key, part)),
            "</html>",
        ]
    )


def _part(name: str, part: Mapping[str, Any]) -> Iterator[str]:
    yield f'<h2 id="{name}">{escape(PARTS[name].title)}</h2>'
    if find_spec("matplotlib") is not None:
        from .plots import PLOTS, svg_of

        if name in PLOTS and (svg := svg_of(PLOTS[name], part)):
            yield svg
    if name in COLUMNS:
        yield from _table(COLUMNS[name], rows_of(part))
    else:
        yield from (_facts(item, row) for item, row in part["rows"].items())


def _table(columns: list[Column], rows: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    yield "<table><tr>" + "".join(f"<th>{escape(title)}</th>" for title in ["", *(each.title for each in columns)])
    yield "</tr>"
    for item, row in rows.items():
        note = row.get("error") or row.get("skipped")
        cells = (
            f'<td class="note" colspan="{len(columns)}">{escape(str(note))}</td>'
            if note
            else "".join(f"<td>{escape(each.text(row))}</td>" for each in columns)
        )
        yield f"<tr><td>{escape(item)}</td>{cells}</tr>"
    yield "</table>"


def _facts(item: str, row: Mapping[str, Any]) -> str:
    """Return a table of one item, a line per figure."""
    texts = {key: f"{value:.6g}" if isinstance(value, float) else str(value) for key, value in row.items()}
    lines = (f'<tr><td>{escape(key)}</td><td class="text">{escape(text)}</td></tr>' for key, text in texts.items())
    return f"<h3>{escape(item)}</h3><table>{''.join(lines)}</table>"
