"""Data that a glTF file refers to: embedded in its URIs, or in files next to it."""

from __future__ import annotations

import base64
import binascii
import logging
import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, unquote_to_bytes

from ...errors import SceneError
from ..referenced_files import note_read

log = logging.getLogger(__name__)
_DATA = re.compile(r"data:([^,]*),", re.IGNORECASE)
_SPACE = re.compile(rb"\s+")


def read_uri(model: Path, uri: str, user: str) -> bytes:
    """Return the content of a URI in the file `model`: data embedded in it, or a file relative to the model.

    File names may be percent-encoded or not, and have backslashes. Where there is no such file, one that differs in
    case alone is read, with a warning. Raises SceneError naming the `user`.
    """
    if head := _DATA.match(uri):
        return _embedded(head[1], uri[head.end() :], user)
    name = unquote(uri)
    try:
        for each in (name, uri, name.replace("\\", "/")):
            if (file := model.parent / each).is_file():
                return note_read(file).read_bytes()
        if near := _in_another_case(model.parent, name.replace("\\", "/")):
            log.warning('%s: %s: there is no file "%s"; read "%s" instead', model, user, name, near.name)
            return note_read(near).read_bytes()
    except (OSError, ValueError):
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


def _in_another_case(folder: Path, name: str) -> Path | None:
    """Return the only file of this name in any case; None if there is none, or several."""
    found = [folder]
    for part in PurePosixPath(name).parts:
        if part == "..":
            found = [each.parent for each in found]
        else:
            found = [
                each
                for above in found
                if above.is_dir()
                for each in above.iterdir()
                if each.name.lower() == part.lower()
            ]
    files = [each for each in found if each.is_file()]
    return files[0] if len(files) == 1 else None
