"""Files of all kinds to one set of measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
from pathlib import Path

from ..errors import InputError
from ..files import Json, open_file
from ..simulate.modes.label import Label
from ..tyre.state import TyreState
from .arrangement import arrange
from .measurement import Measurement
from .modal import Geometry, LabelledMode, Layout, ModalTest, measurements_of, read_modal_test
from .repeats import FLOOR, combined, one_for_both
from .sense import doubts
from .shapes import SensorShapes, shapes_of
from .slips import common_shifts, contradictions
from .tables import HEAD, PROPERTY_FILE, TYDEX, other_format, read_table
from .tir import property_measurements
from .tydex import tydex_measurements
from .universal import Place, Universal, is_same_place, is_universal, read_universal

SAME_UNLABELLED = 0.01  # relative, of repeats without a label
FILE_READERS = {PROPERTY_FILE: property_measurements, TYDEX: tydex_measurements}
MIN_EXPLAINED = 0.98  # of the functions' mean square; less, and modes are missing


@dataclass(frozen=True)
class Gathered:
    """Measurements of several files together."""

    rows: list[Measurement]  # one value each with its sigma
    runs: list[ModalTest]  # of the universal files
    notes: list[str]  # what a user has to know
    doubts: list[str]  # sentences on labels or pressures that may be exchanged, see `sense`


def gather(
    paths: Sequence[Path],
    pressure_kPa: float | None = None,
    layout: Layout | None = None,
    floor: float = FLOOR,
    assumed: float = 0.0,
    leave_out: Sequence[str] = (),
    keep_going: bool = False,
) -> Gathered:
    """Measurements of several files; those of the same thing are repeats.

    pressure_kPa: of files that do not state theirs; layout: axle, centre, directions and band of
    the universal files; floor: of the value, the least sigma of a mean; assumed: of the value, the
    standard deviation of one run that states none (0: unknown); leave_out: names of channels, see
    ``arrange``;
    keep_going: leave out repeats that contradict each other.
    Frequencies without labels come last. Raises InputError, where repeats contradict each other
    too; OSError.
    """
    for k, path in enumerate(paths):
        if path.resolve() in [other.resolve() for other in paths[:k]]:
            raise InputError(f"{path}: is given twice; a file cannot be its own repeat")
    universal = [read_universal(path) for path in paths if is_universal(path)]
    axes = {node: each for file in universal for node, each in file.axes.items()}  # of the sensors
    geometry = Geometry(all_nodes(universal), axes)
    tables = [path for path in paths if path not in [file.path for file in universal]]
    values, notes = list[Measurement](), list[str]()
    for path in tables:
        with open_file(path) as file:
            reader = FILE_READERS.get(other_format(file.read(HEAD)) or "")
        read, remarks = (
            reader(path, pressure_kPa) if reader else (read_table(path, pressure_kPa), [])
        )
        values += read
        notes += remarks
    _refuse_unlabelled_repeats(values)
    runs: list[ModalTest] = []
    notes += [
        f"{file.path}: not used: {what}" + f" ({count} times)" * (count > 1)
        for file in universal
        for what, count in file.skipped.items()
    ]
    # a file with nodes alone is the geometry of the others
    measured = [f for f in universal if f.shapes or f.functions or not f.nodes]
    arranged = arrange(measured or universal, leave_out)
    notes += arranged.notes
    for test in arranged.tests:
        if pressure_kPa is None:
            raise InputError(f"{test.path}: universal files hold no pressure; give --pressure-kPa")
        run = read_modal_test(test, geometry, layout or Layout())
        runs.append(run)
        notes += [f"{test.path}: {note}" for note in run.notes]
        if run.explained < MIN_EXPLAINED:
            advice = "one may be missing: look at the picture, try a narrower --band"
            if channel := run.least_explained:
                advice = f"most of the rest is channel {channel}: try --leave-out {channel}"
            notes.append(
                f"{test.path}: the modes make {100 * run.explained:.0f} % of the functions;"
                f" {advice}"
            )
        measured_here = measurements_of(run, pressure_kPa)
        for each in measured_here:
            if mistake := each.mistake:
                raise InputError(f"{each.place}: {mistake}")
        values += measured_here
    # a doublet's mean in place of its members, where not all runs have the same ones
    labelled = one_for_both([each for each in values if not each.is_unlabelled])
    slips = contradictions(labelled)
    if slips and not keep_going:
        raise InputError("\n".join(map(str, slips)))
    left_out = {id(each) for slip in slips for each in slip.left_out}
    notes += [f"left out{' (both)' * (len(s.left_out) > 1)}: {s.words}" for s in slips]
    kept = [each for each in labelled if id(each) not in left_out]
    if labelled and not kept:
        raise InputError(f"{paths[0]}: all repeats contradict each other, none is left")
    rows = combined(kept, floor, assumed)
    more = [each for each in values if each.is_unlabelled]
    without_label = _without_labels(more, rows, floor, assumed)
    if without_label and (layout is None or layout.labels):
        why = next((e.judged.why for run in runs for e in run.modes if not e.judged.label), "")
        notes.append(
            f"{len(without_label)} of {len(rows) + len(without_label)} values are frequencies"
            f" without a label{f' ({why})' * bool(why)}; 'tyrecal fit' and 'tyrecal measured label'"
            " label them by the model"
        )
        if any(isfinite(each.damping_ratio) for each in without_label):
            notes.append("damping of frequencies without a label is left out: it belongs to a mode")
    return Gathered(rows + without_label, runs, notes, [*common_shifts(kept), *doubts(rows)])


def unlabelled(
    path: Path, pressure_kPa: float, layout: Layout | None = None, assumed: float = 0.0
) -> tuple[list[Measurement], list[SensorShapes], list[str]]:
    """Frequencies of a universal file without labels, their shapes, and notes for the user.

    Arguments and errors as of `gather`.
    """
    own = replace(layout or Layout(), labels=False)
    gathered = gather([path], pressure_kPa, own, assumed=assumed)
    shapes = [each for run in gathered.runs for each in shapes_of(run, pressure_kPa)]
    return gathered.rows, shapes, gathered.notes


def _without_labels(
    values: Sequence[Measurement], labelled: Sequence[Measurement], floor: float, assumed: float
) -> list[Measurement]:
    """One value for each frequency without a label; those of several runs that are near each other
    are repeats. One that states no sigma has the largest (relative) of ``labelled``."""
    groups: list[list[Measurement]] = []
    for each in sorted(values, key=lambda v: (v.pressure_kPa, v.rim or "", v.value)):
        last = groups[-1] if groups else [each]
        near = each.value <= (1 + SAME_UNLABELLED) * last[0].value and each.state == last[0].state
        if groups and near and each.run not in [other.run for other in last]:
            last.append(each)
        else:
            groups.append([each])
    usual = max((row.sigma / row.value for row in labelled if row.label), default=0.0)
    return [row for group in groups for row in combined(group, floor, assumed or usual)]


def _refuse_unlabelled_repeats(values: Sequence[Measurement]) -> None:
    """Raises InputError where frequencies without labels come from several runs: nothing shows
    which of them repeat each other."""
    runs: dict[TyreState, Measurement] = {}
    for each in values:
        if each.is_unlabelled:
            first = runs.setdefault(each.state, each)
            if first.run != each.run:
                raise InputError(
                    f"{each.place}: frequencies without labels were measured before, in"
                    f" {first.place}: import one run, or give labels (c and m)"
                )


def all_nodes(files: Sequence[Universal]) -> dict[int, Place]:
    """x, y, z (m, global system) of the nodes of all files together, by number. Raises InputError
    where two differ."""
    nodes: dict[int, Place] = {}
    for file in files:
        for number, place in file.nodes.items():
            if not is_same_place(nodes.setdefault(number, place), place):
                raise InputError(
                    f"{file.path}: node {number} has other coordinates than in the files before"
                )
    return nodes


def result(gathered: Gathered) -> Json:
    """The JSON that ``tyrecal measured import --json`` prints."""
    return {
        "format": 1,
        "measurements": [
            {
                "quantity": row.quantity,
                **label_entry(row.label),
                "member": row.member,
                "pressure_kPa": row.pressure_kPa,
                "load_N": row.load_N,
                **({"rim": row.rim} if row.rim else {}),
                "value": row.value,
                "sigma": row.sigma,
                **({"damping_ratio": row.damping_ratio} if isfinite(row.damping_ratio) else {}),
            }
            for row in gathered.rows
        ],
        "modes": [_entry(run, mode) for run in gathered.runs for mode in run.modes],
    }


def label_entry(label: Label | None) -> Json:
    """c, m and kind, None where there is no label."""
    return asdict(label) if label else dict.fromkeys(("c", "m", "kind"))


def _entry(run: ModalTest, labelled: LabelledMode) -> Json:
    """A labelled mode of a run as an entry of the result file."""
    finite = lambda x: x if isfinite(x) else None
    return {
        "file": run.name,
        "frequency_Hz": labelled.mode.frequency_Hz,
        "sigma_Hz": finite(labelled.mode.sigma_Hz),
        "damping_ratio": finite(labelled.mode.damping),
        "collinearity": round(labelled.collinearity, 4),
        **label_entry(labelled.judged.label),
        "member": labelled.member,
        "confidence": round(labelled.judged.confidence, 4),
        "why": labelled.judged.why,
    }
