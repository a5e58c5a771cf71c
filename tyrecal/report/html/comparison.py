"""Fits and diagnoses of several folders side by side, a column a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from ...studies.diagnose.result import DiagnosisResult
from ...studies.fit.result import ROAD_QUANTITIES, FitResult
from ...studies.fit.result_parts import FittedMode
from ...studies.result import Column, Table
from ...units import printed_value, signed
from ..fit import farthest
from ..table import CLOSE, FAR, MINUS
from .diagnosis import verdict_words
from .parts import PageSection, PageTable, Paragraphs, shown_table
from .results import Results

Content = TypeVar("Content")
NOTHING, NB = "–", "\N{NO-BREAK SPACE}"
LEGEND = (
    f"○ within {CLOSE:g} %, ◐ within {FAR:g} %, ● beyond. Compare objectives only if the fits have"
    " the same targets. Objectives in sigmas count standard deviations."
)
UNITS = {"Hz": "Hz", "sigma": "sigmas"}


@dataclass(frozen=True)
class ComparisonRow:
    """A row: its name, more of it in small letters, and a cell per folder."""

    name: str
    more: str
    cells: list[str]


@dataclass(frozen=True)
class Group:
    """Rows under a heading."""

    heading: str
    rows: list[ComparisonRow]


@dataclass
class ComparisonTable(PageTable):
    """Rows in groups, a column a folder; folders: id, name and case of each."""

    groups: Sequence[Group] = ()
    folders: Sequence[tuple[str, str, str]] = ()
    kind = "comparison"


def comparison(results: Sequence[Results], prefixes: Sequence[str]) -> PageSection | None:
    """The section that sets folders side by side; None where fewer than two hold a fit or a
    diagnosis. prefixes: of the folders' ids."""
    if sum(bool(each.fit or each.diagnosis) for each in results) < 2:
        return None
    groups, names = comparison_groups(results), [each.folder.resolve().name for each in results]
    rows = [
        [f"{row.name} {row.more}".rstrip(), *row.cells] for group in groups for row in group.rows
    ]
    heads = [Column("", ""), *(Column(name) for name in names)]
    plain = shown_table(Table(heads, rows), "Fits and diagnoses side by side", "comparison")
    folders = [
        (f"{prefix}top", name, each.case)
        for prefix, name, each in zip(prefixes, names, results, strict=True)
    ]
    table = ComparisonTable(
        plain.table, plain.caption, plain.file, plain.text, groups=groups, folders=folders
    )
    return PageSection("comparison", "Side by side", [Paragraphs("legend", [LEGEND]), table])


def comparison_groups(results: Sequence[Results]) -> list[Group]:
    """Objective, variables, deviations of the fits, verdicts of the diagnoses."""
    fits, diagnoses = [each.fit for each in results], [each.diagnosis for each in results]
    groups = []
    if any(fits):
        names = dict.fromkeys(n for fit in fits if fit for n in (*fit.variables, *fit.fixed))
        aims = dict.fromkeys(aim for fit in fits if fit for aim in _deviations(fit))
        groups = [
            Group("Fit", list(_whole(fits))),
            Group(
                "Variables ± standard error",
                [ComparisonRow(n, "", _cells(fits, partial(_variable, name=n))) for n in names],
            ),
            Group(
                "Fitted over target, %",
                [ComparisonRow(*aim, _cells(fits, partial(_graded, aim=aim))) for aim in aims],
            ),
        ]
    if any(diagnoses):
        groups.append(Group("Diagnosis", list(_verdicts(diagnoses))))
    return groups


def _whole(fits: Sequence[FitResult | None]) -> Iterator[ComparisonRow]:
    """Rows of the comparison that belong to no single variable or mode."""
    yield ComparisonRow(
        "objective", "initial", _cells(fits, lambda fit: _objective(fit, "initial_"))
    )
    yield ComparisonRow("objective", "fitted", _cells(fits, _objective))
    yield ComparisonRow("worst target", "", _cells(fits, _worst))
    yield ComparisonRow("verdict", "chi2 per degree of freedom", _cells(fits, _fit_verdict))
    yield ComparisonRow("converged", "design points", _cells(fits, _end))
    yield ComparisonRow("pressure", "", _cells(fits, _pressures))
    yield ComparisonRow(
        "mass", "tyre without rim", _cells(fits, lambda fit: f"{fit.mass_kg:.2f} kg")
    )


def _verdicts(diagnoses: Sequence[DiagnosisResult | None]) -> Iterator[ComparisonRow]:
    yield ComparisonRow("verdict", "", _cells(diagnoses, verdict_words))
    yield ComparisonRow("likeliest", "probability", _cells(diagnoses, _likeliest))


def _cells(contents: Sequence[Content | None], tell: Callable[[Content], str]) -> list[str]:
    return [NOTHING if each is None else tell(each) for each in contents]


def _objective(fit: FitResult, when: str = "") -> str:
    return f"{getattr(fit, f'{when}objective_Hz'):.2f} {UNITS.get(fit.objective_unit, '')}".strip()


def _fit_verdict(fit: FitResult) -> str:
    words = fit.verdict.replace("_", " ")
    return words if fit.chi2_per_dof is None else f"{words}, {fit.chi2_per_dof:.3g}"


def _end(fit: FitResult) -> str:
    return f"{'yes' if fit.converged else 'no'}, {fit.evaluations}"


def _pressures(fit: FitResult) -> str:
    pressures = dict.fromkeys(each.pressure_kPa for each in fit.states) or [fit.pressure_kPa]
    return f"{', '.join(f'{p:g}' for p in pressures)} kPa"


def _worst(fit: FitResult) -> str:
    worst = farthest(fit)
    return f"{worst[0]} {_grade(worst[1])}{NB}%" if worst else NOTHING


def _aim(mode: FittedMode) -> tuple[str, str]:
    """Name, and what is added in small letters, of a mode's row."""
    return mode.named()[0].removesuffix(" ×2"), ", ".join(
        filter(None, (mode.label.motion, mode.state))
    )


def _variable(fit: FitResult, name: str) -> str:
    """Value and standard error of a variable in one fit, as text."""
    if name in fit.fixed:
        return f"{printed_value(fit.fixed[name], fit.fixed_units.get(name, ''))} held"
    known = fit.variables.get(name)
    if known is None:
        return NOTHING
    error = known.percent(known.standard_error_total or known.standard_error)
    spread = f" ±{NB}{error}{NB}%" if error else ""
    return (
        f"{printed_value(known.value, known.unit)}{spread}{', at bound' if known.at_bound else ''}"
    )


def _deviations(fit: FitResult) -> dict[tuple[str, str], float]:
    """Deviations in per cent, by target."""
    return {_aim(mode): mode.deviation_percent for mode in fit.modes} | {
        (each.state, ROAD_QUANTITIES[each.quantity].name.split(",")[0]): each.deviation_percent
        for each in fit.others
    }


def _graded(fit: FitResult, aim: tuple[str, str]) -> str:
    off = _deviations(fit).get(aim)
    return NOTHING if off is None else _grade(off)


def _grade(off: float) -> str:
    """A deviation in per cent with the mark of how near it is."""
    grade = "○" if abs(off) <= CLOSE else "◐" if abs(off) <= FAR else "●"
    return f"{grade}{NB}{signed(off, 2)}".replace("-", MINUS)


def _likeliest(diagnosis: DiagnosisResult) -> str:
    name, p = max(diagnosis.probabilities.items(), key=lambda item: item[1])
    return f"{name} {p:.2f}"
