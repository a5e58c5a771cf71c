"""Plies on nodes of their own, embedded where the rubber has none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError

from . import own_decks
from .own_decks import EMBEDDED, apart, plain
from .test_own_deck import frequencies, write


@pytest.mark.slow
def test_with_finer_hosts_it_is_the_tyre_with_nodes_that_coincide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Mass and modes: 2.6 and 0.19 % are left of twelve hosts and of twice as many, of cords on a
    circle in hosts that are parabolas."""
    off = []
    for times in (1, 2):
        for name, value in (("COLUMNS", 24), ("RIM", 2)):
            monkeypatch.setattr(own_decks, name, times * value)
        monkeypatch.setattr(own_decks, "BELT", (8 * times, 16 * times))
        same = frequencies(write(tmp_path, plain()))
        other = frequencies(write(tmp_path, plain(apart(18 * times).mesh() + EMBEDDED)))
        off.append(abs(other / same - 1))
    assert off[0].max() < 0.03 and off[1].max() < 0.003
    assert off[1].max() < off[0].max() / 8  # third order
    assert off[1][0] < 2e-8  # the mass


def test_a_reflected_half_is_the_whole(tmp_path: Path) -> None:
    """And a whole whose elements are no mirror images is solved as one, not by its half."""
    whole = frequencies(write(tmp_path, plain(apart(18).mesh() + EMBEDDED)))
    half = frequencies(write(tmp_path, own_decks.half(apart(18), EMBEDDED)))
    assert half == pytest.approx(whole, rel=1e-9)
    odd = frequencies(write(tmp_path, plain(apart(15).mesh() + EMBEDDED)))
    assert odd == pytest.approx(whole, rel=0.03)


def test_slopes_by_places_are_exact(tmp_path: Path) -> None:
    """An embedded node is moved: its host's weights change with it, and what it carries moves
    too."""
    text = plain(apart(18).mesh() + EMBEDDED)
    line = next(row for row in text.splitlines() if row.startswith("50011, "))
    n, r, z = line.split(", ")
    path = tmp_path / "tyre.inp"
    path.write_text(text.replace(line, f"{n}, {{{{ place }}}}, {z}"))
    deck = read_own_deck(path)
    case = own_case(deck, deck.flat({"place": float(r)}), "not given", None)
    case = case.replace("numbers: {}", f"numbers: {{place: {r}}}")
    path.with_suffix(".yaml").write_text(case.replace("highest_harmonic: 4", "highest_harmonic: 1"))
    evaluator = Evaluator(TyreDesign(load_case(path.with_suffix(".yaml"))))
    hertz = lambda values: np.array(
        [m.frequency_Hz for m in evaluator.evaluate(Question(values)).modes]
    )
    start = {"deck.numbers.place": float(r), "A_CORD": 4.2e-7}
    slopes = evaluator.evaluate(Question(start, tuple(start))).gradients
    for name, step in zip(start, (1e-6, 1e-11), strict=True):
        up, down = (hertz({**start, name: start[name] + side * step}) for side in (1, -1))
        expected = (up - down) / (2 * step)
        assert slopes[name] == pytest.approx(expected, abs=1e-5 * abs(expected).max())


def test_a_node_outside_is_refused_by_line(tmp_path: Path) -> None:
    """Beyond 5 % of an element, or what the deck says, in its own units."""
    tyre = apart(18)
    r, z = tyre.nodes[50_011]
    tyre.nodes[50_011] = 1.06 * r, z
    path = tmp_path / "tyre.inp"
    for text in (
        plain(tyre.mesh() + EMBEDDED),
        plain(
            apart(18).mesh()
            + EMBEDDED.replace("SOLID\n", "SOLID, ABSOLUTE EXTERIOR TOLERANCE=1e-9\n")
        ).replace(f"50001, {apart(18).nodes[50_001][0]!r}", "50001, 0.1915"),
    ):
        path.write_text(text)
        line = text.splitlines().index("CARCASS, BELT") + 1
        with pytest.raises(OwnDeckError, match=rf"^tyre.inp, line {line}: .* outside its hosts"):
            trial(read_own_deck(path).flat({}))
