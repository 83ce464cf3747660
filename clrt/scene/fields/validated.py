"""Base classes of the scene's dataclasses, which are valid once they are made."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, Self

from ...errors import ObjectError
from .field_types import (
    array_fields,
    field_problems,
    field_types,
    fields_of,
    missing_fields,
    required_fields,
    show,
    unknown,
    usable,
)
from .tuples import tuples_for_lists


class KnownFields:
    """Base class of dataclasses that raise ObjectError for unknown keywords and attributes, with the closest one, for
    fields that are missing, and for more fields without their names than have places."""

    def __new__(cls, *values: object, **named: object) -> Self:
        _check_known(cls, named)
        places = [field.name for field in fields_of(cls) if not field.kw_only]
        if len(values) > len(places):
            example = next((name for name in field_types(cls) if name not in places), "name")
            fault = f": {show(values[len(places)])} has no name; write {example}=..., or another field's name"
            raise ObjectError(cls.__name__, [fault])
        if faults := missing_fields(cls, {*places[: len(values)], *named}):
            raise ObjectError(cls.__name__, faults)
        return super().__new__(cls)

    def __setattr__(self, name: str, value: object) -> None:
        if name not in field_types(type(self)):
            _check_known(type(self), (name,))
        super().__setattr__(name, value)

    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]:
        """Return what copying and unpickling give `__new__`: the fields that it asks for."""
        return (), {name: getattr(self, name) for name in required_fields(type(self))}


class Validated(KnownFields):
    """Base class of dataclasses whose fields are validated when an object is made, copied or unpickled.

    Raises ObjectError, which names the class, the field, the value and the remedy. Lists and arrays of numbers become
    tuples. Fields that are arrays may be lists, and keep read-only views: they share the memory of the array that was
    given, if it has the field's type, which stays writable for its owner, who must not change it any more.
    """

    def __post_init__(self) -> None:
        arrays = array_fields(type(self))
        for name in arrays:
            object.__setattr__(self, name, _stored(getattr(self, name), arrays[name]))
        tuples_for_lists(self, without=arrays)
        if faults := self.faults():
            raise ObjectError(self.title, faults)
        for name, value in usable(type(self), self._given()).items():
            object.__setattr__(self, name, value)

    def check(self) -> None:
        """Raise ObjectError if a field is invalid that was assigned since the last time, for which see `Editable`."""

    @property
    def title(self) -> str:
        """What its errors call it, if its place in a scene is not known."""
        return type(self).__name__

    def faults(self) -> list[str]:
        """Return what is wrong with its fields: ".FIELD: value is wrong; remedy"."""
        return field_problems(type(self), self._given(), "") or [f".{conflict}" for conflict in self.conflicts()]

    def _given(self) -> dict[str, Any]:
        """Return the fields that are not the defaults, which are valid."""
        values = vars(self)
        return {
            field.name: values[field.name] for field in fields_of(type(self)) if values[field.name] is not field.default
        }

    def conflicts(self) -> list[str]:
        """Return what is wrong with fields whose types are right: "FIELD: fault; remedy"."""
        return []

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a copied or unpickled object, whose arrays are writable."""
        vars(self).update(state)
        vars(self).pop("_valid", None)
        self.__post_init__()


class Editable(Validated):
    """Base class of dataclasses whose fields may be assigned. What is assigned is validated when the object becomes
    part of a scene, and before a scene is rendered."""

    _valid = False

    def __post_init__(self) -> None:
        super().__post_init__()
        vars(self)["_valid"] = True

    def __setattr__(self, name: str, value: object) -> None:
        arrays = array_fields(type(self))
        super().__setattr__(name, _stored(value, arrays[name]) if name in arrays else value)
        vars(self).pop("_valid", None)

    def check(self) -> None:
        if not self._valid:
            if faults := self.faults():
                raise ObjectError(self.title, faults)
            vars(self)["_valid"] = True


def _check_known(kind: type, names: Iterable[str]) -> None:
    known = field_types(kind)
    if wrong := [name for name in names if name not in known]:
        raise ObjectError(kind.__name__, [f': the field "{name}" {unknown(name, known)}' for name in wrong])


def _stored(value: Any, kind: type) -> Any:
    """Return a field that is an array as it is stored; None and others as they are, without loading numpy."""
    return _array_converter()(value, kind) if isinstance(value, list | tuple) or hasattr(value, "dtype") else value


@cache
def _array_converter() -> Callable[[Any, Any], Any]:
    from .number_arrays import stored_array  # with numpy, not for render settings, which the command line reads

    return stored_array
