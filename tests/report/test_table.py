"""Tables: the paper's Table 2 on a terminal and as CSV."""

from __future__ import annotations

import io
import subprocess
import sys

import pytest
from rich.console import Console
from rich.table import Table

from tyrecal.report.table import fit_doubts, shown, tyre_doubts
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.modes import ModesResult

# c, m, kind, initial, optimised, target: Table 2 of Bekakos et al. 2016
TABLE_2 = [
    (0, 0, "axial", 36.85, 30.86, 31.7),
    (0, 0, "torsional", 37.17, 35.85, 35.0),
    (1, 1, None, 43.85, 36.92, 37.8),
    (2, 1, None, 76.33, 68.41, 66.1),
    (3, 1, None, 117.07, 107.9, 102.7),
]
FIT = FitResult.model_validate(
    {
        **dict.fromkeys(
            ("pressure_kPa", "mass_kg", "projected_gradient_norm", "label_margin"), 1.0
        ),
        **dict.fromkeys(("evaluations", "failed_evaluations"), 1),
        **dict.fromkeys(("converged", "moved"), True),
        "method": "slsqp",
        "message": "",
        "correlations": {},
        "singular_values": [],
        "starts": [],
        "initial_objective_Hz": 33.1349,
        "objective_Hz": 8.6031,
        "modes": [
            {
                "c": c,
                "m": m,
                "kind": kind,
                "multiplicity": 2 if c else 1,
                "frequency_Hz": fitted,
                "initial_Hz": initial,
                "fitted_Hz": fitted,
                "target_Hz": target,
                "deviation_percent": round(100 * (fitted / target - 1), 4),
            }
            for c, m, kind, initial, fitted, target in TABLE_2
        ],
        "variables": {
            "A_belt": {
                "initial": 2.11868e-7,
                "value": 3.64826e-7,
                "lower": 1e-7,
                "upper": 1e-5,
                "standard_error": 3.64826e-8,
                "at_bound": False,
            },
            "odd[bold]name": {
                "initial": 4.2e-7,
                "value": 1e-8,
                "lower": 1e-8,
                "upper": 1e-5,
                "standard_error": None,
                "at_bound": True,
            },
        },
        "fixed": {"C10": 1e6},
    }
)


def lines(table: Table, width: int = 110, terminal: bool = False) -> list[str]:
    text = io.StringIO()
    colours = "standard" if terminal else "auto"
    Console(file=text, width=width, force_terminal=terminal or None, color_system=colours).print(
        table
    )
    return text.getvalue().splitlines()


def test_a_fit_reads_like_table_2():
    rows = [" ".join(line.split()) for line in lines(shown(*FIT.tables()))]
    assert [row for row in rows if row][2:] == [
        "[0,0] lateral 36.85 30.86 31.70 -2.65",
        "[0,0] torsional 37.17 35.85 35.00 +2.43",
        "[1,1] ×2 pitch / yaw-camber 43.85 36.92 37.80 -2.33",
        "[2,1] ×2 first out-of-plane bending 76.33 68.41 66.10 +3.49",
        "[3,1] ×2 second out-of-plane bending 117.07 107.90 102.70 +5.06",
        "variable unit initial fitted bounds std. err. % scatter %",
        "A_belt 2.119e-07 3.648e-07 1e-07 to 1e-05 - 10",
        "odd[bold]name at bound 4.2e-07 1e-08 1e-08 to 1e-05 - -",
        "C10 held 1e+06 1e+06 - - -",
        "objective equation (1) 33.135 8.603",
        "frequencies and objective in Hz",
    ]


def test_a_narrow_terminal_breaks_no_figure():
    text = "\n".join(lines(shown(*FIT.tables()), 80))
    assert "…" not in text
    for figure in (
        "117.07",
        "107.90",
        "102.70",
        "+5.06",
        "2.119e-07",
        "3.648e-07",
        "1e-07 to 1e-05",
    ):
        assert figure in text


def test_colours_only_on_terminals():
    assert not any("\x1b" in line for line in lines(shown(*FIT.tables())))
    coloured = {line[:5]: line for line in lines(shown(*FIT.tables()), terminal=True)}
    assert "\x1b[31m" in coloured["[3,1]"]
    assert "\x1b[33m" in coloured["[2,1]"]


def test_csv_to_the_byte():
    assert FIT.csv() == (
        "c,m,kind,multiplicity,initial_Hz,fitted_Hz,target_Hz,deviation_percent\n"
        "0,0,axial,1,36.85,30.86,31.7,-2.6498\n"
        "0,0,torsional,1,37.17,35.85,35.0,2.4286\n"
        "1,1,,2,43.85,36.92,37.8,-2.328\n"
        "2,1,,2,76.33,68.41,66.1,3.4947\n"
        "3,1,,2,117.07,107.9,102.7,5.0633\n"
    )


def test_modes_under_load_show_their_symmetry():
    mode = {
        "c": 1,
        "m": 0,
        "kind": None,
        "frequency_Hz": 58.754,
        "multiplicity": 1,
        "symmetry": "antisymmetric",
    }
    content = {"pressure_kPa": 240.0, "load_N": 4000.0, "mass_kg": 12.8, "modes": [mode]}
    text = lines(shown(*ModesResult(**content, variables={}).tables()))
    assert text[0].strip() == "240 kPa, 4000 N, 12.80 kg"
    assert " ".join(text[-1].split()) == "[1,0] vertical / fore-aft 58.75 antisymmetric"


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ((0, 0, "axial"), "lateral"),
        ((2, 0), "ovalisation"),
        ((2, 1), "first out-of-plane bending"),
        ((4, 0), "third in-plane bending"),
        ((12, 1), "11th out-of-plane bending"),
        ((3, 2), "belt bends across its width"),
    ],
)
def test_words(label, words):
    assert Label(*label).motion == words


def test_tables_load_no_drawing_packages():
    code = "import sys, tyrecal.report.table; sys.exit(not {'matplotlib', 'meshio'}.isdisjoint(sys.modules))"  # noqa: E501
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("off", "expected"), [((-80.0, -70.0, 2.0), True), ((-80.0, 3.0, 2.0), False)]
)
def test_a_fit_that_is_far_off_most_modes_asks_for_the_unit(
    off: tuple[float, ...], expected: bool
) -> None:
    modes = [{"deviation_percent": percent} for percent in off]
    result = {
        "moved": True,
        "converged": True,
        "variables": {},
        "failed_evaluations": 0,
        "label_margin": 1.0,
        "modes": modes,
        "singular_values": [1.0],
    }
    assert any("in Hz" in doubt for doubt in fit_doubts(result)) is expected


def test_a_tyre_that_is_none_is_doubted() -> None:
    assert tyre_doubts({"mass_kg": 12.8, "modes": [{"frequency_Hz": 31.7}]}) == []
    heavy, slow = tyre_doubts({"mass_kg": 173e3, "modes": [{"frequency_Hz": 4.6e-5}]})
    assert "1.73e+05 kg, usual is 0.5 to 500 kg" in heavy and "4.6e-05 Hz" in slow


def test_both_members_of_a_split_doublet_are_shown() -> None:
    """Each member has the number of the file if something splits the doublet."""
    mode = {"c": 2, "m": 1, "kind": None, "multiplicity": 1, "clarity": 0.9}
    result = ModesResult.model_validate(
        {
            **dict.fromkeys(("pressure_kPa", "load_N", "mass_kg"), 1.0),
            "variables": {},
            "modes": [{**mode, "frequency_Hz": 66.0 + k, "member": k} for k in (1, 2)],
        }
    )
    (table,) = result.tables()
    place = [column.name for column in table.columns].index("member")
    assert [row[place] for row in table.rows] == ["1", "2"]
    console = Console(file=io.StringIO(), width=120)
    console.print(shown(table))
    assert "67.00" in console.file.getvalue()  # type: ignore[attr-defined]
