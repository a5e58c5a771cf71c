"""The modes of one universal file, with their labels: from shapes that are in it, or from
frequency-response functions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import BELT, HIGHEST_HARMONIC, TAKES_PART, Label
from .geometry import sensors_of
from .identify import FORMS, Responses, identify
from .labels import Judged, Labeller
from .measurement import Measurement
from .sensors import MeasuredMode, Sensors, real_part
from .universal import Function, MeasuredShape, Place, Signal, Universal

Array = np.ndarray

MAX_DOUBLET_SPLIT = 0.05  # relative distance of a doublet's members, at most
MIN_COLLINEARITY = 0.5  # modal phase collinearity below which a shape has no real part to speak of


@dataclass(frozen=True)
class Layout:
    """How a test's coordinates and directions are meant, and what can be in its band."""

    axle: str = ""  # x, y or z; "": told by the sensors' places
    centre: Place = (0.0, 0.0, 0.0)  # m
    cylindrical: bool = False  # directions 1, 2, 3 are radial, tangential, axial
    highest: int = HIGHEST_HARMONIC  # the largest c that is possible
    band: tuple[float, float] | None = None  # Hz; None: all
    form: str = ""  # of functions that do not say theirs


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
    """All of one file; the functions are None where it holds shapes."""

    name: str
    modes: tuple[LabelledMode, ...]
    frequency_Hz: Array | None = None  # (n,)
    functions: Array | None = None  # (k, n) from which the modes were identified
    fitted: Array | None = None  # (k, n) what the modes make, NaN outside the band

    @property
    def explained(self) -> float:
        """Share of the functions' mean square that the modes make, in the band."""
        if self.functions is None or self.fitted is None:
            return 1.0
        rest = np.nansum(np.abs(self.functions - self.fitted) ** 2)
        return float(1 - rest / np.sum(np.abs(self.functions[np.isfinite(self.fitted)]) ** 2))


def read_modal_test(file: Universal, nodes: Mapping[int, Place], layout: Layout) -> ModalTest:
    """Modes of a file by rising frequency; shapes in it come before functions.

    Raises InputError.
    """
    with _naming(file):
        return (_from_shapes if file.shapes else _identified)(file, nodes, layout)


def sensors_in(file: Universal, layout: Layout) -> Labeller:
    """Judge of the sensors of a file. Raises InputError."""
    with _naming(file):
        signals = list(_signals(file.shapes[0])) if file.shapes else []
        if file.functions and not signals:
            signals = list(next(iter(_by_reference(file.functions).values())))
        if not signals:
            raise InputError("nothing was measured in it")
        return _labeller(signals, file.nodes, layout)


def _labeller(signals: Sequence[Signal], nodes: Mapping[int, Place], layout: Layout) -> Labeller:
    sensors = sensors_of(signals, nodes, layout.axle, layout.centre, layout.cylindrical)
    return Labeller(sensors, layout.highest)


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


def _from_shapes(file: Universal, nodes: Mapping[int, Place], layout: Layout) -> ModalTest:
    labellers: dict[tuple[Signal, ...], Labeller] = {}
    told = []
    for shape in file.shapes:
        signals = _signals(shape)
        if signals not in labellers:
            if not signals:
                raise InputError(f"{shape.place}: every value is 0")
            labellers[signals] = _labeller(signals, nodes, layout)
        amplitude = shape.values[np.isfinite(shape.values)]
        mode = MeasuredMode(shape.frequency_Hz, amplitude, shape.damping)
        told.append(_labelled(mode, labellers[signals], shape.place))
    return ModalTest(str(file.path), tuple(settled(told)))


def _identified(file: Universal, nodes: Mapping[int, Place], layout: Layout) -> ModalTest:
    if not file.functions:
        others = ", ".join(f"{count} x {what}" for what, count in file.skipped.items())
        raise InputError(
            "there is neither a mode shape nor a frequency-response function"
            + (f", only {others}" if others else "")
        )
    table = _by_reference(file.functions)
    first = file.functions[0]
    form = first.form or layout.form
    if form not in FORMS:
        raise InputError(
            f"{first.place}: does not say whether displacement, velocity or acceleration was"
            " measured; give --response"
        )
    f = first.frequency_Hz
    signals = list(next(iter(table.values())))
    labeller = _labeller(signals, nodes, layout)
    values = np.vstack([[each.values for each in row.values()] for row in table.values()])
    points = np.tile([node for node, _ in signals], len(table))
    low, high = layout.band or (f[0], f[-1])
    found = identify(Responses(f, values, form, points), low, high)
    f, values = f[f > 0], values[:, f > 0]
    told = []
    for mode in found.modes:
        residues = mode.amplitude.reshape(len(table), -1)
        strongest = residues[np.argmax(np.linalg.norm(residues, axis=1))]
        told.append(_labelled(replace(mode, amplitude=strongest), labeller, str(file.path)))
    return ModalTest(str(file.path), tuple(settled(told)), f, values, found.fitted)


def _by_reference(functions: list[Function]) -> dict[Signal, dict[Signal, Function]]:
    """Functions by reference, then by signal, all with the same signals and frequencies."""
    table: dict[Signal, dict[Signal, Function]] = {}
    first = functions[0]
    for each in functions:
        row = table.setdefault(each.reference, {})
        if each.response in row:
            raise InputError(
                f"{each.place}: node {each.response[0]}, direction {each.response[1]} was measured"
                " before in this file; give each repeat a file of its own"
            )
        same = len(each.frequency_Hz) == len(first.frequency_Hz)
        if not same or not np.allclose(each.frequency_Hz, first.frequency_Hz):
            raise InputError(f"{each.place}: its frequencies are not those of the first")
        if each.form != first.form:
            raise InputError(f"{each.place}: is a {each.form}, the first a {first.form}")
        row[each.response] = each
    wanted = set(next(iter(table.values())))
    for reference, row in table.items():
        if set(row) != wanted:
            node, direction = min(wanted ^ set(row))
            raise InputError(
                f"node {node}, direction {direction} was not measured with every reference"
                f" ({reference[0]} is another)"
            )
    order = sorted(wanted)
    return {reference: {s: row[s] for s in order} for reference, row in table.items()}


def _labelled(mode: MeasuredMode, labeller: Labeller, place: str) -> LabelledMode:
    shape, collinearity = real_part(mode.amplitude)
    size = np.abs(shape).max()
    judged = labeller.judge(shape / (size or 1.0))
    R = labeller.sensors.points[:, 0]
    belt = R / R.max() > BELT
    part = np.mean(shape[belt] ** 2) / (np.mean(shape**2) or 1.0)
    if judged.label and part < TAKES_PART:
        judged = replace(judged, label=None, why="the belt hardly moves: a mode of the sidewalls")
    if judged.label and collinearity < MIN_COLLINEARITY:
        why = f"the shape is complex (collinearity {collinearity:.2f})"
        judged = replace(judged, label=None, why=why)
    return LabelledMode(mode, labeller.sensors, shape / (size or 1.0), collinearity, judged, place)


def settled(told: list[LabelledMode]) -> list[LabelledMode]:
    """Each label once in a run, or twice where both members of a doublet were found.

    As in ``modes.label``, the lowest mode on an order has its label; what comes above is an
    overtone, which has none here.
    """
    hertz = lambda each: each.mode.frequency_Hz
    result: list[LabelledMode] = []
    by_label: dict[Label | None, list[LabelledMode]] = {}
    for each in sorted(told, key=hertz):
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
            why = f"{label.said} stands at {lowest:.2f} Hz already; an overtone, or another's pair"
            result.append(replace(each, judged=replace(each.judged, label=None, why=why)))
    return sorted(result, key=hertz)


def measurements_of(test: ModalTest, pressure_kPa: float) -> list[Measurement]:
    """The frequencies of the modes that have a label."""
    found = []
    for each in test.modes:
        if label := each.judged.label:
            what = ("frequency_Hz", label, each.member, pressure_kPa, 0.0)
            value, sigma = each.mode.frequency_Hz, each.mode.sigma_Hz
            found.append(Measurement(*what, value, sigma, test.name, each.place))
    return found
