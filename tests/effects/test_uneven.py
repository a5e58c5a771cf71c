"""Effects that split doublets: what the tool shows of them, slopes, and who refuses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.job import run
from tyrecal_solvers.language.text import DeckError

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from .support import CASE, CASES, START, data, decks

SMALL = {"point_mass": 0.02, "road_contact": 2e4, "rotation": 10.0, "stiffness_splice": 0.2}
each = pytest.mark.parametrize("id", SMALL)
DEAR = {"stiffness_splice", "road_contact"}  # in time, of four


def few(case: LoadedCase = CASE) -> LoadedCase:
    """Harmonics up to 2 only: a splice has fewer to couple then."""
    analysis = case.case.analysis.model_copy(update={"highest_harmonic": 2})
    return replace(case, case=case.case.model_copy(update={"analysis": analysis}))


def evaluated(id: str = "", value: float = 0.0, case: LoadedCase | None = None) -> Evaluation:
    effect = {f"effects.{id}": value} if id else {}
    return Evaluator(TyreDesign(case or few())).evaluate(Question({**START, **effect}))


def by_label(evaluation: Evaluation) -> dict[Label, dict]:
    _, modes = modes_result(CASE, START, evaluation)
    return {mode.label: mode for mode in modes}


@each
def test_doublets_split_and_the_mean_stands_for_both(id: str) -> None:
    """modes.json has two entries of multiplicity 1, the lower first, for every doublet, and the
    evaluation one mode at their mean; singles and labels are the plain tyre's."""
    evaluation, plain = evaluated(id, SMALL[id]), evaluated()
    assert by_label(evaluation).keys() == by_label(plain).keys()
    entries = modes_result(CASE, START, evaluation)[0].content()["modes"]
    for label, mode in by_label(evaluation).items():
        own = [e for e in entries if (e["c"], e["m"], e["kind"]) == (label.c, label.m, label.kind)]
        assert [e["multiplicity"] for e in own] == ([1, 1] if label.c else [1])
        assert [e.get("member") for e in own] == ([1, 2] if label.c else [None])
        members = [e["frequency_Hz"] for e in own]
        assert members == sorted(members)
        assert mode.frequency_Hz == pytest.approx(np.mean(members), rel=1e-12)
        if label.c:
            assert mode.raw.members == tuple(members) and mode.multiplicity == 2
    frequencies = [e["frequency_Hz"] for e in entries]
    assert frequencies == sorted(frequencies)
    assert all("member" not in e for e in modes_result(CASE, START, plain)[0].content()["modes"])


@pytest.mark.parametrize(
    "id", [pytest.param(id, marks=[pytest.mark.slow] * (id in DEAR)) for id in SMALL]
)
def test_vanishes_with_its_parameter(id: str) -> None:
    """A hundredth of the size moves every member by a hundredth, up to second order: absent at 0,
    and linear there (rotation: the mean grows with the square)."""
    plain = by_label(evaluated())

    def moved(value: float) -> np.ndarray:
        modes = by_label(evaluated(id, value))
        both = {label: m.raw.members or (m.frequency_Hz,) for label, m in modes.items()}
        return np.concatenate(
            [np.array(f) / plain[label].frequency_Hz - 1 for label, f in both.items()]
        )

    small, smaller = moved(0.02 * SMALL[id]), moved(0.01 * SMALL[id])
    assert abs(small).max() > 1e-6
    assert smaller == pytest.approx(small / 2, abs=0.02 * abs(small).max())


def test_a_mass_is_weighed_with_the_tyre() -> None:
    assert evaluated("point_mass", 0.02).mass_kg == pytest.approx(evaluated().mass_kg + 0.02)


def test_the_record_answers_with_both_members(tmp_path) -> None:
    evaluator = Evaluator(TyreDesign(few()), store=Store(tmp_path))
    question = Question({**START, "effects.point_mass": 0.02})
    first, again = evaluator.evaluate(question), evaluator.evaluate(question)
    assert (evaluator.counts.runs, evaluator.counts.recorded) == (2, 1)  # the plain tyre first
    assert [m.members for m in first.modes] == [m.members for m in again.modes]


def test_a_splice_has_no_exact_slopes_but_where_it_is_0() -> None:
    name = "effects.stiffness_splice"
    evaluator = Evaluator(TyreDesign(with_values(few(), {name: 0.2})))
    assert not evaluator.has_gradients and Evaluator(TyreDesign(few())).has_gradients
    with pytest.raises(DeckRefused, match="no exact derivatives"):
        evaluator.evaluate(Question({**START, name: 0.2}, ("A_belt",)))
    assert Decks(TyreDesign(few(), {name: 0.0}), (name,)).tangents("abaqus")[name]
    name = "effects.point_mass"
    with pytest.raises(TemplateFailed, match=f"{name} is 0"):
        Decks(TyreDesign(few(), {name: 0.0}), (name,)).tangents("abaqus")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"effects.point_mass": 0.1, "effects.rotation": 5.0}, "one at a time"),
        ({"effects.point_mass": 0.1, "effects.wheel_free": 0.1}, "not honoured together"),
        ({"effects.rotation": 5.0, "effects.cavity_air": 1.0}, "not honoured together"),
    ],
)
def test_what_does_not_go_together(values: dict[str, float], words: str) -> None:
    with pytest.raises(DeckRefused, match=words):
        Evaluator(TyreDesign(few())).evaluate(Question({**START, **values}))


def test_not_on_a_road() -> None:
    for id, words in (("stiffness_splice", "pressed on a road"), ("rotation", "turning tyre")):
        with pytest.raises((DeckRefused, TemplateFailed), match=words):
            Evaluator(TyreDesign(CASE)).press({**START, f"effects.{id}": SMALL[id]}, [1000.0])


@pytest.mark.parametrize("solver", ["calculix", "abaqus"])
@pytest.mark.parametrize(
    "path", ["point_mass.mass_kg", "road_spring.radial_N_per_m", "spin_rad_per_s", "splice.share"]
)
def test_others_refuse_the_case_in_one_sentence(solver: str, path: str) -> None:
    with pytest.raises(DeckRefused, match=f"solver '{solver}' cannot express"):
        Evaluator(TyreDesign(CASE), solver).evaluate(Question({**START, path: 0.5}))


def test_deck_is_abaqus() -> None:
    """Masses and springs on nodes of the section, which the revolve keeps in its first plane; the
    road's stiffness is the sum of its springs'; speed and its square on every element set."""
    text = decks(CASE, point_mass=0.02, road_contact=3e4)["modes.inp"].splitlines()
    at = text.index("*MASS, ELSET=POINT_MASS")
    assert (text[at - 2], float(text[at + 1])) == ("*ELEMENT, TYPE=MASS, ELSET=POINT_MASS", 0.02)
    spring = text.index("*SPRING, ELSET=ROAD_RADIAL")
    nodes = spring - text.index("*ELEMENT, TYPE=SPRING1, ELSET=ROAD_RADIAL") - 1
    assert (text[spring + 1], float(text[spring + 2]) * nodes) == ("1", pytest.approx(3e4))
    for name, direction in (("LATERAL", "2"), ("TANGENTIAL", "3")):
        along = text.index(f"*SPRING, ELSET=ROAD_{name}")
        assert text[along + 1] == direction
        assert float(text[along + 2]) * nodes == pytest.approx(3e4)
    spun = decks(CASE, rotation=12.0)
    loads = [line for line in spun["modes.inp"].splitlines() if "CENTRIF" in line]
    assert len(loads) == 4 and all(float(line.split(",")[2]) == 144.0 for line in loads)
    assert spun["inflate.inp"].count("CENTRIF") == 4 and spun["modes.inp"].count("ROTDYNF") == 4


def test_splice_in_the_case_file(case_folder) -> None:
    """A splice of the case's own numbers: another section deck beside the same others; a path that
    is no number is named."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text()
    splice = "splice: {share: 1.0, width_deg: 4, numbers: [rebar_layers.carcass.area_m2]}\n"
    path.write_text(text + splice)
    written = data(Decks(TyreDesign(load_case(path))))
    plain = data(Decks(TyreDesign(load_case(CASES / path.name))))
    assert {name: written[name] for name in plain} == plain
    differ = [
        (a, b)
        for a, b in zip(
            plain["inflate.inp"].splitlines(), written["splice.inp"].splitlines(), strict=True
        )
        if a != b
    ]
    assert len(differ) == 1 and differ[0][0].startswith("CARCASS,")
    path.write_text(text + splice.replace("area_m2", "area"))
    with pytest.raises(TemplateFailed, match=r"splice.numbers: .*there is no 'area'"):
        Decks(TyreDesign(load_case(path))).texts("abaqus")


@pytest.mark.parametrize("id", ["point_mass", "rotation"])
def test_deck_alone_gives_the_same(tmp_path, id: str) -> None:
    """Run without the side file: as many modes as the deck asks for, split all the same."""
    for name, text in decks(few(), **{id: SMALL[id]}).items():
        (tmp_path / name).write_text(text)
    run(tmp_path, "modes", "inflate")
    step = json.loads((tmp_path / "modes.json").read_text())["steps"][-1]
    alone = {(m["n"], m["doublet"], m["member"]): m for m in step["modes"] if "member" in m}
    for label, mode in by_label(evaluated(id, SMALL[id])).items():
        if label.c:
            own = [alone[label.c, k, i]["frequency_Hz"] for k in range(2) for i in (1, 2)]
            assert min(abs(mode.frequency_Hz - (own[j] + own[j + 1]) / 2) for j in (0, 2)) < 1e-5


def test_mass_on_a_held_node_is_refused(tmp_path) -> None:
    for name, text in decks(few(), point_mass=0.1).items():
        rim = decks(few())["inflate.inp"].split("*NSET, NSET=RIM\n")[1].split(",")[0]
        lines = text.split("\n")
        if "*MASS, ELSET=POINT_MASS" in lines:
            at = lines.index("*MASS, ELSET=POINT_MASS") - 1
            lines[at] = f"{lines[at].split(',')[0]}, {rim}"
        (tmp_path / name).write_text("\n".join(lines))
    with pytest.raises(DeckError, match="do nothing"):
        run(tmp_path, "modes", "inflate")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (", CENTRIF, 144\n", ", GRAV, 144\n", "'GRAV' is not honoured"),
        (", ROTDYNF, 12, 0.0", ", ROTDYNF, 13, 0.0", "not the square of ROTDYNF 13"),
        ("PLY, ROTDYNF, 12, 0.0", "PLY, ROTDYNF, 13, 0.0", "must be one for all"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0\n*", "0.0, 0.0, 0.0, 1.0, 0.0, 0.0\n*", "about its axle"),
        ("SOLID_1, CENTRIF, 144\n", "", "is left out of the load CENTRIF"),
        ("SOLID_1, CENTRIF", "SOLID_9, CENTRIF", "SOLID_9 .* is not defined"),
        ("*COMPLEX FREQUENCY\n", "*COMPLEX FREQUENCY, FRICTION DAMPING=YES\n", "FRICTION DAMPING"),
    ],
)
def test_turning_decks_that_are_refused(tmp_path, old: str, new: str, words: str) -> None:
    texts = decks(few(), rotation=12.0)
    assert any(old in text for text in texts.values())
    for name, text in texts.items():
        (tmp_path / name).write_text(text.replace(old, new))
    with pytest.raises(DeckError, match=words):
        run(tmp_path, "modes", "inflate")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*MASS, ELSET=POINT_MASS\n0.02", "*MASS, ELSET=POINT_MASS\n-0.02", "must be positive"),
        ("*MASS, ELSET=POINT_MASS", "*MASS, ELSET=NOTHING", "NOTHING is no set of MASS elements"),
        ("*SPRING, ELSET=ROAD_RADIAL\n1\n", "*SPRING, ELSET=ROAD_RADIAL\n4\n", "1, 2 or 3, got 4"),
        ("*SPRING, ELSET=ROAD_RADIAL\n1\n", "*SPRING, ELSET=ROAD_RADIAL\n", "takes 2 data lines"),
        ("TYPE=MASS", "TYPE=MASSES", "ELEMENT: TYPE=MASSES is not honoured"),
    ],
)
def test_attached_decks_that_are_refused(tmp_path, old: str, new: str, words: str) -> None:
    texts = decks(few(), point_mass=0.02, road_contact=2e4)
    assert old in texts["modes.inp"]
    for name, text in texts.items():
        (tmp_path / name).write_text(text.replace(old, new))
    with pytest.raises(DeckError, match=words):
        run(tmp_path, "modes", "inflate")


def test_sector_of_another_mesh_is_refused(tmp_path) -> None:
    texts = Decks(TyreDesign(with_values(few(), {"splice.share": 0.5}))).texts("abaqus")
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    request = {"harmonics": [0, 1], "sector": {"job": "splice", "width_deg": 10.0}}
    (tmp_path / "modes.request.json").write_text(json.dumps(request))
    first = texts["splice.inp"].split("*NODE, NSET=TYRE\n")[1].split("\n")[0]
    node, r, z = first.split(", ")
    moved = texts["splice.inp"].replace(first, f"{node}, {float(r) + 1e-4}, {z}")
    (tmp_path / "splice.inp").write_text(moved)
    with pytest.raises(DeckError, match="the same mesh"):
        run(tmp_path, "modes", "inflate")
