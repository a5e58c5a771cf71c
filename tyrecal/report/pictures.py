"""The pictures of a study in its folder: section, modes on one sheet, VTU, convergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..simulate.evaluate.results import Evaluation
from ..simulate.modes.label import Label, Mode
from ..studies.fit.result import FitResult
from ..tyre.case import LoadedCase
from ..tyre.resolve import resolved
from .convergence import draw_convergence, draw_states
from .figure import save
from .revolve import placed
from .section import draw_section
from .sensitivities import mac_figures
from .shape_data import section_data
from .shapes import draw_modes_overview
from .vtu import write_vtu


def draw_evaluation(
    folder: Path,
    study: str,
    case: LoadedCase,
    evaluation: Evaluation,
    modes: Sequence[Mode],
    kind: str = "png",
) -> None:
    """Draw the section (STUDY_section) and the lowest `MAX_IN_OVERVIEW` modes (modes or
    STUDY_modes); write each mode as VTU (STUDY_mode_C_M[_KIND]).

    kind: one of `files.PICTURE_FORMATS`. Modes are drawn only if the solver gives them on the whole
    section; a 3-D solver gives them on the crown only. Nothing is drawn without a section.
    """
    if case.drawn is None:
        return
    mesh = resolved(case).mesh
    inflation, modes = placed(evaluation, modes, mesh)  # displacements on the nodes of this mesh
    section = section_data(case, mesh, inflation)
    figure = draw_section(section, case.case.name, evaluation.pressure_kPa)
    save(figure, folder / f"{study}_section.{kind}")
    if modes:
        overview = f"modes.{kind}" if study == "modes" else f"{study}_modes.{kind}"
        draw_modes_overview(folder / overview, modes, mesh)
    for mode in modes:
        write_vtu(folder / f"{study}_{file_name(mode.label)}.vtu", mode, mesh)


def draw_fit(
    folder: Path,
    case: LoadedCase,
    evaluation: Evaluation,
    modes: Sequence[Mode],
    history: Sequence[Mapping[str, Any]],
    fit: FitResult,
    kind: str = "png",
) -> None:
    """Draw the fitted design ``case``, the convergence and, for several states, fit_states.

    kind: one of `files.PICTURE_FORMATS`.
    """
    draw_evaluation(folder, "fit", case, evaluation, modes, kind)
    save(draw_convergence(history, fit.objective_unit), folder / f"convergence.{kind}")
    for name, figure in mac_figures(fit).items():
        save(figure, folder / f"{name}.{kind}")
    if fit.states and fit.modes:
        save(draw_states(fit), folder / f"fit_states.{kind}")


def file_name(label: Label) -> str:
    """Name of a mode's files: mode_2_1, mode_0_0_axial, ..."""
    return f"mode_{label.c}_{label.m}" + (f"_{label.kind}" if label.kind else "")
