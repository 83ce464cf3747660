"""Text of model files: encodings, line breaks and continued lines."""

from __future__ import annotations

import codecs
import re

from ..errors import SceneError

#: Control characters other than line feeds become spaces.
BLANKS = bytes(ord("\n") if byte == ord("\n") else max(byte, ord(" ")) for byte in range(256))
CONTINUED = re.compile(rb"^([^#\n]*)\\ *\n", re.MULTILINE)


def plain_text(content: bytes, first: bool = True) -> bytes:
    """Return lines that end with line feeds and contain no tabs, with continued lines joined.

    first: whether it is the file's beginning, which may have a byte order mark. Raises SceneError for UTF-16.
    """
    if first:
        if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            raise SceneError("is encoded as UTF-16; save it as UTF-8")
        content = content.removeprefix(codecs.BOM_UTF8)
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\t" in content:
        content = content.translate(BLANKS)
    if b"\\" in content:
        content = CONTINUED.sub(rb"\1 ", content)
    return content
