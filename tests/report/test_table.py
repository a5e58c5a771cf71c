"""Tables: the paper's Table 2 on a terminal, and those of every study as CSV."""

from __future__ import annotations

import csv
import io
import subprocess
import sys
from collections.abc import Iterator
from fnmatch import fnmatch
from typing import Any

import pytest
from rich.console import Console
from rich.table import Table

from tyrecal.files import RESULTS
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.report.html.results import Results, read_results
from tyrecal.report.table import fit_doubts, shown, tyre_doubts
from tyrecal.simulate.modes.label import Label
from tyrecal.studies import STUDIES
from tyrecal.studies.fit.calibrate import history_csv
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.modes import ModesResult
from tyrecal.studies.result import rows_csv

from .html import toy

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


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return read_results(toy.write(tmp_path_factory.mktemp("csv") / "toy"))


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def numbers(content: Any, key: str = "") -> Iterator[float]:
    if isinstance(content, dict):
        for name, each in content.items():
            yield from numbers(each, name)
    elif isinstance(content, list):
        for each in content:
            yield from numbers(each, key)
    elif isinstance(content, float) and key not in LEFT_OUT:
        yield content


HEADS = {  # columns with their units, as a user's script reads them
    "fit.csv": "c,m,kind,multiplicity,initial_Hz,fitted_Hz,target_Hz,deviation_percent,load_N,"
    "quantity,initial,fitted,target,sigma",
    "fit_variables.csv": "variable,initial,value,lower,upper,standard_error,standard_error_total,"
    "total_holds,explained_by_data,at_bound,unit",
    "modes.csv": "c,m,kind,frequency_Hz,multiplicity,symmetry,overlap,spanned",
    "pressure_sweep.csv": "design,pressure_kPa,c,m,kind,multiplicity,frequency_Hz,d_ln_f_d_ln_p",
    "sweep.csv": "C10,pressure_kPa,mass_kg,c,m,kind,multiplicity,frequency_Hz",
    "sweep_modes.csv": "c,m,kind,frequency_Hz,lowest_Hz,highest_Hz,change_percent.C10,"
    "change_percent.pressure_kPa,linear_share",
    "footprint.csv": "design,load_N,deflection_m,area_m2,length_m,width_m,mean_pressure_Pa,"
    "peak_pressure_Pa,vertical_stiffness_N_per_m",
    "stiffness.csv": "design,pressure_kPa,load_N,vertical_N_per_m,lateral_N_per_m,"
    "longitudinal_N_per_m,torsional_Nm_per_rad,vertical_sliding_N_per_m,loaded_radius_m,"
    "rolling_radius_m,deflection_m,length_m,width_m",
    "frf.csv": "excite,respond,quantity,unit,frequency_Hz,real,imag",
    "sensitivities.csv": "quantity,by,value,per",
    "sensitivities_selection.csv": "name,sets,gain,p_value,shift_in_sd,alike",
    "sensitivities_uncertain.csv": "name,sets,shift_in_sd",
    "effects.csv": "id,unit,value,mass_kg,before_percent,after_percent,absorbed,"
    "refitted.C10.before,refitted.C10.after",
    "effects_modes.csv": "id,pressure_kPa,c,m,kind,before_percent,after_percent",
    "load_sweep.csv": "design,load_N,deflection_m,c,m,kind,symmetry,frequency_Hz,overlap,spanned,"
    "sliding_Hz,grip_mm",
    "sample.csv": "c,m,kind,pressure_kPa,frequency_Hz,low,high,mean,standard_error,measured_Hz,"
    "sigma_Hz",
    "sample_variables.csv": "variable,mean,median,low,high,standard_error,best,lower,upper,unit",
    "sample_shares.csv": "c,m,kind,frequency_Hz,deviation_percent,first.A_belt,first.angle,"
    "total.A_belt,total.angle",
    "plan_steps.csv": "what,hours,total_hours,chance,predicted_percent",
    "plan_effects.csv": "id,chance,unit,base,largest_lambda,detectable_from,named_from,similar",
    "diagnosis.csv": "row,run,percent,sigma_percent",
    "diagnosis_probabilities.csv": "explanation,probability",
    "diagnosis_section.csv": "region,stiffness_percent,stiffness_sigma,mass_percent,mass_sigma,"
    "evidence,same_as",
    "diagnosis_effects.csv": "effect,lambda,judged_at,full_size,smallest_visible,absorbed",
    "diagnosis_next.csv": "what,gain,hours",
}


FIRST_ROWS = {  # numbers in their columns
    "fit.csv": "0,0,axial,1,36.85,30.86,31.7,-2.649842271293379,,,,,,",
    "fit_variables.csv": "A_belt,2e-07,3.6e-07,1e-07,1e-05,3.6e-08,,True,,False,m2",
    "effects.csv": "filler,K,3.0,0.1,4.5,1.5,0.886,1000000.0,1100000.0",
    "stiffness.csv": "initial,240.0,4000.0,210000.0,110000.0,350000.0,4800.0,200000.0,0.29,0.3,"
    "0.02,0.13,0.14",
    "frf.csv": "tread:0deg:radial,hub:fz,force,N/N,0.0,1.0,0.0",
    "sensitivities.csv": '"frequency_Hz [2,0]",C10,0.5,',
    "sensitivities_selection.csv": "belt_angle,rebar_layers.belt.angle_deg,31.0,5e-05,2.75,gauge",
    "footprint.csv": "initial,1000.0,0.005,0.003,0.1,0.08,330000.0,500000.0,200000.0",
    "sample.csv": "2,0,,240.0,79.0,78.5,79.5,79.0,0.3,79.5,",
    "diagnosis_effects.csv": "rim_width,12.0,,,,",
}


def test_every_file_has_its_columns_and_numbers_under_them(results: Results) -> None:
    written = {
        name: text.splitlines()
        for result in results.studies.values()
        for name, text in result.texts().items()
        if name.endswith(".csv")
    }
    assert {name: lines[0] for name, lines in written.items()} == HEADS
    assert {name: written[name][1] for name in FIRST_ROWS} == FIRST_ROWS


def test_files_that_few_results_have() -> None:
    """Designs that a fit tried, and measurements as they are read again."""
    row = {"values": {"C10": 1e6}, "point": 2, "start": 1, "objective_Hz": 8.6, "failure": ""}
    assert history_csv([row]) == "point,start,C10,objective_Hz,failure\r\n2,1,1000000.0,8.6,\r\n"
    mode = Measurement("frequency_Hz", Label(2, 1), "", 240.0, 0.0, 73.9, 0.25)
    rim = Measurement("mass_kg", None, "", 0.0, 0.0, 12.5, 0.05, rim="6.5x15")
    assert measurements_csv([mode, rim]).splitlines() == [
        "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma,rim",
        "frequency_Hz,2,1,,,240,0,73.9,0.25,case",
        "mass_kg,,,,,,0,12.5,0.05,6.5x15",
    ]


def test_entries_of_a_mapping_have_columns_and_lists_one_cell() -> None:
    row = {"id": "a", "by": {"x": {"low": 1.0}}, "names": ["b", "c"]}
    assert rows_csv([row, {"id": "d"}]) == "id,by.x.low,names\na,1.0,b; c\nd,,\n"


# histograms, and how clear a label is: no table has them
LEFT_OUT = {"density", "box", "counts", "clarity"}


IN_TABLES = {  # key of the JSON content whose every number has to be in some CSV file
    "fit": ("variables", "modes", "states"),
    "modes": ("modes", "cavity"),
    "sweep-pressure": ("rows",),
    "sweep-load": ("rows",),
    "sweep": ("rows", "modes"),
    "footprint": ("rows",),
    "sensitivities": ("rows",),
    "sample": ("variables", "predicted", "variance_shares"),
    "diagnose": ("probabilities", "detectability", "section_map"),
}


def test_every_number_of_a_table_is_in_a_csv(results: Results) -> None:
    for study, keys in IN_TABLES.items():
        result = results.studies[study]
        written = {name: text for name, text in result.texts().items() if name.endswith(".csv")}
        cells = {cell for text in written.values() for row in rows(text) for cell in row.values()}
        for key in keys:
            values = list(numbers(result.content().get(key, {})))
            missing = [x for x in values if repr(x) not in cells]
            assert not missing, (study, key, missing, sorted(written))


def test_every_study_with_a_table_has_a_csv_that_a_new_run_replaces(results: Results) -> None:
    assert set(results.studies) == set(STUDIES) - {"labels", "sensors"}
    for study, result in results.studies.items():
        names = [name for name in result.texts() if name.endswith(".csv")]
        assert names, study
        for name in names:
            patterns = RESULTS.get(study, (f"{study}.*", f"{study}_*"))
            assert any(fnmatch(name, pattern) for pattern in patterns), name


def test_files_of_a_diagnosis_and_of_effects(results: Results) -> None:
    texts = results.studies["diagnose"].texts()
    assert rows(texts["diagnosis_probabilities.csv"])[0]["explanation"] == "rim_width"
    assert set(rows(texts["diagnosis_section.csv"])[0]) >= {"region", "evidence", "same_as"}
    first = rows(results.studies["effects"].texts()["effects_modes.csv"])[0]
    percent = first["before_percent"], first["after_percent"]
    assert (first["id"], *percent) == ("filler", "4.0", "1.5")
