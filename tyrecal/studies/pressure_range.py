"""Pressures of a sweep, by default round the case's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from ..tyre.case import LoadedCase

# of the case's pressure, to 10 kPa: 100 and 320 of a car's 240 kPa, 350 and 1130 of a truck's 850
DEFAULT_ENDS = (5 / 12, 4 / 3)
WITHOUT_PRESSURE = (100.0, 320.0)  # kPa, of a case that states 0


@dataclass(frozen=True)
class PressureRange:
    """Ends in kPa, None: the default for the case's own pressure; number of pressures, 2 or more.

    >>> PressureRange(low=200, high=None, steps=3).on(case)
    [200.0, 260.0, 320.0]
    """

    low: float | None
    high: float | None
    steps: int

    def on(self, case: LoadedCase) -> list[float]:
        """Equidistant pressures in kPa, both ends among them. Raises InputError."""
        from .sweep import SweptRange

        own = case.case.pressure_kPa
        ends = [10.0 * round(own * share / 10) for share in DEFAULT_ENDS]
        usual_low, usual_high = ends if own else WITHOUT_PRESSURE
        low = usual_low if self.low is None else self.low
        high = usual_high if self.high is None else self.high
        if low >= high:
            raise InputError(
                f"--from-kPa {low:g} must be less than --to-kPa {high:g} (default:"
                f" {usual_low:g} to {usual_high:g} for {own:g} kPa)"
            )
        return SweptRange("pressure_kPa", low, high, self.steps).values()
