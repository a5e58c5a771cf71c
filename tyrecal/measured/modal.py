"""The modes of one universal file, with their labels: from shapes that are in it, or from
frequency-response functions."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import BELT, MAX_SAMPLED_HARMONIC, TAKES_PART, Label
from .case_modes import CaseModes
from .geometry import sensors_of
from .identify import FORMS, Responses, identify
from .labels import Judged, Labeller
from .measurement import Measurement
from .sensors import MeasuredMode, Sensors, real_part
from .universal import Function, MeasuredShape, Place, Signal, Universal, channel_name

Array = np.ndarray

MAX_DOUBLET_SPLIT = 0.05  # relative distance of a doublet's members, at most
MIN_COLLINEARITY = 0.5  # modal phase collinearity below which a shape has no real part to speak of
# ln of the odds from which on one meaning of the directions is clearly the better: of all modes
# together, and of one mode in the mean
LN_ODDS_OF_DIRECTIONS, LN_ODDS_OF_DIRECTIONS_PER_MODE = 10.0, 1.0
FAR_LARGER = 10.0  # times the others' median size, of a suspected channel
MAX_NOISE = 0.5  # share of noise in a bad channel's mean square


@dataclass(frozen=True)
class Layout:
    """How a test's coordinates and directions are meant, and what can be in its band.

    directions: of 1, 2, 3: ``stated`` as the file's coordinate systems say, ``cartesian`` along x,
    y, z, or ``cylindrical``, radial, tangential, axial; "": stated where nodes have systems of
    their own, else cartesian or cylindrical, whichever the shapes clearly fit better.
    """

    axle: str = ""  # x, y or z; "": told by the sensors' places
    centre: Place = (0.0, 0.0, 0.0)  # m
    directions: str = ""
    highest: int = MAX_SAMPLED_HARMONIC  # the largest c that is possible
    band: tuple[float, float] | None = None  # Hz; None: all
    form: str = ""  # of functions that do not say theirs
    case: CaseModes | None = None  # by which shapes and frequencies are judged, too


@dataclass(frozen=True)
class Geometry:
    """Where nodes are, and where the directions of those with a system of their own point."""

    nodes: Mapping[int, Place]
    axes: Mapping[int, Array]


@dataclass(frozen=True)
class LabelledMode:
    """A measured mode with its label."""

    mode: MeasuredMode
    sensors: Sensors
    shape: Array  # (k,) real, of unit largest value
    collinearity: float
    judged: Judged
    place: str  # file and data set
    member: str = ""  # 1 or 2 where both of a doublet were found


@dataclass(frozen=True)
class ModalTest:
    """All of one test; the functions are None where it holds shapes."""

    name: str
    modes: tuple[LabelledMode, ...]
    frequency_Hz: Array | None = None  # (n,)
    functions: Array | None = None  # (k, n) from which the modes were identified
    fitted: Array | None = None  # (k, n) what the modes make, NaN outside the band
    channels: tuple[str, ...] = ()  # (k,) names
    notes: tuple[str, ...] = ()  # what a user has to know

    @property
    def explained(self) -> float:
        """Share of the functions' mean square that the modes make, in the band."""
        if self.functions is None or self.fitted is None:
            return 1.0
        rest = np.nansum(np.abs(self.functions - self.fitted) ** 2)
        return float(1 - rest / np.sum(np.abs(self.functions[np.isfinite(self.fitted)]) ** 2))

    @property
    def least_explained(self) -> str:
        """The channel that has more than half of what the modes do not make, "" if none has."""
        if self.functions is None or self.fitted is None or not self.channels:
            return ""
        rest = np.nansum(np.abs(self.functions - self.fitted) ** 2, axis=1)
        return self.channels[int(np.argmax(rest))] if rest.max() > rest.sum() / 2 else ""


@dataclass(frozen=True)
class _Found:
    """A mode before its label."""

    mode: MeasuredMode
    signals: tuple[Signal, ...]
    place: str


def read_modal_test(file: Universal, geometry: Geometry, layout: Layout) -> ModalTest:
    """Modes of a test by rising frequency; shapes in it come before functions.

    Raises InputError.
    """
    with _naming(file):
        if file.shapes:
            identified, test = _from_shapes(file), ModalTest(str(file.path), ())
        else:
            identified, test = _identified(file, layout)
        judged, note = _judges_by_directions(identified, geometry, layout)
        modes = tuple(label_in_turn(judged))
        return replace(test, modes=modes, notes=test.notes + (note,) * bool(note))


def sensors_in(file: Universal, layout: Layout) -> Labeller:
    """Judge of the sensors of a file. Raises InputError."""
    with _naming(file):
        signals = tuple(_signals(file.shapes[0])) if file.shapes else ()
        if file.functions and not signals:
            signals = tuple(next(iter(_by_reference(file.functions).values())))
        if not signals:
            raise InputError("nothing was measured in it")
        first, *others = _readings(signals, Geometry(file.nodes, file.axes), layout).values()
        apart = first.looks_like()
        others = [] if layout.directions else others
        if any(each is not first and each.looks_like() != apart for each in others):
            raise InputError(f"the file does not say what its directions are; {_ASK}")
        return first


_ASK = "give --directions cartesian (along x, y, z) or cylindrical (radial, tangential, axial)"


def _readings(signals: Sequence[Signal], geometry: Geometry, layout: Layout) -> dict[str, Labeller]:
    """Judges of the signals by what the directions can mean: first what the user gives, or else the
    file or the format. Where two meanings put the sensors in the same directions, one judge has
    both."""
    names = ["stated", "cartesian"] if geometry.axes else ["cartesian", "cylindrical"]
    names = list(dict.fromkeys([layout.directions or names[0], *names]))
    judges: dict[str, Labeller] = {}
    for name in names:
        axes = geometry.axes if name == "stated" else {}
        place = (geometry.nodes, layout.axle, layout.centre, name == "cylindrical", axes)
        sensors = sensors_of(signals, *place)
        known = [
            j for j in judges.values() if np.allclose(j.sensors.directions, sensors.directions)
        ]
        judges[name] = known[0] if known else Labeller(sensors, layout.highest, layout.case)
    return judges


def _judges_by_directions(
    modes: Sequence[_Found], geometry: Geometry, layout: Layout
) -> tuple[list[tuple[MeasuredMode, Labeller, str]], str]:
    """Modes with the judges of their sensors and their places in the file, by the meaning of the
    directions that the shapes fit; and a sentence where that is not the format's. Raises InputError
    where no meaning is clearly right."""
    judges = {s: _readings(s, geometry, layout) for s in {each.signals for each in modes}}
    names = list(next(iter(judges.values())))
    chosen, note = names[0], ""
    if any(len(set(each.values())) > 1 for each in judges.values()):
        shapes = [(judges[each.signals], _unit(each.mode)[0]) for each in modes]
        evidence = {n: sum(judge[n].ln_evidence(u) for judge, u in shapes) for n in names}
        chosen, note = _meaning(evidence, len(modes), layout.directions)
    return [(each.mode, judges[each.signals][chosen], each.place) for each in modes], note


def _meaning(evidence: Mapping[str, float], count: int, given: str) -> tuple[str, str]:
    """The meaning of the directions, and a sentence where that is not the format's or not what the
    shapes fit. evidence: by meaning, ln of the probability of ``count`` shapes, first that of
    ``given``, or else of the file or the format. Raises InputError where none is clearly right."""
    first, *others = evidence
    best = max(others, key=lambda name: evidence[name])
    lead = evidence[best] - evidence[first]
    clear = abs(lead) > max(LN_ODDS_OF_DIRECTIONS, LN_ODDS_OF_DIRECTIONS_PER_MODE * count)
    better = f"the shapes fit {best} directions clearly better"
    if given:
        words = f"--directions {given} is given, but {better}: the labels may be wrong"
        return given, words if clear and lead > 0 else ""
    if first == "stated":
        if clear and lead > 0:
            raise InputError(
                "the shapes do not fit the directions of the file's coordinate systems, but those"
                " along x, y, z; give --directions stated or cartesian"
            )
        return first, ""
    if not clear:
        raise InputError(
            "the shapes do not tell whether directions 1, 2, 3 are along x, y, z or radial,"
            f" tangential, axial; {_ASK}"
        )
    return (best, f"{better}: --directions {best} is taken") if lead > 0 else (first, "")


@contextmanager
def _naming(file: Universal) -> Iterator[None]:
    """Every InputError begins with its file."""
    try:
        yield
    except InputError as error:
        named = str(error).startswith(str(file.path))
        raise error if named else InputError(f"{file.path}: {error}") from None


def _signals(shape: MeasuredShape) -> tuple[Signal, ...]:
    rows, columns = np.nonzero(np.isfinite(shape.values))
    return tuple((shape.nodes[i], int(k) + 1) for i, k in zip(rows, columns, strict=True))


def _from_shapes(file: Universal) -> list[_Found]:
    modes = []
    for shape in file.shapes:
        signals = _signals(shape)
        if not signals:
            raise InputError(f"{shape.place}: every value is 0")
        amplitude = shape.values[np.isfinite(shape.values)]
        mode = MeasuredMode(shape.frequency_Hz, amplitude, shape.damping)
        modes.append(_Found(mode, signals, shape.place))
    return modes


def _identified(file: Universal, layout: Layout) -> tuple[list[_Found], ModalTest]:
    if not file.functions:
        others = ", ".join(f"{count} x {what}" for what, count in file.skipped.items())
        raise InputError(
            "there is neither a mode shape nor a frequency-response function"
            + (f", only {others}" if others else "")
        )
    first = file.functions[0]
    form = first.form or layout.form
    if form not in FORMS:
        raise InputError(
            f"{first.place}: does not say whether displacement, velocity or acceleration was"
            " measured; give --response"
        )
    f = first.frequency_Hz
    band = layout.band or (f[0], f[-1])
    functions, notes = _without_bad_channels(file.functions, band)
    if not functions:
        raise InputError("every channel is 0 in the whole band")
    table = _by_reference(functions)
    values = np.vstack([[each.values for each in row.values()] for row in table.values()])
    points = np.array([node for row in table.values() for node, _ in row])
    names = [
        channel_name(e.response, e.response_part) for row in table.values() for e in row.values()
    ]
    try:
        identified = identify(Responses(f, values, form, points), *band)
    except InputError as error:
        raise InputError(f"{error}{_largest(names, values[:, _within(f, band)])}") from None
    f, values = f[f > 0], values[:, f > 0]
    modes = []
    for mode in identified.modes:
        parts = np.split(mode.amplitude, np.cumsum([len(row) for row in table.values()])[:-1])
        strongest = int(np.argmax([np.linalg.norm(part) for part in parts]))
        signals = tuple(list(table.values())[strongest])
        moved = replace(mode, amplitude=parts[strongest])
        modes.append(_Found(moved, signals, str(file.path)))
    name = str(file.path)
    return modes, ModalTest(name, (), f, values, identified.fitted, tuple(names), tuple(notes))


def _largest(names: Sequence[str], values: Array) -> str:
    """A hint at the channel that is far larger than the others, "" if none is."""
    sizes = np.sqrt(np.mean(np.abs(values) ** 2, axis=1))
    name, ratio = names[int(np.argmax(sizes))], sizes.max() / np.median(sizes)
    if ratio < FAR_LARGER:
        return ""
    return f"; channel {name} is {ratio:.0f} times as large as the others, try --leave-out {name}"


def _without_bad_channels(
    functions: Sequence[Function], band: tuple[float, float]
) -> tuple[list[Function], list[str]]:
    """Functions without those that are 0 in the band, or mostly noise although no smaller than the
    others, and a sentence that names their channels.

    The third differences over the lines leave little of a resonance; those of white noise have 20
    times its mean square, and their median is ln 2 of that.
    """
    inside = [(each.frequency_Hz > 0) & _within(each.frequency_Hz, band) for each in functions]
    values = [each.values[lines] for each, lines in zip(functions, inside, strict=True)]
    sizes = np.array([np.mean(np.abs(H) ** 2) if len(H) else 0.0 for H in values])
    rough = np.array([np.median(np.abs(np.diff(H, 3)) ** 2) if len(H) > 3 else 0.0 for H in values])
    noise = rough / (20 * np.log(2) * np.where(sizes > 0, sizes, 1.0))
    noisy = (noise > MAX_NOISE) & (sizes >= np.median(sizes))
    noisy &= noisy.mean() < 0.5  # else the test is noise, and no channel of it
    names = [channel_name(each.response, each.response_part) for each in functions]
    notes = []
    for bad, words in ((sizes == 0, "0 in the whole band"), (noisy, "mostly noise")):
        if bad.any():
            bad_names = dict.fromkeys(compress(names, bad))
            notes.append(f"left out, {words}: channel {', '.join(bad_names)}")
    return list(compress(functions, (sizes > 0) & ~noisy)), notes


def _within(f: Array, band: tuple[float, float]) -> Array:
    return (f >= band[0]) & (f <= band[1])


def _by_reference(functions: Sequence[Function]) -> dict[Signal, dict[Signal, Function]]:
    """Functions by reference, then by signal, all at the same frequencies. A reference need not
    have all signals. Raises InputError."""
    table: dict[Signal, dict[Signal, Function]] = {}
    first = functions[0]
    for each in functions:
        same = len(each.frequency_Hz) == len(first.frequency_Hz)
        if not same or not np.allclose(each.frequency_Hz, first.frequency_Hz):
            raise InputError(f"{each.place}: its frequencies are not those of the first")
        if each.form != first.form:
            words = [form or "function that does not say which" for form in (each.form, first.form)]
            raise InputError(f"{each.place}: is a {words[0]}, the first a {words[1]}")
        table.setdefault(each.reference, {})[each.response] = each
    return {reference: {s: row[s] for s in sorted(row)} for reference, row in table.items()}


def label_in_turn(identified: Sequence[tuple[MeasuredMode, Labeller, str]]) -> list[LabelledMode]:
    """The modes of a run with their labels, lowest frequency first: each is judged by its shape
    and by what was found clearly below it.

    identified: of each mode the judge of its sensors, and its place in the file."""
    modes: list[LabelledMode] = []
    lowest: dict[Label, float] = {}  # Hz
    for mode, labeller, place in sorted(identified, key=lambda each: each[0].frequency_Hz):
        limit = mode.frequency_Hz / (1 + MAX_DOUBLET_SPLIT)
        below = [label for label, hertz in lowest.items() if hertz < limit]
        modes.append(_labelled(mode, labeller, place, below))
        if label := modes[-1].judged.label:
            lowest.setdefault(label, mode.frequency_Hz)
    return settled(modes)


def _labelled(
    mode: MeasuredMode, labeller: Labeller, place: str, below: Collection[Label] = ()
) -> LabelledMode:
    shape, collinearity = _unit(mode)
    judged = labeller.judge(shape, below, mode.frequency_Hz)
    R = labeller.sensors.points[:, 0]
    belt = R / R.max() > BELT
    part = np.mean(shape[belt] ** 2) / (np.mean(shape**2) or 1.0)
    if judged.label and part < TAKES_PART:
        judged = replace(judged, label=None, why="the belt hardly moves: a mode of the sidewalls")
    if judged.label and collinearity < MIN_COLLINEARITY:
        why = f"the shape is complex (collinearity {collinearity:.2f})"
        judged = replace(judged, label=None, why=why)
    return LabelledMode(mode, labeller.sensors, shape, collinearity, judged, place)


def _unit(mode: MeasuredMode) -> tuple[Array, float]:
    """The real part of a shape (k,), of unit largest value, and its collinearity."""
    shape, collinearity = real_part(mode.amplitude)
    return shape / (np.abs(shape).max() or 1.0), collinearity


def settled(labelled: list[LabelledMode]) -> list[LabelledMode]:
    """Each label once in a run, or twice where both members of a doublet were found.

    As in ``modes.label``, the lowest mode on an order has its label; what comes above is an
    overtone, which has none here.
    """
    hertz = lambda each: each.mode.frequency_Hz
    result: list[LabelledMode] = []
    by_label: dict[Label | None, list[LabelledMode]] = {}
    for each in sorted(labelled, key=hertz):
        by_label.setdefault(each.judged.label, []).append(each)
    for label, group in by_label.items():
        if label is None:
            result += group
            continue
        lowest = hertz(group[0])
        pair = [each for each in group if hertz(each) <= (1 + MAX_DOUBLET_SPLIT) * lowest]
        pair = pair[: 2 if label.c else 1]
        for number, each in enumerate(pair, start=1):
            result.append(replace(each, member=str(number) if len(pair) == 2 else ""))
        for each in group[len(pair) :]:
            why = (
                f"{label.display} stands at {lowest:.2f} Hz already; an overtone, or another's pair"
            )
            result.append(replace(each, judged=replace(each.judged, label=None, why=why)))
    return sorted(result, key=hertz)


def measurements_of(test: ModalTest, pressure_kPa: float) -> list[Measurement]:
    """The frequencies of all modes; those that have no label go without one."""
    return [
        Measurement(
            "frequency_Hz",
            each.judged.label,
            each.member,
            pressure_kPa,
            0.0,
            each.mode.frequency_Hz,
            each.mode.sigma_Hz,
            test.name,
            each.place,
        )
        for each in test.modes
    ]
