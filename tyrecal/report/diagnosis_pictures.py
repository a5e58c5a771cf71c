"""Pictures of a diagnosis: residuals, probabilities, held-out errors, the section's map."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize

from ..case import LoadedCase
from ..deck.context import section_mesh
from ..diagnose.diagnosis import Diagnosis
from ..diagnose.evidence import NONE, OUTSIDE
from ..diagnose.gap import family
from ..diagnose.study import Study
from ..diagnose.where import Place
from ..modes.mode import Label
from ..tyre.mesh import SectionMesh
from .figure import COLOURS, GREY, headline, in_house_style, new_figure, save
from .words import map_resolution

Array = np.ndarray
FAMILIES = ("[0,0]", "in-plane", "lateral")
SHOWN, LEAST = 12, 0.005  # explanations, and the probability below which one is not drawn
WARM = LinearSegmentedColormap.from_list("evidence", ["#EDEDED", "#F5C98A", "#D55E00"])
WORDS = 24  # letters of a bar's name in a line
ENOUGH = 5.0  # ln evidence that is drawn in the full colour


def draw_diagnosis(folder: Path, case: LoadedCase, study: Study) -> None:
    """diagnosis_residuals, _probabilities, _held_out and _section .png, as far as there is such."""
    d = study.diagnosis
    draw_residuals(folder / "diagnosis_residuals.png", d)
    draw_probabilities(folder / "diagnosis_probabilities.png", d)
    if d.shrinkage:
        draw_held_out(folder / "diagnosis_held_out.png", d)
    if d.parts:
        draw_section_map(folder / "diagnosis_section.png", case, d.parts, d.effective_rank)


@in_house_style
def draw_residuals(path: Path, d: Diagnosis) -> None:
    """Residuals of the plain fit over the harmonic, a column a family, a colour a pressure; hollow
    with the likeliest effect in the model. Bars: one standard deviation without a gap."""
    rows, gap = d.problem.observations.rows, d.gap
    after = _after(d) if d.leading else None
    pressures = sorted({row.pressure_kPa for row in rows if row.label})
    shown = [name for name in FAMILIES if any(family(row) == name for row in rows)]
    figure = new_figure(2.0 + 2.8 * len(shown), 3.8)
    axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for panel, name in zip(axes, shown, strict=True):
        panel.axhline(0, color=GREY, lw=0.8)
        for k, p in enumerate(pressures):
            mine = [row.pressure_kPa == p and not row.run and family(row) == name for row in rows]
            chosen = np.flatnonzero(mine)
            at = np.array([_place(rows[i].label) for i in chosen])
            at = at + 0.16 * (k - (len(pressures) - 1) / 2)
            colour = COLOURS[k % len(COLOURS)]
            panel.errorbar(
                at,
                100 * gap.residuals[chosen],
                100 * gap.spread[chosen],
                fmt="o",
                color=colour,
                ms=5,
                lw=1,
                label=f"{p:g} kPa",
            )
            if after is not None:
                panel.plot(at, 100 * after[chosen], "o", mfc="white", mec=colour, ms=5, zorder=3)
        panel.set_title(name, loc="left")
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
    with_effect = f"; hollow: with {_within(d, d.leading)}" if d.leading else ""
    headline(figure, f"{words}{with_effect}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(pressures), frameon=False)
    save(figure, path)


@in_house_style
def draw_probabilities(path: Path, d: Diagnosis) -> None:
    """The likeliest explanations as bars, before (a mark) and after the data."""
    order = sorted(d.hypotheses, key=lambda h: -d.probabilities[h.key])[:SHOWN]
    order = [h for h in order if d.probabilities[h.key] >= LEAST or h.key in (NONE, OUTSIDE)]
    figure = new_figure(7.4, 1.4 + 0.34 * len(order))
    axes = figure.add_subplot()
    place = np.arange(len(order))[::-1]
    colours = ["0.6" if h.key in (NONE, OUTSIDE) else COLOURS[0] for h in order]
    p = [d.probabilities[h.key] for h in order]
    axes.barh(place, p, color=colours, height=0.7)
    axes.plot(
        [h.prior for h in order], place, "|", color="black", ms=13, mew=1.5, label="before the data"
    )
    for y, value, h in zip(place, p, order, strict=True):
        axes.text(max(value, h.prior) + 0.01, y, f"{value:.2f}", va="center", fontsize=8)
    axes.axvline(0.7, color=GREY, lw=0.8, ls=":")
    axes.text(0.71, -0.45, "named from here on", fontsize=8, color="0.3")
    axes.set_yticks(place, [fill(_short(d, h.key), 2 * WORDS) for h in order])
    axes.set_xlim(0, max(1.0, 1.1 * max(p)))
    axes.set_xlabel("probability")
    words = "What explains the gap" if d.leading else "No gap is seen: how likely each effect is"
    axes.set_title(words, loc="left")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.2)
    save(figure, path)


@in_house_style
def draw_held_out(path: Path, d: Diagnosis) -> None:
    """The error on held-out data without and, where there is a gap, with the effect, beside the
    noise floor and what chance does."""
    s = d.shrinkage
    assert s is not None
    figure = new_figure(6.4, 3.4)
    axes = figure.add_subplot()
    names = ["without an effect"]
    axes.bar([0], [s.before_percent], color="0.6", width=0.55)
    if d.leading:
        names.append(f"{fill(f'with {_within(d, s.effect)}', WORDS)}\n(line: 90 % range)")
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
    save(figure, path)


@in_house_style
def draw_section_map(
    path: Path, case: LoadedCase, parts: tuple[Place, ...], effective_rank: int
) -> None:
    """Parts of the section, coloured by the evidence for a change of them alone."""
    mesh = section_mesh(case)
    point = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    by_name: dict[str, Place] = {}
    for place in parts:  # of several rubbers in a region the likelier one
        by_name.setdefault(place.region.split(",")[0], place)
    figure = new_figure(10.0, 5.2)
    axes, beside = figure.subplots(1, 2, width_ratios=[5, 4])
    axes.set_aspect("equal")
    beside.axis("off")
    for name, solids in rubber_parts(case, mesh, set(by_name)).items():
        cells = [[point[n] for n in nodes] for nodes in solids]
        colour = _colour(by_name.get(name))
        axes.add_collection(PolyCollection(cells, fc=colour, ec="0.7", lw=0.3))
    for layer in case.case.rebar_layers.values():
        cord = by_name.get(cord_part(layer.material))
        lines = [[point[n] for n in nodes] for nodes in mesh.cords[layer.line].values()]
        axes.add_collection(LineCollection(lines, color=_colour(cord), lw=2.2, zorder=2))
        axes.add_collection(LineCollection(lines, color="0.3", lw=0.5, zorder=3))
    axes.autoscale_view()
    axes.set_xlabel("z along the axle, mm")
    axes.set_ylabel("r from the axle, mm")
    table = [f"{'part':22s}   stiffness, %     mass, %   ln evidence"]
    table += [
        f"{p.region[:22]:22s}   {_spread(p.stiffness_percent, p.stiffness_sigma)}"
        f"   {_spread(p.mass_percent, p.mass_sigma)}   {_signed(p.evidence, 1):>8s}"
        for p in parts
    ]
    beside.text(
        0.0,
        0.98,
        "\n".join(table),
        transform=beside.transAxes,
        va="top",
        fontsize=7.5,
        family="monospace",
    )
    same = [f"{p.region} looks like {', '.join(p.same_as)}" for p in parts if p.same_as]
    words = [fill(map_resolution(effective_rank), 62), *same]
    beside.text(
        0.0,
        0.02,
        "\n".join(words),
        transform=beside.transAxes,
        va="bottom",
        fontsize=7.5,
        color="0.3",
    )
    headline(figure, "One part changed alone: how well it explains what calibration leaves")
    scale = ScalarMappable(Normalize(0, ENOUGH), WARM)
    bar = figure.colorbar(scale, ax=axes, orientation="horizontal", shrink=0.6, extend="max")
    bar.set_label("ln evidence against no change")
    save(figure, path)


def rubber_parts(
    case: LoadedCase, mesh: SectionMesh, named: set[str]
) -> dict[str, list[tuple[int, ...]]]:
    """Corner nodes of the elements of each part of the section, by the part's name in a map of
    the parts ``named``."""
    crown = case.section.regions[0][0]
    rows = case.case.mesh.levels[case.case.mesh.level].rows
    found: dict[str, list[tuple[int, ...]]] = {}
    for number, (region, row) in mesh.cells.items():
        name = region.replace("_", " ")
        if region == crown and name not in named:
            name = "tread" if row >= sum(rows[:-1]) else f"{name} under the tread"
        found.setdefault(name, []).append(mesh.solids[number][:4])
    return found


def cord_part(material: str) -> str:
    """The name of the cords of a material in a map of the parts."""
    return material.replace("_", " ") + "s"


def _after(d: Diagnosis) -> Array | None:
    """Residuals (n,) with the leading effect at its likeliest size; None without one."""
    if d.leading is None:
        return None
    h = d.hypothesis(d.leading)
    assert h.fitted is not None
    i = h.best
    shift, tilt, _ = d.problem.added({id: e[[i]] for id, e in h.values.items()}, 1)
    eta, _ = d.problem.plain(h.fitted.d[i])
    return np.asarray(d.problem.observations.y - eta - shift[0] - tilt[0] @ h.fitted.d[i])


def _place(label: Label | None) -> float:
    assert label is not None
    return {"axial": 0.0, "torsional": 1.0}.get(label.kind or "", float(label.c))


def _short(d: Diagnosis, key: str | None) -> str:
    spans = d.problem.spans
    if key in (NONE, OUTSIDE) or key is None:
        return {NONE: "No effect", OUTSIDE: "Outside the catalogue"}.get(key or "", "")
    return " + ".join((spans[id].title or id) for id in key.split("+"))


def _signed(value: float, digits: int) -> str:
    """With a sign, a true minus, and no -0."""
    text = f"{round(value, digits) + 0.0:+.{digits}f}"
    return text.replace("-", "\N{MINUS SIGN}")


def _spread(percent: float, sigma: float) -> str:
    return f"{_signed(percent, 0):>5s} ± {sigma:<4.0f}"


def _within(d: Diagnosis, key: str | None) -> str:
    """Amid a sentence."""
    words = _short(d, key)
    return words[:1].lower() + words[1:]


def _colour(place: Place | None) -> str | tuple[float, ...]:
    return WARM(0.0) if place is None else WARM(min(max(place.evidence, 0.0) / ENOUGH, 1.0))
