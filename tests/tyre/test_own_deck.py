"""A deck in any style is the tyre that it describes; what is not understood is refused by line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tyrecal.cli.main import main
from tyrecal.simulate.deck.own import asked_by_abaqus, lacking_in_calculix
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import CaseError, LoadedCase, start_values
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import OwnDeck, Units, read_own_deck
from tyrecal.tyre.own_deck.own_text import own_texts
from tyrecal.tyre.own_deck.solver_deck import SolverDeck
from tyrecal.tyre.own_deck.summary import contents
from tyrecal.tyre.own_deck.text import OwnDeckError
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from . import own_deck_mutants, own_decks


def write(folder: Path, text: str) -> Path:
    """The deck, and its case beside it."""
    path = folder / "tyre.inp"
    path.write_text(text, encoding="utf-8")
    deck = read_own_deck(path)
    case = path.with_suffix(".yaml")
    case.write_text(own_case(deck, deck.flat({}), "not given", None), encoding="utf-8")
    return case


def frequencies(case: Path) -> np.ndarray:
    """Mass and frequencies of the tyre's first modes."""
    loaded = load_case(case)
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 2})
    plain = loaded.case.model_copy(update={"analysis": analysis})
    object.__setattr__(loaded, "case", plain)
    evaluation = Evaluator(TyreDesign(loaded)).evaluate(Question({}))
    return np.array([evaluation.mass_kg, *(mode.frequency_Hz for mode in evaluation.modes)])


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return frequencies(write(tmp_path_factory.mktemp("plain"), own_decks.plain()))


def test_what_abaqus_would_refuse(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing of the decks; what is wrong for it and for us is said of each, by file and line."""
    path = tmp_path / "tyre.inp"
    for style in (own_decks.plain, *own_decks.STYLES.values()):
        path.write_text(style())
        deck = read_own_deck(path, "m")
        report = asked_by_abaqus(deck.with_numbers({}))
        assert not report["refuses"]
        assert all("more than the 20 characters" in doubt for doubt in report["unknown"])
    text = own_decks.plain().replace("*REBAR LAYER\nCAR", "*ELASTIC\n1e9, 0.3\n*REBAR LAYER\nCAR")
    path.write_text(text.replace("*END STEP", "*CLOAD\n900001, 1\n*END STEP"))
    with pytest.raises(SystemExit) as ended:
        main(["deck", "--check", str(path), "--json"])
    assert ended.value.code == 2
    out = json.loads(capsys.readouterr().out)
    assert re.match(r"tyre.inp, line \d+: \*ELASTIC: must be under", out["refused"])
    assert [re.sub(r".*?: ", "", words, count=1) for words in out["calculix"]] == [
        "*ELEMENT: its axisymmetric elements (CAX) do not twist, as belts make a tyre do",
        "*ELEMENT: it has no rebar: cords are solids of a stiff direction there",
        "*VISCOELASTIC: its hyperelastic rubber does not relax",
    ]
    assert [re.sub(r".*?: ", "", words, count=1) for words in out["abaqus"]["refuses"]] == [
        "*ELASTIC: must be directly under *MATERIAL",
        "*CLOAD: field 3, a number, is missing",
    ]


@pytest.mark.parametrize("style", own_decks.STYLES)
def test_only_the_writing_differs(style: str, reference: np.ndarray, tmp_path: Path) -> None:
    values = frequencies(write(tmp_path, own_decks.STYLES[style]()))
    assert values == pytest.approx(reference, rel=1e-9)


def test_cords_that_bear_no_compression(reference: np.ndarray, tmp_path: Path) -> None:
    """Where all are taut they are as any. CalculiX has nothing for it."""
    text, count = re.subn(r"(\*ELASTIC\n.*\n)", r"\1*NO COMPRESSION\n", own_decks.plain())
    assert count == 1
    assert frequencies(write(tmp_path, text)) == pytest.approx(reference, rel=1e-9)
    blocks = read_own_deck(tmp_path / "tyre.inp", "m").with_numbers({})
    assert not asked_by_abaqus(blocks)["refuses"]
    assert any("it passes over the keyword" in words for words in lacking_in_calculix(blocks))


def test_included_files(reference: np.ndarray, tmp_path: Path) -> None:
    text = own_decks.plain()
    at = text.index("*SOLID SECTION")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(text[:at])
    values = frequencies(write(tmp_path, "*include, Input=parts/mesh.inp\n" + text[at:]))
    assert values == pytest.approx(reference, rel=1e-12)
    (tmp_path / "tyre.inp").write_text(text)
    whole = read_own_deck(tmp_path / "tyre.inp").flat({}).text
    head, data = text[: text.index("1001,")], text[text.index("1001,") : text.index("*NODE\n")]
    (tmp_path / "nodes.txt").write_bytes(b"** in \x85 mm\n" + data.encode())
    for taken in (f"{head}*INCLUDE, INPUT=nodes.txt\n", f"{head.rstrip()}, input = nodes.txt\n"):
        rest = text[len(head) + len(data) :]
        (tmp_path / "tyre.inp").write_text(taken + rest, newline="\r\n")
        deck = read_own_deck(tmp_path / "tyre.inp")
        assert deck.flat({}).text == whole
        assert own_texts(deck, {})["nodes.txt"].endswith(data)
    (tmp_path / "nodes.txt").write_text("*NODE\n" + data)
    with pytest.raises(OwnDeckError, match=r"^nodes.txt, line 1: .* in a file of data lines"):
        read_own_deck(tmp_path / "tyre.inp")
    (tmp_path / "tyre.inp").write_text("*include, Input=parts/mesh.inp\n" + text[at:])
    (tmp_path / "parts" / "mesh.inp").write_text(text[:at] + "*NOD\n")
    with pytest.raises(OwnDeckError, match=r"^parts/mesh.inp, line \d+: \*NOD: .*\*NODE"):
        read_own_deck(tmp_path / "tyre.inp").flat({})


def test_a_ply_on_the_inner_surface(tmp_path: Path) -> None:
    """The pressure on its face is that on the rubber's."""
    texts = own_decks.inner_ply(), own_decks.inner_ply(spelled=True)
    flats = []
    for text in texts:
        (tmp_path / "tyre.inp").write_text(text)
        flats.append(read_own_deck(tmp_path / "tyre.inp").flat({}))
    assert flats[0].text == flats[1].text


def test_marks_and_paths_have_exact_slopes(tmp_path: Path) -> None:
    """A mark in the text, a path, a parameter: the same number, the same slope; and that slope is
    the frequencies'."""
    case = write(tmp_path, own_decks.parameters())
    deck = tmp_path / "tyre.inp"
    deck.write_text(deck.read_text().replace("<c01>", "{{ second }}"))
    text = case.read_text()
    text = text[: text.index("variables:")] + text[text.index("# What was measured") :]
    text += (
        "variables:\n"
        "  area: {sets: [parameter / AREA], start: 2.1e-7, lower: 1.0e-7, upper: 1.0e-6}\n"
        "  second: {sets: [deck.numbers.second], start: 2.0e5, lower: 1.0e5, upper: 1.0e6}\n"
        "  E: {sets: [material cord/elastic/e], start: 1.0e10, lower: 1.0e9, upper: 1.0e11}\n"
    )
    case.write_text(text)
    loaded = load_case(case)
    start = start_values(loaded)
    evaluator = Evaluator(TyreDesign(with_values(loaded, start)))
    hertz = lambda values: np.array(
        [m.frequency_Hz for m in evaluator.evaluate(Question(values)).modes]
    )
    slopes = evaluator.evaluate(Question(start, tuple(start))).gradients
    for name, value in start.items():
        h = 1e-4 * value
        up, down = (hertz({**start, name: value + side * h}) for side in (1, -1))
        assert slopes[name] == pytest.approx((up - down) / (2 * h), rel=1e-5, abs=1e-6 / value)


def test_a_parameter_that_is_only_the_pressure_is_no_number_of_a_case(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The case's pressure counts in its place. One that sets more is a number."""
    text = own_decks.parameters().replace("p = 2*10**5", "bar = 1e5\nidle = 3.\np = 2*bar")
    case = write(tmp_path, text)
    deck = load_case(case).kind.deck
    assert deck.idle.keys() == {"parameter / bar", "parameter / idle"}
    assert {"parameter / shear", "parameter / share", "parameter / area"} <= {*deck.section_numbers}
    numbers = json.dumps({"parameter / bar": 9e4})
    other = case.with_name("other.yaml")
    other.write_text(f"format: 1\ndeck: {{file: tyre.inp, numbers: {numbers}}}\n")
    for command in (["modes", str(case), "--set", "Parameter/BAR=9e4"], ["validate", str(other)]):
        with pytest.raises(SystemExit) as ended:
            main(command)
        assert ended.value.code == 2
        assert re.search(r"/ ?bar.*use pressure_kPa", capsys.readouterr().err, re.IGNORECASE)


def test_a_parameter_is_set_behind_its_sign(tmp_path: Path) -> None:
    path = tmp_path / "tyre.inp"
    path.write_text("*PARAMETER\np2 =2 # two\n" + own_decks.plain())
    written = own_texts(read_own_deck(path), {"parameter / p2": 2.5})["tyre.inp"]
    assert written == path.read_text().replace("=2 #", "=2.5 #")


REFUSED = {
    "SOLID SECTION, ELSET=SOLID": (
        "SOLID SECTION, ELSET=SOLIDS",
        "element set SOLIDS is not defined",
    ),
    "*HYPERELASTIC": ("*HYPERELASTICS", "did you mean \\*HYPERELASTIC"),
    "MODULI=LONG TERM": ("MODULUS=LONG TERM", "did you mean MODULI"),
    "*DENSITY\n1100.0": ("", "needs a \\*DENSITY"),
    "NLGEOM=YES": ("NLGEOM=NO", "only YES or no value"),
    "900001, 1, 6": ("900001, 1, 2", "1, 2 and 6"),
    "CAVITY, P, 2.0E+05": ("CAVITY, HP, 2.0E+05", "only P"),
    "LINER, S4": ("LINER, S1", "no free surface"),
    "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001, 0.0,": (
        "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001, 0.1,",
        "position",
    ),
    "*END STEP": ("", "cut off"),
    "TYPE=CGAX8R": ("TYPE=CPS8R", "no element of a revolved tyre"),
    "*ELEMENT, TYPE=CGAX8R": ("*ELEMENT, TYPE=CGAX8T", "no element of a revolved tyre"),
    "*ELASTIC": ("*ELASTIC, MODULI=INSTANTANEOUS", "only LONG TERM"),
    "*DSLOAD": ("*BOUNDARY, OP=NEW\n1001, ENCASTRE\n*DSLOAD", "must be at every \\*BOUNDARY"),
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused_by_line(text: str, tmp_path: Path) -> None:
    other, words = REFUSED[text]
    path = tmp_path / "tyre.inp"
    whole = own_decks.plain()
    assert whole.count(text) >= 1
    path.write_text(whole.replace(text, other, 1))
    with pytest.raises(OwnDeckError, match=r"^tyre.inp, line \d+: .*" + words):
        trial(read_own_deck(path).flat({}))


def test_a_seat_far_from_the_rim_is_refused(tmp_path: Path) -> None:
    """*TIE leaves nodes free that lie beyond its tolerance, and moves those within it."""
    path, tied = tmp_path / "tyre.inp", own_decks.rax_rim()
    for seat in ("ADJUST=NO, POSITION TOLERANCE=0.01", "POSITION TOLERANCE=0.04"):
        path.write_text(tied.replace("ADJUST=NO, POSITION TOLERANCE=0.04", seat))
        with pytest.raises(OwnDeckError, match=r"line \d+: \*TIE: node \d+ is .* from the rim"):
            read_own_deck(path).flat({})


@pytest.mark.parametrize("held", ["MIDDLE, YSYMM\n", "MIDDLE, 2\n", "MIDDLE, 2\nMIDDLE, 5\n", ""])
def test_half_a_tyre_is_named_with_the_lines_that_make_it_whole(held: str, tmp_path: Path) -> None:
    """Whatever its middle is held in; with the lines it is the whole one."""
    path, text = tmp_path / "tyre.inp", own_decks.half()
    path.write_text(text)
    whole = read_own_deck(path).flat({}).text
    lines = re.findall(r"\*SYMMETRIC.*\n.*\n", text)[0]
    bare = text.replace(lines, "").replace("MIDDLE, YSYMM\n", held)
    path.write_text(bare)
    with pytest.raises(OwnDeckError) as error:
        read_own_deck(path).flat({})
    added = "\n".join(re.findall(r"'(.+?)'", error.value.message)) + "\n"
    path.write_text(bare.replace("*STEP", f"{added}*STEP", 1))
    assert read_own_deck(path).flat({}).text == whole


def test_a_half_is_mirrored_in_the_model_not_in_a_part(tmp_path: Path) -> None:
    path, whole = tmp_path / "tyre.inp", own_decks.half()
    path.write_text(whole)
    flat = read_own_deck(path).flat({})
    head, mirror, rest = re.split(r"(\*SYMMETRIC.*\n.*\n)", whole)
    sections, step = rest[: rest.index("*MATERIAL")], rest[rest.index("*MATERIAL") :]
    step = re.sub("^(900001|MIDDLE|CAVITY),", r"I.\1,", step, flags=re.M)
    part = head.replace("*HEADING\na tyre\n", "*PART, NAME=P\n")
    end = "*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*END ASSEMBLY\n"
    path.write_text(part + sections + end + mirror + step)
    assert read_own_deck(path).flat({}).text == flat.text
    path.write_text(part + mirror + sections + end + step)
    line = 1 + part.count("\n")
    with pytest.raises(OwnDeckError, match=rf"line {line}: \*SYMMETRIC MODEL GENERATION: belongs"):
        read_own_deck(path).flat({})


@pytest.mark.parametrize(
    ("more", "refused"),
    [("", ""), (", 0.", ""), (", 0.5", "third"), (", 0., 0.5", r"'0\.5' is not")],
)
def test_a_node_has_two_coordinates(more: str, refused: str, tmp_path: Path) -> None:
    """A third one of 0, as of CAE, is the same node; one that is not, or a fourth, is refused."""
    path, text = tmp_path / "tyre.inp", own_decks.plain()
    path.write_text(text)
    whole = read_own_deck(path).flat({}).text
    path.write_text(re.sub("^(1003, .*)$", rf"\g<1>{more}", text, count=1, flags=re.M))
    line = 1 + text[: text.index("\n1003, ")].count("\n") + 1
    if refused:
        with pytest.raises(OwnDeckError, match=rf"line {line}: \*NODE: .*{refused}"):
            read_own_deck(path).flat({})
    else:
        assert read_own_deck(path).flat({}).text == whole


def test_nodes_are_not_filled_in_steps_of_0(tmp_path: Path) -> None:
    path, text = tmp_path / "tyre.inp", own_decks.plain()
    path.write_text(text.replace("*RIGID BODY", "*NFILL\nRIM, RIM, 5, 0\n*RIGID BODY"))
    with pytest.raises(OwnDeckError, match=r"\*NFILL: 5 steps of 0"):
        read_own_deck(path).flat({})


def test_what_a_step_releases_is_free(tmp_path: Path) -> None:
    """By OP=NEW, in the step that inflates or in one before."""
    text = own_decks.plain()
    held = text.replace("*STEP", "*BOUNDARY\n1005, ENCASTRE\n900001, 1, 6\n*STEP")
    first = "*STEP\n*STATIC\n1., 1.\n*BOUNDARY, OP=NEW\n900001, 1, 6\n*END STEP\n*STEP"
    for each, more in (
        (text, 0),
        (held, 1),
        (held.replace("*BOUNDARY\n900001", "*BOUNDARY, OP=NEW\n900001"), 0),
        (held.replace("*STEP", first, 1), 0),
    ):
        (tmp_path / "tyre.inp").write_text(each)
        assert len(read_own_deck(tmp_path / "tyre.inp").flat({}).mesh.rim) == 26 + more


def test_laws_and_elements_in_either_units(tmp_path: Path) -> None:
    """Every law's constants are converted; hybrid elements take incompressible rubber."""
    laws = {
        "YEOH": ((1e6, -2e5, 5e4), (-1,) * 3),
        "NEO HOOKE": ((1e6, 5e-8), (-1, 1)),
        "ARRUDA-BOYCE": ((2e6, 3.0), (-1, 0)),
        "OGDEN, N=2": ((2e6, 2.0, 1e5, -2.0), (-1, 0, -1, 0)),
        "REDUCED POLYNOMIAL, N=2": ((1e6, 1e4, 5e-8, 5e-8), (-1, -1, 1, 1)),
        "POLYNOMIAL, N=2": ((8e5, 2e5, 1e4, 1e4, 1e4), (-1,) * 5),
    }
    for law, (constants, powers) in laws.items():
        texts = []
        for style, scale in ((own_decks.plain, 1.0), (own_decks.millimetres, 1e6)):
            row = ", ".join(repr(x * scale**p) for x, p in zip(constants, powers, strict=True))
            text = re.sub(r"MOONEY-RIVLIN(.*)\n.*", rf"{law}\1\n{row}", style())
            (tmp_path / "tyre.inp").write_text(text.replace("CGAX8R,", "CGAX8RH,"))
            texts.append(read_own_deck(tmp_path / "tyre.inp").flat({}))
            assert trial(texts[-1]) == pytest.approx(9.3377, rel=1e-5)
        for first, other in zip(*map(numbers_of, texts), strict=True):
            assert other == pytest.approx(first, rel=1e-12)


def numbers_of(flat: SolverDeck) -> list[list[float]]:
    """Numbers in the data lines of the materials, and the nodes' coordinates."""
    texts = flat.text.splitlines()
    lines = texts[texts.index("*MATERIAL, NAME=RUBBER") :]
    rows = [line.split(",") for line in lines if not line.startswith("*")]
    nodes = [x for point in flat.mesh.nodes.values() for x in point]
    return [[float(x) for row in rows for x in row], nodes]


def test_wrong_decks_are_refused_by_line_or_are_the_same(request: pytest.FixtureRequest) -> None:
    """None is computed otherwise."""
    mutants = own_deck_mutants.draw(25, request.config.getoption("--seed"))
    wrong = [
        (kind, style, how) for kind, style, how, _ in mutants if how not in ("refused", "same")
    ]
    assert not wrong
    assert sum(how == "refused" for _, _, how, _ in mutants) >= 20


def test_a_tyre_is_the_same_however_its_paths_are_written(tmp_path: Path) -> None:
    """And however its deck is indented; another tyre with another constant."""
    case = write(tmp_path, own_decks.plain())
    first = tyre_sha256(load_case(case))
    text, deck = case.read_text(), (tmp_path / "tyre.inp").read_text()
    case.write_text(text.replace("material RUBBER / HYPER", "Material  rubber/hyper"))
    (tmp_path / "tyre.inp").write_text("** mine\n" + deck.replace(", ", "  , "))
    assert tyre_sha256(load_case(case)) == first
    (tmp_path / "tyre.inp").write_text(deck.replace("*DENSITY\n1100", "*DENSITY\n1200"))
    assert tyre_sha256(load_case(case)) != first


def test_validate_reads_a_deck_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case, paths = write(tmp_path, own_decks.plain()), list[Path]()

    def reading(path: Path, units: Units | None = None) -> OwnDeck:
        paths.append(path)
        return read_own_deck(path, units)

    monkeypatch.setattr("tyrecal.tyre.case.deck_file.read_own_deck", reading)
    with pytest.raises(SystemExit) as ended:
        main(["validate", str(case)])
    assert not ended.value.code and len(paths) == 1


def test_what_stays_the_same_is_built_once(tmp_path: Path) -> None:
    """A layer's area, a constant, a parameter of either: the mesh is the one that was."""
    (tmp_path / "tyre.inp").write_text(own_decks.parameters())
    deck = read_own_deck(tmp_path / "tyre.inp")
    meshes = [
        deck.flat(numbers).mesh
        for numbers in ({}, {"parameter / area": 3e-7}, {"material CORD / ELASTIC / E": 1e9})
    ]
    assert meshes[0] is meshes[1] is meshes[2]


@pytest.mark.slow
def test_studies_take_such_a_case(tmp_path: Path) -> None:
    """A sweep follows the pressure, a footprint bears the load, the rest is refused by name."""
    case = write(tmp_path, own_decks.cae())

    def run(*words: str) -> int:
        with pytest.raises(SystemExit) as ended:
            main([*words, "--quiet", "--output", str(tmp_path / "out"), "--no-store"])
        return int(ended.value.code or 0)

    pressures = ("--from-kPa", "150", "--to-kPa", "250", "--steps", "2")
    assert run("sweep-pressure", str(case), *pressures) == 0
    assert run("footprint", str(case), "--loads-N", "500") == 0
    rows = json.loads((tmp_path / "out" / "footprint.json").read_text())["rows"]
    assert rows[0]["area_m2"] * rows[0]["mean_pressure_Pa"] == pytest.approx(500, rel=1e-6)
    assert run("modes", str(case), "--set", "effects.bead_filler=0.5") == 2
    assert run("modes", str(case), "--set", "rebar carcass/AREA=3e-7") == 2  # a variable sets it
    assert run("modes", str(case), "--solver", "calculix") == 2


def test_a_deck_says_itself_what_the_rim_holds(tmp_path: Path) -> None:
    path = write(tmp_path, own_decks.plain())
    assert "rim:\n" in path.read_text()
    path.write_text(path.read_text().replace("rim:\n", "rim:\n  holds: bead_surface\n"))
    with pytest.raises(CaseError, match=r"rim.*must be absent with deck, which names"):
        load_case(path)


def with_parts(folder: Path, **parts: list[str]) -> LoadedCase:
    """The case of a deck with a tread of its own, whose sets are named."""
    case = write(folder, own_decks.two_compounds())
    named = f"  parts: {json.dumps(parts)}\n  numbers: {{"
    case.write_text(case.read_text().replace("  numbers: {", named))
    return load_case(case)


def test_effects_of_named_parts_change_their_numbers(tmp_path: Path) -> None:
    """And no other: what the deck says is that of the same numbers set by hand."""
    parts = {"tread": ["tread"], "bead_filler": ["BODY"], "belts": ["BELT"]}
    case = with_parts(tmp_path, **parts)
    assert case.case.deck
    plain = case.case.deck.numbers
    of_rubber, of_tread = (f"material {m} / HYPERELASTIC / " for m in ("RUBBER", "TREAD"))
    for effect, value, expected in (
        ("tread_density", 0.1, {"material TREAD / DENSITY / density": 1.1}),
        (
            "bead_filler",
            1.0,
            {f"{of_rubber}{name}": f for name, f in (("C10", 2.0), ("C01", 2.0), ("D1", 0.5))},
        ),
        ("belt_angle", 2.0, {"rebar BELT_1 / angle": 68 / 70, "rebar BELT_2 / angle": 112 / 110}),
        (
            "temperature",
            20.0,
            {f"{of}{name}": 0.85 for of in (of_rubber, of_tread) for name in ("C10", "C01")},
        ),
    ):
        deck = resolved(with_values(case, {f"effects.{effect}": value})).case.deck
        assert deck
        by_hand = {path: factor * plain[path] for path, factor in expected.items()}
        assert deck.numbers == pytest.approx({**plain, **by_hand}, rel=1e-12)
    with pytest.raises(ValueError, match="cap_ply changes lines or regions of a section"):
        resolved(with_values(case, {"effects.cap_ply": 1e-5}))


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({}, r"needs the sets of tread: name them in deck.parts.tread"),
        ({"tread": ["OTHER"]}, "OTHER is none of TREAD, BODY"),
    ],
)
def test_an_effect_that_knows_no_part_is_refused_by_name(
    tmp_path: Path, parts: dict[str, list[str]], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        resolved(with_values(with_parts(tmp_path, **parts), {"effects.tread_density": 0.1}))


@pytest.mark.parametrize(
    ("pressures", "used"), [((1e5, 2e5), 1), ((2e5, 2e4, 2e5), 2), ((2e5, 2e5), 0), ((2e5, 1e5), 0)]
)
def test_the_step_that_inflates_is_the_last_that_raises_the_pressure(
    pressures: tuple[float, ...], used: int, tmp_path: Path
) -> None:
    """Seated at a lower pressure, or deflated in between: the flat deck is that of one step."""
    steps = [
        own_decks.STEP.replace("INFLATE", f"S{k}").replace("2.0E+05", f"{p}")
        for k, p in enumerate(pressures)
    ]
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain(step="".join(steps)))
    deck = read_own_deck(path)
    flat = deck.flat({})
    assert flat.pressure_Pa == pytest.approx(pressures[used])
    assert contents(deck, flat)["inflation_step"] == f"S{used}"
    alone = tmp_path / "alone.inp"
    alone.write_text(own_decks.plain(step=steps[used]))
    assert flat.text == read_own_deck(alone).flat({}).text


def test_a_later_load_on_another_surface_is_no_inflation(tmp_path: Path) -> None:
    """Nor is what follows it."""
    road = own_decks.STEP.replace("INFLATE", "ROAD").replace(
        "CAVITY, P, 2.0E+05", "TREAD, P, 9.0E+05"
    )
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain(step=own_decks.STEP + road + own_decks.STEP))
    deck = read_own_deck(path)
    assert contents(deck, deck.flat({}))["later_steps"] == ["ROAD", "INFLATE"]


def test_a_real_parameter_stays_real(tmp_path: Path) -> None:
    """A third of 2200000. is no whole number, which ABAQUS and we make of 2200000/3; a whole one
    that its user wrote so stays whole."""
    path = tmp_path / "tyre.inp"
    text = own_decks.parameters().replace("c01=shear/2.-c10", "count = 6\nc01=shear/count-c10/2")
    path.write_text(text.replace("name='RUBBER'", "name='RUBBER'\nthird = shear/3"))
    deck = read_own_deck(path)
    numbers = {"parameter / shear": 2.2e6, "parameter / count": 7.0}
    new = own_texts(deck, numbers)["tyre.inp"]
    assert "shear = 2200000.\n" in new and "count = 7\n" in new
    for blocks in (deck.with_numbers(numbers), None):
        path.write_text(new)
        blocks = blocks or read_own_deck(path, "m").with_numbers({})
        (law,) = (block for block in blocks if block.name == "HYPERELASTIC")
        assert law.rows[0].number(1) == pytest.approx(2.2e6 / 7 - 0.2 * 2.2e6)
