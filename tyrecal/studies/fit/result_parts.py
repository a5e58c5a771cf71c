"""Parts of the result of a fit: variables, modes and other targets, states."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..result import Named, PositiveNumber, ResultPart, state_words


class FittedVariable(ResultPart):
    """A design variable."""

    initial: float  # value before the fit
    value: float  # fitted value
    lower: float  # lower bound
    upper: float  # upper bound
    # standard error by the scatter of the measurement; null: not determined
    standard_error: float | None
    # standard error by all that is uncertain; null: not known
    standard_error_total: float | None = None
    # whether the total is small enough for a linear estimate, with no bound near
    total_holds: bool = True
    # with a prior: share of the variance known before that the data took away
    explained_by_data: float | None = None
    # shares of the total variance by cause, 1 together
    variance_by_cause: dict[str, float] = Field(default={})
    at_bound: bool  # whether the value is at a bound
    unit: str = ""  # unit of the number that it sets

    def percent(self, error: float | None) -> str | None:
        """A standard error in per cent of the value: two digits, and never 1.9e+02."""
        if error is None or not self.value:
            return None
        percent = abs(100 * error / self.value)
        return f"{percent:.0f}" if percent >= 10 else f"{percent:.2g}"


class FreedNumberFit(ResultPart):
    """A number that the fit freed: the knowledge of it, and how far it moved."""

    known: float  # value that was known before
    standard_deviation: float  # standard deviation of it, in the same unit
    shift_in_sd: float  # how far the fit moved it, in standard deviations
    numbers: dict[str, float]  # fitted values by path: the number, and others that move with it


class FittedState(ResultPart):
    """A state, as `TyreState` with nothing left to the case: what its values add, as standard
    errors of a fit without it; of one that was not measured, what they would be with it."""

    pressure_kPa: float
    load_N: float
    rim: str
    values: int = 0  # measured values in this state
    rms_sigmas: float | None = None  # rms of their deviations, in standard deviations
    # standard errors of the variables without this state
    standard_errors_without: dict[str, float | None] = Field(default={})
    # standard errors of the variables with it
    standard_errors_with: dict[str, float | None] = Field(default={})
    ratio: float | None = None  # mean ratio of the standard errors with it to those without

    @property
    def display(self) -> str:
        """State in words."""
        return state_words(self.pressure_kPa, self.load_N, self.rim)


class FittedMode(Named):
    """A mode that has a target; in a fit over several states, its own."""

    multiplicity: int  # 2: a pair of modes
    initial_Hz: PositiveNumber  # frequency before the fit
    fitted_Hz: PositiveNumber  # frequency after the fit
    target_Hz: PositiveNumber  # measured frequency
    deviation_percent: float  # fitted over measured, less 1
    sigma_Hz: float | None = None
    damping_ratio: float | None = None  # damping of the fitted tyre, fraction of critical damping
    target_damping_ratio: float | None = None  # measured damping
    pressure_kPa: float | None = None
    load_N: float = 0.0
    rim: str | None = None
    symmetry: str | None = None

    @property
    def state(self) -> str:
        """State in words; "" in a fit to one."""
        if self.pressure_kPa is None:
            return ""
        return state_words(self.pressure_kPa, self.load_N, self.rim or "")

    def named(self) -> list[str]:
        """The cells of `NAME_COLUMNS`."""
        name, motion = super().named()
        return [f"{name} {self.symmetry or ''}".rstrip(), motion]


class FittedFootprint(ResultPart):
    """A target on the road that is no mode, or the mass, SI."""

    load_N: float = 0.0
    # measured quantity
    quantity: Literal[
        "contact_area_m2",
        "contact_length_m",
        "contact_width_m",
        "vertical_stiffness_N_per_m",
        "mass_kg",
    ]
    initial: float  # value before the fit, SI
    fitted: float  # value after the fit
    target: float  # measured value
    sigma: float | None = None  # standard deviation of the measured value
    deviation_percent: float  # fitted over measured, less 1
    pressure_kPa: float | None = None
    rim: str | None = None

    @property
    def state(self) -> str:
        """State in words, of the mass none; in a fit to one state the load."""
        if self.quantity == "mass_kg":
            return ""
        if self.pressure_kPa is None:
            return f"{self.load_N:g} N"
        return state_words(self.pressure_kPa, self.load_N, self.rim or "")
