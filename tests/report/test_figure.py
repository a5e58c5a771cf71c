"""A figure as part of a page: its words as text, colours of the page, ids of its own."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from PIL import Image

from tyrecal.files import PICTURE_FORMATS
from tyrecal.report.drawn import read_drawn_numbers
from tyrecal.report.figure import COLOURS, GREY, in_house_style, new_figure, save, svg

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
        assert ">0.01<" in text and "mathdefault" not in text
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
