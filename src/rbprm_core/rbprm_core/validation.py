"""Validation of values from outside: each error names the field and its value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput

FILE_NAME = r"^[A-Za-z0-9_.-]+$"  # names that become part of a file's name
MAX_COORDINATE = 1e5
"""Metres; products of larger coordinates are not exact to a millimetre."""
MAX_FRICTION = 10.0  # rubber on rock has 1 or 2; statics lose their digits from 1e5 on
MAX_GRAVITY = 100.0  # m/s^2, four times Jupiter's
MAX_FORCE = 1e6  # newtons; written for an infinite b0 too, since JSON has no infinity
MAX_COUNT = 10**9  # upper bound of every option that is a number of things

Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]
Length = Annotated[float, Field(ge=0, le=MAX_COORDINATE)]
PositiveLength = Annotated[float, Field(gt=0, le=MAX_COORDINATE)]
Step = Annotated[float, Field(ge=1e-4, le=MAX_COORDINATE)]
"""Length in metres of the pieces of a path; much shorter ones would take all time and memory."""

Acceleration = Annotated[float, Field(ge=-MAX_GRAVITY, le=MAX_GRAVITY)]
Friction = Annotated[float, Field(ge=0, le=MAX_FRICTION)]
Robustness = Annotated[float, Field(ge=0, le=MAX_FORCE)]
"""Minimum raw b0, newtons."""
Model = TypeVar("Model", bound=BaseModel)


class Record(BaseModel):
    """A frozen record read from a file; unknown keys are errors, since they are mostly typos."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def parse_record(kind: type[Model], data: object, prefix: str = "") -> Model:
    """The record of some data.

    Args:
        kind: class of the record.
        data: nested tables and lists, as read from a file.
        prefix: dotted name of the data in errors; "" for none.

    Raises:
        InvalidInput: names the first field that pydantic refuses.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        path, value = _place(data, first["loc"]), first["input"]
        if first["type"].startswith("union_tag"):
            path.append(first["ctx"]["discriminator"].strip("'"))
            value = first["ctx"].get("tag", value)
        field = ".".join(part for part in (prefix, *path) if part) or kind.__name__
        raise InvalidInput(field, value, first["msg"]) from error


@contextmanager
def naming_fields(names: Mapping[str, str], prefix: str = "") -> Iterator[None]:
    """Rename the field of an `InvalidInput` that is raised inside, into the caller's words.

    Args:
        names: caller's name by name of a field; what follows the name stays, so that
            {"start": "start.pose"} makes `start.pose.position` of `start.position`. Of several
            names that fit, the longest counts.
        prefix: put before fields that no name fits, such as "request.".

    Raises:
        InvalidInput: the one raised inside, with its field renamed.
    """
    try:
        yield
    except InvalidInput as error:
        field = renamed_field(error.field, names, prefix)
        raise InvalidInput(field, error.value, error.reason) from error


def renamed_field(field: str, names: Mapping[str, str], prefix: str = "") -> str:
    """A dotted name of a field in other words, see `naming_fields`.

    Args:
        field: dotted name.
        names: other name by name.
        prefix: put before a field that no name fits.
    """
    parts = field.split(".")
    for count in range(len(parts), 0, -1):
        known = names.get(".".join(parts[:count]))
        if known is not None:
            return ".".join([known, *parts[count:]])
    return prefix + field


def _place(data: object, location: tuple[int | str, ...]) -> list[str]:
    """Keys that lead to a failure: those of pydantic without the tags of unions."""
    path, place = [], data
    for i, part in enumerate(location):
        if isinstance(place, dict):
            if part not in place and i + 1 < len(location):
                continue
            place = place.get(part)
        elif isinstance(place, (list, tuple)) and isinstance(part, int) and part < len(place):
            place = place[part]
        else:
            place = None
        path.append(str(part))
    return path


def finite_array(field: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """The array of finite floats of a value.

    Args:
        field: name of the value in errors.
        value: numbers, nested as the shape demands.
        shape: wanted shape; -1 stands for any length.

    Raises:
        InvalidInput: other shape, not numbers, NaN or infinity.
    """
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(field, value, "must be an array of numbers") from error
    fits = array.ndim == len(shape) and all(
        want in (-1, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = " x ".join("n" if n < 0 else str(n) for n in shape)
        raise InvalidInput(field, value, f"must have shape {wanted}, has {array.shape}")
    if not np.isfinite(array).all():
        raise InvalidInput(field, value, "must be finite")
    return array


def coordinates(field: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """The array of finite coordinates of a value, metres.

    Args:
        field: name of the value in errors.
        value: numbers, nested as the shape demands.
        shape: wanted shape; -1 stands for any length.

    Raises:
        InvalidInput: as `finite_array`, or farther from the origin than geometry can be exact.
    """
    array = finite_array(field, value, shape)
    if np.abs(array).max(initial=0.0) > MAX_COORDINATE:
        raise InvalidInput(field, value, f"must lie within {MAX_COORDINATE:g} m of the origin")
    return array


def finite_number(field: str, value: Any, low: float = -np.inf, high: float = np.inf) -> float:
    """The finite number of a value.

    Args:
        field: name of the value in errors.
        value: the value.
        low: least number allowed.
        high: largest number allowed.

    Raises:
        InvalidInput: not a number, not finite or out of bounds.
    """
    number = float(finite_array(field, value, ()))
    if not low <= number <= high:
        if high == np.inf:
            raise InvalidInput(field, value, f"must be at least {low:g}")
        raise InvalidInput(field, value, f"must lie in [{low:g}, {high:g}]")
    return number


def one_of(field: str, value: str, known: Sequence[str]) -> str:
    """The value, which is a known name.

    Args:
        field: name of the value in errors.
        value: the value.
        known: known names.

    Raises:
        InvalidInput: unknown; the text lists what is known.
    """
    if value not in known:
        raise InvalidInput(field, value, f"unknown; known are {', '.join(known) or 'none'}")
    return value
