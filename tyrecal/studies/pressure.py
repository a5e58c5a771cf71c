"""The tyre swept over the pressure: frequencies of each design, and what the sweep found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np
from pydantic import Field

from ..files import Json
from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.modes.find import LabelledModes
from ..simulate.modes.label import FAMILIES, Label, Mode, labelled
from ..simulate.modes.rings import follow
from ..tyre.case import LoadedCase
from ..tyre.state import pressure_name
from .result import Failed, Notify, ResultPart, silent
from .sweep import evaluate_points

BENT = "concave", "convex"
STRAIGHT = 1e-6  # of a frequency: solvers that print them give seven digits


@dataclass(frozen=True)
class State:
    """A design at a pressure: all labelled modes by rising frequency and, where the solver has
    slopes, d ln f / d ln p by label (else None)."""

    design: str
    pressure_kPa: float
    modes: list[Mode]
    slopes: dict[Label, float] | None

    def __repr__(self) -> str:
        low, high = (self.modes[place].frequency_Hz for place in (0, -1))
        ends = f"{len(self.modes)} modes, {low:.1f} to {high:.1f} Hz"
        return f"State({self.pressure_kPa:g} kPa: {ends})"

    @property
    def frequencies(self) -> dict[Label, float]:
        """Hz by label."""
        return {mode.label: mode.frequency_Hz for mode in self.modes}


SweepOutcome = State | Failed


def sweep(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    pressures_kPa: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
) -> list[SweepOutcome]:
    """Every design (name to values of the variables) at every pressure, in that order. Raises what
    `evaluate_points` does; an evaluation that fails is an outcome.

    >>> from tyrecal.tyre.case import start_values
    >>> outcomes = sweep(case, evaluator, {"initial": start_values(case)}, [200.0, 240.0])
    >>> [round(state.modes[0].frequency_Hz, 1) for state in outcomes]
    [34.2, 37.0]
    """
    name = pressure_name(case)
    gradients = (name,) if evaluator.has_gradients else ()
    points = [{name: p} for p in pressures_kPa]
    outcomes: dict[int, SweepOutcome] = {}

    def use(place: int, design: str, answer: LabelledModes | EvaluationFailed) -> None:
        pressure = pressures_kPa[place % len(points)]
        if isinstance(answer, EvaluationFailed):
            cause, words = answer.cause, answer.words
            failed = Failed(design=design, pressure_kPa=pressure, cause=cause, words=words)
            outcomes[place] = failed
            notify(failed.place, answer)
            return
        state = outcomes[place] = _state(design, pressure, answer, name)
        notify(f"{design}, {pressure:g} kPa: {len(state.modes)} modes", None)

    evaluate_points(case, evaluator, designs, points, use, gradients, jobs)
    return [outcomes[place] for place in sorted(outcomes)]


def _state(design: str, pressure_kPa: float, answer: LabelledModes, name: str) -> State:
    """The tyre at one pressure: its modes, with exact slopes by the pressure if the solver has
    them."""
    modes = labelled(answer.evaluation)
    gradient = answer.evaluation.gradients.get(name)  # Hz per kPa
    exact = None
    if gradient is not None:
        scale = {m.label: pressure_kPa / m.frequency_Hz for m in modes}
        exact = {m.label: float(gradient[m.position]) * scale[m.label] for m in modes}
    return State(design, pressure_kPa, modes, exact)


class PressureFindings(ResultPart):
    """Findings about one design over the pressures."""

    design: str
    from_kPa: float = 0.0  # lowest pressure
    to_kPa: float = 0.0  # highest pressure
    # for each mode its label, rises, rise_Hz, rise_percent, curvature, convex_at_kPa
    modes: list[Json] = Field(default=[])
    # in-plane and out-of-plane: family, members, rise_Hz, grows_with_c, exceptions
    families: list[Json] = Field(default=[])
    least_mac: float = 1.0  # least MAC of shapes between neighbouring pressures
    # where a label and the shape followed differ: from_kPa, to_kPa, label, followed_to, mac
    disagreements: list[Json] = Field(default=[])
    words: list[str]  # findings in words


def findings(states: Sequence[State], labels: Sequence[Label]) -> PressureFindings:
    """Findings on one design's states by rising pressure, two at least."""
    p = np.array([state.pressure_kPa for state in states])
    table = {label: np.array([s.frequencies[label] for s in states]) for label in labels}
    modes = [{**asdict(x), **_curve(p, table[x])} for x in labels]
    rises = {label: float(f[-1] - f[0]) for label, f in table.items()}
    families = [_family(name, rises) for name in FAMILIES]
    steps = [
        (before.pressure_kPa, after.pressure_kPa, step)
        for before, after in pairwise(states)
        for step in follow(before.modes, after.modes)
        if step.before in table
    ]
    result: Json = {
        "design": states[0].design,
        "from_kPa": states[0].pressure_kPa,
        "to_kPa": states[-1].pressure_kPa,
        "modes": modes,
        "families": [each for each in families if each["members"]],
        "least_mac": min((step.mac for _, _, step in steps), default=1.0),
        "disagreements": [
            {
                "from_kPa": low,
                "to_kPa": high,
                "label": str(step.before),
                "followed_to": str(step.after),
                "mac": step.mac,
            }
            for low, high, step in steps
            if step.before != step.after
        ],
    }
    return PressureFindings(**result, words=_words(result, labels))


def _curve(p: np.ndarray, f: np.ndarray) -> Json:
    """Curve of one mode, Hz f (n,) at rising pressures p (n,): its rise, whether it rises at every
    step, and how it bends, which two pressures cannot show."""
    weight = (p[2:] - p[1:-1]) / (p[2:] - p[:-2])
    bow = f[1:-1] - (weight * f[:-2] + (1 - weight) * f[2:])  # above the neighbours' chord
    straight = "neither" if len(bow) else "unknown"
    up, down = bow > STRAIGHT * f[1:-1], bow < -STRAIGHT * f[1:-1]
    return {
        "rise_Hz": float(f[-1] - f[0]),
        "rise_percent": float(100 * (f[-1] / f[0] - 1)),
        "rises": bool((np.diff(f) > 0).all()),
        "curvature": {(True, False): "concave", (False, True): "convex"}.get(
            (bool(up.any()), bool(down.any())), straight
        ),
        "convex_at_kPa": [float(x) for x in p[1:-1][down]],
    }


def _family(name: str, rises: Mapping[Label, float]) -> Json:
    """Whether the rise grows with c; exceptions: members that rise no more than the one before."""
    members = [label for label in sorted(rises) if label.family == name]
    hertz = [rises[label] for label in members]
    exceptions = [str(x) for i, x in enumerate(members) if i and hertz[i] <= hertz[i - 1]]
    return {
        "family": name,
        "members": [str(label) for label in members],
        "rise_Hz": hertz,
        "grows_with_c": not exceptions,
        "exceptions": exceptions,
    }


def _words(findings: Json, labels: Sequence[Label]) -> list[str]:
    names = {str(label): label.display for label in labels}
    modes = list(zip(names.values(), findings["modes"], strict=True))
    span = f"from {findings['from_kPa']:g} to {findings['to_kPa']:g} kPa"
    falling = [name for name, mode in modes if not mode["rises"]]
    words = [f"{_all_but('every mode rises', falling)} {span}"]
    for each in findings["families"]:
        if len(each["members"]) > 1:
            first, *_, last = (
                f"{names[name]} rises {hertz:.1f} Hz"
                for name, hertz in zip(each["members"], each["rise_Hz"], strict=True)
            )
            others = [names.get(name, name) for name in each["exceptions"]]
            grows = _all_but(f"{each['family']}, the rise grows with c", others)
            words.append(f"{grows}: {first}, {last}")
    bent = {name: mode["curvature"] for name, mode in modes if mode["curvature"] in BENT}
    if any(mode["curvature"] == "unknown" for _, mode in modes):
        words.append("the curvature needs three pressures")
    if bent:
        odd = [
            f"{name} ({bent.get(name, 'neither')})"
            for name, _ in modes
            if bent.get(name) != "concave"
        ]
        words.append(_all_but("every curve is concave, steeper at low pressure", odd))
    if not findings["disagreements"]:
        words.append(
            "labels follow the shapes throughout; least MAC between neighbouring pressures"
            f" {findings['least_mac']:.3f}"
        )
    for odd_step in findings["disagreements"]:
        words.append(
            f"from {odd_step['from_kPa']:g} to {odd_step['to_kPa']:g} kPa the shape of"
            f" {names.get(odd_step['label'], odd_step['label'])} continues under the label"
            f" {names.get(odd_step['followed_to'], odd_step['followed_to'])}"
            f" (MAC {odd_step['mac']:.2f})"
        )
    return words


def _all_but(claim: str, exceptions: Sequence[str]) -> str:
    return f"{claim}, except {', '.join(exceptions)}" if exceptions else claim
