"""The content of load_sweep.json, and of modes.json for the tyre on the road."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

from pydantic import Field

from ..files import Json
from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.modes.label import Label
from ..simulate.modes.loaded import SYMMETRIES
from ..tyre.case import LoadedCase
from .loaded import Loaded, LoadedMode, LoadedTyre, LoadOutcome, load_tyres, progress
from .modes import ModesFindings, ModesResult
from .result import (
    MIN_NAMED_OVERLAP,
    NAME_COLUMNS,
    CavityMode,
    Column,
    Failed,
    ModeEntry,
    Notify,
    Result,
    ResultPart,
    Table,
    csv_text,
    not_reached,
    silent,
)

SPLIT_ATOL = 1e-3  # Hz, below which a split is none


class LoadRow(ResultPart):
    """A design at a load; 0: the unloaded tyre."""

    design: str  # name of the design: initial, fitted or set
    load_N: float  # load; 0: the unloaded tyre
    deflection_m: float  # fall of the wheel's centre
    modes: list[ModeEntry]  # modes by rising frequency
    cavity: list[CavityMode] = Field(default=[])  # first wave of the gas in the cavity


class LoadFindings(ResultPart):
    """Findings about one design over the loads."""

    design: str  # name of the design
    # for each pair its label, split_Hz (load_N, split: antisymmetric less symmetric), grows,
    # shrinks_from_N
    splits: list[Json] = Field(default=[])
    least_overlap: float = 1.0  # least overlap with the unloaded member
    words: list[str]  # findings in words


class LoadSweep(Result):
    """load_sweep.json"""

    study, stem, heading = "sweep-load", "load_sweep", "Frequencies over load"
    figures = "tyrecal.report.frequencies:load_figures"
    command = "modes --sweep-load"

    pressure_kPa: dict[str, float] = Field(default={})  # inflation pressure by design
    designs: dict[str, dict[str, float]] = Field(default={})  # values of the variables by design
    rows: list[LoadRow]  # designs at loads
    failed: list[Failed]  # loads that were not reached
    findings: list[LoadFindings]  # findings on each design

    def csv(self) -> str:
        keys = ["design", "load_N", "deflection_m", "c", "m", "kind", "symmetry", "frequency_Hz"]
        rows = ({**row.model_dump(), **m} for row in self.rows for m in _csv_modes(row))
        keys += ["overlap", "spanned", "sliding_Hz", "grip_mm"]
        keys += ["damping_ratio"] * any(m.damping_ratio for row in self.rows for m in row.modes)
        return csv_text(keys, rows)

    def tables(self) -> list[Table]:
        return [self._table(design) for design in dict.fromkeys(row.design for row in self.rows)]

    def _table(self, design: str) -> Table:
        """A line a member of a doublet: Hz at each load."""
        own = [row for row in self.rows if row.design == design]
        hertz = [Column(f"{row.load_N:g} N") for row in own]
        modes_by_load = [{(m.label, m.symmetry): m for m in row.modes} for row in own]
        members = {key: mode for modes in reversed(modes_by_load) for key, mode in modes.items()}
        lowest = {
            label: min(m.frequency_Hz for (other, _), m in members.items() if other == label)
            for label, _ in members
        }
        order = sorted(members, key=lambda k: (lowest[k[0]], str(k[0]), k[1] != SYMMETRIES[0]))
        rows = [
            [
                *members[key].named(),
                key[1],
                *(_hertz_cell(hertz[0], m.get(key)) for m in modes_by_load),
            ]
            for key in order
        ]
        for pair in zip(*(row.cavity for row in own), strict=False):
            cells = [hertz[0].cell(each.frequency_Hz) for each in pair]
            rows.append([*pair[0].named(), "", *cells])
        return Table([*NAME_COLUMNS, Column("symmetry", ""), *hertz], rows, f"{design}, Hz")


def _hertz_cell(column: Column, mode: ModeEntry | None) -> str | None:
    """A frequency, in brackets where the mode has lost its name."""
    cell = column.cell(mode.frequency_Hz if mode else None)
    return f"({cell})" if mode and mode.has_lost_name else cell


def _csv_modes(row: LoadRow) -> list[Json]:
    """The tyre's modes, and the cavity's, of the kinds "cavity fore-aft" and "cavity vertical"."""
    cavity = [
        {"c": 1, "kind": f"cavity {each.direction}", "frequency_Hz": each.frequency_Hz}
        for each in row.cavity
    ]
    return [*(mode.model_dump() for mode in row.modes), *cavity]


def run(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
) -> LoadSweep:
    """Every design at rising loads. Raises as ``load_tyres`` does."""
    outcomes = load_tyres(case, evaluator, designs, loads_N, jobs, notify)
    return load_sweep_result(designs, loads_N, outcomes)


def loaded_modes_result(values: Mapping[str, float], tyre: LoadedTyre) -> ModesResult:
    """The content of modes.json: the tyre at its last load."""
    last = tyre.loads[-1]
    return ModesResult(
        format=1,
        pressure_kPa=tyre.pressure_kPa,
        load_N=last.load_N,
        mass_kg=tyre.mass_kg,
        variables=dict(values),
        deflection_m=last.deflection_m,
        modes=[_entry(mode) for mode in last.modes],
        **_cavity(last),
        findings=ModesFindings(
            words=_cavity_words([last]) + _held_by_friction([last]) + _doubts([last])
        ),
    )


def load_sweep_result(
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    outcomes: Mapping[str, LoadOutcome],
) -> LoadSweep:
    """outcomes: of ``load_tyres``."""
    tyres = {name: each for name, each in outcomes.items() if isinstance(each, LoadedTyre)}
    above = [load for load in loads_N if load]
    return LoadSweep(
        format=1,
        pressure_kPa={name: tyre.pressure_kPa for name, tyre in tyres.items()},
        designs={name: dict(values) for name, values in designs.items()},
        rows=[
            LoadRow(
                design=name,
                load_N=each.load_N,
                deflection_m=each.deflection_m,
                modes=[_entry(mode) for mode in each.modes],
                **_cavity(each),
            )
            for name, tyre in tyres.items()
            for each in tyre.loads
        ],
        failed=not_reached(above, {name: progress(each) for name, each in outcomes.items()}),
        findings=[findings(name, tyre.loads) for name, tyre in tyres.items()],
    )


def _entry(mode: LoadedMode) -> ModeEntry:
    label = mode.member.label
    known = {key: getattr(mode, key) for key in ("sliding_Hz", "grip_mm", "damping_ratio")}
    return ModeEntry(
        **asdict(label),
        frequency_Hz=mode.frequency_Hz,
        multiplicity=1,
        symmetry=mode.member.symmetry,
        overlap=round(mode.overlap, 6),
        spanned=round(mode.spanned, 6),
    ).model_copy(update={key: number for key, number in known.items() if number is not None})


def _cavity(loaded: Loaded) -> Json:
    """The field of a result, where there is a gas."""
    return {"cavity": CavityMode.pair(loaded.cavity_Hz)} if loaded.cavity_Hz else {}


def _cavity_words(loads: Sequence[Loaded]) -> list[str]:
    """How far the last load splits the cavity's first mode."""
    if not loads or not loads[-1].cavity_Hz:
        return []
    fore_aft, vertical = loads[-1].cavity_Hz
    return [
        f"the cavity's first mode at {loads[-1].load_N:g} N, between rigid walls: fore-aft"
        f" {fore_aft:.1f}, vertical {vertical:.1f} Hz, split {vertical - fore_aft:+z.1f}"
    ]


def findings(design: str, loads: Sequence[Loaded]) -> LoadFindings:
    """Whether splits grow with the load, which frequencies fall, how far shapes change."""
    tables = {
        each.load_N: {(m.member.label, m.member.symmetry): m.frequency_Hz for m in each.modes}
        for each in loads
    }
    labels = sorted({label for table in tables.values() for label, _ in table if label.c})
    splits = [_split(label, tables) for label in labels]
    loaded = [mode for each in loads if each.load_N for mode in each.modes]
    least = min(loaded, key=lambda mode: mode.overlap, default=None)
    words = _splitting(splits) + _rising(tables) + _cavity_words(loads)
    if least:
        words.append(
            f"least overlap of a loaded shape with the unloaded one of its name:"
            f" {least.overlap:.2f}, {least.member} at {_load_of(loads, least):g} N (the load"
            " changes shapes; modes are followed from load to load); the modes at the load before"
            f" make up {min(m.spanned for m in loaded):.2f} of each shape or more"
        )
    return LoadFindings(
        design=design,
        splits=splits,
        least_overlap=least.overlap if least else 1.0,
        words=words + _held_by_friction(loads) + _doubts(loads),
    )


def _load_of(loads: Sequence[Loaded], mode: LoadedMode) -> float:
    return next(each.load_N for each in loads if any(m is mode for m in each.modes))


def _split(label: Label, tables: Mapping[float, Mapping[Any, float]]) -> Json:
    """A doublet's split at each load where both members are known, and whether it only grows."""
    both = {
        load: table[label, SYMMETRIES[1]] - table[label, SYMMETRIES[0]]
        for load, table in tables.items()
        if all((label, symmetry) in table for symmetry in SYMMETRIES)
    }
    sizes = [(load, abs(hertz)) for load, hertz in both.items()]
    return {
        "c": label.c,
        "m": label.m,
        "kind": label.kind,
        "split_Hz": [{"load_N": load, "split": hertz} for load, hertz in both.items()],
        "grows": all(b > a - SPLIT_ATOL for (_, a), (_, b) in pairwise(sizes)),
        "shrinks_from_N": [low for (low, a), (_, b) in pairwise(sizes) if b <= a - SPLIT_ATOL],
    }


def _splitting(splits: Sequence[Json]) -> list[str]:
    """Which doublets' splits grow with the load."""
    if not any(len(each["split_Hz"]) > 1 for each in splits):
        return []
    odd = [
        f"[{each['c']},{each['m']}] (" + ", ".join(f"{x:g} N" for x in each["shrinks_from_N"]) + ")"
        for each in splits
        if not each["grows"]
    ]
    last = ", ".join(
        f"[{each['c']},{each['m']}] {each['split_Hz'][-1]['split']:+z.1f}"
        for each in splits
        if each["split_Hz"]
    )
    claim = "every doublet's split grows with the load"
    if odd:
        claim += f", except {', '.join(odd)} from the given load on"
    return [f"{claim}; antisymmetric less symmetric at the last, Hz: {last}"]


def _rising(tables: Mapping[float, Mapping[Any, float]]) -> list[str]:
    """Which frequencies do not rise with the load."""
    falling = sorted(
        {
            f"[{label.c},{label.m}] {symmetry}"
            for before, after in pairwise(tables.values())
            for (label, symmetry), hertz in after.items()
            if hertz < before.get((label, symmetry), 0.0) - SPLIT_ATOL
        }
    )
    if len(tables) < 2:
        return []
    claim = "every frequency rises with the load"
    return [claim + (f", except {', '.join(falling)}" if falling else "")]


def _held_by_friction(loads: Sequence[Loaded]) -> list[str]:
    """Effect of friction on the mode that it moves most, and the motion up to which it can hold."""
    rises = [
        (mode.frequency_Hz - mode.sliding_Hz, each.load_N, mode)
        for each in loads
        for mode in each.modes
        if mode.sliding_Hz is not None and mode.grip_mm is not None
    ]
    if not rises:
        return []
    shift, load, most = max(rises, key=lambda each: each[0])
    return [
        f"the patch is assumed to stick; without friction {most.member} at {load:g} N has"
        f" {most.sliding_Hz:.2f} Hz, {shift:.2f} Hz less; the patch sticks up to a crown amplitude"
        f" of {most.grip_mm:.2g} mm: above it, or on a low-friction road, the frequency is between"
        " the two values"
    ]


def _doubts(loads: Sequence[Loaded]) -> list[str]:
    """Modes without a name, and names that depend on the loads in between."""
    words = []
    for each in loads:
        lost = [mode.member for mode in each.modes if _entry(mode).has_lost_name]
        if lost:
            words.append(
                f"at {each.load_N:g} N less than {MIN_NAMED_OVERLAP:g} of the unloaded shape is"
                f" left of {', '.join(map(str, lost))}: the name no longer describes it;"
                " frequencies in brackets, or not named, continue its curve"
            )
        if each.unnamed:
            words.append(
                f"at {each.load_N:g} N no shape could be identified as"
                f" {', '.join(map(str, each.unnamed))}: add loads in between (--sweep-load)"
            )
        if each.disputed:
            words.append(
                f"at {each.load_N:g} N {', '.join(map(str, each.disputed))} would have other names"
                " straight from the unloaded tyre: the curves come close in between"
            )
    return words
