"""Words, strings and arrays of a pbrt file, with their lines."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ..text_numbers import numbers as numbers_of

#: Arrays of at least this many bytes are parsed in array operations.
LONG = 4096
#: Number of characters of a value in a message.
SHOWN = 60
_BLANK = re.compile(rb"(?:[\s\0]|#[^\n]*(?:\n|\Z))*")
_TOKEN = re.compile(rb'"((?:[^"\\\n]|\\.)*)"|([\[\]])|([^\s"\[\]#\0]+)', re.DOTALL)
_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}
Doubles = NDArray[np.float64]
Values = Doubles | list[str] | list[bool]


class Token(NamedTuple):
    """A word, a quoted string or a bracket."""

    text: str
    is_string: bool
    start: int


class Tokens:
    """Tokens of a file. prefix: of places, such as "geometry.pbrt "."""

    def __init__(self, content: bytes, prefix: str) -> None:
        self._content = content
        self._prefix = prefix
        self._place = 0
        self._next: Token | None = None
        self._counted, self._line = 0, 1

    def place(self, token: Token) -> str:
        """Return the place of a token that is not before the last one asked for."""
        self._line += self._content.count(b"\n", self._counted, token.start)
        self._counted = max(self._counted, token.start)
        return f"{self._prefix}line {self._line}"

    def peek(self) -> Token | None:
        """Return the next token; None at the end."""
        if self._next is None:
            self._next = self._read()
        return self._next

    def _read(self) -> Token | None:
        found = _BLANK.match(self._content, self._place)
        self._place = found.end() if found else self._place
        if self._place >= len(self._content):
            return None
        match = _TOKEN.match(self._content, self._place)
        if match is None:
            token = Token("", False, self._place)
            shown = self._content[self._place : self._place + SHOWN].decode("utf-8", "backslashreplace")
            raise SceneError(f"{self.place(token)}: {shown.splitlines()[0]} is a string without an end; add one")
        quoted, bracket, word = match.groups()
        text = (quoted if quoted is not None else bracket or word).decode("utf-8", "backslashreplace")
        if quoted is not None and "\\" in text:
            text = _ESCAPE.sub(lambda found: _ESCAPED.get(found[1], found[1]), text)
        token = Token(text, quoted is not None, self._place)
        self._place = match.end()
        return token

    def take(self, wanted: str) -> Token:
        """Return the next token and move on. wanted: what it stands for, if the file ends."""
        token = self.peek()
        if token is None:
            raise SceneError(f"{self._prefix}ends where {wanted} should be; complete it")
        self._next = None
        return token

    def values(self, name: str) -> Values:
        """Return the values of a parameter, in brackets or one without."""
        token = self.take(f'a value of "{name}"')
        if token.text != "[" or token.is_string:
            return _parsed([token], f'{self.place(token)}: "{name}"')
        end = self._content.find(b"]", self._place)
        inside = self._content[self._place : end] if end >= 0 else b'"'
        if b'"' not in inside and b"#" not in inside and (found := _plain(inside)) is not None:
            self._place = end + 1
            return found
        tokens: list[Token] = []
        while (token := self.take(f'the ] of "{name}"')).text != "]" or token.is_string:
            tokens.append(token)
        return _parsed(tokens, f'{self.place(token)}: "{name}"')

    def numbers(self, count: int, name: str) -> list[float]:
        """Return `count` numbers, in brackets or without."""
        values: list[float] = []
        if not count:
            return values
        first = self.peek()
        if first is not None and first.text == "[" and not first.is_string:
            found = self.values(name)
            values = found.tolist() if isinstance(found, np.ndarray) else []
        else:
            tokens = [self.take(f"number {i + 1} of {count} of {name}") for i in range(count)]
            parsed = _parsed(tokens, f"{self.place(tokens[-1])}: {name}")
            values = parsed.tolist() if isinstance(parsed, np.ndarray) else []
        if len(values) != count:
            place = self.place(first) if first else self._prefix
            raise SceneError(f"{place}: {name} has {len(values)} numbers; write {count}")
        return values


def _plain(text: bytes) -> Doubles | None:
    """Return the numbers of a text; None if there are other words."""
    if len(text) >= LONG:
        found = numbers_of(text)
        values = found.values if not found.malformed else np.full(1, np.nan)
    else:
        try:
            values = np.array([float(word) for word in text.split()], np.float64)
        except ValueError:
            return None
    return values if np.isfinite(values).all() else None


def _parsed(tokens: list[Token], where: str) -> Values:
    """Return numbers, strings or booleans. Raises SceneError for a mixture of these and for other words."""
    texts = [token.text for token in tokens]
    if tokens and all(token.is_string for token in tokens):
        return texts
    if tokens and all(text in ("true", "false") for text in texts):
        return [text == "true" for text in texts]
    values = []
    for token in tokens:
        try:
            value = float("nan" if token.is_string else token.text)
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            raise SceneError(f"{where}: {token.text:.{SHOWN}} is not a number; write one")
        values.append(value)
    return np.array(values, np.float64)
