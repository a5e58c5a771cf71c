"""How often the solver runs for a study, on how large a problem, and about how long it takes.
Commands print it with --dry-run; on the road, where a run takes minutes, always.

Where the solver gives no exact sensitivities, commands print how many runs differences take, and
how long, before they begin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic

from ..files import Json
from ..simulate.deck.decks_design import design_of
from ..simulate.evaluate.evaluator import Evaluator, Question
from ..tyre.case import LoadedCase
from ..tyre.values import paths_of, value_at

# The costs of the bundled solver's factorisation grow as its entries: unknowns of the whole problem
# times those of a section. Seconds of one processor, and bytes, for 1e9 of them.
FIRST_LOAD_S, FURTHER_LOAD_S = 90.0, 30.0
FURTHER_DESIGN_S = 35.0  # of the first load of a design or state that begins at another one's
MODES_AT_LOAD_S = 30.0  # in addition, for the modes at each load
RIM_AT_LOAD_S = 30.0  # in addition, for the stiffness of the rim at each load
# Seconds of an evaluation without a road, and more of them for each unknown of the section
UNLOADED_S, UNLOADED_PER_UNKNOWN_S = 0.015, 2.4e-5
MEMORY_BYTES, PROCESS_BYTES = 3.3e9, 1.5e8  # the latter of a process without any
SENSITIVITY_SHARE = 0.08  # of a press, for the exact sensitivities by one variable
UNLOADED_SENSITIVITY_SHARE = 0.15  # of an evaluation without a road, for the same
DESIGNS_OF_FIT = {"slsqp": 20, "gauss-newton": 7}  # of a start, about
DESIGNS_OF_LABELS = 5  # at which frequencies without labels are compared, as a rule


@dataclass(frozen=True)
class PlannedState:
    """One state of a design, and the loads to which it is pressed there."""

    loads: int = 0  # how many; 0: the tyre is on no road
    modes: bool = False  # those at each load are wanted
    sensitivities: int = 0  # number of variables with exact ones
    neighbours: int = 0  # further designs, from which sensitivities are differences
    rim_stiffness: bool = False  # that at each load is wanted


@dataclass(frozen=True)
class RunPlan:
    """Size of the problem, number of runs, likely time and memory, on the road and without one.

    >>> plan = RunPlan(nodes=100, places_round=17, designs=1, states=())
    >>> plan.section_unknowns
    300
    """

    nodes: int  # of the section
    # nodes round half the tyre, from the patch to the top, which has a half turn's symmetry
    places_round: int
    designs: int  # how many, or about how many where ``is_estimate``
    states: tuple[PlannedState, ...]
    at_once: int = 1  # how many of them run side by side
    is_timed: bool = True  # the estimates hold for the solver
    is_estimate: bool = False
    starts: int = 0  # runs before them: of the design at which they start, or of a calibration

    @property
    def on_road(self) -> bool:
        """Whether anything is pressed on the road."""
        return any(each.loads for each in self.states)

    @property
    def section_unknowns(self) -> int:
        """Displacements of the section's nodes."""
        return 3 * self.nodes

    @property
    def unknowns(self) -> int:
        """Displacements of the pressed tyre's nodes: nodes x places round half the tyre."""
        return self.section_unknowns * self.places_round

    @property
    def runs(self) -> int:
        """Runs in all: designs x states x loads, and ``starts``."""
        each = sum(max(1, x.loads) * (1 + x.neighbours) for x in self.states)
        return self.designs * each + self.starts

    @property
    def seconds(self) -> float | None:
        """Likely time on quiet processors, nothing answered from the record; None: not known."""
        if not self.is_timed:
            return None
        unloaded_s = UNLOADED_S + UNLOADED_PER_UNKNOWN_S * self.section_unknowns
        total = unloaded_s * self.starts
        for state in self.states:
            if not state.loads:
                share = 1 + UNLOADED_SENSITIVITY_SHARE * state.sensitivities + state.neighbours
                total += unloaded_s * self.designs * share
        return (total + self._pressing_s) / self.at_once

    @property
    def _pressing_s(self) -> float:
        """Seconds of all that is pressed on the road."""
        states = [each for each in self.states if each.loads]
        # designs and states begin at the first one's equilibrium, except where more is wanted
        alone = [each.modes or each.rim_stiffness for each in states]
        total = 0.0 if all(alone) else FIRST_LOAD_S - FURTHER_DESIGN_S
        for each, is_alone in zip(states, alone, strict=True):
            begun = FIRST_LOAD_S if is_alone else FURTHER_DESIGN_S
            press = begun + FURTHER_LOAD_S * (each.loads - 1) + self._more_s(each)
            share = 1 + SENSITIVITY_SHARE * each.sensitivities + each.neighbours
            total += self.designs * press * share
        return 1e-9 * self._entries * total

    def _more_s(self, state: PlannedState) -> float:
        """Seconds for results at each load in addition to the footprint."""
        at_load = MODES_AT_LOAD_S * state.modes + RIM_AT_LOAD_S * state.rim_stiffness
        return at_load * state.loads

    @property
    def memory_bytes(self) -> float | None:
        """Likely memory of all that run side by side; None: not known."""
        of_one = self.on_road * 1e-9 * self._entries * MEMORY_BYTES + PROCESS_BYTES
        return self.at_once * of_one if self.is_timed else None

    @property
    def _entries(self) -> float:
        return float(self.unknowns) * self.section_unknowns

    def content(self) -> Json:
        """The JSON that --dry-run --json prints."""
        return {
            "format": 1,
            "section_unknowns": self.section_unknowns,
            "unknowns": self.unknowns,
            "designs": self.designs,
            "states": len(self.states),
            "loads": [each.loads for each in self.states],
            "runs": self.runs,
            "seconds": self.seconds and float(f"{self.seconds:.3g}"),
            "memory_bytes": self.memory_bytes and float(f"{self.memory_bytes:.3g}"),
        }

    def __str__(self) -> str:
        about = "about " * self.is_estimate
        size = f"size: {self.section_unknowns} unknowns in the section"
        counts = f"{about}{_count(self.designs, 'design')} x {_count(len(self.states), 'state')}"
        if self.on_road:
            size += (
                f", {self.unknowns} in 3-D"
                f" ({self.nodes} nodes x {self.places_round} stations round half the tyre)"
            )
            loads = sorted({each.loads for each in self.states})
            counts += f" x {_count(loads[-1], 'load', loads[:-1])}"
        counts += f" + {self.starts} before" * bool(self.starts)
        words = [size, f"{counts}: {about}{_count(self.runs, 'run')}"]
        if self.seconds is not None and self.memory_bytes is not None:
            words += [f"about {time_in_words(self.seconds)} in the solver"]
            words += [f"{self.memory_bytes / 1e9:.1f} GB of memory"]
        return "; ".join(words)


def _count(number: int, noun: str, more: Sequence[int] = ()) -> str:
    """'1 state', '2 states', '1 or 2 loads'."""
    numbers = " or ".join(filter(None, [", ".join(map(str, more)), str(number)]))
    return f"{numbers} {noun}{'s' * (number != 1)}"


def time_in_words(seconds: float) -> str:
    """A time in its largest unit, to two digits."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s"


def plan_runs(
    case: LoadedCase,
    evaluator: Evaluator,
    states: Sequence[PlannedState],
    designs: int = 1,
    at_once: int = 1,
    is_estimate: bool = False,
) -> RunPlan:
    """The plan of ``designs`` tyres of a case that are each pressed in ``states``; decks in three
    dimensions, which are not, have no nodes of a section. At most ``at_once`` run side by side, and
    no more than the memory holds. Raises what the section's mesh does."""
    plan = RunPlan(
        nodes=design_of(case).section_nodes,
        places_round=2 * len(case.case.road.element_angles_deg) + 1,
        designs=designs,
        states=tuple(states),
        is_timed=evaluator.solver.name == "bundled",
        is_estimate=is_estimate,
    )
    most, available = designs * len(states), available_memory_bytes()
    if plan.memory_bytes and available is not None:
        most = min(most, int(available / plan.memory_bytes))
    return replace(plan, at_once=max(1, min(at_once, most)))


def plan_evaluations(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Sequence[Mapping[str, float]],
    sensitivities: int = 0,
    at_once: int = 1,
) -> RunPlan:
    """The plan of designs on no road, each with so many sensitivities: of their differences, where
    the solver gives none. The case's own design is evaluated first where others start from it."""
    exact = evaluator.has_gradients
    state = PlannedState(0, False, *((sensitivities, 0) if exact else (0, sensitivities)))
    plan = plan_runs(case, evaluator, [state], len(designs), at_once)
    if evaluator.design.nominal is None or "start" not in evaluator.solver.capabilities:
        return plan
    # without the sensitivities of a design its run answers for the start, too
    others = designs[:1] if sensitivities else designs

    def is_nominal(values: Mapping[str, float]) -> bool:
        numbers = [(path, x) for name, x in values.items() for path in paths_of(case, name)]
        same = all(value_at(case, path) == x for path, x in numbers)
        return same and evaluator.design.at(values).is_nominal  # which is slow

    return replace(plan, starts=int(not any(map(is_nominal, others))))


def available_memory_bytes() -> float | None:
    """Memory that a program can have without swapping; None where the system does not state it."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return 1024.0 * next(int(x.split()[1]) for x in lines if x.startswith("MemAvailable:"))
    except (OSError, ValueError, StopIteration):
        return None


def runs_in_words(
    evaluator: Evaluator, values: Mapping[str, float], runs: int, jobs: int = 1
) -> str:
    """A sentence on about so many ``runs``, ``jobs`` at a time; "" for exact sensitivities. The
    design ``values`` is run to measure the time, again if it is recorded. Raises what
    ``Evaluator.evaluate`` does."""
    if evaluator.has_gradients:
        return ""
    before = evaluator.counts.runs
    for each in (evaluator, replace(evaluator, store=None)):
        began = monotonic()
        each.evaluate(Question(values))
        seconds = monotonic() - began
        if evaluator.counts.runs > before:
            break
    return (
        f"sensitivities are differences: about {runs} runs of solver '{evaluator.solver.name}',"
        f" {time_in_words(seconds)} each: about {time_in_words(runs * seconds / jobs)} with {jobs}"
        " at a time, less where runs are recorded"
    )
