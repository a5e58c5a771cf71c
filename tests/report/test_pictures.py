"""Pictures of the real tyre: written, of the size meant, small, and showing something.

A figure as part of a page: its words as text, colours of the page, ids of its own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from PIL import Image
from threadpoolctl import threadpool_limits

from tyrecal.files import PICTURE_FORMATS
from tyrecal.report import shapes
from tyrecal.report.convergence import draw_convergence
from tyrecal.report.figure import (
    COLOURS,
    GREY,
    in_house_style,
    new_figure,
    read_drawn_numbers,
    save,
    svg,
)
from tyrecal.report.section import draw_section
from tyrecal.report.shape_data import section_data
from tyrecal.report.shapes import draw_modes_overview, title
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.label import Label, Mode, label_modes
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.mesh import SectionMesh, build_mesh

from ..conftest import CASES

LINE = 40  # pixels: a line of text and its distance


@dataclass
class Tyre:
    case: LoadedCase
    mesh: SectionMesh
    evaluation: Evaluation
    modes: dict[Label, Mode]


@pytest.fixture(scope="module")
def tyre() -> Tyre:
    case = load_case(CASES / "p235_75r17.yaml")
    with threadpool_limits(1):
        evaluation = Evaluator(TyreDesign(case)).evaluate(Question(start_values(case)))
    modes = {mode.label: mode for mode in label_modes(evaluation.modes)}
    return Tyre(case, resolved(case).mesh, evaluation, modes)


def ink(path, width: int, height: int, most_bytes: int) -> float:
    """Share of the picture that is not paper, its size having been checked."""
    assert path.stat().st_size < most_bytes
    with Image.open(path) as image:
        assert image.format == "PNG"
        assert image.size == (width, height)
        return float((np.asarray(image.convert("L")) < 245).mean())


def test_a_twist_is_told_from_rest(tyre, tmp_path, written):
    """The outline stays where it is: the meridians at rest stand beside those that moved, in a
    colour that nothing else has, and only there; what colours and lines are is said."""
    orange = {}
    for kind in ("torsional", "axial"):
        written.clear()
        draw_modes_overview(tmp_path / f"{kind}.png", [tyre.modes[Label(0, 0, kind)]], tyre.mesh)
        assert "displacement over the largest" in written
        assert any("outline at rest" in text for text in written)
        with Image.open(tmp_path / f"{kind}.png") as image:
            red, green, blue = np.moveaxis(np.asarray(image.convert("RGB"), int), -1, 0)
        orange[kind] = int(((red > 180) & (blue < 60) & (red - green > 60)).sum())
        assert any("orange: meridians" in text for text in written) == (kind == "torsional")
    assert orange["torsional"] > 500 + orange["axial"]


def test_modes_overview_says_what_it_leaves_out(tyre, tmp_path, written, monkeypatch):
    modes = list(tyre.modes.values())
    monkeypatch.setattr(shapes, "MAX_IN_OVERVIEW", 2)
    draw_modes_overview(tmp_path / "modes.png", modes, tyre.mesh)
    lowest = sorted(modes, key=lambda mode: mode.frequency_Hz)
    assert [title(mode) in written for mode in lowest[:3]] == [True, True, False]
    assert any(f"; the 2 lowest of {len(modes)} modes" in words for words in written)


def test_modes_overview_is_no_larger_than_its_modes(tyre, tmp_path):
    draw_modes_overview(tmp_path / "modes.png", list(tyre.modes.values())[:5], tyre.mesh)
    assert 0.2 < ink(tmp_path / "modes.png", 1350, 1095, 400_000) < 0.6


def test_the_largest_motion_is_12_percent_and_stands_at_the_top(tyre):
    surface = shapes._surface(tyre.modes[Label(2, 0)], tyre.mesh)
    motion = np.linalg.norm(surface.moved - surface.rest, axis=-1)
    radius = np.hypot(surface.rest[..., 0], surface.rest[..., 2]).max()
    assert motion.max() == pytest.approx(0.12 * radius)
    node, angle = np.unravel_index(motion[:, :-1].argmax(), motion[:, :-1].shape)
    assert 4 * angle % shapes.ANGLES == 0  # one of the four crests, one of them at the top
    x, _, z = surface.rest[node, 3 * shapes.ANGLES // 4]
    assert z > 0.3
    assert abs(x) < 1e-9


def test_a_line_is_a_strip_of_its_width_along_it():
    line = np.array([[[0.0, 0.0, 1.0]], [[3.0, 4.0, 2.0]]])
    a, b, c, d = shapes._strips(line)[:, :2]
    for one, other, middle in ((a, b, line[0, 0]), (d, c, line[1, 0])):
        assert (one + other) / 2 == pytest.approx(middle[:2])
        assert other - one == pytest.approx(shapes.LINE_WIDTH * np.array([-0.8, 0.6]))


def test_title(tyre):
    mode = replace(tyre.modes[Label(2, 1)], frequency_Hz=66.1)
    assert title(mode) == "[2,1] 66.1 Hz: first out-of-plane bending"


def test_section(tyre, tmp_path, written):
    """The picture is as high as its content: one line between the drawing, its title and its
    legend."""
    inflation = dict(zip(tyre.evaluation.nodes, tyre.evaluation.displacement, strict=True))
    inflated = section_data(tyre.case, tyre.mesh, inflation)
    plain = section_data(tyre.case, tyre.mesh, {})
    low = load_case(CASES / "205_60r15.yaml")
    for name, section, words in (
        ("inflated", inflated, tyre.case.case.name),
        ("long", plain, "A tyre " * 30),
        ("low", section_data(low, resolved(low).mesh, {}), low.case.name),
        ("plain", plain, tyre.case.case.name),
    ):
        figure = draw_section(section, words, 240.0)
        save(figure, tmp_path / f"{name}.png")
        (axes,), (legend,), render = figure.axes, figure.legends, figure.canvas.get_renderer()
        size = map(int, figure.bbox.size)
        assert 0.05 < ink(tmp_path / f"{name}.png", *size, 200_000) < 0.3
        facts, label = (
            axes.title.get_window_extent(render),
            axes.xaxis.label.get_window_extent(render),
        )
        assert figure._suptitle.get_window_extent(render).y0 - facts.y1 < LINE
        assert label.y0 - legend.get_window_extent(render).y1 < LINE
        rubber = [e.get_facecolor() for e in legend.legend_handles if isinstance(e, Patch)]
        assert len(set(rubber[:7])) == min(7, len(rubber)) > 2
    assert (tmp_path / "inflated.png").read_bytes() != (tmp_path / "plain.png").read_bytes()


def test_section_of_linear_elements(tyre, tmp_path):
    mesh = build_mesh(tyre.case.section, [4, 4, 4, 1], [1, 1, 1, 2], False)
    figure = draw_section(section_data(tyre.case, mesh, {}), "linear", 240.0)
    save(figure, tmp_path / "section.png")
    size = map(int, figure.bbox.size)
    assert 0.05 < ink(tmp_path / "section.png", *size, 200_000) < 0.3


@pytest.mark.parametrize("holds", ["whole_bead", "bead_surface"])
def test_what_the_rim_holds_is_drawn(tyre, holds):
    """The elements of a whole bead and nothing beside; of its surface the lines of the outline."""
    rim = with_part(tyre.case.case.rim, holds=holds)
    case = changed(tyre.case, rim=rim)
    mesh = resolved(case).mesh
    held = [np.reshape(each, (-1, 2)) for each in section_data(case, mesh, {}).rim]
    corners = {4} if holds == "whole_bead" else {2}
    assert {len(each) for each in held} == corners
    drawn = np.concatenate(held)
    for n in {n for solid in mesh.solids.values() for n in solid[:4]} & set(mesh.rim):
        r, z = mesh.nodes[n]
        assert abs(drawn - [1e3 * z, 1e3 * r]).sum(1).min() < 2e-3


@pytest.mark.parametrize("failed", [(), (3,), range(1, 9)], ids=["none", "one", "all"])
def test_convergence(tmp_path, failed):
    history = [
        {
            "point": k,
            "objective_Hz": None if k in failed else 3 + 30 / k**2,
            "start": 1 + k // 5,
            "values": {"A_belt": 2e-7 * k, "angle": 3.0 - k, "zero": 0.0},
        }
        for k in range(1, 9)
    ]
    save(draw_convergence(history), tmp_path / "fit.png")
    assert 0.01 < ink(tmp_path / "fit.png", 1200, 840, 100_000) < 0.2


@pytest.mark.parametrize("spread", [1.0, 1e-4, 0.04, 0.4, 3.0, 30.0])
def test_convergence_has_numbers_on_its_axes(spread):
    history = [
        {
            "point": k,
            "objective_Hz": 47 * (1 + spread * (k == 1)),
            "start": 1,
            "values": {"C10": 1e6 * (1 + spread * (k > 1))},
        }
        for k in range(1, 5)
    ]
    figure = draw_convergence(history)
    figure.canvas.draw()
    for axes in figure.axes:
        low, high = axes.get_ylim()
        numbers = {
            float(tick.get_text())
            for tick in axes.get_yticklabels()
            if low <= tick.get_position()[1] <= high
        }
        assert 2 <= len(numbers) <= 8, numbers
        assert all(low * (1 - 1e-3) <= n <= high * (1 + 1e-3) for n in numbers)


NAME = "$x$ & <sons>"


@in_house_style
def drawn() -> Figure:
    figure = new_figure(3.0, 2.0)
    axes = figure.add_subplot()
    axes.plot([0, 1, 2], [3, 4, 3], "o-", color=COLOURS[1], mfc="white")
    axes.fill_between([0, 1], [3, 3], [4, 4], fc="none", hatch="//", ec=GREY)
    axes.set_title(NAME)
    return figure


def test_the_same_figure_gives_the_same_text_but_for_its_ids() -> None:
    one, again, other = (str(svg(drawn(), "a line", key)) for key in ("a", "a", "b"))
    assert one == again
    ids = re.findall(r' id="(.*?)"', one)
    assert ids and len(set(ids)) == len(ids) and all(id.startswith("a-") for id in ids)
    assert set(re.findall(r'(?:url\(|href=")#([\w-]+)', one)) == set(ids)
    assert other == re.sub(r'((?: id="|url\(#|href="#))a-', r"\1b-", one)


def test_words_are_text_and_colours_the_page_s() -> None:
    text = svg(drawn(), NAME, "a")
    assert text.count("$x$ &amp; &lt;sons&gt;") == 2  # one of them for who does not see it
    assert "var(--s1)" in text and "var(--edge)" in text and "var(--panel)" in text
    assert not re.search(r"#[0-9a-f]{6}|https?:|data:|<style|\d\.\d{3}", text)


@in_house_style
def over_decades() -> Figure:
    figure = new_figure(3.0, 2.0)
    axes = figure.add_subplot()
    axes.loglog([1, 1000], [1e-6, 0.5])
    axes.set_title(NAME)
    return figure


@pytest.mark.parametrize("kind", PICTURE_FORMATS)
def test_formats(kind: str, tmp_path: Path) -> None:
    """Files have their format and the same bytes each time; numbers of decades are no
    mathematical markup."""
    contents = []
    for name in ("a", "b"):
        figure, path = over_decades(), tmp_path / f"{name}.{kind}"
        save(figure, path)
        contents.append(path.read_bytes())
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[kind]
    assert contents[0].startswith(start) and contents[0] == contents[1]
    figure.canvas.draw()
    (axes,) = figure.axes
    labels = [label.get_text() for label in (*axes.get_xticklabels(), *axes.get_yticklabels())]
    assert {"10", "100", "0.1"} <= {*labels} and not any("$" in text for text in labels)
    if kind == "svg":
        text = contents[0].decode()
        assert ">10<" in text and "mathdefault" not in text
    assert "mathdefault" not in svg(over_decades(), "", "a")


def test_a_picture_keeps_the_numbers_that_it_draws(tmp_path: Path) -> None:
    """Count, least, greatest, mean and root mean square of x and y; areas by their corners."""
    save(drawn(), tmp_path / "a.png")
    _, panel = read_drawn_numbers(tmp_path / "a.png")
    assert panel["words"] == [NAME]
    x, y, *_ = panel["numbers"]
    assert x == [3, 0.0, 2.0, 1.0, pytest.approx((5 / 3) ** 0.5, rel=1e-5)]
    assert y == [3, 3.0, 4.0, pytest.approx(10 / 3, rel=1e-5), pytest.approx((34 / 3) ** 0.5)]
    corners = [part[:3] for part in panel["numbers"][2:]]
    assert [7, 0.0, 1.0] in corners or [8, 0.0, 1.0] in corners
    Image.new("RGB", (2, 2)).save(tmp_path / "plain.png")
    with pytest.raises(ValueError, match="no numbers"):
        read_drawn_numbers(tmp_path / "plain.png")
