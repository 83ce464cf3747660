"""Writers of small USD files for the tests."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

HEAD = '#usda 1.0\n(\n    metersPerUnit = {meters}\n    upAxis = "{up}"\n)\n'
SQUARE = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
"""
ST = """
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
"""


def usda(folder: Path, content: str, meters: float = 1, up: str = "Y", name: str = "a.usda") -> Path:
    """Write a text file of prims, with braces on lines of their own, as the format requires."""
    path = folder / name
    path.write_text(HEAD.format(meters=meters, up=up) + content.replace("{", "{\n").replace("}", "\n}"))
    return path


def mesh(content: str = "", name: str = "square", base: str = SQUARE) -> str:
    """Return a square, with further content."""
    return f'def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])\n{{{base}{content}}}\n'


def material(inputs: str, nodes: str = "", name: str = "look") -> str:
    """Return a material whose surface has the inputs."""
    return f"""
def Material "{name}"
{{
    token outputs:surface.connect = </{name}/surface.outputs:surface>
    def Shader "surface"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    {nodes}
}}
"""


def texture(file: str, content: str = "", uv: str = "st", name: str = "image") -> str:
    """Return the nodes of a texture of the material "look"."""
    coordinates = f"float2 inputs:st.connect = </look/{name}_reader.outputs:result>"
    return f"""
    def Shader "{name}"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{file}@
        {"" if "inputs:st" in content else coordinates}
        {content}
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:a
    }}
    def Shader "{name}_reader"
    {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "{uv}"
        float2 outputs:result
    }}
"""


BOUND = "    rel material:binding = </look>\n"
TEXTURED = "color3f inputs:diffuseColor.connect = </look/image.outputs:rgb>"


def usdz(path: Path, files: Mapping[str, bytes], compression: int = zipfile.ZIP_STORED) -> Path:
    """Write an archive, with the content of each file on a boundary of 64 bytes as USD requires."""
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = compression
            start = archive.start_dir + 30 + len(name)
            padding = -start % 64
            entry.extra = (0x1986).to_bytes(2, "little") + (padding + 60).to_bytes(2, "little") + bytes(padding + 60)
            archive.writestr(entry, content)
    return path


def animated(content: str) -> str:
    """Return the text of a stage of time codes 12 to 36, at 48 per second, in frames of 12 per second."""
    codes = "startTimeCode = 12\n    endTimeCode = 36\n    timeCodesPerSecond = 48\n    framesPerSecond = 12\n"
    head = HEAD.format(meters=1, up="Y").replace("    upAxis", f"    {codes}    upAxis")
    return head + content.replace("{", "{\n").replace("}", "\n}")
