"""Frequencies over the pressure and footprints over the load, on the page."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from ...studies.footprint import FootprintResult
from ...studies.pressure_result import PressureSweep
from ..footprint import draw_curves, draw_patches
from ..frequencies import draw_pressure_sweep
from .parts import Block, Chapter, PageFigure, Paragraphs, StudyPart, usual_part


def pressure_part(sweep: PressureSweep, chapter: Chapter) -> StudyPart:
    """The sweep's part of a page, with the targets of the fit. Raises InputError."""
    fit = chapter.results.fit
    plot = partial(draw_pressure_sweep, sweep.rows, fit.over_pressure() if fit else [])
    return usual_part(sweep, [chapter.figure("pressure", f"{sweep.stem}.json", plot)])


def footprint_part(footprint: FootprintResult, chapter: Chapter) -> StudyPart:
    """The part of the footprints of a page; the pressure in the patches is in a file of its own.
    Raises InputError."""
    more: list[Block] = []
    if not chapter.results.patches:
        words = "The pressure in the patches (footprint_patches.json) is not in this folder;"
        more.append(Paragraphs("absent", [f"{words} 'tyrecal footprint' keeps it."]))
    return usual_part(footprint, _figures(footprint, chapter), more=more)


def _figures(footprint: FootprintResult, chapter: Chapter) -> Iterator[PageFigure]:
    known = {(row.design, row.load_N) for row in footprint.rows}
    patches = chapter.results.patches.patches if chapter.results.patches else []
    patches = [each for each in patches if (each.design, each.load_N) in known]
    yield chapter.figure("curves", "footprint.json", partial(draw_curves, footprint.rows))
    highest = max((row.peak_pressure_Pa for row in footprint.rows), default=0.0) / 1e3
    for design in dict.fromkeys(patch.design for patch in patches):
        own = [patch for patch in patches if patch.design == design]
        plot = partial(draw_patches, own, highest)
        yield chapter.figure(f"patches-{design}", "footprint_patches.json", plot)
