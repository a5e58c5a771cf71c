"""Mode shapes and the section on the page; shapes are packed for its script as 16 bit whole numbers
in base64."""

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
from .parts import Block, Chapter, PageSection, Paragraphs, ShapeViewer, lists_of

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
