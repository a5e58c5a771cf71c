"""What all result files share: pieces that are checked when read, and what a file is of."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..modes.mode import Label

Positive = Annotated[float, Field(gt=0)]
Wave = Annotated[int, Field(ge=0, le=200)]


class Part(BaseModel):
    """A piece of a result file; numbers are finite, SI or as named."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True)


class State(Part):
    """What a study asked for, several values where it has several."""

    pressure_kPa: float | list[float]
    load_N: float | list[float]
    rim: str  # how it is held


class Provenance(Part):
    """What a result file is of."""

    tyrecal: str
    solver: str
    solver_version: str
    name: str
    size: str
    tyre_sha256: str
    overrides: dict[str, float]
    state: State
    mesh: str
    targets: str | None = None
    measured_sha256: str | None = None


class Result(Part):
    """A result file, not only a piece of one; older ones do not say what they are of."""

    format: Literal[1]
    provenance: Provenance | None = None


class Named(Part):
    """A mode's label and frequency."""

    c: Wave
    m: Wave
    kind: str | None
    frequency_Hz: Positive

    @property
    def label(self) -> Label:
        """[c, m]"""
        return Label(self.c, self.m, self.kind)
