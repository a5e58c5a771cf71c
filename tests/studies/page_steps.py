"""Commands whose results the documents print, and how their figures are read.

`pages` runs them and compares; `page_sentences` and `page_tables` say which figure is where.
"""

from __future__ import annotations

import csv
import itertools
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from tyrecal.simulate.modes.label import Label

ROOT = Path(__file__).parents[2]
LOADS_N = (1000, 2000, 3000, 4000, 5000, 6000)
OPTIMUM = "--set A_belt=3.64826e-7 --set A_carcass=8.01133e-8 --set C10=1000000.01489"
Figures = dict[str, float]


def of_fit(content: Mapping[str, Any]) -> Figures:
    """fit.json"""
    keys = ("objective_Hz", "evaluations", "evaluations_to_0.05_Hz", "mass_kg")
    figures = {key: content[key] for key in (*keys, "initial_objective_Hz")}
    figures["least singular value"] = content["singular_values"][-1]
    for name, v in content["variables"].items():
        figures |= {name: v["value"], f"{name} %": 100 * v["standard_error"] / v["value"]}
        if (total := v.get("standard_error_total")) is not None:
            figures[f"{name} total %"] = 100 * total / v["value"]
    for pair in itertools.combinations(content["variables"], 2):
        figures[f"{' and '.join(pair)} correlated"] = content["correlations"][pair[0]][pair[1]]
    for mode in content["modes"]:
        label = label_of(mode)
        if f"off {label}" in figures:  # measured in several states
            label += f" {mode['pressure_kPa']:g}"
        figures[f"off {label}"] = mode["deviation_percent"]
        for name in ("initial", "fitted", "target"):
            figures[f"{name} {label}"] = mode[f"{name}_Hz"]
    for each in content.get("footprint", []):
        figures[f"off {each['quantity']} {each.get('pressure_kPa', 'own')}"] = each[
            "deviation_percent"
        ]
    if "labels" in content:
        figures["labels %"] = 100 * content["labels"]["labelings"][0]["probability"]
        figures["chi2"] = content["chi2_per_dof"]
    return figures


def of_modes(content: Mapping[str, Any]) -> Figures:
    """modes.json"""
    return {"mass_kg": content["mass_kg"]} | {
        label_of(mode): mode["frequency_Hz"] for mode in content["modes"]
    }


def of_footprint(content: Mapping[str, Any]) -> Figures:
    """footprint.json: cm2, N/mm, mm"""
    figures: Figures = {}
    for row in content["rows"]:
        figures[f"cm2 at {row['load_N']:g}"] = 1e4 * row["area_m2"]
        figures[f"N/mm at {row['load_N']:g}"] = row["vertical_stiffness_N_per_m"] / 1e3
        for name in ("length", "width", "deflection"):
            figures[f"{name} at {row['load_N']:g}"] = 1e3 * row[f"{name}_m"]
    return figures


def of_labels(content: Mapping[str, Any]) -> Figures:
    """labels.json: probabilities, %"""
    figures = {
        f"labeling {k}": 100 * each["probability"]
        for k, each in enumerate(content["labels"]["labelings"])
    }
    for each in content["labels"]["frequencies"]:
        figures[f"{each['frequency_Hz']:g} Hz"] = each["expected_Hz"]
        for one in (each, *each["rivals"]):
            if one["c"] is not None:
                figures[f"{each['frequency_Hz']:g} {label_of(one)}"] = 100 * one["probability"]
    return figures


def of_diagnosis(content: Mapping[str, Any]) -> Figures:
    """diagnosis.json"""
    gap = content["gap"]
    effects = [p for key, p in content["probabilities"].items() if key not in ("none", "outside")]
    return {
        "rms %": gap["rms_percent"],
        "p": gap["p_value"],
        "none %": 100 * content["probabilities"]["none"],
        "outside %": 100 * content["probabilities"]["outside"],
        "effect %": 100 * max(effects, default=0.0),
    }


def of_sweep(content: Mapping[str, Any]) -> Figures:
    """pressure_sweep.json: Hz by design, label and kPa, and the rise from the first to the last."""
    rows: dict[str, list[Mapping[str, Any]]] = {}
    for row in content["rows"]:
        rows.setdefault(row["design"], []).append(row)
    figures: Figures = {}
    for design, states in rows.items():
        first, last = (
            {label_of(mode): mode["frequency_Hz"] for mode in state["modes"]}
            for state in (states[0], states[-1])
        )
        for label in first.keys() & last.keys():
            figures |= {
                f"{design} {label} from": first[label],
                f"{design} {label} to": last[label],
                f"{design} {label} rise": last[label] - first[label],
            }
        rates = [mode["d_ln_f_d_ln_p"] for state in states for mode in state["modes"]]
        figures |= {f"{design} least rate": min(rates), f"{design} largest rate": max(rates)}
    return dict(sorted(figures.items()))


def of_loads(content: Mapping[str, Any]) -> Figures:
    """load_sweep.json: Hz by label, symmetry and load, sticking and sliding."""
    figures: Figures = {}
    for row in content["rows"]:
        for mode in row["modes"]:
            name = label_of(mode) + (f" {mode['symmetry']}" if mode["c"] else "")
            figures[f"{name} at {row['load_N']:g}"] = mode["frequency_Hz"]
            if mode.get("sliding_Hz") is not None:
                figures[f"{name} sliding at {row['load_N']:g}"] = mode["sliding_Hz"]
    return figures


def of_sample(content: Mapping[str, Any]) -> Figures:
    """sample.json"""
    figures: Figures = {"evaluations": content["emulator"]["evaluations"]}
    for name, v in content["variables"].items():
        half = (v["high"] - v["low"]) / (2 * 1.645)
        figures |= {f"{name} {key}": v[key] for key in ("median", "low", "high", "best")}
        figures[f"{name} %"] = 100 * half / v["median"]
        figures[f"{name} linear %"] = 100 * v["standard_error"] / v["median"]
    return figures


def of_measurements(text: str) -> Figures:
    """A measurements CSV: each value and its sigma by label and kPa."""
    figures: Figures = {}
    for row in csv.DictReader(StringIO(text)):
        if row["quantity"] == "damping_ratio":
            continue
        label = Label(int(row["c"]), int(row["m"]), row["kind"])
        figures[f"{label} {row['pressure_kPa']}"] = float(row["value"])
        figures[f"{label} {row['pressure_kPa']} sigma"] = float(row["sigma"])
    return figures


def of_shapes(text: str) -> Figures:
    """Probability of the label of each shape, from what `measured import` prints."""
    lines = re.findall(r"(\[\d,\d\](?: lateral| torsional)?)((?: +[\d.]+)+)\s*$", text, re.M)
    return {f"{label} sure": float(numbers.split()[-1]) for label, numbers in lines}


def of_table(text: str) -> Figures:
    """Numbers of a study's tables, by table, row and column; of other lines by place."""
    figures: Figures = {}
    tables, within = 0, False
    for place, line in enumerate(text.splitlines()):
        tables += line.startswith("|") and not within
        within = line.startswith("|")
        if within:
            name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
            numbers = {
                k: cell
                for k, cell in enumerate(cells)
                if re.fullmatch(r"[+\-]?\d+(?:\.\d+)?", cell)
            }
            figures |= {f"{tables}: {name} {k}": float(cell) for k, cell in numbers.items()}
        else:
            printed = re.findall(r"(?<![\w.])[+\-]?\d+(?:\.\d+)?(?:e[+\-]?\d+)?", line)
            figures |= {f"line {place} {k}": float(x) for k, x in enumerate(printed)}
    return figures


def label_of(mode: Mapping[str, Any]) -> str:
    """[c,m] with its kind."""
    return str(Label(mode["c"], mode["m"], mode["kind"]))


@dataclass(frozen=True)
class Step:
    """A command, the file of its folder that holds its result ("": what it prints, ".": its output
    is a file), its reader; whether a test runs it."""

    command: str
    file: str
    read: Callable[[Any], Figures]
    is_quick: bool = False


TYRE, REAL = "cases/p235_75r17.yaml", "cases/205_60r15.yaml"
NARROW = "cases/p235_75r17_narrow_rim.yaml"
TRUTH = "--set A_belt=2.6e-7 --set A_carcass=3.6e-7 --set C10=1.08e6"
AT_240 = (
    "tyrecal measured import cases/measured/p235_75r17_240kPa_1.uff"
    " cases/measured/p235_75r17_240kPa_2.uff cases/measured/p235_75r17_240kPa_3.uff"
    " --pressure-kPa 240 --directions cylindrical --band 28,132 --highest-harmonic 8"
)
ROAD = f"tyrecal fit {REAL} --mesh coarse --method gauss-newton --no-pictures"
PRESSED = f"--loads-N {','.join(map(str, LOADS_N))} --no-pictures"
STEPS = {
    "fit": Step(f"tyrecal fit {TYRE} --no-pictures", "fit.json", of_fit),
    "fit gauss-newton": Step(
        f"tyrecal fit {TYRE} --method gauss-newton --no-pictures", "fit.json", of_fit
    ),
    "fit C10 held": Step(f"tyrecal fit {TYRE} --fix C10 --no-pictures", "fit.json", of_fit),
    "initial": Step(f"tyrecal modes {TYRE}", "modes.json", of_modes, is_quick=True),
    "optimum": Step(f"tyrecal modes {TYRE} {OPTIMUM}", "modes.json", of_modes, is_quick=True),
    "A_carcass": Step(f"tyrecal modes {TYRE} --set A_carcass=8.01133e-8", "modes.json", of_modes),
    "A_belt": Step(f"tyrecal modes {TYRE} --set A_belt=3.64826e-7", "modes.json", of_modes),
    "pressed": Step(f"tyrecal footprint {TYRE} {PRESSED}", "footprint.json", of_footprint),
    "pressed optimum": Step(
        f"tyrecal footprint {TYRE} {PRESSED} {OPTIMUM}", "footprint.json", of_footprint
    ),
    "section": Step("python -m tests.studies.both_columns", "", of_table),
    "inferred": Step("python -m tests.studies.both_columns --inferred", "", of_table),
    "narrow rim": Step(
        "python -m tests.studies.both_columns p235_75r17_narrow_rim --inferred", "", of_table
    ),
    "real": Step(f"tyrecal fit {REAL} --fix A_belt --no-pictures", "fit.json", of_fit),
    "labels": Step(
        f"tyrecal measured label {REAL} cases/205_60r15_vervoort.csv --fitted {{real}}",
        "labels.json",
        of_labels,
    ),
    "diagnosed": Step(
        f"tyrecal diagnose {REAL} --set rim.free=true --measured {{labels}}/labelled.csv"
        " --no-pictures",
        "diagnosis.json",
        of_diagnosis,
    ),
    "few": Step(
        "tyrecal fit {size} --prior --mesh coarse --measured cases/205_60r15_few.csv --set"
        " variables.C10_sidewall.percent=15 --set variables.C10_tread.percent=17 --method"
        " gauss-newton --no-pictures",
        "fit.json",
        of_fit,
    ),
    "public": Step("python -m tests.studies.real_prior {size} {few}/fit.json", "", of_table),
    "one effect": Step("python -m tests.studies.real_data", "", of_table),
    "both": Step(
        f"tyrecal fit {REAL} --measured cases/205_60r15_both.csv --no-pictures", "fit.json", of_fit
    ),
    "narrow rim, fit": Step(f"tyrecal fit {NARROW} --no-pictures", "fit.json", of_fit),
    "narrow rim, gauss-newton": Step(
        f"tyrecal fit {NARROW} --method gauss-newton --no-pictures", "fit.json", of_fit
    ),
    "real, free": Step(f"tyrecal fit {REAL} --no-pictures", "fit.json", of_fit),
    "real, gauss-newton": Step(
        f"tyrecal fit {REAL} --method gauss-newton --no-pictures", "fit.json", of_fit
    ),
    "more modes": Step("python -m tests.studies.more_modes", "", of_table),
    "real, pressed": Step(
        f"tyrecal footprint {REAL} --mesh coarse --fitted {{real}}/fit.json --compare fitted"
        f" {PRESSED}",
        "footprint.json",
        of_footprint,
    ),
    "four modes": Step(f"{ROAD} --measured {{four}}", "fit.json", of_fit),
    "and stiffness": Step(f"{ROAD} --measured {{stiffness}}", "fit.json", of_fit),
    "and area": Step(f"{ROAD} --measured {{area}}", "fit.json", of_fit),
    "as built": Step("tyrecal modes {size} --mesh coarse", "modes.json", of_modes, is_quick=True),
    "as built, surface": Step(
        "tyrecal modes {size} --mesh coarse --set rim.holds=bead_surface",
        "modes.json",
        of_modes,
        is_quick=True,
    ),
    "sweep": Step(
        f"tyrecal sweep-pressure {TYRE} --fitted {{fit}}/fit.json --no-pictures",
        "pressure_sweep.json",
        of_sweep,
    ),
    "narrow rim, sweep": Step(
        f"tyrecal sweep-pressure {NARROW} --fitted {{narrow rim, fit}}/fit.json --no-pictures",
        "pressure_sweep.json",
        of_sweep,
    ),
    "true tyre": Step(f"tyrecal modes {TYRE} {TRUTH}", "modes.json", of_modes, is_quick=True),
    "at 240": Step(f"{AT_240} --no-pictures", ".", of_measurements, is_quick=True),
    "shapes at 240": Step(f"{AT_240} --no-pictures --output {{shapes at 240}}", "", of_shapes),
    "at 200": Step(
        "tyrecal measured import cases/measured/p235_75r17_200kPa_shapes.uff --pressure-kPa 200"
        " --directions cylindrical --sigma-percent 0.2 --no-pictures",
        ".",
        of_measurements,
    ),
    "at 280": Step(
        "tyrecal measured import cases/measured/p235_75r17_280kPa_table.csv --no-pictures",
        ".",
        of_measurements,
    ),
    "joined": Step(
        "tyrecal measured import {at 200} {at 240} {at 280} --no-pictures", ".", of_measurements
    ),
    "three states": Step(
        f"tyrecal fit {TYRE} --measured {{joined}} --no-pictures", "fit.json", of_fit
    ),
    "one of three states": Step(
        f"tyrecal fit {TYRE} --measured {{joined}} --pressure-kPa 240 --no-pictures",
        "fit.json",
        of_fit,
    ),
    "sample": Step(
        f"tyrecal sample {TYRE} --measured cases/p235_75r17_wheeler.csv --no-pictures",
        "sample.json",
        of_sample,
    ),
    "paper diagnosed": Step(
        f"tyrecal diagnose {TYRE} --measured cases/p235_75r17_wheeler.csv --no-pictures",
        "diagnosis.json",
        of_diagnosis,
    ),
    "eight loads": Step(f"tyrecal footprint {TYRE} --no-pictures", "footprint.json", of_footprint),
    "loaded": Step(
        f"tyrecal modes {TYRE} --mesh coarse --sweep-load 0,1000,4000 --no-pictures",
        "load_sweep.json",
        of_loads,
    ),
    "effects": Step(f"python -m tests.studies.effects {TYRE} {{fit}}/fit.json", "", of_table),
    "sizes": Step(
        "python -m tests.studies.sizes tests/benchmarks/sizes.jsonl", "", of_table, is_quick=True
    ),
    "slips": Step(
        "python -m tests.studies.slips tests/benchmarks/slips.jsonl", "", of_table, is_quick=True
    ),
    "cluster": Step("python tests/benchmarks/cluster.py --tasks 3000", "", of_table),
}

Record = Mapping[str, Figures]


def from_size_code(folder: Path) -> Path:
    """The case of a 205/60R15 at 220 kPa that `tyrecal init` writes."""
    case = folder / "205_60r15.yaml"
    if not case.exists():
        folder.mkdir(parents=True, exist_ok=True)
        words = ["init", "205/60R15", "--pressure-kPa", "220", "--no-pictures", "--quiet"]
        subprocess.run(
            [sys.executable, "-m", "tyrecal", *words, "--output", str(case)], cwd=ROOT, check=True
        )
    return case


def rows_of(*quantities: str) -> Callable[[Path], Path]:
    """Writes the rows of some quantities of the MF-Swift set to a file."""

    def write(folder: Path) -> Path:
        head, *rows = (ROOT / "cases" / "205_60r15_mf_swift.csv").read_text().splitlines()
        folder.mkdir(parents=True, exist_ok=True)
        kept = [row for row in rows if row.startswith(quantities)]
        (folder / "targets.csv").write_text("\n".join([head, *kept, ""]), encoding="utf-8")
        return folder / "targets.csv"

    return write


SOURCES = {  # files that commands read, by their name there: what writes them to a folder
    "size": from_size_code,
    "four": rows_of("frequency"),
    "stiffness": rows_of("frequency", "vertical"),
    "area": rows_of("frequency", "vertical", "contact"),
}
