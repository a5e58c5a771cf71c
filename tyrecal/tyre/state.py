"""The state that a tyre is in while it is measured or computed: pressure, load, and how its rim is
held.

Everything else makes it another tyre (`case.identity`): one design has one frequency for each mode
in each state, and a fit over several states has one design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

from ..errors import InputError
from .case.loaded import LoadedCase
from .case.parts import RimSupport

RIMS: tuple[RimSupport, ...] = get_args(RimSupport)
SPRINGS = tuple(
    f"{part}{axis}"
    for part, axes in (
        (
            "rim.spindle.",
            ("lateral_m_per_N", "radial_m_per_N", "torsional_rad_per_N_m", "tilt_rad_per_N_m"),
        ),
        ("effects.spindle_", ("lateral", "radial", "torsional", "tilt")),
    )
    for axis in axes
)
"""Numbers of a case that are compliances of what holds its rim."""
PRESSURE_PATH, RIM_FREE = "pressure_kPa", "rim.free"
WHEEL_FREE = "effects.wheel_free"
STANDING = "effects.road_contact"  # 0 for a wheel that hangs freely: it touches no road


@dataclass(frozen=True)
class TyreState:
    """Inflation pressure; vertical load on the road, 0: none; whether the rim is held ``fixed``, by
    ``springs`` (the compliances of the case's spindle) or ``free``. None: as the case has it."""

    pressure_kPa: float | None = None
    load_N: float = 0.0
    rim: RimSupport | None = None

    @property
    def unloaded(self) -> TyreState:
        """The state without a load."""
        return replace(self, load_N=0.0)

    def of(self, case: LoadedCase) -> TyreState:
        """The state with None for what the case has anyway, so that equal ones compare equal."""
        same_pressure = self.pressure_kPa == case.case.pressure_kPa
        return TyreState(
            None if same_pressure else self.pressure_kPa,
            self.load_N,
            None if self.rim == rim_of(case) else self.rim,
        )

    def with_defaults(self, case: LoadedCase) -> TyreState:
        """The state with the case's own pressure and rim in the places of None."""
        pressure = case.case.pressure_kPa if self.pressure_kPa is None else self.pressure_kPa
        return TyreState(pressure, self.load_N, self.rim or rim_of(case))

    def kept(self, before: LoadedCase, after: LoadedCase) -> TyreState:
        """The state of a target of the case ``before``, written for the case ``after``, in which
        the user has set numbers: None becomes the pressure and rim of ``before`` if they differ.
        If a variable sets the pressure, None stays: the pressure of that variable."""
        pressure, rim = self.pressure_kPa, self.rim
        if pressure is None and pressure_name(before) == PRESSURE_PATH:
            pressure = before.case.pressure_kPa
        if rim is None and is_free(before) != is_free(after):
            rim = rim_of(before)
        return TyreState(pressure, self.load_N, rim).of(after)

    def numbers(self, case: LoadedCase) -> dict[str, float]:
        """Numbers that the state sets in the case, by path: none where it is as the case.

        Raises InputError where the case cannot be in it.
        """
        state, numbers = self.of(case), dict[str, float]()
        if state.rim:
            case.kind.require_rim()
        if state.pressure_kPa is not None:
            numbers["pressure_kPa"] = state.pressure_kPa
        if state.rim == "springs":  # a case that has them is as it is: `of` gave None
            raise InputError(
                "has no springs in this case: give a compliance in rim.spindle, as"
                " rim: {spindle: {lateral_m_per_N: 1e-7}}"
            )
        if state.rim:  # fixed or free: without springs
            numbers |= {RIM_FREE: state.rim == "free", WHEEL_FREE: 0.0} | dict.fromkeys(
                SPRINGS, 0.0
            )
            point = case.case.rim.reference_point_m
            if state.rim == "free":
                numbers[STANDING] = 0.0
            if state.rim == "free" and point.r:
                raise InputError(
                    "cannot move: rim.reference_point_m must be on the axle, with r = 0, got"
                    f" {point.r:g}"
                )
        return numbers

    def design(self, case: LoadedCase, values: Mapping[str, float]) -> dict[str, float]:
        """Values of variables, or other numbers of the case by path, and the state's own, which win
        over a variable that sets the same. Raises InputError."""
        own = self.numbers(case)
        return {**without(case, values, own), **own}


AS_THE_CASE = TyreState()


def without(
    case: LoadedCase, values: Mapping[str, float], own: Mapping[str, float]
) -> dict[str, float]:
    """``values`` less those of variables that set one of the numbers ``own``."""
    variables = case.case.variables
    taken = {name for name, v in variables.items() if not own.keys().isdisjoint(v.sets)}
    return {name: value for name, value in values.items() if name not in taken}


def with_states_kept(before: LoadedCase, after: LoadedCase) -> LoadedCase:
    """The case ``after``, in which its user has set numbers, with its targets in the states that
    they have in the case ``before``: they were measured there."""
    if AS_THE_CASE.kept(before, after) == AS_THE_CASE:
        return after
    targets = after.case.targets
    modes = []
    for mode in targets.modes:
        state = TyreState(mode.pressure_kPa, 0.0, mode.rim).kept(before, after)
        own = {"pressure_kPa": state.pressure_kPa, "rim": state.rim}
        modes.append(mode.model_copy(update=own))
    footprint = []
    for target in targets.footprint:
        state = TyreState(target.pressure_kPa).kept(before, after)
        footprint.append(target.model_copy(update={"pressure_kPa": state.pressure_kPa}))
    kept = targets.model_copy(update={"modes": modes, "footprint": footprint})
    return replace(after, case=after.case.model_copy(update={"targets": kept}))


def is_free(case: LoadedCase) -> bool:
    """Whether nothing holds the case's wheel while it vibrates."""
    return case.case.rim.free or bool(case.case.effects["wheel_free"])


def pressure_name(case: LoadedCase) -> str:
    """The name of the variable that sets the pressure, else the path of that number."""
    names = (name for name, v in case.case.variables.items() if PRESSURE_PATH in v.sets)
    return next(names, PRESSURE_PATH)


def rim_of(case: LoadedCase) -> RimSupport:
    """How the case has its rim held; a compliance that a variable sets counts as one."""
    c = case.case
    if is_free(case):
        return "free"
    set_by_variables = {path for v in c.variables.values() for path in v.sets}
    effects = (c.effects[path.removeprefix("effects.")] for path in SPRINGS if "effects" in path)
    if c.rim.spindle.gives_way or any(effects) or not set_by_variables.isdisjoint(SPRINGS):
        return "springs"
    return "fixed"
