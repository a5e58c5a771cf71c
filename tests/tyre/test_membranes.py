"""Decks of tyre makers' pre-processors: cords by *REBAR in membranes, and whole tyres."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.own import asked_by_abaqus
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.case.parts import Gauge
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.section import regions_of

from ..effects.support import CASE, START
from . import maker_decks, own_decks
from .own_decks import EMBEDDED, apart, plain
from .test_contact import with_lines
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


def with_carcass_on(line: str, liner: float) -> LoadedCase:
    """The carcass on a line of the section whose liner is ``liner`` times as thick."""
    case = CASE.case
    layers = {**case.rebar_layers}
    layers["carcass"] = layers["carcass"].model_copy(update={"line": line})
    gauges = 2 * [Gauge(between=["inner", "ply"], factor=liner**0.5)]
    section = case.section.model_copy(update={"gauges": gauges})
    return replace(CASE, case=case.model_copy(update={"rebar_layers": layers, "section": section}))


def test_a_ply_on_the_inner_surface_is_the_limit_of_one_just_inside() -> None:
    """Frequencies differ by the liner's thickness, at first order."""
    apart = []
    for liner in (0.02, 0.01):
        evaluations = [
            Evaluator(TyreDesign(with_carcass_on(line, liner))).evaluate(Question(START))
            for line in ("ply", "inner")
        ]
        inside, on = ([m.frequency_Hz for m in each.modes] for each in evaluations)
        apart.append(np.array(on) / np.array(inside) - 1)
    assert (apart[1] != 0).all()
    # terms of second order: a fiftieth, the liner's share of itself
    assert apart[0] == pytest.approx(2 * apart[1], abs=0.02 * abs(apart[0]).max())


def test_plies_on_surfaces_have_elements_of_their_own() -> None:
    """Numbered apart from solids and other plies, along the faces of the outermost solids."""
    mesh = resolved(CASE).mesh
    numbers = [n for cords in mesh.cords.values() for n in cords] + list(mesh.solids)
    assert len(set(numbers)) == len(numbers)
    for line, solids, face in (("inner", mesh.inner, (0, 3)), ("outer", mesh.outer, (1, 2))):
        ends = [(nodes[0], nodes[-1]) for nodes in mesh.cords[line].values()]
        assert ends == [tuple(mesh.solids[n][k] for k in face) for n in solids]
        assert [mesh.region_of(n) for n in mesh.cords[line]] == [mesh.cells[n][0] for n in solids]


@pytest.mark.parametrize(
    ("labels", "rigid", "regions"),
    [
        ("abbcc", "00011", {"a": 1, "b": 2, "c": 1}),  # alone at the crown: the interval behind it
        ("aabcc", "00011", {"a": 1, "b": 2, "c": 1}),
        ("aaabb", "00011", {"a": 3, "b": 1}),
        ("aabc", "0001", {"a": 1, "b": 1, "c": 1}),  # alone under the rim: the one before it
        ("aaabc", "00011", {"a": 2, "b": 1, "c": 1}),
        ("abcd", "0000", {"a": 1, "b": 1, "c": 1}),
    ],
)
def test_a_region_of_one_station_has_an_interval(
    labels: str, rigid: str, regions: dict[str, int]
) -> None:
    by_region = dict(regions_of(list(labels), [flag == "1" for flag in rigid]))
    if len(regions) < len(set(labels)):  # no interval for each: refused where the table is read
        assert min(by_region.values()) < 1
    else:
        assert by_region == regions
    assert sum(by_region.values()) == len(labels) - 1


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


QUICK = "included", "rim_in_contact"


CASES = [
    pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])
    for name in maker_decks.DECKS
]


def recorded(name: str, folder: Path, soft: bool = False) -> str:
    """The deck's text; files that it includes are put into the folder, beads in contact held."""
    for path in maker_decks.FOLDER.glob(f"{name}*"):
        text = path.read_text(encoding="utf-8")
        (folder / path.name).write_text(maker_decks.softened(text) if soft else text)
    text = (folder / f"{name}.inp").read_text()
    try:
        read_own_deck(folder / f"{name}.inp").flat({})
    except OwnDeckError as error:
        return with_lines(text, str(error))
    return text


def mass_and_frequencies(folder: Path, text: str) -> np.ndarray:
    """kg, and Hz of all modes up to two waves."""
    loaded = load_case(write(folder, text), allow_unusual=True)
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 2})
    object.__setattr__(loaded, "case", loaded.case.model_copy(update={"analysis": analysis}))
    answer = Evaluator(TyreDesign(loaded)).evaluate(Question({}))
    return np.array([answer.mass_kg, *(mode.frequency_Hz for mode in answer.modes)])


@pytest.mark.parametrize("name", maker_decks.DECKS)
def test_the_files_are_those_that_the_program_writes(name: str) -> None:
    """And ABAQUS' manual takes all of it."""
    for file, text in maker_decks.DECKS[name]().items():
        assert (maker_decks.FOLDER / file).read_text(encoding="utf-8") == text
    deck = read_own_deck(maker_decks.FOLDER / f"{name}.inp")
    assert asked_by_abaqus(deck.with_numbers({})) == {"refuses": [], "unknown": []}


@pytest.mark.parametrize("name", CASES)
def test_with_soft_membranes_it_is_the_same_tyre(name: str, tmp_path: Path) -> None:
    """Within 0.1 %; with the compound as stiff as it is some mode moves by more than that."""
    ours = mass_and_frequencies(tmp_path, maker_decks.OUR_WAY[name])
    soft = mass_and_frequencies(tmp_path, recorded(name, tmp_path, soft=True))
    np.testing.assert_allclose(soft, ours, rtol=1e-3)
    if name not in QUICK:
        whole = mass_and_frequencies(tmp_path, recorded(name, tmp_path))
        assert whole[0] == pytest.approx(ours[0], rel=1e-6)
        assert 0.01 < (whole / ours - 1).max() < 0.05


@pytest.mark.parametrize(
    "law",
    [
        "*HYPERELASTIC, MARLOW\n*UNIAXIAL TEST DATA\n 0., 0.\n 1.0E8, 0.05",
        "*HYPERELASTIC, N=2, TEST DATA INPUT\n*UNIAXIAL TEST DATA\n 1.0E8, 0.05",
        "*USER MATERIAL, CONSTANTS=3\n 4.0E9, 4.0E7, -0.001",
        "*HYPERELASTIC, NEO HOOKE\n 6.0E8",
    ],
)
def test_cords_are_elastic_or_refused_with_what_to_give(law: str, tmp_path: Path) -> None:
    text = maker_decks.lifted_membranes()["lifted_membranes.inp"]
    path = tmp_path / "tyre.inp"
    path.write_text(text.replace("*ELASTIC\n4e+09, 0.3", law))
    with pytest.raises(OwnDeckError, match=r"line \d+: .*(cord.*\*ELASTIC|\*ELASTIC.*cord)"):
        trial(read_own_deck(path).flat({}))
