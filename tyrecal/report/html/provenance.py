"""Origin of what a page shows: tyre, data, versions, and each run with its command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import PurePath

from ...studies import result_types
from ...studies.result import Column, Provenance, Table
from ...tyre.case import as_written
from .parts import Block, PageSection, Paragraphs, shown_table
from .results import Results

FACTS: dict[str, Callable[[Provenance], str]] = {
    "tyre": lambda of: f"{of.name}, {of.size}",
    "tyre, SHA-256": lambda of: of.tyre_sha256,
    "targets": lambda of: of.targets or "",
    "measured file": lambda of: ", ".join(of.measured_files),
    "measured file, SHA-256": lambda of: of.measured_sha256 or "",
    "mesh": lambda of: of.mesh,
    "solver": lambda of: f"{of.solver} {of.solver_version}",
    "tyrecal": lambda of: of.tyrecal,
}
RUN_HEADS = ("study", "started", "state", "set on the command line", "command")


def provenance_section(folders: Sequence[Results]) -> PageSection:
    """The last section of a page."""
    blocks: list[Block] = []
    for results in folders:
        name = results.folder.resolve().name
        if results.provenances:
            heads = [Column("input", ""), Column("value", "words")]
            table = Table(heads, _facts(results))
            blocks.append(shown_table(table, f"Inputs of the results in {name}", "inputs"))
        if runs := _runs(results):
            table = Table([Column(head, "words") for head in RUN_HEADS], runs)
            blocks.append(shown_table(table, f"Runs that gave the results in {name}", "runs"))
        absent = ", ".join(
            kind.command or study
            for study, kind in result_types().items()
            if study not in results.studies and not kind.is_seldom
        )
        words = f" Not in it: results of {absent}." if absent else ""
        blocks.append(Paragraphs("legend", [f"Folder {name}.{words}"]))
    return PageSection("provenance", "Provenance", blocks)


def _facts(results: Results) -> list[list[str]]:
    """A row a fact, or one for each value of it with the studies that have it."""
    cases = dict.fromkeys(PurePath(run.case).name for run in results.runs.values() if run.case)
    rows = [["case file", ", ".join(cases)]] if cases else []
    for name, value_of in FACTS.items():
        studies: dict[str, list[str]] = {}
        for study, of in results.provenances.items():
            if value := value_of(of):
                studies.setdefault(value, []).append(study)
        for value, own in studies.items():
            rows.append([name if len(studies) == 1 else f"{name} ({', '.join(own)})", value])
    return rows


def doubts_of(results: Results) -> list[str]:
    """Doubts whether the results of a folder belong together."""
    provenances = results.provenances.values()
    doubts = []
    if len({of.tyre_sha256 for of in provenances}) > 1:
        doubts.append("These studies belong to different tyres.")
    if len({of.mesh for of in provenances}) > 1:
        doubts.append("These studies have different meshes: compare their frequencies with care.")
    doubts += [
        f"The last run of {study} did not finish: its results here are from an earlier run."
        for study, run in results.runs.items()
        if study in results.provenances and not run.finished
    ]
    return doubts


def _runs(results: Results) -> list[list[str]]:
    """Cells of `RUN_HEADS` for each study with an origin or a run."""
    rows = []
    for study in results.studies:
        of, run = results.provenances.get(study), results.runs.get(study)
        if not of and not run:
            continue
        state = f"{_range(of.state.pressure_kPa)} kPa, {_range(of.state.load_N)} N" if of else ""
        rim = of.state.rim if of else ""
        state += ", rim " * bool(rim) + (rim if isinstance(rim, str) else ", ".join(rim))
        changes = of.overrides.items() if of else ()
        given = ", ".join(f"{name} = {as_written(value)}" for name, value in changes)
        done = run if run and run.finished else None
        started = ", ".join(filter(None, (done.minute, done.host))) if done else ""
        rows.append([study, started, state, given or "nothing", done.typed if done else ""])
    return rows


def _range(value: float | list[float]) -> str:
    """A number, or the ends of several."""
    values = value if isinstance(value, list) else [value]
    ends = dict.fromkeys(f"{each:.6g}" for each in (min(values), max(values))) if values else ()
    return " to ".join(ends)
