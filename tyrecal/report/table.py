"""Modes, and doubts about a fit, in an engineer's words; tables for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich import table as rich
from rich.text import Text

from ..simulate.modes.label import Label
from ..studies.fit.verdict import DOES_NOT_FIT, MAX_CHI2_PER_DOF, FitReason, does_not_fit_words
from ..studies.labels import Labels
from ..studies.result import Cell, Column, Deviation, Table, state_words
from ..tyre.usual import USUAL_MEASUREMENTS

CLOSE, FAR = 2.0, 5.0  # % of deviation from a target
MINUS = "\N{MINUS SIGN}"
MAX_RELATIVE_ERROR = 0.5  # standard error over the value, above which a variable is not determined
SAME_RATIO = 1.02  # of an objective, or a variable, up to which two fits are one
MAX_OFF = 30.0  # % after a fit: no tyre is that far from its model
MIN_FREQUENCY_HZ = 1.0  # no mode of a tyre is below
MIN_LABEL_MARGIN = 0.3  # clarity of a label, below which the user must look
MIN_SINGULAR_RATIO = 1e-3  # smallest over largest, below which the data leave a combination open
EMPTY_CELL = "-"


def nearness(modes: Sequence[Mapping[str, Any]]) -> str:
    """How near the fitted frequencies (``modes`` of fit.json) come to their targets; in the rms the
    two modes of a pair count as two."""
    near = [mode for mode in modes if abs(mode["deviation_percent"]) <= CLOSE]
    worst = max(modes, key=lambda mode: abs(mode["deviation_percent"]))
    twice = [mode["deviation_percent"] for mode in modes for _ in range(mode["multiplicity"])]
    rms = (sum(x * x for x in twice) / len(twice)) ** 0.5
    name = f"[{worst['c']},{worst['m']}] {Label(worst['c'], worst['m'], worst['kind']).motion}"
    if worst.get("pressure_kPa"):
        name += f" ({state_words(worst['pressure_kPa'], worst['load_N'], worst['rim'])})"
    return (
        f"{len(near)} of {len(modes)} frequencies come within {CLOSE:g} % of their targets (rms"
        f" {rms:.1f} %); farthest off is {name} with {worst['deviation_percent']:+z.1f} %"
    )


def fit_verdict(result: Mapping[str, Any]) -> list[str]:
    """Verdict on a fit by the content of fit.json, in sentences; doubts aside, see `fit_doubts`."""
    states = result.get("states", ())
    count = "one state" if len(states) == 1 else f"{len(states)} states"
    where = f"in {count}" if states else f"at {result['pressure_kPa']:g} kPa"
    words = [f"{ended_words(result)} {where}, {result['mass_kg']:.2f} kg."]
    if result["modes"]:
        words.append(f"{nearness(result['modes'])}.")
    if (per_dof := result.get("chi2_per_dof")) is not None:
        words.append(
            f"chi2 per degree of freedom is {per_dof:.3g}: about 1 if the stated uncertainty"
            f" explains what is left, above {MAX_CHI2_PER_DOF:g} the model does not fit."
        )
    if len(result["starts"]) > 1:
        words.append(_starts(result))
    if labels := result.get("labels"):
        words += [f"{each[0].upper()}{each[1:]}." for each in Labels(**labels).sentences()]
    return words


def ended_words(result: Mapping[str, Any]) -> str:
    """How a fit ended: converged, and whether the model fits."""
    if result.get("verdict") == DOES_NOT_FIT:
        return "Does not fit"
    return "Converged" if result["converged"] else "Ended"


def _starts(result: Mapping[str, Any]) -> str:
    """Whether the fits from several starts found one and the same."""
    starts = result["starts"]
    best = min(start["objective_Hz"] for start in starts)
    alike = [start for start in starts if start["objective_Hz"] <= SAME_RATIO * best + 1e-9]
    spread = {
        name: max(abs(start["values"][name] / v["value"] - 1) for start in alike)
        for name, v in result["variables"].items()
        if v["value"]
    }
    far, share = max(spread.items(), key=lambda item: item[1], default=("", 0.0))
    if share > SAME_RATIO - 1:
        return (
            f"{len(alike)} of {len(starts)} starts reach this objective, but with {far} up to"
            f" {100 * share:.0f} % apart: other designs serve as well."
        )
    others = [start["objective_Hz"] for start in starts if start not in alike]
    if others:
        unit = "sigma" if result.get("prior") else result["objective_unit"]
        return (
            f"{len(alike)} of {len(starts)} starts end here, the others at {min(others):.2f} {unit}"
            " or more."
        )
    return f"All {len(starts)} starts end here."


def tyre_doubts(result: Mapping[str, Any]) -> list[str]:
    """Doubts about a result whose ``mass_kg`` and ``modes`` no tyre has."""
    doubts = []
    if message := USUAL_MEASUREMENTS["mass_kg"].refusal(result["mass_kg"]):
        doubts.append(
            f"the tyre weighs {result['mass_kg']:.4g} kg, {message.partition(';')[0]}: are"
            " densities and areas of cords in the units of their keys?"
        )
    slowest = min((mode["frequency_Hz"] for mode in result["modes"]), default=MIN_FREQUENCY_HZ)
    if slowest < MIN_FREQUENCY_HZ:
        doubts.append(
            f"a mode is at {slowest:.3g} Hz, lower than any tyre's: are all stiffnesses and"
            " compliances in the units of their keys?"
        )
    return doubts


def fit_doubts(result: Mapping[str, Any]) -> list[str]:
    """Doubts that the user of a fit (the content of fit.json) must not overlook."""
    doubts = []
    if not result["moved"]:
        doubts.append("THE FIT DID NOT MOVE: every variable ended where it started")
    if not result["converged"]:
        doubts.append(
            f"not converged: {result['message']}; projected gradient"
            f" {result['projected_gradient_norm']:.3g} {result['objective_unit']}"
        )
    for name, variable in result["variables"].items():
        if variable["at_bound"]:
            seen = variable["standard_error"] is not None
            why = "the misfit would be lower beyond it" if seen else "the data do not determine it"
            doubts.append(f"{name} ended at a bound: {why}")
        elif variable["standard_error"] is None:
            doubts.append(f"the data do not determine {name}: fix it, or add targets")
        elif variable["standard_error"] > MAX_RELATIVE_ERROR * abs(variable["value"]):
            share = 100 * variable["standard_error"] / max(abs(variable["value"]), 1e-300)
            doubts.append(f"the data hardly determine {name}: its standard error is {share:.0f} %")
    if failed := result["failed_evaluations"]:
        designs = "1 design" if failed == 1 else f"{failed} designs"
        doubts.append(f"{designs} could not be evaluated; the search stepped back")
    if error := result.get("next_states_error"):
        doubts.append(f"which state to measure next could not be evaluated: {error}")
    if result["label_margin"] < MIN_LABEL_MARGIN:
        doubts.append(
            f"a mode is hard to name (margin {result['label_margin']:.2f} of 1): two modes have"
            " met; look at their pictures"
        )
    reason = FitReason.model_validate(result["reason"]) if result.get("reason") else None
    if result.get("verdict") == DOES_NOT_FIT:
        doubts.insert(0, does_not_fit_words(result["chi2_per_dof"], reason))
    elif reason:
        doubts.append(reason.sentence)
    far = [mode for mode in result["modes"] if abs(mode["deviation_percent"] or 0) > MAX_OFF]
    if not reason and 2 * len(far) > len(result["modes"]):
        doubts.append(
            f"most modes are still more than {MAX_OFF:g} % off: are the targets in Hz, with the"
            " right labels, at this pressure?"
        )
    values = result["singular_values"]
    if not result.get("prior") and values and values[-1] < MIN_SINGULAR_RATIO * values[0]:
        doubts.append("the data do not determine all variables: see singular_values in fit.json")
    if labels := result.get("labels"):
        doubts += Labels(**labels).doubts()
    return doubts


def map_resolution(combinations: int) -> str:
    """Resolution of the map on the section: its effective rank in words."""
    if not combinations:
        return (
            "A change of 20 % in stiffness or 10 % in mass of any parts would be within the"
            " scatter of these data. The map is at most a hint of a larger change of one part."
        )
    return (
        f"The data see {combinations} independent combination{'s' if combinations > 1 else ''} of"
        " parts (changes of 20 % in stiffness, 10 % in mass, beyond their scatter)."
    )


def shown(table: Table, *sections: Table) -> rich.Table:
    """Table for a terminal, with others as sections of it."""
    printed = _empty(table)
    for each in (table, *sections):
        if each is not table:
            printed.add_section()
            if each.columns:
                printed.add_row(*(Text(column.name, "bold") for column in each.columns))
        for row in each.rows:
            printed.add_row(*map(_cell, row))
    return printed


def _empty(table: Table) -> rich.Table:
    """An empty table of the terminal with the columns of ``table``."""
    # figures never break: on a narrow terminal only names and words do
    made = rich.Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1), pad_edge=False, show_edge=False)
    made.title, made.caption = table.title or None, table.caption or None
    for column in table.columns:
        figures = bool(column.form)
        made.add_column(
            Text(column.name),
            justify="right" if figures else "left",
            no_wrap=figures,
            overflow="fold",
        )
    return made


def _cell(cell: Cell) -> Text:
    """A cell as text; a deviation is coloured by its size."""
    # square brackets of names and labels are markup to rich unless they come as Text
    if isinstance(cell, Deviation):
        off = abs(cell.percent)
        colour = "green" if off < CLOSE else "yellow" if off < FAR else "red"
        return Text(f"{cell.value} ".lstrip()).append(f"{cell.percent:+z.2f}", colour)
    return Text(EMPTY_CELL if cell is None else cell)


def solvers_table(solvers: Sequence[Mapping[str, Any]]) -> Table:
    """The installed solvers and what they can do, or why they cannot."""
    rows = [
        [
            each["name"],
            each["version"] or "",
            each["dialect"] or "",
            each["problem"] or ", ".join(each["capabilities"]),
        ]
        for each in solvers
    ]
    return Table([Column(name, "") for name in ("solver", "version", "decks", "can do")], rows)
