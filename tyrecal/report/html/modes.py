"""Modes of one design on the page, with their shapes and, without a fit, the section.

Shapes are packed for the page's script as 16 bit whole numbers in base64.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ...files import Json
from ...simulate.modes.label import Label
from ...studies.modes import ModesResult
from ...studies.result import Named
from ...tyre.case import as_written
from ..section import draw_section
from ..shape_data import Shape, Shapes
from .parts import (
    Block,
    Chapter,
    KeyFigure,
    PageSection,
    PageTable,
    Paragraphs,
    ShapeViewer,
    StudyPart,
    lists_of,
    sentence,
    usual_part,
)

INT16_MAX = 32767
PAGE_ANGLES = 60  # round the circumference, in the page


def shape_section(
    chapter: Chapter, what: str, heading: str, shapes: Shapes | None, table: Sequence[Named]
) -> PageSection:
    """Shapes of the modes of a study that turn and vibrate, or why there are none; table: the modes
    that they must be of. Raises InputError."""
    why = ""
    if shapes is None:
        why = f"The mode shapes are not in this folder; 'tyrecal {what} --report' keeps them."
    elif not shapes.are_of(table):
        why, shapes = "The mode shapes in this folder are from another run: not shown.", None
    elif not shapes.modes:
        why = "This solver gives shapes on the crown only, so there is no section to revolve."
    blocks: list[Block] = [Paragraphs("absent", [why])] if why else []
    if shapes and shapes.modes:
        with lists_of(chapter.results.folder / f"{what}_shapes.json"):
            blocks.append(ShapeViewer(f"{what}-data", packed(shapes), heading))
    if shapes and shapes.load_N:
        heading += f" under {shapes.load_N:g} N, on the tread"
    if shapes and shapes.provenance and shapes.provenance.overrides:
        given = shapes.provenance.overrides.items()
        changes = (f"{name} = {as_written(value)}" for name, value in given)
        heading += f", with {', '.join(changes)}"
    return PageSection(f"{what}-shapes", heading, blocks)


def section_drawing(chapter: Chapter) -> Iterator[PageSection]:
    """The section of the fitted tyre, or of that whose modes are known. Raises InputError."""
    results = chapter.results
    fit, modes = results.fit, results.get(ModesResult)
    for what, shapes, table in (
        ("fit", results.fit_shapes, fit.of_first_state if fit else ()),
        ("modes", results.modes_shapes, modes.modes if modes else ()),
    ):
        if shapes and shapes.section and table and shapes.are_of(table):
            plot = partial(draw_section, shapes.section, shapes.case, shapes.pressure_kPa)
            drawing = chapter.figure("section", f"{what}_shapes.json", plot)
            yield PageSection("section", "Section", [drawing])
            return


def packed(shapes: Shapes) -> Json:
    """Data that `viewer.js` reads: points and modes; a surface round the section's outside that the
    script sweeps, or the loaded tyre's as it is.

    Places are over the largest distance from the tyre's centre, angles over a full turn, shapes
    over their largest component: all are from -1 to 1. Raises ValueError where lists that belong
    together differ in length.
    """
    return _loaded(shapes) if shapes.load_N else _swept(shapes)


def _swept(shapes: Shapes) -> Json:
    """Shapes of unloaded modes for the viewer, to be swept round the axle. Raises ValueError."""
    R, Z = np.array(shapes.R_m, float), np.array(shapes.Z_m, float)
    if len(R) != len(Z) or len(R) < 2:
        raise ValueError("points")
    radius = float(np.hypot(R, Z).max())
    modes = []
    for mode in shapes.modes:
        both = np.array([mode.real, mode.imaginary], float)
        if both.shape != (2, len(R), 3):
            raise ValueError(mode.c)
        modes.append({**_named(mode), "n": mode.n, "shape": _base64(both)})
    return {
        "kind": "swept",
        "points": len(R),
        "angles": PAGE_ANGLES,
        "place": _base64(np.stack([R, Z]) / radius),
        "modes": modes,
    }


def _loaded(shapes: Shapes) -> Json:
    """Shapes of modes under load for the viewer, node by node. Raises ValueError."""
    angles, place = np.array(shapes.angles, float), np.array(shapes.surface_m, float)
    if place.ndim != 3 or place.shape[::2] != (len(angles), 3):
        raise ValueError("points")
    place = place.copy()  # (ring, point, 3): r, theta, z, m
    place[..., 2] -= (place[..., 2].max() + place[..., 2].min()) / 2
    radius = float(np.linalg.norm(place, axis=-1).max())
    modes = []
    for mode in shapes.modes:
        moved = np.array(mode.displacement, float)
        if moved.shape != place.shape:
            raise ValueError(mode.c)
        modes.append({**_named(mode), "shape": _base64(moved)})
    return {
        "kind": "loaded",
        "points": place.shape[1],
        "angles": len(angles),
        "angle": _base64(angles / (2 * np.pi)),
        "place": _base64(place / radius),
        "modes": modes,
    }


def _named(mode: Shape) -> dict[str, str]:
    symmetry = f" {mode.symmetry}" if mode.symmetry else ""
    return {
        "name": Label(mode.c, mode.m, mode.kind).display + symmetry,
        "hertz": f"{mode.frequency_Hz:.2f} Hz",
        "words": mode.label.motion,
    }


def _base64(values: np.ndarray) -> str:
    """Values of -1 to 1, little end first."""
    whole = np.rint(np.clip(values, -1, 1) * INT16_MAX).astype("<i2")
    return b64encode(whole.tobytes()).decode("ascii")


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
