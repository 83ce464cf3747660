"""Data that a glTF file refers to: embedded in its URIs, or in files next to it."""

from __future__ import annotations

import base64
import binascii
import re
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from ...errors import SceneError
from ..referenced_files import find_file, note_read

_DATA = re.compile(r"data:([^,]*),", re.IGNORECASE)
_SPACE = re.compile(rb"\s+")


def read_uri(model: Path, uri: str, user: str) -> bytes:
    """Return the content of a URI in the file `model`: data embedded in it, or a file relative to the model.

    File names may be percent-encoded or not; see `find_file` for what else they may be. Raises SceneError naming the
    `user`.
    """
    if head := _DATA.match(uri):
        return _embedded(head[1], uri[head.end() :], user)
    name = uri if (model.parent / uri).is_file() else unquote(uri)
    try:
        if file := find_file(model, [model.parent], name):
            return note_read(file).read_bytes()
    except OSError:
        pass
    raise SceneError(f'{user}: cannot read the file "{name[:200]}"; put it next to the model')


def _embedded(kind: str, data: str, user: str) -> bytes:
    """Decode a data URI (RFC 2397): base64, whose padding may be missing, or percent-encoded."""
    content = unquote_to_bytes(data)
    if not kind.lower().endswith(";base64"):
        return content
    content = _SPACE.sub(b"", content)
    try:
        return base64.b64decode(content + b"=" * (-len(content) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise SceneError(f"{user}: its data URI is not base64; export the file again") from None
