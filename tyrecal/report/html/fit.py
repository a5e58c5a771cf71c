"""A fit on the page: key figures, frequencies, variables, residuals, course, shapes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from ...studies.fit.result import FitResult
from ...units import display_unit, printed_value
from ..convergence import draw_convergence, draw_deviations, draw_states
from ..fit import draw_bounds, draw_correlations, draw_normalised, draw_responses, farthest
from ..sensitivities import mac_figures
from ..table import CLOSE, FAR, ended_words, fit_doubts, nearness
from .modes import LABEL_WORDS, section_drawing, shape_section
from .parts import (
    Block,
    Chapter,
    CsvFiles,
    KeyFigure,
    PageFigure,
    PageSection,
    PageTable,
    Paragraphs,
    StudyPart,
    usual_part,
)

CAPTIONS = "Targets, with frequencies in Hz and deviations in %", "Variables with standard errors"


def part(fit: FitResult, chapter: Chapter) -> StudyPart:
    """The fit's part of a page. Raises InputError."""
    results = chapter.results
    usual = usual_part(fit, _figures(fit, chapter), [*_key_figures(fit)], fit_words(fit))
    own = usual.sections[0]
    for table, caption in zip(
        (x for x in own.blocks if isinstance(x, PageTable)), CAPTIONS, strict=False
    ):
        table.caption = caption
    blocks: list[Block] = [Paragraphs("facts", [_facts(fit)]), *own.blocks]
    if results.fit_shapes and results.fit_shapes.variables:
        sets = results.fit_shapes.variables.items()
        words = "; ".join(f"{name} sets {' and '.join(paths)}" for name, paths in sets)
        blocks.append(Paragraphs("legend", [f"{words}."]))
    if results.history_csv:
        blocks.append(CsvFiles({"fit_history.csv": results.history_csv}))
    else:
        words = "The history of the fit (fit_history.csv) is not in this folder."
        blocks.append(Paragraphs("absent", [words]))
    heading = "Shapes of the fitted tyre"
    shapes = shape_section(chapter, "fit", heading, results.fit_shapes, fit.of_first_state)
    sections = [PageSection(own.id, own.heading, blocks), shapes, *section_drawing(chapter)]
    return replace(usual, doubts=fit_doubts(fit.content()), sections=sections)


def _facts(fit: FitResult) -> str:
    starts = f", {len(fit.starts)} starts" if len(fit.starts) > 1 else ""
    return (
        f"{fit.pressure_kPa:.6g} kPa, {fit.mass_kg:.2f} kg, {fit.method}{starts}. ○ within"
        f" {CLOSE:g} %, ◐ within {FAR:g} %, ● beyond. A pair counts twice. {LABEL_WORDS}"
    )


def _figures(fit: FitResult, chapter: Chapter) -> Iterator[PageFigure]:
    """Figures of the fit, the deviations first."""
    if fit.states and fit.modes:
        yield chapter.figure("states", "fit.json", partial(draw_states, fit))
    elif fit.modes:
        yield chapter.figure("deviations", "fit.json", partial(draw_deviations, fit.modes))
    yield chapter.figure("bounds", "fit.json", partial(draw_bounds, fit))
    for name, draw in (
        ("normalised", draw_normalised),
        ("correlations", draw_correlations),
        ("responses", draw_responses),
    ):
        if figure := draw(fit):
            yield chapter.figure(name, "fit.json", partial(lambda drawn: drawn, figure))
    if history := chapter.results.history:
        plot = partial(draw_convergence, history, fit.objective_unit)
        yield chapter.figure("convergence", "fit_history.csv", plot)
    plots = mac_figures(fit)
    for name in plots:
        yield chapter.figure(name, "fit.json", partial(plots.__getitem__, name))


def _key_figures(fit: FitResult) -> Iterator[KeyFigure]:
    """Verdict, objective before and after, the farthest target, mass."""
    words = fit.verdict.replace("_", " ")
    chi2 = "" if fit.chi2_per_dof is None else f"chi2 per degree of freedom {fit.chi2_per_dof:.3g}"
    yield KeyFigure("Verdict of the fit", words, chi2 or ended_words(fit.content()).lower())
    unit = fit.objective_unit if fit.objective_unit == "Hz" else "sigma"
    yield KeyFigure(
        "Objective",
        f"{fit.initial_objective_Hz:.2f} → {fit.objective_Hz:.2f} {unit}",
        "before and after the fit",
    )
    if worst := farthest(fit):
        yield KeyFigure("Farthest from its target", f"{worst[1]:+z.1f} %", worst[0])
    yield KeyFigure("Mass", f"{fit.mass_kg:.2f} kg", "tyre without rim")


def fit_words(fit: FitResult) -> list[str]:
    """How the fit went, how near it came, where the variables went."""
    unit = fit.objective_unit if fit.objective_unit == "Hz" else "(deviations in sigmas)"
    # of the paper: cases/paper.md
    equation = "equation (1), " if fit.objective_unit == "Hz" else ""
    chi2 = ""
    if fit.chi2_per_dof is not None:
        chi2 = f" (chi2 per degree of freedom {fit.chi2_per_dof:.3g})"
    words = [
        f"{ended_words(fit.content())}{chi2}.",
        f"The objective ({equation}{fit.method}) went from {fit.initial_objective_Hz:.2f} to"
        f" {fit.objective_Hz:.2f} {unit} in {fit.evaluations} design points.",
    ]
    if fit.modes:
        words.append(f"{nearness(fit.model_dump()['modes'])}.")
    moves = []
    for name, v in fit.variables.items():
        unit, factor = display_unit(v.unit)
        share = f" ({100 * (v.value / v.initial - 1):+z.0f} %)" if v.initial else ""
        after = printed_value(v.value, v.unit)
        moves.append(f"{name} from {factor * v.initial:.4g} to {after}{share}")
    return [*words, f"{', '.join(moves)}."]
