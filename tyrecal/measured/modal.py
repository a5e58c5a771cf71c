"""Labelled modes of one universal file: from its mode shapes, or else from its frequency-response
functions.

A `Labeller` compares shapes on one layout of sensors with those of all labels [c,m]. Files may not
say what directions 1, 2, 3 are, so there is one Labeller for each possible meaning.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import compress
from math import nan

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import BELT, MAX_SAMPLED_HARMONIC, TAKES_PART, Label
from ..tyre.usual import USUAL_MEASUREMENTS
from .identify import FORMS, Responses, identify
from .labels import Judged, Labeller
from .measurement import DAMPING_RATIO, Measurement
from .sensors import MeasuredMode, Sensors, real_part, sensors_of
from .universal import Function, MeasuredShape, Place, Signal, Universal, channel_name

Array = np.ndarray

MAX_DOUBLET_SPLIT = 0.05  # relative distance of a doublet's members, at most
MIN_COLLINEARITY = 0.5  # modal phase collinearity below which a shape is too complex for a label
# ln of the odds above which one meaning of the directions is clearly better than another: for all
# modes together, and for each mode on average
LN_ODDS_OF_DIRECTIONS, LN_ODDS_OF_DIRECTIONS_PER_MODE = 10.0, 1.0
FAR_LARGER = 10.0  # times the median size of the channels: such a channel is suspected
MAX_NOISE = 0.5  # share of noise in the mean square of a channel, above which it is left out


@dataclass(frozen=True)
class Layout:
    """Statements of the user about a test: coordinates, directions and band.

    directions 1, 2, 3 are ``stated`` (by the file's coordinate systems), ``cartesian`` (x, y, z) or
    ``cylindrical`` (radial, tangential, axial). "": stated if nodes have systems of their own, else
    cartesian or cylindrical, whichever the shapes clearly fit better.
    """

    axle: str = ""  # direction of the axle, x, y or z; "": from the places of the sensors
    centre: Place = (0.0, 0.0, 0.0)  # of the wheel, m
    directions: str = ""
    highest: int = MAX_SAMPLED_HARMONIC  # the largest c that a mode can have
    band: tuple[float, float] | None = None  # Hz; None: all
    # receptance, mobility or accelerance (`identify.FORMS`), for functions that do not state theirs
    form: str = ""
    labels: bool = True  # whether modes get labels by their shapes alone


@dataclass(frozen=True)
class Geometry:
    """Places and directions of the nodes, by number."""

    nodes: Mapping[int, Place]  # x, y, z, m
    axes: Mapping[int, Array]  # (3, 3) unit vectors of the directions 1 to 3, a row each


@dataclass(frozen=True)
class LabelledMode:
    """A measured mode with its label."""

    mode: MeasuredMode
    sensors: Sensors
    shape: Array  # (k,) real, largest value 1
    collinearity: float  # modal phase collinearity, 0 to 1 (a real shape)
    judged: Judged
    place: str  # file and data set
    member: str = ""  # 1 or 2 if both modes of a doublet were measured


@dataclass(frozen=True)
class ModalTest:
    """Modes of one test. The functions are None if the file has mode shapes."""

    name: str
    modes: tuple[LabelledMode, ...]  # by rising frequency
    frequency_Hz: Array | None = None  # (n,)
    functions: Array | None = None  # (k, n) from which the modes were identified
    fitted: Array | None = None  # (k, n) the functions of the modes, NaN outside the band
    channels: tuple[str, ...] = ()  # (k,) names
    notes: tuple[str, ...] = ()  # warnings for the user

    @property
    def explained(self) -> float:
        """Share of the mean square of the functions that the modes reproduce, in the band."""
        if self.functions is None or self.fitted is None:
            return 1.0
        rest = np.nansum(np.abs(self.functions - self.fitted) ** 2)
        return float(1 - rest / np.sum(np.abs(self.functions[np.isfinite(self.fitted)]) ** 2))

    @property
    def least_explained(self) -> str:
        """The channel with more than half of what the modes do not reproduce, "" if none has."""
        if self.functions is None or self.fitted is None or not self.channels:
            return ""
        rest = np.nansum(np.abs(self.functions - self.fitted) ** 2, axis=1)
        return self.channels[int(np.argmax(rest))] if rest.max() > rest.sum() / 2 else ""


@dataclass(frozen=True)
class _UnlabelledMode:
    """A mode before its label; ``signals``: node and direction of each value of its amplitude."""

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
            identified, test = _from_functions(file, layout)
        judged, note = _with_labellers(identified, geometry, layout)
        modes = tuple(label_in_turn(judged) if layout.labels else map(_unlabelled, judged))
        return replace(test, modes=modes, notes=test.notes + (note,) * bool(note))


def sensors_in(file: Universal, layout: Layout) -> Labeller:
    """Labeller for the sensors of a file.

    Raises InputError if the file does not state the directions and they matter for labels.
    """
    with _naming(file):
        signals = tuple(_signals(file.shapes[0])) if file.shapes else ()
        if file.functions and not signals:
            signals = tuple(next(iter(_by_reference(file.functions).values())))
        if not signals:
            raise InputError("nothing was measured in it")
        first, *others = _readings(signals, Geometry(file.nodes, file.axes), layout).values()
        confused = first.looks_like()  # labels that these sensors cannot distinguish
        others = [] if layout.directions else others
        if any(each is not first and each.looks_like() != confused for each in others):
            raise InputError(f"the file does not state its directions; {_ASK}")
        return first


_ASK = "give --directions cartesian (along x, y, z) or cylindrical (radial, tangential, lateral)"


def _readings(signals: Sequence[Signal], geometry: Geometry, layout: Layout) -> dict[str, Labeller]:
    """A Labeller for each meaning of the directions: first that of the user, or else of the file,
    or else of the format. Two meanings that give the same directions share one."""
    names = ["stated", "cartesian"] if geometry.axes else ["cartesian", "cylindrical"]
    names = list(dict.fromkeys([layout.directions or names[0], *names]))
    labellers: dict[str, Labeller] = {}
    for name in names:
        axes = geometry.axes if name == "stated" else {}
        place = (geometry.nodes, layout.axle, layout.centre, name == "cylindrical", axes)
        sensors = sensors_of(signals, *place)
        known = [
            j for j in labellers.values() if np.allclose(j.sensors.directions, sensors.directions)
        ]
        labellers[name] = known[0] if known else Labeller(sensors, layout.highest)
    return labellers


def _with_labellers(
    modes: Sequence[_UnlabelledMode], geometry: Geometry, layout: Layout
) -> tuple[list[tuple[MeasuredMode, Labeller, str]], str]:
    """Each mode with the Labeller of its sensors and its place in the file, by the meaning of the
    directions that the shapes fit; and a note for the user, or "". Raises InputError if no meaning
    is clearly right."""
    labellers = {s: _readings(s, geometry, layout) for s in {each.signals for each in modes}}
    names = list(next(iter(labellers.values())))
    chosen, note = names[0], ""
    if any(len(set(each.values())) > 1 for each in labellers.values()):
        shapes = [(labellers[each.signals], _unit(each.mode)[0]) for each in modes]
        evidence = {n: sum(own[n].ln_evidence(u) for own, u in shapes) for n in names}
        chosen, note = _meaning(evidence, len(modes), layout.directions)
    return [(each.mode, labellers[each.signals][chosen], each.place) for each in modes], note


def _meaning(evidence: Mapping[str, float], count: int, given: str) -> tuple[str, str]:
    """The meaning of the directions, and a note if it is not the format's or the shapes do not fit.

    evidence: ln of the probability of ``count`` shapes by meaning, first that of the user
    (``given``), or else of the file or the format. Raises InputError if none is clearly right.
    """
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
            "the shapes do not show whether directions 1, 2, 3 are along x, y, z or radial,"
            f" tangential, lateral; {_ASK}"
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


def _from_shapes(file: Universal) -> list[_UnlabelledMode]:
    """Modes of a file that holds mode shapes. Raises InputError."""
    modes = []
    for shape in file.shapes:
        signals = _signals(shape)
        if not signals:
            raise InputError(f"{shape.place}: every value is 0")
        amplitude = shape.values[np.isfinite(shape.values)]
        mode = MeasuredMode(shape.frequency_Hz, amplitude, shape.damping)
        modes.append(_UnlabelledMode(mode, signals, shape.place))
    return modes


def _from_functions(file: Universal, layout: Layout) -> tuple[list[_UnlabelledMode], ModalTest]:
    """Modes identified in a file's frequency-response functions, and the test with its functions.
    Raises InputError."""
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
            f"{first.place}: does not state whether displacement, velocity or acceleration was"
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
        # a mode is known on the signals of one reference (exciter): the one that excites it most
        strongest = int(np.argmax([np.linalg.norm(part) for part in parts]))
        signals = tuple(list(table.values())[strongest])
        own = replace(mode, amplitude=parts[strongest])
        modes.append(_UnlabelledMode(own, signals, str(file.path)))
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
            words = [form or "function of no stated type" for form in (each.form, first.form)]
            raise InputError(f"{each.place}: is a {words[0]}, the first a {words[1]}")
        table.setdefault(each.reference, {})[each.response] = each
    return {reference: {s: row[s] for s in sorted(row)} for reference, row in table.items()}


def label_in_turn(identified: Sequence[tuple[MeasuredMode, Labeller, str]]) -> list[LabelledMode]:
    """The modes of a run with their labels, lowest frequency first. A label depends on the shape
    and on the labels of clearly lower modes.

    identified: each mode with the Labeller of its sensors and its place in the file."""
    modes: list[LabelledMode] = []
    lowest: dict[Label, float] = {}  # Hz
    for mode, labeller, place in sorted(identified, key=lambda each: each[0].frequency_Hz):
        limit = mode.frequency_Hz / (1 + MAX_DOUBLET_SPLIT)
        below = [label for label, hertz in lowest.items() if hertz < limit]
        modes.append(_labelled(mode, labeller, place, below))
        if label := modes[-1].judged.label:
            lowest.setdefault(label, mode.frequency_Hz)
    return without_overtones(modes)


def _unlabelled(identified: tuple[MeasuredMode, Labeller, str]) -> LabelledMode:
    mode, labeller, place = identified
    return LabelledMode(mode, labeller.sensors, *_unit(mode), Judged(None, {}), place)


def _labelled(
    mode: MeasuredMode, labeller: Labeller, place: str, below: Collection[Label] = ()
) -> LabelledMode:
    """The mode with its label, or with the reason why it has none."""
    shape, collinearity = _unit(mode)
    judged = labeller.judge(shape, below)
    R = labeller.sensors.points[:, 0]
    belt = R / R.max() > BELT  # sensors on the belt and not on a sidewall
    belt_share = np.mean(shape[belt] ** 2) / (np.mean(shape**2) or 1.0)
    if judged.label and belt_share < TAKES_PART:
        judged = replace(judged, label=None, why="the belt hardly moves: a mode of the sidewalls")
    if judged.label and collinearity < MIN_COLLINEARITY:
        why = f"the shape is complex (collinearity {collinearity:.2f})"
        judged = replace(judged, label=None, why=why)
    return LabelledMode(mode, labeller.sensors, shape, collinearity, judged, place)


def _unit(mode: MeasuredMode) -> tuple[Array, float]:
    """The real part of a shape (k,), with largest value 1, and its collinearity."""
    shape, collinearity = real_part(mode.amplitude)
    return shape / (np.abs(shape).max() or 1.0), collinearity


def without_overtones(labelled: list[LabelledMode]) -> list[LabelledMode]:
    """The modes of a run, each label on its lowest mode only, or on both modes of a doublet.

    Higher modes with the same label are overtones, and lose it, as in ``modes.label``.
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
            why = f"{label.display} is at {lowest:.2f} Hz already; an overtone, or another's pair"
            result.append(replace(each, judged=replace(each.judged, label=None, why=why)))
    return sorted(result, key=hertz)


def measurements_of(test: ModalTest, pressure_kPa: float) -> list[Measurement]:
    """The frequencies of all modes, also of those without a label; with the damping ratios that
    modes can have."""
    usual = USUAL_MEASUREMENTS[DAMPING_RATIO]
    return [
        Measurement(
            quantity="frequency_Hz",
            label=each.judged.label,
            member=each.member,
            pressure_kPa=pressure_kPa,
            load_N=0.0,
            value=each.mode.frequency_Hz,
            sigma=each.mode.sigma_Hz,
            run=test.name,
            place=each.place,
            damping_ratio=each.mode.damping if usual.holds(each.mode.damping) else nan,
        )
        for each in test.modes
    ]
