"""The kinds of number and text that a case file holds, and the model that all its parts share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)
from pydantic_core import PydanticCustomError

LEAST, LARGEST = 1e-30, 1e15  # beyond, products of numbers leave what a computer holds


def _can_be_computed_with(value: float) -> float:
    if value and not LEAST <= abs(value) <= LARGEST:
        raise PydanticCustomError("size", f"must be 0, or from {LEAST:g} to {LARGEST:g} in size")
    return value


Number = Annotated[float, AfterValidator(_can_be_computed_with)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Frequency = Annotated[Positive, Field(ge=1e-3, le=1e5)]  # Hz
Degrees = Annotated[float, Field(ge=-180, le=180)]
# names end in decks, paths of keys and file names: one word of plain letters is safe in all
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_\-]*$", max_length=60)]
Text = Annotated[str, StringConstraints(pattern=r"^[^\x00-\x1f\x7f]*$", max_length=300)]

Disagreement = tuple[str, str]
"""A key of a part, and what would be right there."""

WRONG = object()
"""Stands in a part's values for one that is already reported."""


def number(values: Mapping[str, Any], key: str) -> float | None:
    """The number at ``key``; None where there is none, or a wrong one."""
    value = values.get(key)
    return value if isinstance(value, int | float) else None


def one_of(values: Mapping[str, Any], first: str, second: str) -> Iterator[Disagreement]:
    """What is wrong where not exactly one of two keys is given."""
    if values.get(first) is None and values.get(second) is None:
        yield first, f"must be given, or {second}"
    elif values.get(first) is not None and values.get(second) is not None:
        yield second, f"must be absent with {first}"


class Part(BaseModel):
    """A part of the case: known keys only, text is never a number, every number finite."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Disagreement]:
        """What is wrong between the keys of ``values``; those that are WRONG are not judged."""
        yield from ()

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for key, message in self.problems(self.__dict__):
            raise PydanticCustomError("disagree", "{message}", {"key": key, "message": message})
        return self
