"""Modes of one design on the page, with their shapes and, without a fit, the section."""

from __future__ import annotations

from ...studies.modes import ModesResult
from .parts import Chapter, KeyFigure, PageTable, StudyPart, sentence, usual_part
from .shapes import section_drawing, shape_section

LABEL_WORDS = (
    "[c,m]: c waves round the circumference, m nodal circles on the belt; ×2: a pair of modes."
)
COLUMN_WORDS = {
    "clarity": "clarity: share of the motion that the label explains, less that of the next label",
    "sliding_Hz": "sliding: frequency if nothing holds the patch along the road",
    "grip_mm": "grip: motion of the crown at which the whole patch slides",
    "overlap": "overlap: with the unloaded shape of this label, 1 for an equal one",
}


def part(modes: ModesResult, chapter: Chapter) -> StudyPart:
    """The part of the modes of a page. Raises InputError."""
    results = chapter.results
    heading = "Mode shapes of the initial tyre" if _is_initial(modes, chapter) else "Mode shapes"
    sections = [shape_section(chapter, "modes", heading, results.modes_shapes, modes.modes)]
    if not results.fit:
        sections += section_drawing(chapter)
    hertz = [mode.frequency_Hz for mode in modes.modes]
    span = f"{min(hertz):.1f} to {max(hertz):.1f} Hz"
    state = f"{modes.pressure_kPa:g} kPa" + f", {modes.load_N:g} N" * bool(modes.load_N)
    key_figures = [
        KeyFigure("Frequencies", span, f"{len(hertz)} modes at {state}"),
        KeyFigure("Mass", f"{modes.mass_kg:.2f} kg", "tyre without rim"),
    ]
    usual = usual_part(modes, (), key_figures, modes_words(modes), sections=sections)
    shown = {key for mode in modes.modes for key in COLUMN_WORDS if getattr(mode, key) is not None}
    for block in usual.sections[0].blocks:
        if isinstance(block, PageTable):
            words = sentence("; ".join(x for key, x in COLUMN_WORDS.items() if key in shown))
            block.caption = f"Modes at {block.caption}. {LABEL_WORDS} {words}".rstrip(". ")
    return usual


def modes_words(modes: ModesResult) -> list[str]:
    """How many modes, where, of what tyre."""
    hertz = [mode.frequency_Hz for mode in modes.modes]
    where = f"{modes.pressure_kPa:g} kPa" + (f" under {modes.load_N:g} N" if modes.load_N else "")
    words = [
        f"{len(hertz)} frequencies from {min(hertz):.1f} to {max(hertz):.1f} Hz at {where}; the"
        f" tyre weighs {modes.mass_kg:.2f} kg."
    ]
    if modes.deflection_m is not None:
        words.append(f"The axle moves {1e3 * modes.deflection_m:.1f} mm down.")
    return [*words, *map(sentence, modes.findings.words)]


def _is_initial(modes: ModesResult, chapter: Chapter) -> bool:
    """Whether the modes are those of the design that the fit started from."""
    fit = chapter.results.fit
    if not fit:
        return False
    start = {name: each.initial for name, each in fit.variables.items()} | fit.fixed
    return modes.variables == start
