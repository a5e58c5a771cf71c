"""Targets of a fit: measured values, each with its state, standard deviation and weight."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ...files import Json
from ...measured.measurement import DAMPING_RATIO, DAMPING_SIGMA
from ...simulate.modes.label import Label
from ...simulate.modes.loaded import Member
from ...tyre.case import LoadedCase
from ...tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ...tyre.state import AS_THE_CASE, TyreState
from .free import freed_variables

KNOWLEDGE = "knowledge"  # of a number that the fit frees, see `free`
KNOWLEDGE_SIGMA = 0.01  # of 1 + 0.01 z: a freed number has z = (value - known) / sd
WITHOUT_MODEL_ERROR = KNOWLEDGE, DAMPING_RATIO  # quantities of which no error of the model is known
USUAL_LABELS = (
    Label(0, 0, "axial"),
    Label(0, 0, "torsional"),
    *(Label(c, m) for c in (1, 2, 3) for m in (1, 0)),
    Label(4, 0),
)
RIM_WORDS = {"springs": "spindle"}  # words of provenance where they differ from `TyreState.rim`


@dataclass(frozen=True)
class Target:
    """A measured mode of the unloaded tyre: frequency and standard deviation in Hz, weight in the
    objective.

    >>> from tyrecal.simulate.modes.label import Label
    >>> target = Target(Label(2, 0), frequency_Hz=79.5, sigma_Hz=0.5)
    >>> target.multiplicity
    2
    """

    label: Label
    frequency_Hz: float
    weight: float = 1.0
    sigma_Hz: float | None = None
    state: TyreState = AS_THE_CASE
    damping_ratio: float | None = None  # compared, and fitted by loss factors alone
    damping_sigma: float | None = None  # standard deviation of that; None: not stated

    quantity = "frequency_Hz"

    @property
    def value(self) -> float:
        """The frequency, Hz."""
        return self.frequency_Hz

    @property
    def sigma(self) -> float | None:
        """Its standard deviation, Hz."""
        return self.sigma_Hz

    @property
    def multiplicity(self) -> int:
        """How many modes it stands for: doublets count twice."""
        return 2 if self.label.c else 1

    @property
    def scale(self) -> float:
        """Residual per Hz, sqrt(weight multiplicity) / sigma."""
        return math.sqrt(self.weight * self.multiplicity) / (self.sigma_Hz or 1.0)


@dataclass(frozen=True)
class ValueTarget:
    """Anything else, with its standard deviation in the same unit: on the road one of
    `FOOTPRINT_QUANTITIES`, or the frequency of the mode ``member``; the mass; the damping ratio of
    an unloaded mode, ``member``; ``KNOWLEDGE``."""

    quantity: str
    value: float
    sigma: float
    weight: float = 1.0
    state: TyreState = AS_THE_CASE
    member: Member | None = None

    @property
    def scale(self) -> float:
        """Residual per unit of the quantity, sqrt(weight) / sigma."""
        return math.sqrt(self.weight) / self.sigma


def read_targets(case: LoadedCase) -> list[Target]:
    """Target modes of the unloaded tyre, those as the case is before those in other states.

    >>> first = read_targets(case)[0]
    >>> print(first.label, first.frequency_Hz)
    [0,0] axial 31.7
    """
    targets = [
        Target(
            Label(t.c, t.m, t.kind),
            t.frequency_Hz,
            t.weight,
            t.sigma_Hz,
            TyreState(t.pressure_kPa, 0.0, t.rim).of(case),
            t.damping_ratio,
            t.damping_sigma,
        )
        for t in case.case.targets.modes
        if not t.load_N
    ]
    return sorted(targets, key=lambda t: t.state != AS_THE_CASE)


def target_labels(case: LoadedCase) -> list[Label]:
    """Labels of the unloaded tyre's target modes, each once, whatever states they were measured
    in."""
    return list(dict.fromkeys(target.label for target in read_targets(case)))


def labels_to_measure(case: LoadedCase) -> list[Label]:
    """The modes of trials and plans: the case's targets or, where it has none, those that a modal
    analysis of any tyre shows."""
    return target_labels(case) or list(USUAL_LABELS)


def read_road_targets(case: LoadedCase) -> list[ValueTarget]:
    """Targets on the road: those of the patch and stiffnesses, then modes."""
    targets = case.case.targets
    rows = [
        ValueTarget(
            name,
            getattr(t, name),
            getattr(t, quantity.sigma),
            t.weight,
            TyreState(t.pressure_kPa, t.load_N).of(case),
        )
        for t in targets.footprint
        for name, quantity in FOOTPRINT_QUANTITIES.items()
        if getattr(t, name) is not None
    ]
    return rows + [
        ValueTarget(
            "frequency_Hz",
            t.frequency_Hz,
            t.sigma_Hz or 1.0,  # as in equation (1) of `problem`
            t.weight,
            TyreState(t.pressure_kPa, t.load_N, t.rim).of(case),
            Member(Label(t.c, t.m, t.kind), t.symmetry or ""),
        )
        for t in targets.modes
        if t.load_N
    ]


def read_mass_targets(case: LoadedCase) -> list[ValueTarget]:
    """The mass, where it is a target."""
    mass = case.case.targets.mass
    return [ValueTarget("mass_kg", mass.mass_kg, mass.sigma_kg, mass.weight)] if mass else []


def is_loss_factor(path: str) -> bool:
    """Whether a number of the case is a compound's loss factor, on which no frequency depends."""
    return path.startswith("materials.") and ".loss_factor" in path


def read_damping_targets(case: LoadedCase) -> list[ValueTarget]:
    """Damping ratios of the unloaded tyre, where a variable sets a loss factor: no other number
    is fitted to them."""
    paths = [path for variable in case.case.variables.values() for path in variable.sets]
    if not any(map(is_loss_factor, paths)):
        return []
    return [
        ValueTarget(
            DAMPING_RATIO,
            t.damping_ratio,
            t.damping_sigma or DAMPING_SIGMA * t.damping_ratio,
            t.weight,
            t.state,
            Member(t.label, ""),
        )
        for t in read_targets(case)
        if t.damping_ratio
    ]


def read_known(case: LoadedCase) -> list[ValueTarget]:
    """Knowledge of each of the numbers that the fit frees, as a target."""
    return [ValueTarget(KNOWLEDGE, 1.0, KNOWLEDGE_SIGMA) for _ in freed_variables(case)]


def states_of(case: LoadedCase) -> Json:
    """The states of all targets, as `provenance` takes them."""
    others = read_road_targets(case) + read_mass_targets(case)
    every = [t.state for t in read_targets(case)] + [t.state for t in others]
    states = dict.fromkeys(state.unloaded for state in every)
    loads: Json = {"load_N": case.case.targets.loads_N or 0.0}
    if not states.keys() - {AS_THE_CASE}:
        return loads
    pressures = {state.with_defaults(case).pressure_kPa for state in states}
    return {**loads, "pressure_kPa": sorted(pressures), "rim": rims_of(case, states)}


def rims_of(case: LoadedCase, states: Iterable[TyreState]) -> list[str]:
    """How their rims are held, as `provenance` takes it."""
    rims = (state.with_defaults(case).rim or "" for state in states)
    return list(dict.fromkeys(RIM_WORDS.get(rim, rim) for rim in rims))


def objective_unit(case: LoadedCase) -> str:
    """``Hz``, or ``sigma`` where a target has a standard deviation: the objective counts them."""
    others = read_road_targets(case) + read_mass_targets(case)
    others += read_damping_targets(case) + read_known(case)
    modal = any(target.sigma_Hz for target in read_targets(case))
    return "sigma" if modal or others else "Hz"
