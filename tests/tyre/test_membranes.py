"""Decks as a tyre maker's pre-processor writes them: cords by *REBAR in membranes of compound."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError

from . import own_decks
from .test_own_deck import frequencies, write

LAYERS = {
    "CARCASS": ["4.2E-07, 0.001, 0.0"],
    "BELT": ["2.1e-7, 1.16e-3, 70.", "2.1e-7, 1.16e-3, 110."],
}
TOPPING = """*MATERIAL, NAME=TOPPING
*HYPERELASTIC, NEO HOOKE
8e5
*DENSITY
1100.
"""


def maker(per_element: bool = False, measured_at: float = 0.0, thickness: float = 1e-6) -> str:
    """The deck of `own_decks` in thin membranes; lines of each element, a spacing at a radius."""
    text = own_decks.plain(materials=own_decks.MATERIALS.format(**own_decks.SI) + TOPPING)
    text = text.replace("TYPE=SFMGAX2", "TYPE=MGAX2")
    head, _, rest = text.partition("*SURFACE SECTION, ELSET=CARCASS")
    lines = []
    for name, layers in LAYERS.items():
        lines += [f"*MEMBRANE SECTION, ELSET={name}, MATERIAL=TOPPING", f"{thickness}"]
        members = own_decks.Tyre().plies[name] if per_element else [name]
        for k, layer in enumerate(layers, start=1):
            for member in members:
                lines.append(
                    f"*REBAR, ELEMENT=AXIMEMBRANE, MATERIAL=CORD, GEOM=SKEW, NAME={name}_{k}"
                )
                fanned = f", {measured_at}" * bool(measured_at and name == "CARCASS")
                lines.append(f"{member}, {layer}{fanned}")
    return head + "\n".join(lines) + "\n*MATERIAL" + rest.partition("*MATERIAL")[2]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return frequencies(write(tmp_path_factory.mktemp("plain"), own_decks.plain()))


@pytest.mark.parametrize("per_element", [False, True])
def test_soft_membranes_are_surfaces_with_layers(
    per_element: bool, reference: np.ndarray, tmp_path: Path
) -> None:
    case = write(tmp_path, maker(per_element))
    np.testing.assert_allclose(frequencies(case), reference, rtol=1e-3)
    plies = read_own_deck(case.with_suffix(".inp")).flat({}).plies
    assert len(plies) == (12 + 2 * 4 if per_element else 3)


def test_a_spacing_at_a_radius_grows_with_the_radius(tmp_path: Path) -> None:
    """As a layer of an angular spacing, written our way."""
    degrees = float(np.degrees(0.001 / 0.3))
    fanned = own_decks.SECTIONS.replace(
        "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001",
        f"*REBAR LAYER, GEOMETRY=ANGULAR\nCARCASS, 4.2E-07, {degrees!r}",
    )
    (tmp_path / "ours").mkdir()
    ours = frequencies(write(tmp_path / "ours", own_decks.plain(sections=fanned)))
    np.testing.assert_allclose(
        frequencies(write(tmp_path, maker(measured_at=0.3))), ours, rtol=1e-3
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ELEMENT=AXIMEMBRANE", "ELEMENT=AXISHELL", "ELEMENT=AXISHELL is not honoured"),
        ("CARCASS, 4.2E-07", "SOLID, 4.2E-07", "is a CGAX8R, no membrane"),
        ("CARCASS, 4.2E-07", "CARCASS, 0.0", "the area must be positive"),
        ("TYPE=MGAX2", "TYPE=SFMGAX2", "is a SFMGAX2"),
        (
            "\n1e-06\n*REBAR",
            "\n1e-06\n*HOURGLASS STIFFNESS\n1\n*REBAR",
            "not honoured of a *MEMBRANE",
        ),
        ("\n1e-06\n*REBAR", "\n-1e-06\n*REBAR", "thickness"),
    ],
)
def test_what_is_wrong_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    from tyrecal.tyre.case.kinds.section_deck import trial

    path = tmp_path / "tyre.inp"
    path.write_text(maker().replace(old, new), encoding="utf-8")
    with pytest.raises(OwnDeckError, match=re.escape(words)):
        trial(read_own_deck(path).flat({}))
