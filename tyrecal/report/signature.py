"""Picture of an effect's signature: bars over the modes, before and after a re-fit."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..studies.effects import CatalogueEntry, EffectResult, Effects
from ..studies.signature import Signature
from ..tyre.effects import catalogue
from ..units import in_engineers_units
from .figure import COLOURS, GREY, headline, in_house_style, new_figure
from .table import MINUS

MAX_SIGNATURES = 3  # effects with a picture on a page
BAR = 0.38  # thickness of a bar, of the distance of two labels


def figures(result: Effects) -> dict[str, Figure]:
    """Figures by name of the effects that move the modes most."""
    known = [each for each in result.rows if each.before_percent]
    most = sorted(known, key=lambda each: -(each.before_percent or 0.0))[:MAX_SIGNATURES]
    return {f"effect_{each.id}": draw_signature(_signature(each), each) for each in most}


def _signature(effect: EffectResult) -> Signature:
    """The signature that effects.json holds; a mode that is not at every pressure is left out."""
    by_label = [{mode.label: mode for mode in row.modes} for row in effect.rows]
    labels = tuple(label for label in by_label[0] if all(label in modes for modes in by_label))
    changes = [
        [[getattr(modes[label], when) for label in labels] for modes in by_label]
        for when in ("before_percent", "after_percent")
    ]
    before, after = np.array(changes, float)  # None becomes NaN
    pressures = tuple(row.pressure_kPa for row in effect.rows)
    absorbed, mass_kg = effect.absorbed, effect.mass_kg  # a share; None: nothing to absorb
    return Signature(
        effect.id, effect.value, pressures, labels, before, after, absorbed, {}, mass_kg
    )


@in_house_style
def draw_signature(signature: Signature, entry: CatalogueEntry | None = None) -> Figure:
    """Change of every mode in per cent, a panel per pressure; entry: of the effect, by default as
    the catalogue has it."""
    effect = entry or catalogue()[signature.id]
    count = len(signature.pressures_kPa)
    words = f"{effect.title}: change of every mode, before and after a re-fit of the variables"
    figure = new_figure(8.0, 1.2 + 1.8 * count, caption=words)
    panels = np.atleast_1d(figure.subplots(count, 1, sharex=True, sharey=True))
    places = np.arange(len(signature.labels))
    digits = 1 if np.nanmax(abs(signature.before)) >= 1 else 2
    for k, axes in enumerate(panels):
        for side, rows, colour, words in (
            (-1, signature.before, COLOURS[0], "before the re-fit"),
            (1, signature.after, COLOURS[1], "after the re-fit of the variables"),
        ):
            bars = axes.bar(places + side * BAR / 2, rows[k], BAR, color=colour, label=words)
            look = {"fontsize": 7, "color": "0.3"}
            axes.bar_label(bars, [_text(x, digits) for x in rows[k]], padding=1, **look)
            for place in places[~np.isfinite(rows[k])]:  # such bars get no label
                axes.text(place + side * BAR / 2, 0, "lost", ha="center", va="bottom", **look)
        axes.axhline(0, color=GREY, lw=0.8)
        axes.margins(y=0.15)
        axes.set_title(f"{signature.pressures_kPa[k]:g} kPa", loc="left", fontsize=9, color="0.3")
    figure.supylabel("change of frequency, %", fontsize=9)
    panels[-1].set_xticks(places, [label.display.replace(" ", "\n") for label in signature.labels])
    size = f"{effect.symbol} = {in_engineers_units(signature.value, effect.unit, 4)}"
    absorbed = (
        f": calibration absorbs {100 * signature.absorbed:.1f} %" if signature.absorbed else ""
    )
    headline(figure, f"{effect.title}, {size}{absorbed}")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _text(value: float, digits: int) -> str:
    return f"{value:+z.{digits}f}".replace("-", MINUS)
