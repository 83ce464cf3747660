"""Draw docs/images/architecture.svg, the packages in their import order and a sample's way through them.

    python docs/make_architecture.py

The order is that of ROOMS in tests/test_package_structure.py.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.test_package_structure import KNOW_OPENCL, ROOMS  # noqa: E402

FILE = ROOT / "docs" / "images" / "architecture.svg"
#: What packages do, row by row from the top; each row from x to x, its boxes as wide as the weights say.
ROWS: tuple[tuple[tuple[str, str, int, int], ...], ...] = (
    (("clrt", "public names", 350, 650), ("cli", "the commands", 670, 850), ("__main__", "", 862, 960)),
    (("window", "clrt view", 350, 540), ("farm", "several machines", 560, 760), ("views", "of many cameras", 780, 960)),
    (
        ("baking", "light maps", 350, 440),
        ("bench", "speed and accuracy", 452, 578),
        ("debug", "paths of a pixel", 590, 696),
        ("api", "load, render, animate", 708, 848),
        ("live", "edited scenes", 860, 960),
    ),
    (("check", "known answers of a device", 350, 650), ("output", "images, AOVs, reports, denoiser", 670, 960)),
    (("rendering", "compiles the scene, plans launches, sums samples, estimates the error, checkpoints", 350, 960),),
    (("queries", "rays from Python", 710, 838), ("trimesh", "its interface", 850, 960)),
    (("device", "drivers, programs, launches", 350, 650), ("accel", "builds and packs BVHs", 670, 960)),
    (("scene", "dataclasses, validation", 350, 650), ("formats", "TOML, glTF, USD, OBJ, Mitsuba, pbrt", 670, 960)),
)
#: Folders of kernels/ in the order in which a path segment passes them, from the bottom.
KERNELS = (
    ("film", "sum of the sample"),
    ("bsdf", "next direction, throughput"),
    ("light", "shadow ray to a light"),
    ("surface", "position, normal, material"),
    ("traverse", "first hit in the BVH"),
    ("sampler, camera", "ray through the pixel"),
)
TOP, STEP, HEIGHT = 56, 70, 46
STYLE = """
text { font: 12px system-ui, "Segoe UI", Helvetica, Arial, sans-serif; fill: #24292f; text-anchor: middle }
.name { font-weight: 600; font-size: 14px }
.title { font-weight: 600; font-size: 13px; text-anchor: start }
.note { text-anchor: start }
.page { fill: #ffffff }
.box { fill: #f3f5f8; stroke: #8c959f }
.opencl, .kernel { fill: #fff1df; stroke: #bc6c00 }
.panel { fill: none; stroke: #bc6c00; stroke-dasharray: 5 4 }
.way { fill: none; stroke: #0969da; stroke-width: 2.5; stroke-linejoin: round; marker-end: url(#tip) }
.aside { stroke-dasharray: 4 4; stroke-width: 2 }
.tip, .stop { fill: #0969da }
.number { fill: #ffffff; font-weight: 600 }
"""
DARK = (
    ("#24292f", "#e6edf3"),
    ("#ffffff", "#0d1117"),
    ("#f3f5f8", "#1c232c"),
    ("#8c959f", "#768390"),
    ("#fff1df", "#33240f"),
    ("#bc6c00", "#d9954a"),
    ("#0969da", "#58a6ff"),
)


def dark(style: str) -> str:
    """Return the style for dark pages."""
    for light, instead in DARK:
        style = style.replace(light, instead)
    return style


def row(name: str) -> int:
    """Return the y of the middle of a package's row."""
    return next(
        TOP + STEP * number + HEIGHT // 2 for number, boxes in enumerate(ROWS) for each, *_ in boxes if each == name
    )


def box(kind: str, name: str, text: str, x: int, y: int, end: int) -> str:
    """Return a box with a name, and a text below it if there is one."""
    middle = (x + end) // 2
    lines = [
        f'<rect class="{kind}" x="{x}" y="{y}" width="{end - x}" height="{HEIGHT}" rx="6"/>',
        f'<text class="name" x="{middle}" y="{y + (20 if text else 28)}">{escape(name)}</text>',
    ]
    return "\n".join([*lines, f'<text x="{middle}" y="{y + 37}">{escape(text)}</text>'] if text else lines)


def way(*points: tuple[int, int], kind: str = "way") -> str:
    """Return a line through points, with an arrow at its end."""
    return f'<polyline class="{kind}" points="{" ".join(f"{x},{y}" for x, y in points)}"/>'


def stop(number: int, x: int, y: int) -> str:
    """Return a numbered mark on the way."""
    return f'<circle class="stop" cx="{x}" cy="{y}" r="10"/><text class="number" x="{x}" y="{y + 4}">{number}</text>'


def drawn(rooms: Sequence[str] = ROOMS) -> str:
    """Return the figure; raises ValueError unless its boxes, from the bottom and from the left, are the rooms."""
    placed = [name for boxes in reversed(ROWS) for name, *_ in boxes]
    small = [name for name in rooms if name not in placed]  # modules that packages share
    if [*small, *placed] != list(rooms):
        raise ValueError(f"ROWS has the order {placed}; the packages are {rooms}: change ROWS")
    bottom = TOP + STEP * len(ROWS)
    parts = [
        box("opencl" if name in KNOW_OPENCL else "box", name, text, x, TOP + STEP * number, end)
        for number, boxes in enumerate(ROWS)
        for name, text, x, end in boxes
    ]
    half = (len(small) + 1) // 2
    parts.append(f'<rect class="box" x="350" y="{bottom}" width="610" height="{HEIGHT}" rx="6"/>')
    parts += [
        f'<text x="655" y="{bottom + y}">{" · ".join(names)}</text>'
        for y, names in ((20, small[:half]), (37, small[half:]))
    ]
    first = row("output") - HEIGHT // 2
    levels = [first + STEP * number for number in range(len(KERNELS))]
    parts.append(
        f'<rect class="panel" x="22" y="{first - 34}" width="270" height="{bottom + HEIGHT - first + 48}" rx="8"/>'
    )
    parts += [box("kernel", name, text, 70, y, 270) for (name, text), y in zip(KERNELS, levels, strict=True)]
    film, bsdf, *_, traverse, camera = (y + HEIGHT // 2 for y in levels)
    parts += [way((170, below), (170, above + HEIGHT)) for above, below in zip(levels, levels[1:], strict=False)]
    scene, accel, rendering = row("scene"), row("accel"), row("rendering")
    parts += [
        way(
            (760, row("cli") + HEIGHT // 2),
            (760, row("cli") + HEIGHT // 2 + 12),
            (978, row("cli") + HEIGHT // 2 + 12),
            (978, scene),
            (960, scene),
        ),
        way((670, scene), (650, scene)),
        way(
            (600, scene - HEIGHT // 2),
            (600, scene - HEIGHT // 2 - 12),
            (660, scene - HEIGHT // 2 - 12),
            (660, rendering + HEIGHT // 2),
        ),
        way((500, rendering + HEIGHT // 2), (500, row("device") - HEIGHT // 2)),
        way((690, rendering + HEIGHT // 2), (690, accel - HEIGHT // 2), kind="way aside"),
        way((350, row("device")), (330, row("device")), (330, camera), (270, camera)),
        way((70, bsdf), (46, bsdf), (46, traverse), (70, traverse)),
        way((270, film), (310, film), (310, rendering), (350, rendering)),
        way((900, rendering - HEIGHT // 2), (900, row("output") + HEIGHT // 2)),
    ]
    marks = (
        (685, row("cli")),
        (945, scene),
        (365, scene),
        (945, rendering),
        (365, row("device")),
        (255, camera),
        (255, film),
        (945, row("output")),
    )
    parts += [stop(number, *at) for number, at in enumerate(marks, 1)]
    parts += [
        '<text class="title" x="350" y="36">clrt/ (Python)</text>',
        f'<text class="title" x="34" y="{first - 12}">kernels/ (OpenCL C)</text>',
        f'<text transform="translate(40 {(bsdf + traverse) // 2}) rotate(-90)">next bounce</text>',
        '<text class="note" x="22" y="76">A package imports only from</text>',
        '<text class="note" x="22" y="94">those below it, and from those</text>',
        '<text class="note" x="22" y="112">to its left in its row.</text>',
        '<rect class="opencl" x="22" y="130" width="30" height="16" rx="3"/>',
        '<text class="note" x="62" y="143">may use OpenCL</text>',
        way((22, 166), (52, 166)),
        '<text class="note" x="62" y="170">the way of a sample</text>',
    ]
    height = bottom + HEIGHT + 30
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1000 {height}" width="1000" height="{height}" '
            f'role="img" aria-label="Packages of clrt in their import order, and a sample\'s way through them">',
            f"<style>{STYLE}@media (prefers-color-scheme: dark) {{{dark(STYLE)}}}\n</style>",
            '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="9" markerHeight="9" '
            'markerUnits="userSpaceOnUse" orient="auto"><path class="tip" d="M0 0 8 4 0 8z"/></marker></defs>',
            f'<rect class="page" width="1000" height="{height}" rx="10"/>',
            *parts,
            "</svg>",
            "",
        ]
    )


if __name__ == "__main__":
    FILE.write_text(drawn(), encoding="utf-8")
