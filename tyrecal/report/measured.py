"""Measured modes as a table, in words and as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from ..simulate.modes.label import BELT, Label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

    from ..measured.modal import LabelledMode, ModalTest

Array = np.ndarray

COMPONENTS = ("radial", "tangential", "axial")  # r, theta, z
MIN_COSINE = 0.9  # of the angle between a sensor and a component that it is drawn as
AMPLITUDE = 0.35  # largest motion drawn, over the radius of the ring
PER_ROW = 5  # shapes in a row of a picture
MAX_SHAPES = 20  # shapes in a picture


def measured_table(runs: Sequence[ModalTest]) -> Table:
    """Modes of each run: label, frequency, damping, and how sure the label is."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, title="modes found")
    for name in ("label", "Hz", "sigma Hz", "damping %", "sure", ""):
        table.add_column(name, justify="left" if name in ("label", "") else "right")
    for run in runs:
        table.add_section()
        table.add_row(Text(Path(run.name).name, "bold"))
        for labelled in run.modes:
            label, sigma = labelled.judged.label, labelled.mode.sigma_Hz
            member = f" member {labelled.member}" if labelled.member else ""
            table.add_row(
                Text(f"{label.display}{member}" if label else "-"),
                f"{labelled.mode.frequency_Hz:.2f}",
                f"{sigma:.3f}" if np.isfinite(sigma) else "-",
                f"{100 * labelled.mode.damping:.2f}" if np.isfinite(labelled.mode.damping) else "-",
                f"{labelled.judged.confidence:.2f}",
                Text(labelled.judged.why),
            )
    return table


def sensors_words(alike_labels: Mapping[Label, Sequence[Label]]) -> str:
    """Labels that sensors can and cannot distinguish, one line per c.

    alike_labels: for each label the others that look like it, from `Labeller.looks_like`.
    """
    lines = []
    for c in sorted({label.c for label in alike_labels}):
        mine = {label: alike for label, alike in alike_labels.items() if label.c == c}
        distinct = ", ".join(label.display for label, alike in mine.items() if not alike)
        confused = [
            f"cannot tell {label.display}, it looks like {_few(alike)}"
            for label, alike in mine.items()
            if alike
        ]
        lines.append("; ".join([f"can tell {distinct}"] * bool(distinct) + confused))
    return "\n".join(lines)


def _few(labels: Sequence[Label], most: int = 4) -> str:
    more = len(labels) - most
    return ", ".join(label.display for label in labels[:most]) + (
        f" and {more} more" if more > 0 else ""
    )


def draw_measured(path: Path, runs: Sequence[ModalTest]) -> None:
    """Draw one run: its functions with the modes, and each shape on a ring, with the sensors of the
    belt displaced by their motion and c waves through them.

    The run is the first one with functions, or else the first one.
    """
    from .figure import in_house_style

    in_house_style(_draw)(path, runs)


def _draw(path: Path, runs: Sequence[ModalTest]) -> None:
    """Draw functions and mode shapes of the first run that has functions."""
    from .figure import new_figure, save

    run = next((each for each in runs if each.functions is not None), runs[0])
    modes = run.modes[:MAX_SHAPES]
    rows = -(-len(modes) // PER_ROW)
    top = run.functions is not None
    figure = new_figure(10.0, 3.4 * top + 2.35 * rows)
    grid = figure.add_gridspec(top + rows, PER_ROW, height_ratios=[3.4] * top + [2.35] * rows)
    if top:
        _draw_functions(figure.add_subplot(grid[0, :]), run)
    for number, labelled in enumerate(modes):
        place = grid[top + number // PER_ROW, number % PER_ROW]
        _draw_shape(figure.add_subplot(place), labelled)
    save(figure, path)


def _draw_functions(axes: Axes, run: ModalTest) -> None:
    """Draw the root mean square over all functions, as measured and as the modes reproduce it."""
    from .figure import COLOURS, GREY

    assert run.functions is not None and run.fitted is not None and run.frequency_Hz is not None
    size = lambda H: np.sqrt(np.mean(np.abs(H) ** 2, axis=0))  # NaN outside the band
    f, measured, fitted = run.frequency_Hz, size(run.functions), size(run.fitted)
    axes.semilogy(f, measured, color=GREY, lw=2.6, alpha=0.6, label="measured")
    axes.semilogy(f, fitted, color=COLOURS[1], lw=1.1, label="made by the modes")
    inside = [labelled.mode.frequency_Hz for labelled in run.modes]
    axes.set_ylim(0.5 * measured[measured > 0].min(), 6.0 * measured.max())
    before, level = -np.inf, 0
    for labelled in run.modes:
        hertz = labelled.mode.frequency_Hz
        axes.axvline(hertz, color=COLOURS[0], lw=0.7, ls=(0, (4, 3)))
        level = level + 1 if hertz - before < 0.08 * (f[-1] - f[0]) else 0
        name = labelled.judged.label.display if labelled.judged.label else "?"
        axes.annotate(
            name,
            (hertz, 1.0),
            (2, -9 - 13 * level),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            fontsize=8,
            color=COLOURS[0],
            bbox={"fc": "white", "ec": "none", "pad": 0.8},
        )
        before = hertz
    axes.set_xlim(min(f[0], *inside), f[-1])
    axes.set_xlabel("frequency, Hz")
    axes.set_ylabel("response over force")
    words = f"{Path(run.name).name}: root mean square over {len(run.functions)} functions"
    axes.set_title(fill(words, 90), loc="left", pad=8)
    axes.legend(loc="lower right", facecolor="white", edgecolor="none", framealpha=1)


def _component_to_draw(label: Label | None, mean_squares: Sequence[float]) -> int:
    """Index in `COMPONENTS` of the motion that has the same sign over the width of the tread.

    It is axial for odd m and [0,0] lateral, where the belt tilts or shifts, else the larger of the
    other two. If no sensor measured it (mean square 0), the largest one is drawn.
    """
    order = [int(k) for k in np.argsort(-np.array(mean_squares))]
    if label is not None:
        tilts = label.m % 2 == 1 or label.kind == "axial"
        order = [2] if tilts else [k for k in order if k != 2]
    return next((k for k in order if mean_squares[k] > 0), int(np.argmax(mean_squares)))


def _draw_shape(axes: Axes, labelled: LabelledMode) -> None:
    """Draw one component of the belt's motion, as a radial displacement of its sensors."""
    from .figure import COLOURS, GREY

    R, angle, _ = labelled.sensors.points.T  # m, rad
    belt = R / R.max() > BELT  # sensors on the belt and not on a sidewall, as in `label`
    along = labelled.sensors.directions  # (k, 3) unit vectors in COMPONENTS
    rows = [np.flatnonzero(belt & (np.abs(along[:, k]) > MIN_COSINE)) for k in range(3)]
    motion = [labelled.shape[rows[k]] * np.sign(along[rows[k], k]) for k in range(3)]
    mean_squares = [np.mean(u**2) if len(u) else 0.0 for u in motion]
    k = _component_to_draw(labelled.judged.label, mean_squares)
    u, at = motion[k], angle[rows[k]]
    turn = np.linspace(0, 2 * np.pi, 361)
    axes.plot(np.cos(turn), np.sin(turn), color="0.8", lw=0.8)
    scale = AMPLITUDE / (np.abs(u).max() if len(u) else 1.0)
    label = labelled.judged.label
    if label is not None and len(u):
        waves = lambda x: np.column_stack([np.cos(label.c * x), np.sin(label.c * x)])
        line = 1 + scale * waves(turn) @ np.linalg.lstsq(waves(at), u, rcond=None)[0]
        axes.plot(line * np.cos(turn), line * np.sin(turn), color=COLOURS[1], lw=1.2)
    for moved, where in zip(1 + scale * u, at, strict=True):
        axes.plot(
            np.array([1, moved]) * np.cos(where),
            np.array([1, moved]) * np.sin(where),
            color=GREY,
            lw=0.8,
        )
        axes.plot(moved * np.cos(where), moved * np.sin(where), "o", ms=4, color=COLOURS[0])
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.45, 1.45)
    axes.set_ylim(-1.45, 1.45)
    member = f" {labelled.member}" if labelled.member else ""
    name = f"{label.display if label else 'no label'}{member}"
    axes.set_title(f"{name}, {labelled.mode.frequency_Hz:.2f} Hz", fontsize=9)
    axes.text(
        0,
        0,
        f"{COMPONENTS[k]}\n{labelled.judged.confidence:.2f}",
        ha="center",
        va="center",
        fontsize=8,
        color=GREY,
    )
