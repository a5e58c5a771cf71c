"""The deck is a real evaluator: what stands in it, and only that, decides the result."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path

import pytest

from tyrecal.simulate.deck.decks import Decks, without_header
from tyrecal.simulate.deck.template_process import TO_START, TemplateProcess
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.templates import TemplateFailed, number
from tyrecal.tyre.values import with_values

from ..conftest import CASES

SHIPPED = Path(str(files("tyrecal_templates") / "abaqus"))


def case_with_template(folder: Path, name: str, old: str, new: str):
    """The case with one of its templates edited in the user's own folder."""
    own = folder / "my templates"
    own.mkdir(exist_ok=True)
    text = (SHIPPED / name).read_text()
    assert old in text
    (own / name).write_text(text.replace(old, new))
    path = folder / "p235_75r17.yaml"
    path.write_text(path.read_text() + "\ntemplates: my templates\n")
    return load_case(path)


def frequencies(case) -> list[float]:
    return [
        m.frequency_Hz
        for m in Evaluator(TyreDesign(case)).evaluate(Question(start_values(case))).modes
    ]


def test_a_number_edited_in_the_users_template_moves_the_frequencies(case_folder: Path) -> None:
    """Density x 1.21 in the template is density x 1.21 in the case; so is a cord angle."""
    plain = load_case(CASES / "p235_75r17.yaml")
    edited = case_with_template(
        case_folder,
        "inflate.inp.j2",
        "{{ material.density | number }}",
        "{{ (material.density * 1.21) | number }}",
    )
    same = with_values(
        plain,
        {
            f"materials.{name}.density_kg_per_m3": 1.21 * density
            for name, density in (
                ("rubber", 1100.0),
                ("belt_cord", 5900.0),
                ("carcass_cord", 1500.0),
            )
        },
    )
    assert frequencies(edited) == pytest.approx(frequencies(same), rel=1e-9)
    # every mass grows by 1.21, so every frequency falls by 1.1
    assert frequencies(edited) == pytest.approx([f / 1.1 for f in frequencies(plain)], rel=1e-9)


@pytest.mark.slow
def test_a_cord_angle_edited_in_the_users_template(case_folder: Path) -> None:
    plain = load_case(CASES / "p235_75r17.yaml")
    edited = case_with_template(
        case_folder,
        "inflate.inp.j2",
        "{{ cord.angle | number }}",
        "{{ (cord.angle - 2 if cord.name == 'BELT_1' else cord.angle) | number }}",
    )
    same = with_values(plain, {"rebar_layers.belt_1.angle_deg": 68.0})
    assert frequencies(edited) == pytest.approx(frequencies(same), rel=1e-12)
    assert abs(frequencies(edited)[6] / frequencies(plain)[6] - 1) > 1e-3


def test_the_solver_alone_gives_the_same_bytes(tmp_path: Path) -> None:
    """The written decks, run by another process through the solver's own command."""
    case = load_case(CASES / "p235_75r17.yaml")
    values = start_values(case)
    evaluator = Evaluator(TyreDesign(case), folder=tmp_path / "runs", keep=True)
    evaluator.evaluate(Question(values, tuple(values)))
    (run,) = evaluator.folder.iterdir()
    alone = tmp_path / "alone"
    alone.mkdir()
    for name in ("inflate.inp", "modes.inp", "modes.request.json"):
        (alone / name).write_bytes((run / name).read_bytes())
    subprocess.run(
        [
            sys.executable,
            "-m",
            "tyrecal_solvers.bundled",
            str(alone / "modes.inp"),
            "--oldjob",
            "inflate",
        ],
        check=True,
    )
    for name in ("modes.json", "modes.npz"):
        assert (alone / name).read_bytes() == (run / name).read_bytes()


def test_without_the_side_file_the_deck_alone_is_solved(tmp_path: Path) -> None:
    """*FREQUENCY's number of modes then decides, over all harmonics, doublets counted twice."""
    case = load_case(CASES / "p235_75r17.yaml")
    for name, text in Decks(TyreDesign(case, start_values(case))).texts("abaqus").items():
        (tmp_path / name).write_text(text.replace("\n20\n", "\n16\n"))
    from tyrecal_solvers.bundled.job import run

    run(tmp_path, "modes", "inflate")
    import json

    modes = json.loads((tmp_path / "modes.json").read_text())["steps"][0]["modes"]
    assert sum(mode["multiplicity"] for mode in modes) == 16
    expected = sorted(frequencies(with_values(case, start_values(case))))
    assert [m["frequency_Hz"] for m in modes] == pytest.approx(expected[: len(modes)], rel=1e-9)


def test_tangents_find_every_place_of_a_variable() -> None:
    """The areas of both belts move with A_belt, one for one; C10 has one place."""
    case = load_case(CASES / "p235_75r17.yaml")
    values = start_values(case)
    decks = Decks(TyreDesign(case, values), tuple(values))
    tangents = decks.tangents("abaqus")
    lines = decks.texts("abaqus")["inflate.inp"].splitlines()
    assert {n: len(rows) for n, rows in tangents.items()} == {"A_belt": 2, "A_carcass": 1, "C10": 1}
    for job, line, field, slope in (row for rows in tangents.values() for row in rows):
        assert job == "inflate"
        assert slope == pytest.approx(1.0, rel=1e-8)
        assert float(lines[line - 1].split(",")[field]) in values.values()


def test_to_first_order_a_splice_is_its_share_of_the_circumference_all_round() -> None:
    """Every number that it changes, by its width over 360 degrees; elsewhere than at 0 nothing."""
    name, width = "effects.stiffness_splice", 30.0
    case = with_values(load_case(CASES / "p235_75r17.yaml"), {"splice.width_deg": width})
    design = TyreDesign(case, {name: 0.0})
    assert design.has_slopes
    decks = Decks(design, (name,))
    lines = decks.texts("abaqus")["inflate.inp"].splitlines()
    slopes = {
        float(lines[line - 1].split(",")[field]): slope
        for job, line, field, slope in decks.tangents("abaqus")[name]
        if job == "inflate"
    }
    assert sorted(slopes) == [1e6, 9.87e9, 172.2e9]  # C10, and the cords' moduli; C01 is 0
    assert slopes == pytest.approx({x: x * width / 360 for x in slopes}, rel=1e-6)
    spliced = TyreDesign(case, {name: 0.5})
    assert not spliced.neighbour(name, 1)[0].has_slopes


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        ("{{ ''.__class__.__mro__ }}", "unsafe"),
        ("{{ cycler.__init__.__globals__.os.system('true') }}", "unsafe"),
        ("{% include '/etc/passwd' %}", "passwd"),
        ("{% include '../p235_75r17.yaml' %}", "p235"),
        ("{{ no_such_name }}", "no_such_name"),
        ("{{ layers.append(1) }}", "unsafe"),
        ("{{ 'abc' | number }}", "not a number"),
        ("{{ (pressure * 1e300 * 1e300) | number }}", "finite"),
        ("{% for i in range(100000000) %}x{% endfor %}", "range"),
        ("{% if %}", "line 2"),
        ("{% include 'more.txt' %}", "'more.txt' must have a name that ends in .j2"),
    ],
)
def test_a_template_may_not_leave_its_sandbox(case_folder: Path, edit: str, words: str) -> None:
    case = case_with_template(case_folder, "inflate.inp.j2", "*HEADING\n", f"*HEADING\n{edit}\n")
    with pytest.raises(TemplateFailed, match="inflate") as failure:
        Decks(TyreDesign(case)).texts("abaqus")
    assert words in str(failure.value)
    assert "\n" not in str(failure.value)


DOUBLED = (
    "{% set ns = namespace(a=['aaaaaaaa']) %}"
    "{% for i in range(60) %}{% set ns.a = [ns.a, ns.a] %}{% endfor %}{{ ns.a }}"
)


@pytest.mark.parametrize(
    "edit",
    [
        pytest.param("{{ 7 ** (7 ** 11) }}", marks=pytest.mark.slow),
        pytest.param(DOUBLED, marks=pytest.mark.slow),
        "{{ 'a' * 3000000000 }}",
        "{{ '%3000000000d' % 1 }}",
        "{{ '{:>3000000000}'.format(1) }}",
        "{{ 'a' | center(3000000000) }}",
        pytest.param("{{ 'a' * 60000000 }}", marks=pytest.mark.slow),
    ],
)
def test_a_template_has_an_end(case_folder: Path, edit: str) -> None:
    case = case_with_template(case_folder, "inflate.inp.j2", "*HEADING\n", f"*HEADING\n{edit}\n")
    with pytest.raises(TemplateFailed, match=r"inflate.*(MemoryError|was stopped)"):
        Decks(TyreDesign(case)).texts("abaqus")
    own = case_folder / "my templates" / "inflate.inp.j2"
    own.write_text(own.read_text().replace(edit, "right"))
    assert "\nright\n" in Decks(TyreDesign(case)).texts("abaqus")["inflate.inp"]


def test_own_templates_give_the_same_bytes(
    case_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rendered apart, and where a module in the present folder has the name of one of ours."""
    (case_folder / "jinja2.py").write_text("raise SystemExit('a stranger was imported')")
    monkeypatch.chdir(case_folder)
    plain = load_case(CASES / "p235_75r17.yaml")
    own = case_with_template(case_folder, "inflate.inp.j2", "*HEADING\n", "*HEADING\n")
    decks = [Decks(TyreDesign(case)).texts("abaqus") for case in (plain, own)]
    plain_text, own_text = (
        {name: without_header(text.encode()) for name, text in texts.items()} for texts in decks
    )
    assert own_text == plain_text


class Hole:
    """A value that is computed in the process that renders, as by a way out of the sandbox."""

    def __init__(self, expression: str):
        self.expression = expression

    def __reduce__(self) -> tuple[object, ...]:
        return eval, (self.expression,)


@pytest.mark.parametrize(
    "expression",
    [
        "str(dict(__import__('os').environ))",
        "__import__('pathlib').Path('/proc/self/environ').read_text()",
    ],
)
def test_a_template_that_leaves_its_sandbox_reads_no_environment(
    case_folder: Path, monkeypatch: pytest.MonkeyPatch, expression: str
) -> None:
    monkeypatch.setenv("SECRET_TOKEN", "hunter2")
    for name in TO_START:
        monkeypatch.delenv(name, raising=False)
    (case_folder / "environ.j2").write_text("{{ environ }}")
    with ThreadPoolExecutor(1) as thread:  # which gets a process of its own
        rendered = thread.submit(
            TemplateProcess("abaqus", case_folder).render,
            "environ.j2",
            {"environ": Hole(expression)},
        )
        assert rendered.result() in ("", "{'OPENBLAS_NUM_THREADS': '1'}")


@pytest.mark.parametrize(
    "line",
    [
        "*INCLUDE, INPUT=/etc/passwd",
        "*INCLUDE, INPUT=../secret.inp",
        "*Include,\n input = 'C:\\secret.inp'",
        "*USER SUBROUTINES",
        "*MATERIAL, NAME=@LIBRARY_FUNCTION",
    ],
)
def test_a_deck_of_own_templates_stays_in_its_folder(case_folder: Path, line: str) -> None:
    case = case_with_template(case_folder, "inflate.inp.j2", "*RESTART, WRITE\n", f"{line}\n")
    with pytest.raises(TemplateFailed, match=r"inflate\.inp, line \d+: .* leads out"):
        Decks(TyreDesign(case)).texts("abaqus")


def test_a_link_out_of_the_template_folder_is_refused(case_folder: Path, tmp_path: Path) -> None:
    case = case_with_template(
        case_folder, "inflate.inp.j2", "*HEADING\n", "*HEADING\n{% include 'link.j2' %}\n"
    )
    (tmp_path / "secret.txt").write_text("secret")
    (case_folder / "my templates" / "link.j2").symlink_to(tmp_path / "secret.txt")
    with pytest.raises(TemplateFailed, match="leads out"):
        Decks(TyreDesign(case)).texts("abaqus")


@pytest.mark.parametrize("keyword", ["*TIE, NAME=X", "*NODE, SYSTEM=C", "*INCLUDE, INPUT=x.inp"])
def test_an_unknown_keyword_is_refused_by_name_and_line(case_folder: Path, keyword: str) -> None:
    case = case_with_template(case_folder, "inflate.inp.j2", "*RESTART, WRITE\n", f"{keyword}\n")
    with pytest.raises(DeckRefused, match=r"inflate\.inp, line 6: .* is not honoured"):
        Evaluator(TyreDesign(case)).evaluate(Question({}))


def test_numbers_have_thirteen_digits_and_fit_abaqus_fields() -> None:
    for value in (-1.2345678901234567e-107, 1 / 3, -2.118683e-7, 1e6, 0.0, 240000):
        text = number(value)
        assert len(text) <= 20
        assert float(text) == pytest.approx(value, rel=1e-12)
    for wrong in (float("nan"), float("inf"), True, "1", None, 1j):
        with pytest.raises(TemplateFailed):
            number(wrong)


@pytest.mark.parametrize(
    ("template", "old", "new", "words"),
    [
        (
            "modes.inp.j2",
            "*RIGID BODY, REF NODE={{ mesh.reference_node }}, TIE NSET=RIM\n",
            "",
            "must be restated",
        ),
        ("modes.inp.j2", "*BOUNDARY\n{{ mesh.reference_node }}, 1, 6\n", "", "must be held"),
        ("modes.inp.j2", "INC={{ increments }}", "INC=3", "INC=10"),
        ("modes.inp.j2", "360.0, {{ sectors }}", "180.0, {{ sectors }}", "360 degrees"),
        ("modes.inp.j2", "CAVITY, P, ", "OUTSIDE, P, ", "OUTSIDE"),
        ("modes.inp.j2", "CAVITY, P, ", "CAVITY, HP, ", "only P"),
        ("modes.inp.j2", ", NORMALIZATION=MASS", ", PROPERTY EVALUATION=fast", "not a number"),
        ("modes.inp.j2", "{{ modes }}\n", "{{ modes }}, , , , 7.0\n", "data '7.0'"),
        ("modes.inp.j2", "0.0, 1.0, 0.0\n", "1.0, 0.0, 0.0\n", "second axis"),
        ("inflate.inp.j2", "{{ material.density | number }}", "1100.0, 20.0", "data '20.0'"),
        ("inflate.inp.j2", ", NLGEOM=YES", "", "NLGEOM"),
        ("inflate.inp.j2", ", DIRECT", "", "DIRECT"),
        ("inflate.inp.j2", "*END STEP\n", "", "cut off"),
        ("inflate.inp.j2", "{{ material.density | number }}", "-5", "density"),
        ("inflate.inp.j2", "{{ cord.spacing | number }}", "0.0", "positive"),
        ("mesh.inp.j2", "INNER_ROW, S4", "INNER_ROW, S5", "S1, S2, S3, S4"),
    ],
)
def test_a_deck_that_would_mean_another_tyre_is_refused(
    case_folder: Path, template: str, old: str, new: str, words: str
) -> None:
    """Each refusal has the deck's name, and the line at fault if there is one."""
    case = case_with_template(case_folder, template, old, new)
    with pytest.raises(DeckRefused, match=r"(inflate|modes)\.inp") as failure:
        Evaluator(TyreDesign(case)).evaluate(Question({}))
    assert words in str(failure.value)


def test_without_its_load_the_second_job_is_not_inflated(case_folder: Path) -> None:
    """ABAQUS drops the first job's loads at the transfer, so a deck without *DSLOAD is flat."""
    case = case_with_template(
        case_folder, "modes.inp.j2", "*DSLOAD\nCAVITY, P, {{ pressure | number }}\n", ""
    )
    with pytest.raises(EvaluationFailed, match="it is of 0 kPa, 240 kPa were requested"):
        Evaluator(TyreDesign(case)).evaluate(Question({}))
