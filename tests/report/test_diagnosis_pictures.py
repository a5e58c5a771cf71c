"""Pictures of a diagnosis: they show its numbers, and no word is cut."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.text import Text

from tyrecal.report import diagnosis_pictures as pictures
from tyrecal.report.figure import save
from tyrecal.report.section import EVIDENCE_COLOURS, draw_section_map
from tyrecal.report.shape_data import DiagnosisSection, parts_data
from tyrecal.studies.diagnose.diagnosis import Diagnosis
from tyrecal.studies.diagnose.where import PartChange
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..diagnose.test_diagnosis import diagnosed
from ..diagnose.test_present_effects import exact
from ..diagnose.toy import Toy

NUMBER = "0123456789.+\N{MINUS SIGN} "


@pytest.fixture(scope="module")
def named() -> Diagnosis:
    return diagnosed(Toy(effects=3), {"e0": 0.8}, 7)


def drawn(d: Diagnosis, folder: Path) -> list[Figure]:
    """The figures, which were saved."""
    figures = pictures.draw_diagnosis(d, DiagnosisSection(format=1, case="", areas={}, cords={}))
    figures.pop("section", None)
    for name, figure in figures.items():
        save(figure, folder / f"{name}.png")
    return list(figures.values())


def words(figure: Figure) -> str:
    """Return the texts of a picture; fails if a text is beyond the picture's edge."""
    box, written = figure.bbox, []
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        place = text.get_window_extent()
        string = text.get_text()
        if text.get_visible() and string.strip(NUMBER):  # ticks beyond an axis are not drawn
            written.append(string)
            assert place.x0 > -1 and place.y0 > -1, text
            assert place.x1 < box.x1 + 1 and place.y1 < box.y1 + 1, text
    return "\n".join(written)


def test_residuals(named: Diagnosis, tmp_path: Path) -> None:
    figure = drawn(named, tmp_path)[0]
    panels = figure.axes
    assert [axes.get_title("left") for axes in panels] == ["[0,0]", "in-plane", "out-of-plane"]
    shown = [bar.lines[0].get_ydata() for axes in panels for bar in axes.containers]
    assert sorted(np.concatenate(shown)) == pytest.approx(sorted(100 * named.gap.residuals))
    assert len(shown) == 3 * 3  # pressures
    assert [list(axes.get_xticks()) for axes in panels] == [[0, 1], [1, 2, 3, 4], [1, 2, 3]]
    for axes in panels:
        low, high = axes.get_xlim()
        places = np.concatenate([line.get_xdata() for bar in axes.containers for line in bar[:1]])
        assert low + 0.2 < places.min() and places.max() < high - 0.2
    text = words(figure)
    assert "one standard deviation" in text and f"hollow: with {named.best}" in text


def test_probabilities_and_held_out(named: Diagnosis, tmp_path: Path) -> None:
    _, bars, held = drawn(named, tmp_path)
    widths = [bar.get_width() for bar in bars.axes[0].patches]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] == pytest.approx(max(named.probabilities.values()))
    assert "No effect" in words(bars) and "90 % range" in words(held)
    assert named.shrinkage is not None
    heights = [bar.get_height() for bar in held.axes[0].patches]
    assert heights == [named.shrinkage.before_percent, named.shrinkage.after_percent]


@pytest.mark.slow
def test_long_names_are_laid_out(named: Diagnosis, tmp_path: Path) -> None:
    """Modes of one family at one pressure, with the catalogue's longest name; see `conftest`."""
    long = "temperature drift over the run of pressures, as the longest of titles"
    ranges = {id: replace(span, title=long) for id, span in named.problem.ranges.items()}
    d = replace(named, problem=replace(named.problem, ranges=ranges))
    few = [row.label is not None and row.label.m == 1 for row in d.problem.observations.rows]
    alone = replace(
        d,
        problem=d.problem.only(np.array(few)),
        gap=replace(d.gap, residuals=d.gap.residuals[few], spread=d.gap.spread[few]),
    )
    rows, gap = alone.problem.observations.rows, alone.gap
    drawn(d, tmp_path)
    figure = pictures.draw_residuals(rows, gap.residuals, gap.spread, gap.residuals, long)
    save(figure, tmp_path / "alone.png")


@pytest.mark.slow
def test_no_gap_has_nothing_that_explains_it(tmp_path: Path) -> None:
    d = exact(Toy(effects=3), {})
    assert d.verdict.kind == "no_gap" and d.shrinkage
    figures = drawn(d, tmp_path)
    title = figures[1].get_suptitle()
    assert title.startswith(("No gap is seen", "Not seen, not excluded"))
    residuals, probabilities, held = map(words, figures)
    assert "hollow" not in residuals and "explains" not in probabilities
    none = d.probabilities["none"]
    heading = "No gap is seen" if none >= 0.9 else f"Not seen, not excluded: no effect {none:.2f}"
    assert heading in probabilities
    assert "with " not in held and len(figures[2].axes[0].patches) == 1


def test_what_the_rim_lets_go_of_a_bead_is_drawn_as_the_bead() -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    loose = with_values(case, {"effects.bead_seat": 0.3})
    sits, gap = (parts_data(each, ["bead"]).areas for each in (case, loose))
    assert gap.keys() == sits.keys() and len(gap["bead"]) > len(sits["bead"])
    assert all(len(gap[name]) == len(areas) for name, areas in sits.items() if name != "bead")


def test_section_map(tmp_path: Path) -> None:
    """The part that explains most is the warmest, and has the longest bar."""
    places = (
        PartChange("upper sidewall", 9.0, 20.0, 21.4, 8.0, 4.9, ("carcass cords",)),
        PartChange("tread", -3.0, 20.0, -0.2, 10.0, -0.01, ()),
    )
    case = load_case(CASES / "p235_75r17.yaml")
    figure = draw_section_map(parts_data(case, [place.region for place in places]), places, 1)
    save(figure, tmp_path / "section.png")
    text = words(figure)
    assert "ln evidence" in text and "independent combination of parts" in text
    section, bars = figure.axes
    numbers = {label.get_text().strip(): label.get_position()[0] for label in bars.texts}
    assert numbers == {"+4.9": 4.9, "+0.0": 0.0}  # at the bars' ends; no negative nothing
    names = [label.get_text() for label in bars.get_yticklabels()]
    lengths = [bar.get_width() for bar in bars.patches]
    assert dict(zip(names, lengths, strict=True)) == {"upper sidewall": 4.9, "tread": -0.01}
    low, high = bars.get_ylim()
    assert low > high  # the first part is at the top
    colours = {
        tuple(c.get_facecolor()[0].round(3))
        for c in section.collections
        if isinstance(c, PolyCollection)
    }
    assert tuple(np.round(EVIDENCE_COLOURS(4.9 / 5), 3)) in colours and len(colours) == 2


def test_section_map_of_many_parts_is_readable_and_as_wide_as_its_picture(tmp_path: Path) -> None:
    """A tyre by `init` has 21 parts with long names: no text is cut or printed over another."""
    case = load_case(CASES / "205_60r15.yaml")
    regions = [f"lower sidewall, rim_strip_{k}" for k in range(20)] + ["crown, belt_skim"]
    places = [PartChange(r, 9.0, 20.0, 1.0, 8.0, 4.2 - 0.2 * k, ()) for k, r in enumerate(regions)]
    figure = draw_section_map(parts_data(case, regions), places, 0)
    save(figure, tmp_path / "section.png")
    section, bars = figure.axes
    assert "12 likeliest of 21 parts" in words(figure) and len(bars.patches) == 12
    z = np.concatenate([p.vertices[:, 0] for c in section.collections for p in c.get_paths()])
    ends = section.transData.transform([(z.min(), 0.0), (z.max(), 0.0)])[:, 0]
    assert np.ptp(ends) > 0.6 * figure.bbox.width


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 2])
def test_the_limit_of_a_named_effect_is_no_text_on_a_bar(
    named: Diagnosis, count: int, tmp_path: Path
) -> None:
    """The words are in the legend, because with one bar they would be on the bar."""
    few = tuple(h for h in named.hypotheses if h.key in ("none", "outside", "e0")[-1 - count :])
    d = replace(named, hypotheses=few)
    figure = pictures.draw_probabilities(d)
    save(figure, tmp_path / "bars.png")
    (axes,), (legend,) = figure.axes, figure.legends
    assert "named from here on" in " ".join(text.get_text() for text in legend.get_texts())
    assert {text.get_text() for text in axes.texts} == {
        f"{d.probabilities[h.key]:.2f}" for h in few
    }
    (line,) = (each for each in axes.lines if each.get_linestyle() == ":")
    assert list(line.get_xdata()) == [0.7, 0.7]
