"""Every table of a study is also a CSV file of its results."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from fnmatch import fnmatch
from typing import Any

import pytest

from tyrecal.files import RESULTS
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.report.html.results import Results, read_results
from tyrecal.simulate.modes.label import Label
from tyrecal.studies import STUDIES
from tyrecal.studies.fit.calibrate import history_csv
from tyrecal.studies.result import rows_csv

from .html import toy


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
