"""Names of light groups as a type of fields."""

from __future__ import annotations

from typing import Annotated

from .limits import Characters

#: Layer names in files are built from a group's name, with dots between their parts.
GroupName = Annotated[str, Characters(r"[A-Za-z0-9_-]{0,100}", "up to 100 letters, digits, - and _")]
