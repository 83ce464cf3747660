"""File names that are not UTF-8: on Linux they may be any bytes, which Python represents as surrogates (PEP 383)."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: What public functions accept as a file name.
StrPath = str | os.PathLike[str]
#: Encoding error handlers. Characters missing from an encoding become escapes such as "\\u65e5"; bytes of file names
#: are kept for programs that read the names, or become escapes such as "\\xe8" for people.
AS_BYTES, SHOWN = "clrt.as_bytes", "clrt.shown"


def _as_bytes(error: UnicodeError) -> tuple[str | bytes, int]:
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.backslashreplace_errors(error)


def _shown(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    text = printable(error.object[error.start : error.end])
    return text.encode("ascii", "backslashreplace").decode(), error.end


codecs.register_error(AS_BYTES, _as_bytes)
codecs.register_error(SHOWN, _shown)


def printable(text: str) -> str:
    """Return the text with bytes that are not UTF-8 as escapes such as "\\xe8", valid in all of Unicode and JSON."""
    return text.encode("utf-8", AS_BYTES).decode("utf-8", "backslashreplace")


@contextmanager
def utf8_path(path: Path) -> Iterator[Path]:
    """Provide a UTF-8 path of the same existing file or folder, for libraries that only accept such paths."""
    if printable(str(path)) == str(path) or not hasattr(os, "O_PATH"):
        yield path
        return
    handle = os.open(path, os.O_PATH)
    try:
        yield Path(f"/proc/{os.getpid()}/fd/{handle}")
    finally:
        os.close(handle)
