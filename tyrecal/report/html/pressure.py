"""Frequencies over the pressure on the page, with the targets of the fit."""

from __future__ import annotations

from functools import partial

from ...studies.pressure_result import PressureSweep
from ..pressure import draw_pressure_sweep
from .parts import Chapter, StudyPart, usual_part


def part(sweep: PressureSweep, chapter: Chapter) -> StudyPart:
    """The sweep's part of a page. Raises InputError."""
    fit = chapter.results.fit
    plot = partial(draw_pressure_sweep, sweep.rows, fit.over_pressure() if fit else [])
    return usual_part(sweep, [chapter.figure("pressure", f"{sweep.stem}.json", plot)])
