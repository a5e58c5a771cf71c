"""One measured value, and the text of a measurements CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan

from ..simulate.modes.label import Label
from ..tyre.case.parts import RimSupport
from ..tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ..tyre.state import TyreState
from ..tyre.usual import USUAL, USUAL_MEASUREMENTS, Usual
from ..units import PRESSURE

CSV_COLUMNS = ("quantity", "c", "m", "kind", "member", "pressure_kPa", "load_N", "value", "sigma")
RIM_COLUMN = "rim"  # written only if a value was measured on another rim than the case's
AS_CASE = "case"  # cell of the rim of a value that was measured on the case's
PRESSURE_USUAL = Usual(20, 2000, "kPa", PRESSURE)  # least, most, unit, and units that may be meant
DAMPING_RATIO = "damping_ratio"  # a row of its own in a CSV, read as part of its mode's frequency
OF_A_MODE = ("frequency_Hz", DAMPING_RATIO)
DAMPING_SIGMA = 0.25  # sigma over the value of a damping ratio that states none
SHARES_OF_NOMINAL = (0.5, 1.0, 1.5)  # of the nominal load: where a file's curves are evaluated
MIN_CARRIED, MAX_CARRIED = 0.05, 3.0  # contact area times pressure over the load
MeasurementKey = tuple[str, Label | None, str, float, float, RimSupport | None]


@dataclass(frozen=True)
class Measurement:
    """A value that was measured, or the mean of several, in the unit of ``quantity``."""

    quantity: str  # one of USUAL_MEASUREMENTS
    label: Label | None  # None if it is not a frequency, or has no label yet
    # 1 or 2 of a doublet; under load symmetric or antisymmetric about the patch; "": one for both
    member: str
    pressure_kPa: float  # 0 for the mass
    load_N: float  # 0: unloaded
    value: float
    sigma: float = nan  # standard deviation; NaN: not stated
    run: str = ""  # name of the test: the tyre mounted once and measured
    place: str = ""  # file and line
    rim: RimSupport | None = None  # None: as the case has it
    damping_ratio: float = nan  # of the mode of a frequency, fraction of critical; NaN: not stated
    damping_sigma: float = nan  # its standard deviation; NaN: not stated

    @property
    def key(self) -> MeasurementKey:
        """Identity of the measured value: quantity, label, member and state."""
        state = (self.pressure_kPa, self.load_N, self.rim)
        return (self.quantity, self.label, self.member, *state)

    @property
    def state(self) -> TyreState:
        """State of the tyre when it was measured."""
        return TyreState(self.pressure_kPa or None, self.load_N, self.rim)

    @property
    def is_unlabelled(self) -> bool:
        """Whether it is a frequency whose mode is not given."""
        return self.quantity == "frequency_Hz" and self.label is None

    @property
    def name(self) -> str:
        """Name of the measured value, in words."""
        return self.label.display if self.label else self.quantity

    @property
    def mistake(self) -> str | None:
        """Why no tyre can have this value, in a sentence; None if one can."""
        if not self.value > 0:
            return f"{self.quantity} is {self.value:g}, must be greater than 0"
        if refusal := USUAL_MEASUREMENTS[self.quantity].refusal(self.value):
            return f"{self.quantity} is {self.value:g}: no tyre has that, {refusal}"
        if self.quantity != "mass_kg" and (refusal := PRESSURE_USUAL.refusal(self.pressure_kPa)):
            return f"the pressure is {self.pressure_kPa:g} kPa: {refusal}"
        if self.load_N and (refusal := USUAL["road.loads_N.*"].refusal(self.load_N)):
            return f"the load is {self.load_N:g} N: {refusal}"
        if self.quantity in FOOTPRINT_QUANTITIES and not self.load_N:
            return f"the load is 0, must be greater than 0 for {self.quantity}"
        if self.quantity == "contact_area_m2":
            share = self.value * 1e3 * self.pressure_kPa / self.load_N
            if not MIN_CARRIED <= share <= MAX_CARRIED:
                return (
                    f"{self.quantity} is {self.value:g} under {self.load_N:g} N: at"
                    f" {self.pressure_kPa:g} kPa it would carry {share * self.load_N:.3g} N; check"
                    " the units and marks of area, load and pressure"
                )
        if self.rim not in (None, "fixed") and self.quantity not in OF_A_MODE:
            return f"rim is {self.rim}, must be fixed or empty for {self.quantity}"
        if self.is_unlabelled and self.load_N:
            return (
                "c is '', must be a whole number under load: labels are found for unloaded"
                " tyres only"
            )
        if self.sigma <= 0:
            return f"sigma is {self.sigma:g}, must be greater than 0"
        return None


def measurements_csv(measurements: Sequence[Measurement]) -> str:
    """Text of a measurements CSV, as `tables.read_measurements` reads it."""
    on_rims = any(each.rim for each in measurements)
    lines = [",".join([*CSV_COLUMNS, *[RIM_COLUMN] * on_rims])]
    for each in measurements:
        label = each.label
        mode = f"{label.c},{label.m},{label.kind or ''}" if label else ",,"
        pressure = f"{each.pressure_kPa:g}" if each.quantity != "mass_kg" else ""
        state = f"{each.member},{pressure},{each.load_N:g}"
        rim = f",{each.rim or AS_CASE}" * on_rims
        lines.append(f"{each.quantity},{mode},{state},{each.value:.6g},{each.sigma:.3g}{rim}")
        if label and isfinite(each.damping_ratio):
            ratio, sigma = each.damping_ratio, each.damping_sigma
            sigma = sigma if isfinite(sigma) else DAMPING_SIGMA * ratio
            lines.append(f"{DAMPING_RATIO},{mode},{state},{ratio:.4g},{sigma:.3g}{rim}")
    return "\n".join(lines) + "\n"
