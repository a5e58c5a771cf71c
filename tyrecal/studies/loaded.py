"""Modes of the loaded tyre, named after the unloaded tyre's and followed from load to load."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..simulate.evaluate.evaluator import Evaluator, PressQuestion, Question
from ..simulate.evaluate.failure import DeckRefused, EvaluationFailed
from ..simulate.evaluate.pressed import Footprint, Pressed
from ..simulate.modes.find import LabelledModes, find_modes
from ..simulate.modes.label import Label, Mode
from ..simulate.modes.loaded import Member, ModesAtLoad, Rings, follow, members, rings, state
from ..tyre.case import LoadedCase
from .fit.targets import target_labels
from .result import Notify, notify_loads, silent

EXTRA_HARMONICS = 3  # harmonics beyond the case's that may stand among its modes
EXTRA_MODES = 6  # modes at a load beyond as many as stand for [0,0] to [c,1]
NEAR = 1.5  # times the highest frequency at a load: unloaded modes beyond it take no part in names
MIN_SPANNED = 0.5  # share of a loaded shape that the modes before must make up to name it


@dataclass(frozen=True)
class LoadedMode:
    """A mode at a load: overlap with its unloaded member, 0 to 1, and the share of its shape that
    the modes at the load before ``spanned``; under a load its shape (ring, node, 3). On a road with
    friction this is the mode of a patch that sticks, ``sliding_Hz`` that of one which nothing holds
    along the road, and ``grip_mm`` the largest motion of the crown at which the patch's forces
    along the road, their sizes summed, reach friction times the load."""

    member: Member
    frequency_Hz: float
    overlap: float
    spanned: float
    shape: np.ndarray | None = field(default=None, compare=False, repr=False)
    sliding_Hz: float | None = None
    grip_mm: float | None = None
    damping_ratio: float | None = None  # fraction of critical damping, of a patch that sticks


@dataclass(frozen=True)
class Loaded:
    """The tyre at one load."""

    load_N: float
    deflection_m: float
    modes: tuple[LoadedMode, ...]  # named ones by rising frequency
    unnamed: tuple[Member, ...] = ()  # members for which no shape was found
    # members that have another name where they are followed from the unloaded tyre in one stride
    disputed: tuple[Member, ...] = ()
    # (ring, node, 3) where the shapes' points stand, deformed: r, way along theta from the ring's
    # angle, z, in m
    surface: np.ndarray | None = field(default=None, compare=False, repr=False)
    # of the first wave in the cavity's gas, fore and aft, and up and down; none: there is no gas
    cavity_Hz: tuple[float, ...] = ()


@dataclass(frozen=True)
class LoadedTyre:
    """One design at rising loads, 0 among them where it was asked for; ``failed``: why no more;
    angles (ring,) in rad from the patch's middle."""

    pressure_kPa: float
    mass_kg: float
    loads: tuple[Loaded, ...]
    failed: EvaluationFailed | None = None
    angles: np.ndarray | None = field(default=None, compare=False, repr=False)


LoadOutcome = LoadedTyre | EvaluationFailed


def load_tyres(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
    labels: Sequence[Label] = (),
) -> dict[str, LoadOutcome]:
    """Every design (name to values of the variables) at rising loads, one above 0 at least, or why
    it has no modes; labels: of the modes to name, else the case's. Raises DeckRefused and what
    else ``Evaluator.press`` raises for wrong input.
    """
    evaluator.needs_road(modes=True)
    unloaded = {
        name: _unloaded(case, evaluator, values, labels) for name, values in designs.items()
    }
    able = [name for name, each in unloaded.items() if not isinstance(each, EvaluationFailed)]
    loads = [load for load in loads_N if load]
    questions = [PressQuestion(designs[name], loads, _count(case)) for name in able]
    answers = evaluator.press_all(questions, jobs)
    outcomes: dict[str, LoadOutcome] = {}
    for name in designs:
        free = unloaded[name]
        outcomes[name] = (
            free
            if isinstance(free, EvaluationFailed)
            else _loaded_tyre(case, free, next(answers), 0.0 in loads_N)
        )
        notify_loads(notify, name, loads, *progress(outcomes[name]))
    return outcomes


def progress(outcome: LoadOutcome) -> tuple[int, EvaluationFailed | None]:
    """How many loads above 0 were reached, and why no more."""
    if isinstance(outcome, LoadedTyre):
        return sum(each.load_N > 0 for each in outcome.loads), outcome.failed
    return 0, outcome


def _wanted(case: LoadedCase, modes: Sequence[Mode]) -> list[Label]:
    """The case's targets or, where it has none, all with m <= 1 up to its highest harmonic."""
    highest = case.case.analysis.highest_harmonic
    return target_labels(case) or [
        m.label for m in modes if m.label.m <= 1 and m.label.c <= highest
    ]


def _count(case: LoadedCase) -> int:
    """Modes to seek at each load: both [0,0], the two members of [c,0] and [c,1], and some."""
    return 2 + 4 * case.case.analysis.highest_harmonic + EXTRA_MODES


def _unloaded(
    case: LoadedCase, evaluator: Evaluator, values: Mapping[str, float], labels: Sequence[Label]
) -> LabelledModes | EvaluationFailed:
    """The unloaded tyre's modes with a few harmonics more, the wanted ones surely among them."""
    highest = case.case.analysis.highest_harmonic + EXTRA_HARMONICS
    question = Question({**values, "analysis.highest_harmonic": highest})
    ((_, outcome),) = find_modes(
        evaluator, [question], lambda place, modes: labels or _wanted(case, modes)
    )
    if isinstance(outcome, DeckRefused):
        raise outcome
    return outcome


def _loaded_tyre(
    case: LoadedCase, unloaded: LabelledModes, pressed: Pressed | EvaluationFailed, with_zero: bool
) -> LoadOutcome:
    """Modes of a pressed tyre at its loads, followed from the unloaded ones."""
    if isinstance(pressed, EvaluationFailed):
        return pressed
    first = pressed.footprints[0]
    assert first.mode_node is not None
    where = rings(pressed.angles, first.mode_node, pressed.nodes, pressed.points)
    wanted = set(unloaded.wanted)
    hertz_there = [f.mode_frequency_Hz for f in pressed.footprints]
    highest = max(float(f.max()) for f in hertz_there if f is not None)
    shapes: dict[Member, np.ndarray] = {}
    hertz: dict[Member, float] = {}
    damping = {mode.label: mode.raw.damping_ratio for mode in unloaded.modes}
    for mode in unloaded.modes:
        if mode.label in wanted or mode.frequency_Hz < NEAR * highest:
            shapes |= (both := members(mode, where))
            hertz |= dict.fromkeys(both, mode.frequency_Hz)
    loads = _followed(pressed, where, wanted, shapes, hertz, case.case.road.friction)
    if with_zero:
        named = (
            LoadedMode(member, f, 1.0, 1.0, damping_ratio=damping[member.label])
            for member, f in hertz.items()
            if member.label in wanted
        )
        wave = () if pressed.cavity_Hz is None else (pressed.cavity_Hz,) * 2
        loads = [Loaded(0.0, 0.0, _by_frequency(named), cavity_Hz=wave), *loads]
    return LoadedTyre(
        pressed.pressure_kPa, pressed.mass_kg, tuple(loads), pressed.failed, pressed.angles
    )


def _followed(
    pressed: Pressed,
    where: Rings,
    wanted: set[Label],
    shapes: Mapping[Member, np.ndarray],
    hertz: Mapping[Member, float],
    friction: float,
) -> list[Loaded]:
    """The named modes at each load, followed from the unloaded ``shapes`` on."""
    names = list(shapes)
    free = state(np.array(list(hertz.values())), np.array(list(shapes.values())), where)
    sticking, sliding = _Trail(free, where), _Trail(free, where)
    row = {int(node): i for i, node in enumerate(pressed.nodes)}
    nodes = [row[int(node)] for node in where.nodes]
    R, Z = pressed.points[nodes].T
    loads = []
    for footprint in pressed.footprints:
        assert footprint.mode_frequency_Hz is not None and footprint.mode_shape is not None
        here = state(footprint.mode_frequency_Hz, footprint.mode_shape, where)
        straight = follow(free, here, where)
        place, spanned = sticking.to(here)
        overlaps = where.overlaps(free.shapes, here.shapes)
        chosen = [i for i, name in enumerate(names) if name.label in wanted]
        slipping = np.full(len(names), np.nan)
        if footprint.sliding_frequency_Hz is not None and footprint.sliding_shape is not None:
            loose = state(footprint.sliding_frequency_Hz, footprint.sliding_shape, where)
            there, _ = sliding.to(loose)
            slipping = np.where(there < 0, np.nan, loose.frequencies[there])
        grip_mm, damping = _grip_mm(footprint, friction), footprint.mode_damping_ratio
        loads.append(
            Loaded(
                footprint.load_N,
                footprint.deflection_m,
                _by_frequency(
                    LoadedMode(
                        names[i],
                        float(here.frequencies[place[i]]),
                        float(overlaps[i, place[i]]),
                        float(spanned[i]),
                        here.shapes[place[i]],
                        None if np.isnan(slipping[i]) else float(slipping[i]),
                        None if grip_mm is None else float(grip_mm[place[i]]),
                        None if damping is None else float(damping[place[i]]),
                    )
                    for i in chosen
                    if place[i] >= 0
                ),
                tuple(names[i] for i in chosen if place[i] < 0),
                tuple(names[i] for i in chosen if 0 <= place[i] != straight.position[i]),
                np.stack([R, 0 * R, Z], -1) + footprint.displacement[:, nodes],
                () if footprint.cavity_Hz is None else tuple(map(float, footprint.cavity_Hz)),
            )
        )
    return loads


class _Trail:
    """Modes followed from load to load, from those of the unloaded tyre on."""

    def __init__(self, free: ModesAtLoad, where: Rings):
        self._before, self._where = free, where
        self._place = np.arange(len(free.frequencies))

    def to(self, here: ModesAtLoad) -> tuple[np.ndarray, np.ndarray]:
        """Each unloaded mode's place (m,) at the next load, -1 if it is lost, and `spanned`
        (m,)."""
        step = follow(self._before, here, self._where)
        spanned = np.where(self._place < 0, 0.0, step.spanned[self._place])
        self._place = np.where(spanned < MIN_SPANNED, -1, step.position[self._place])
        self._before = here
        return self._place, spanned


def _grip_mm(footprint: Footprint, friction: float) -> np.ndarray | None:
    """Per mode (m,) the largest motion on the rings, mm, at which friction is used up."""
    if footprint.mode_traction_N is None or footprint.mode_shape is None:
        return None
    largest = np.linalg.norm(footprint.mode_shape, axis=-1).max((1, 2))
    return np.asarray(1e3 * largest * friction * footprint.load_N / footprint.mode_traction_N)


def _by_frequency(modes: Iterable[LoadedMode]) -> tuple[LoadedMode, ...]:
    return tuple(sorted(modes, key=lambda mode: (mode.frequency_Hz, mode.member)))
