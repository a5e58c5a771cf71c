"""Pictures of a diagnosis: residuals, probabilities, held-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from ..simulate.modes.label import Label
from ..studies.diagnose.diagnosis import Diagnosis
from ..studies.diagnose.evidence import NONE, OUTSIDE
from ..studies.diagnose.gap import family
from ..studies.diagnose.several import before
from ..studies.diagnose.verdict import SURE, no_gap_words
from ..studies.inference.observations import Observable
from .figure import COLOURS, GREY, headline, in_house_style, new_figure
from .section import draw_section_map
from .shape_data import DiagnosisSection

Array = np.ndarray
SHOWN_FAMILIES = ("[0,0]", "in-plane", "lateral")  # as `gap.family` names them
MAX_SHOWN = 12  # explanations
MIN_SHOWN_PROBABILITY = 0.005  # of one that is shown
PROBABILITY_TITLES = {
    "named": "What explains the gap",
    "undecided": "Undecided: how likely each explanation is",
    "outside": "Not explained by the catalogue: how likely each explanation is",
}
MAX_LETTERS = 24  # letters of a bar's name in a line


def draw_diagnosis(d: Diagnosis, parts: DiagnosisSection) -> dict[str, Figure]:
    """Figures by name, as far as there is what they show."""
    rows, gap = d.problem.observations.rows, d.gap
    after, effect = (_after(d), _within(d, d.leading)) if d.leading else (None, "")
    figures = {
        "residuals": draw_residuals(rows, gap.residuals, gap.spread, after, effect),
        "probabilities": draw_probabilities(d),
    }
    if d.shrinkage:
        figures["held_out"] = draw_held_out(d)
    if d.parts:
        figures["section"] = draw_section_map(parts, d.parts, d.effective_rank)
    return figures


@in_house_style
def draw_residuals(
    rows: Sequence[Observable],
    residuals: Array,
    spread: Array,
    after: Array | None = None,
    effect: str = "",
) -> Figure:
    """Residuals (n,) of the plain fit, ln of measured over model, over the harmonic, a column a
    family, a colour a state; hollow (``after``) with the likeliest ``effect`` in the model. Bars
    (``spread``): their standard deviation without a gap, `Gap.spread`. Only rows of run 0."""
    states = sorted(dict.fromkeys((row.pressure_kPa, row.rim or "") for row in rows if row.label))
    shown = [name for name in SHOWN_FAMILIES if any(family(row) == name for row in rows)]
    caption = (
        "Measured over model after calibration, %; bars: one standard deviation of a tyre without a"
        " gap"
    )
    figure = new_figure(2.0 + 2.8 * len(shown), 3.8, caption=caption)
    axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for panel, name in zip(axes, shown, strict=True):
        panel.axhline(0, color=GREY, lw=0.8)
        for k, (p, rim) in enumerate(states):
            here = [(row.pressure_kPa, row.rim or "") == (p, rim) and not row.run for row in rows]
            mine = [at and family(row) == name for at, row in zip(here, rows, strict=True)]
            chosen = np.flatnonzero(mine).tolist()
            at = np.array([_place(rows[i].label) for i in chosen])
            at = at + min(0.16, 0.6 / len(states)) * (k - (len(states) - 1) / 2)
            colour = COLOURS[k % len(COLOURS)]
            panel.errorbar(
                at,
                100 * residuals[chosen],
                100 * spread[chosen],
                fmt="o",
                color=colour,
                ms=5,
                lw=1,
                label=f"{p:g} kPa" + f", rim {rim}" * bool(rim),
            )
            if after is not None:
                panel.plot(at, 100 * after[chosen], "o", mfc="white", mec=colour, ms=5, zorder=3)
        panel.set_title("out-of-plane" if name == "lateral" else name, loc="left")
        kinds = name == "[0,0]"
        if kinds:
            panel.set_xticks([0, 1], ["lateral", "torsional"])
            panel.set_xlim(-0.6, 1.6)
        else:
            highest = max(row.label.c for row in rows if row.label and family(row) == name)
            panel.set_xticks(range(1, highest + 1))
            panel.set_xlim(0.4, highest + 0.6)
            panel.set_xlabel("harmonic c")
    axes[0].set_ylabel("measured over model, %")
    words = "What calibration leaves; bars: one standard deviation of a tyre without a gap"
    with_effect = f"; hollow: with {effect}" if after is not None else ""
    headline(figure, f"{words}{with_effect}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(len(states), 3), frameon=False
    )
    return figure


@in_house_style
def draw_probabilities(d: Diagnosis) -> Figure:
    """Probabilities of the likeliest explanations: bars after the data, marks before (the
    prior)."""
    order = sorted(d.hypotheses, key=lambda h: -d.probabilities[h.key])[:MAX_SHOWN]
    order = [
        h
        for h in order
        if d.probabilities[h.key] >= MIN_SHOWN_PROBABILITY or h.key in (NONE, OUTSIDE)
    ]
    figure = new_figure(7.4, 1.4 + 0.34 * len(order))
    axes = figure.add_subplot()
    place = np.arange(len(order))[::-1]
    colours = ["0.6" if h.key in (NONE, OUTSIDE) else COLOURS[0] for h in order]
    p = [d.probabilities[h.key] for h in order]
    axes.barh(place, p, color=colours, height=0.7)
    prior = [before(d.hypotheses)[h.key] for h in order]
    axes.plot(prior, place, "|", color="black", ms=13, mew=1.5, label="prior")
    for y, value, least in zip(place, p, prior, strict=True):
        axes.text(max(value, least) + 0.01, y, f"{value:.2f}", va="center", fontsize=8)
    axes.axvline(SURE, color=GREY, lw=0.8, ls=":", label="named from here on, alone or summed")
    axes.set_yticks(place, [fill(_short(d, h.key), 2 * MAX_LETTERS) for h in order])
    axes.set_xlim(0, max(1.0, 1.1 * max(p)))
    axes.set_xlabel("probability")
    title = PROBABILITY_TITLES.get(d.verdict.kind)
    none = no_gap_words(d.probabilities[NONE]).capitalize()
    headline(figure, title or f"{none}; how likely each effect is")
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside lower right", ncols=2, frameon=False
    )
    return figure


@in_house_style
def draw_held_out(d: Diagnosis) -> Figure:
    """The error on held-out data without and, where there is a gap, with the effect, next to the
    noise floor and to the error with a random effect in its place: a shrinkage is 1 - after /
    before, and 95 % of random effects shrink it by ``placebo_95`` at most."""
    s = d.shrinkage
    assert s is not None
    figure = new_figure(6.4, 3.4)
    axes = figure.add_subplot()
    names = ["without an effect"]
    axes.bar([0], [s.before_percent], color="0.6", width=0.55)
    if d.leading:
        names.append(f"{fill(f'with {_within(d, s.effect)}', MAX_LETTERS)}\n(line: 90 % range)")
        axes.bar([1], [s.after_percent], color=COLOURS[0], width=0.55)
        low, high = (s.before_percent * (1 - r) for r in (s.high, s.low))
        axes.plot([1, 1], [low, high], color="black", lw=1.2)
        axes.plot([1, 1], [low, high], "_", color="black", ms=10)
        chance = s.before_percent * (1 - s.placebo_95)
        axes.axhline(
            chance, color=GREY, lw=1.2, ls=(0, (5, 3)), label="as far as chance\nshrinks it (95 %)"
        )
    axes.axhline(s.floor_percent, color=GREY, lw=1.2, ls=":", label="repeatability alone")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.5, 1.5)
    axes.set_ylim(bottom=0)
    axes.set_ylabel("rms error, %")
    headline(figure, f"Held out: {s.held_out}")
    return figure


def _after(d: Diagnosis) -> Array | None:
    """Residuals (n,) with the leading effect at its likeliest size; None without one."""
    if d.leading is None:
        return None
    h = d.hypothesis(d.leading)
    i = h.best  # in the grid of sizes
    problem = replace(d.problem, zeta=float(h.fitted.zeta[i]))
    eta = problem.predicted({id: e[[i]] for id, e in h.values.items()}, h.fitted.d[[i]])
    return np.asarray(problem.observations.y - eta[0])


def _place(label: Label | None) -> float:
    assert label is not None  # rows without one have no `family`
    return {"axial": 0.0, "torsional": 1.0}.get(label.kind or "", float(label.c))


def _short(d: Diagnosis, key: str | None) -> str:
    ranges = d.problem.ranges
    if key in (NONE, OUTSIDE) or key is None:
        return {NONE: "No effect", OUTSIDE: "Not explained by the catalogue"}.get(key or "", "")
    return " + ".join((ranges[id].title or id) for id in key.split("+"))


def _within(d: Diagnosis, key: str | None) -> str:
    """As `_short`, within a sentence; key None: empty."""
    words = _short(d, key)
    return words[:1].lower() + words[1:]
