"""A diagnosis on the page: verdict, probabilities, held-out errors, residuals, parts, and its page
in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from ...studies.diagnose.evidence import NONE, OUTSIDE
from ...studies.diagnose.result import DiagnosisResult
from ...studies.diagnose.several import present
from ...studies.diagnose.verdict import NO_GAP, no_gap_words
from ...studies.result import Column, Table
from ...units import display_unit
from ..diagnosis_pictures import MAX_SHOWN, MIN_SHOWN_PROBABILITY, draw_residuals
from ..section import draw_section_map
from ..table import map_resolution
from .parts import (
    BarFigure,
    Block,
    Chapter,
    KeyFigure,
    PageFigure,
    PageSection,
    Paragraphs,
    Prose,
    StudyPart,
    sentence,
    shown_table,
    usual_part,
)

# no more than the page uses: a stranger's text cannot bring links, pictures or HTML
MARKS = MarkdownIt("zero").enable(["heading", "table", "list", "backticks"])


@dataclass
class MarkdownSection:
    """Blocks under a heading; "": above all headings."""

    heading: str
    blocks: list[Block] = field(default_factory=list)


def sections(text: str, stem: str) -> list[MarkdownSection]:
    """Sections under the headings below the title, their tables for download as ``stem``_table;
    marks are paragraphs, numbered lists, tables and `code`. A paragraph that ends with a colon
    above a table is its caption."""
    parts, run = [MarkdownSection("")], list[Token]()

    def end_run() -> None:
        if run:
            html = MARKS.renderer.render(run, MARKS.options, {})
            parts[-1].blocks.append(Prose(Markup(html)))
            run.clear()

    tokens = iter(MARKS.parse(text))
    for token in tokens:
        if token.type == "heading_open":
            end_run()
            inner = next(tokens)
            next(tokens)  # its end
            if token.tag != "h1":
                parts.append(MarkdownSection(_plain(inner.content)))
        elif token.type == "table_open":
            words = ""
            if run and run[-1].type == "paragraph_close" and run[-2].content.endswith(":"):
                words = _plain(run[-2].content).rstrip(":")
                del run[-3:]
            end_run()
            caption = parts[-1].heading or stem
            parts[-1].blocks.append(shown_table(_table(tokens), words or caption, stem))
        else:
            run.append(token)
    end_run()
    return parts


def _table(tokens: Iterator[Token]) -> Table:
    """The table whose tokens come next."""
    rows: list[list[str]] = []
    for token in tokens:
        if token.type == "table_close":
            break
        if token.type == "tr_open":
            rows.append([])
        elif token.type == "inline":
            rows[-1].append(_plain(token.content))
    return Table([*map(Column, rows[0])], rows[1:])


def _plain(text: str) -> str:
    return text.replace("`", "")


VERDICT_WORDS = {
    "named": "Named",
    "undecided": "Undecided",
    "outside": "Not explained by the catalogue",
}
EXPLANATION_WORDS = {NONE: "no effect", OUTSIDE: "not explained by the catalogue"}


def part(d: DiagnosisResult, chapter: Chapter) -> StudyPart:
    """The part of a diagnosis of a page. Raises InputError."""
    usual = usual_part(d, (), [_key_figure(d)], diagnosis_words(d))
    words = sections(chapter.results.diagnosis_words, "diagnosis")
    answer, others = words[:2], words[2:]  # what is above the first heading, and below it
    blocks: list[Block] = [Paragraphs("verdict", [_verdict_line(d)])]
    blocks += [block for each in answer for block in each.blocks]
    blocks += [*_bars(d), *_figures(d, chapter), *usual.sections[0].blocks]
    for each in others:
        blocks += [Paragraphs("heading", [each.heading]), *each.blocks]
    if not chapter.results.diagnosis_words:
        if d.section_map:
            blocks.append(Paragraphs("facts", [map_resolution(d.effective_rank)]))
        absent = "The page in words (diagnosis.md) is not in this folder."
        blocks.append(Paragraphs("absent", [absent]))
    return replace(usual, sections=[PageSection(d.study, d.heading, blocks)])


def _verdict_line(d: DiagnosisResult) -> str:
    names = " or ".join(each.id for each in d.also)
    line = verdict_words(d) + f": {d.effect}" * bool(d.effect) + f", perhaps {names}" * bool(names)
    rung = f" Rung {d.rung} of 4 (strength of the proof)." if d.verdict == "named" else ""
    return f"{line}.{rung}"


def _key_figure(d: DiagnosisResult) -> KeyFigure:
    """The effect that the model lacks, or the verdict."""
    name, p = max(d.probabilities.items(), key=lambda item: item[1])
    value = verdict_words(d).split(":")[0]
    if d.effect:  # alone or with others
        name, p = d.effect, present(d.probabilities, d.effect.split("+"))
        value = d.effect.replace("_", " ").replace("+", " and ")
    more = f"{EXPLANATION_WORDS.get(name, name)}: probability {p:.2f}"
    return KeyFigure("What the model lacks", value, more)


def _bars(d: DiagnosisResult) -> Iterator[BarFigure]:
    """Probabilities of the explanations, and errors on held-out data."""
    shown = [
        (EXPLANATION_WORDS.get(key, key), p, f"{p:.2f}")
        for key, p in list(d.probabilities.items())[:MAX_SHOWN]
        if p >= MIN_SHOWN_PROBABILITY or key in EXPLANATION_WORDS
    ]
    yield BarFigure("Probability of each explanation", shown)
    if not (s := d.shrinkage):
        return
    errors = [("without an effect", s.before_percent), ("repeatability alone", s.floor_percent)]
    if d.verdict != NO_GAP:
        chance = s.before_percent * (1 - s.placebo_95)
        errors[1:1] = [(f"with {s.effect}", s.after_percent), ("by chance, 95 %", chance)]
    largest = max(*(value for _, value in errors), 1e-9)
    bars = [(name, value / largest, f"{value:.2f} %") for name, value in errors]
    yield BarFigure(f"Error on held-out data ({s.held_out}), rms", bars)


def _figures(d: DiagnosisResult, chapter: Chapter) -> Iterator[PageFigure]:
    known = [(row, each) for each in d.gap.residuals if not each.run and (row := each.of)]
    if known:
        in_ln = np.array([[each.percent, each.sigma_percent] for _, each in known]).T / 100
        plot = partial(draw_residuals, [row for row, _ in known], *in_ln)
        yield chapter.figure("residuals", "diagnosis.json", plot)
    place = chapter.results.diagnosis_section
    if place and d.section_map:
        drawing = partial(draw_section_map, place, d.section_map)
        yield chapter.figure("map", "diagnosis_section.json", drawing)


def diagnosis_words(result: DiagnosisResult) -> list[str]:
    """Verdict, size, how far the error shrinks, what next."""
    gap = result.verdict != "no_gap"
    words = [sentence(verdict_words(result) + (f": {result.words}" if gap else ""))]
    if result.effect:
        words[0] += f" Probability {present(result.probabilities, result.effect.split('+')):.2f}."
    if result.damping_ratios:
        words.append(f"{result.damping_ratios} damping ratios are weighed with the frequencies.")
    if result.robust:
        least, most = result.robust.range
        words.append(
            "It depends on labels that were exchanged: correct the file first."
            if result.exchanged_labels
            else f"Robust: {least:.2f} to {most:.2f} with other priors and standard deviations."
            if result.robust.robust
            else sentence(f"It depends on {result.robust.hangs_on[0]}")
        )
    if result.effect and result.parameter:
        p = result.parameter
        unit, factor = display_unit(p.unit)
        value, low, high = (f"{factor * x:.3g}" for x in (p.value, p.low, p.high))
        words.append(f"Its size is {value} {unit}".rstrip() + f", 90 % between {low} and {high}.")
    if result.shrinkage and gap:
        s = result.shrinkage
        words.append(
            f"On held-out data the error goes from {s.before_percent:.2f} to"
            f" {s.after_percent:.2f} % with {s.effect}: it shrinks by {100 * s.fraction:.0f} %,"
            f" chance alone reaches {100 * s.placebo_95:.0f} % (95 % quantile)."
        )
    if result.next_measurements:
        words.append(f"Next: {result.next_measurements[0].what}.")
    return words


def verdict_words(result: DiagnosisResult) -> str:
    """The verdict of a diagnosis in a few words."""
    if result.verdict == "no_gap":
        return no_gap_words(result.probabilities[NONE]).capitalize()
    return VERDICT_WORDS[result.verdict]
