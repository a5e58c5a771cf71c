"""Every figure of cases/paper.md and cases/real_data.md: the command that gives it, and its record.

    python -m tests.studies.pages FOLDER [STEP ...]
    python -m tests.studies.pages --check

The first runs the commands (all, or the steps named, whose earlier ones must lie in FOLDER), writes
what they give to tests/benchmarks/pages.json with command and date, and compares; the second only
compares the pages with the record, as `tests/test_pages.py` does: a printed figure is the recorded
one, rounded to its own last digit. The frequencies of Table 2 and the labels' table that test
computes anew. Figures printed by others (the paper, Vervoort, MF-Swift) are not ours to derive.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from tyrecal.simulate.modes.label import Label

from .both_columns import PAPER_HZ

ROOT = Path(__file__).parents[2]
RECORD = ROOT / "tests" / "benchmarks" / "pages.json"
NUMBER = r"([+\-]?\d+(?:\.\d+)?)"
LOADS_N = (1000, 2000, 3000, 4000, 5000, 6000)
OPTIMUM = "--set A_belt=3.64826e-7 --set A_carcass=8.01133e-8 --set C10=1000000.01489"
Figures = dict[str, float]


def of_fit(content: Mapping[str, Any]) -> Figures:
    """fit.json"""
    keys = ("objective_Hz", "evaluations", "evaluations_to_0.05_Hz", "mass_kg")
    figures = {key: content[key] for key in keys}
    for name, v in content["variables"].items():
        figures |= {name: v["value"], f"{name} %": 100 * v["standard_error"] / v["value"]}
    for mode in content["modes"]:
        figures[f"off {label_of(mode)}"] = mode["deviation_percent"]
    for each in content.get("footprint", []):
        figures[f"off {each['quantity']} {each['pressure_kPa']:g}"] = each["deviation_percent"]
    if "labels" in content:
        figures["labels %"] = 100 * content["labels"]["labelings"][0]["probability"]
        rows = sum(mode["multiplicity"] for mode in content["modes"]) - len(content["variables"])
        figures["chi2"] = content["objective_Hz"] ** 2 / rows
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
        for name in ("length", "width"):
            figures[f"{name} at {row['load_N']:g}"] = 1e3 * row[f"{name}_m"]
    return figures


def of_labels(content: Mapping[str, Any]) -> Figures:
    """labels.json: probabilities, %"""
    figures = {
        f"labeling {k}": 100 * each["probability"]
        for k, each in enumerate(content["labels"]["labelings"])
    }
    for each in content["labels"]["frequencies"]:
        for one in (each, *each["rivals"]):
            if one["c"] is not None:
                figures[f"{each['frequency_Hz']:g} {label_of(one)}"] = 100 * one["probability"]
    return figures


def of_diagnosis(content: Mapping[str, Any]) -> Figures:
    """diagnosis.json"""
    part, gap = content["section_map"][0], content["gap"]
    effects = [p for key, p in content["probabilities"].items() if key not in ("none", "outside")]
    return {
        "rms %": gap["rms_percent"],
        "p": gap["p_value"],
        "none %": 100 * content["probabilities"]["none"],
        "outside %": 100 * content["probabilities"]["outside"],
        "effect %": 100 * max(effects, default=0.0),
        "part %": part["stiffness_percent"],
        "part sigma %": part["stiffness_sigma"],
    }


def of_table(text: str) -> Figures:
    """Numbers of a study's tables, by table, row and column; of other lines by place."""
    figures: Figures = {}
    tables, within = 0, False
    for place, line in enumerate(text.splitlines()):
        tables += line.startswith("|") and not within
        within = line.startswith("|")
        if within:
            name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
            numbers = {k: cell for k, cell in enumerate(cells) if re.fullmatch(NUMBER, cell)}
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
    """A command, the file of its folder that holds its result ("": what it prints), its reader."""

    command: str
    file: str
    read: Callable[[Any], Figures]


TYRE, REAL = "cases/p235_75r17.yaml", "cases/205_60r15.yaml"
PRESSED = f"--loads-N {','.join(map(str, LOADS_N))} --no-pictures"
AT_SIZE = "--loads-N 2000,4000,6000 --no-pictures"
STEPS = {
    "fit": Step(f"tyrecal fit {TYRE} --no-pictures", "fit.json", of_fit),
    "fit gauss-newton": Step(
        f"tyrecal fit {TYRE} --method gauss-newton --no-pictures", "fit.json", of_fit
    ),
    "fit C10 held": Step(f"tyrecal fit {TYRE} --fix C10 --no-pictures", "fit.json", of_fit),
    "initial": Step(f"tyrecal modes {TYRE}", "modes.json", of_modes),
    "optimum": Step(f"tyrecal modes {TYRE} {OPTIMUM}", "modes.json", of_modes),
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
    "labels without a fit": Step(
        f"tyrecal measured label {REAL} cases/205_60r15_vervoort.csv", "labels.json", of_labels
    ),
    "diagnosed": Step(
        f"tyrecal diagnose {REAL} --set rim.free=true --measured {{labels}}/labelled.csv"
        " --no-pictures",
        "diagnosis.json",
        of_diagnosis,
    ),
    "diagnosed, section exact": Step(
        "tyrecal diagnose {exact} --set rim.free=true --measured {labels}/labelled.csv"
        " --no-pictures",
        "diagnosis.json",
        of_diagnosis,
    ),
    "size code": Step(f"tyrecal footprint {{size}} {AT_SIZE}", "footprint.json", of_footprint),
    "stiffnesses": Step(
        "tyrecal fit {size} --mesh coarse --measured cases/205_60r15_two_pressures.csv --fix A_belt"
        " --fix C10_tread --method gauss-newton --no-pictures",
        "fit.json",
        of_fit,
    ),
    "predicted": Step(
        f"tyrecal footprint {{size}} --fitted {{stiffnesses}}/fit.json --compare fitted {AT_SIZE}",
        "footprint.json",
        of_footprint,
    ),
    "one effect": Step("python -m tests.studies.real_data", "", of_table),
    "both": Step(
        f"tyrecal fit {REAL} --measured cases/205_60r15_both.csv --no-pictures", "fit.json", of_fit
    ),
}

Record = Mapping[str, Figures]


def change(record: Record, step: str, label: str) -> float:
    """Per cent, from the initial design."""
    return 100 * record[step][label] / record["initial"][label] - 100


def of(step: str, *keys: str | tuple[str, float]) -> Callable[[Record], list[float]]:
    """Recorded figures, each times its factor."""
    pairs = [(key, 1.0) if isinstance(key, str) else key for key in keys]
    return lambda record: [record[step][key] * factor for key, factor in pairs]


def pressed(step: str, what: str) -> Callable[[Record], list[float]]:
    """At every load."""
    return of(step, *(f"{what} at {load}" for load in LOADS_N))


def rises(record: Record, what: str) -> list[float]:
    """From the initial design to the paper's optimum, %, at every load."""
    after, before = (pressed(step, what)(record) for step in ("pressed optimum", "pressed"))
    return [100 * a / b - 100 for a, b in zip(after, before, strict=True)]


def distance(record: Record, step: str, hertz: Sequence[float]) -> float:
    """Equation (1) to the paper's frequencies, Hz."""
    twice = [1 + (not label.startswith("[0,0]")) for label in LABELS]
    off = (record[step][label] - f for label, f in zip(LABELS, hertz, strict=True))
    return math.sqrt(sum(w * d**2 for w, d in zip(twice, off, strict=True)))


LABELS = ("[0,0] axial", "[0,0] torsional")
LABELS += ("[1,1]", "[1,0]", "[2,1]", "[2,0]", "[3,0]", "[3,1]", "[4,0]")
MEASURED_HZ = (31.7, 35.0, 37.8, 58.5, 66.1, 79.5, 97.6, 102.7, 115.9)
TOLD = ("[0,0] axial", "[1,1]", "[2,1]", "[3,1]", "[1,0]")  # changes of both columns' table
COLUMNS_ROW = " | ".join(["{}"] * 7)


def columns(step: str) -> Callable[[Record], list[float]]:
    """A row of both columns' table."""
    line = [f"line 13 {k}" for k in (1, 2, 4, 5)]
    return of(step, *line[:2], *(f"2: {label} 2" for label in TOLD), *line[2:])


AXIAL, CELLS = "[0,0] axial", " | ".join(["{}"] * 6)
VARIABLES = (("A_belt", 1e7), "A_belt %", ("A_carcass", 1e8), "A_carcass %")
# page, its words with {} for each figure, what the record has for them
CLAIMS: list[tuple[str, str, Callable[[Record], list[float]]]] = [
    ("paper", "SLSQP, exact sensitivities, {} evaluations", of("fit", "evaluations")),
    (
        "paper",
        "Gauss-Newton method, exact sensitivities, {} evaluations",
        of("fit gauss-newton", "evaluations"),
    ),
    (
        "paper",
        "with C10 held {}e-7 ± {} % and {}e-8 m² ± {} %, {} Hz",
        of("fit C10 held", *VARIABLES, "objective_Hz"),
    ),
    (
        "paper",
        "C10 falls to {} MPa ± {} %, A_belt {}e-7, A_carcass {}e-8 m², {} Hz",
        of("fit", ("C10", 1e-6), "C10 %", VARIABLES[0], VARIABLES[2], "objective_Hz"),
    ),
    (
        "paper",
        "{} % ([3,1]) with C10 held; {} % ([0,0] lateral) with all three",
        lambda r: [abs(r["fit C10 held"]["off [3,1]"]), abs(r["fit"][f"off {AXIAL}"])],
    ),
    (
        "paper",
        "| {}, with exact slopes; {} with C10 held; {} to within 0.05 Hz |",
        lambda r: [
            r["fit"]["evaluations"],
            r["fit C10 held"]["evaluations"],
            r["fit"]["evaluations_to_0.05_Hz"],
        ],
    ),
    (
        "paper",
        "it moves [0,0] lateral by {} % and [1,0] by {} %, A_belt alone by {} and {} %; of [3,0]"
        " and [4,0] A_belt has more ({} and {} % for {} and {} %)",
        lambda r: [
            change(r, step, label)
            for labels in ((AXIAL, "[1,0]"), ("[3,0]", "[4,0]"))
            for step in (("A_carcass", "A_belt") if AXIAL in labels else ("A_belt", "A_carcass"))
            for label in labels
        ],
    ),
    (
        "paper",
        "standard errors of {} (A_belt), {} (A_carcass) and {} % (C10)",
        of("fit", "A_belt %", "A_carcass %", "C10 %"),
    ),
    (
        "paper",
        "the belt's added mass ({} to {} kg)",
        lambda r: [r["initial"]["mass_kg"], r["optimum"]["mass_kg"]],
    ),
    (
        "paper",
        "the vertical stiffness falls by {} to {} %",
        lambda r: [-max(rises(r, "N/mm")), -min(rises(r, "N/mm"))],
    ),
    ("paper", f"| initial, cm² | {CELLS} |", pressed("pressed", "cm2")),
    ("paper", f"| the paper's optimum, cm² | {CELLS} |", pressed("pressed optimum", "cm2")),
    ("paper", f"| larger by | {CELLS.replace('{}', '{} %')} |", lambda r: rises(r, "cm2")),
    ("paper", f"| initial, N/mm | {CELLS} |", pressed("pressed", "N/mm")),
    ("paper", f"| the paper's optimum, N/mm | {CELLS} |", pressed("pressed optimum", "N/mm")),
    (
        "paper",
        f"| nothing: the case | {COLUMNS_ROW} | {{}} → {{}} |",
        lambda r: [
            distance(r, "initial", PAPER_HZ[0]),
            distance(r, "optimum", PAPER_HZ[1]),
            *(change(r, "optimum", label) for label in TOLD),
            *(distance(r, step, MEASURED_HZ) for step in ("initial", "optimum")),
        ],
    ),
    ("paper", f"rim width, turn-up | {COLUMNS_ROW} | {{}} → {{}} |", columns("section")),
    ("paper", f"all densities | {COLUMNS_ROW} | {{}} → {{}} |", columns("inferred")),
    (
        "paper",
        "each frequency within {} %",
        lambda r: [max(abs(r["inferred"][f"2: {x} {k}"]) for x in LABELS for k in (0, 1))],
    ),
    (
        "paper",
        "sidewalls {} % thinner, belt cords of steel's density ({} g/cm³ for the example's 5.9) and"
        " modulus ({} GPa, the bound), softer carcass cords ({} GPa for 9.87), denser rubber ({},",
        of(
            "inferred",
            *(("line 25 0", -100.0), ("line 33 0", 1e-3), ("line 31 0", 1e-9)),
            *(("line 32 0", 1e-9), ("line 35 0", 1e-3)),
        ),
    ),
    (
        "paper",
        "The narrow rim's section ends at {} and {} Hz",
        of("narrow rim", "line 13 1", "line 13 2"),
    ),
    ("real_data", "All six together are {} % probable", of("labels", "labeling 0")),
    ("real_data", "next, with {} %, is [9,0]", of("labels", "labeling 1")),
    (
        "real_data",
        "114 Hz is [2,0] with {} %, [3,0] with {} %, [1,0] with {} %",
        of("labels without a fit", "114 [2,0]", "114 [3,0]", "114 [1,0]"),
    ),
    (
        "real_data",
        'calibration leaves {} % (rms, weighed by all that is uncertain), p = {}; "nothing" has'
        ' {} %, "outside the catalogue" {} %, the likeliest effect {} %',
        of("diagnosed", "rms %", "p", "none %", "outside %", "effect %"),
    ),
    (
        "real_data",
        "*outside the catalogue*: {} % left, p = {}e-12",
        of("diagnosed, section exact", "rms %", ("p", 1e12)),
    ),
    (
        "real_data",
        "the tread, stiffness {} % ± {} %",
        of("diagnosed, section exact", "part %", "part sigma %"),
    ),
    (
        "real_data",
        "Of the labels [3,0] to [8,0] it is {} % sure, and it fails to fit them: {} sigmas are left"
        " (χ² per degree of freedom {}), A_belt {}e-7 m² ± {} %, A_carcass {}e-7 m² ± {} %,"
        " C10 {} MPa ± {} %",
        of(
            "both",
            *("labels %", "objective_Hz", "chi2", ("A_belt", 1e7), "A_belt %"),
            *(("A_carcass", 1e7), "A_carcass %", ("C10", 1e-6), "C10 %"),
        ),
    ),
    (
        "real_data",
        "| " + " | ".join(["{} %"] * 10) + " | Rubber that",
        of(
            "both",
            *(f"off {x}" for x in (AXIAL, "[0,0] torsional", "[1,1]", "[1,0]")),
            *(f"off [{c},0]" for c in range(3, 9)),
        ),
    ),
    (
        "real_data",
        "carcass cords ({} and {} kg, for",
        of("one effect", "1: tread_modulus 10 2", "1: tread_modulus 20 2"),
    ),
]
EFFECTS = {  # of real_data.md's table, and the study's rows
    "nothing": "nothing",
    "dynamic stiffening 1": "dynamic_stiffening 1",
    "frequency stiffening 0.1": "frequency_stiffening 0.1",
    "frequency stiffening 0.2": "frequency_stiffening 0.2",
    "cap ply 2 MN/m": "cap_ply 2e+06",
    "tread density -25 %": "tread_density -0.25",
    "tread worn by a quarter": "tread_wear 0.25",
    "belt angle +3°": "belt_angle 3",
    "belts 10 mm wider": "belt_width 0.01",
    "sidewalls 15 % thicker": "sidewall_gauge 0.15",
    "bead filler 1": "bead_filler 1",
    "air in the cavity": "cavity_air 1",
    "tread of G = 5 MPa": "tread_modulus 5",
    "tread of G = 10 MPa": "tread_modulus 10",
    "tread of G = 20 MPa": "tread_modulus 20",
}
CLAIMS += [
    (
        "real_data",
        f"| {name} | {{}} | {{}} | {CELLS} | {{}} % |",
        of("one effect", *(f"1: {row} {k}" for k in (0, 1, *range(3, 10)))),
    )
    for name, row in EFFECTS.items()
]
# the public set of a 205/60R15 at 220 kPa, by load in N: N/mm, then length and width in mm
PUBLIC_SET = {2000: (197.3, 87.4, 120.7), 4000: (209.7, 131.8, 141.1), 6000: (221.3, 169.1, 151.0)}


def against_set(what: str, public: float) -> Callable[[Record], list[float]]:
    """A figure of the tyre from its size code, then of the fitted one, each with its deviation
    from the public set, %."""

    def figures(record: Record) -> list[float]:
        values = [record[step][what] for step in ("size code", "predicted")]
        return [x for value in values for x in (value, 100 * value / public - 100)]

    return figures


for load_N, row in PUBLIC_SET.items():
    for (name, what), value in zip(
        (("stiffness", "N/mm"), ("length", "length"), ("width", "width")), row, strict=True
    ):
        words = f"| {name} at {load_N} N | {value} | {{}} | {{}} % | {{}} | {{}} % |"
        CLAIMS.append(("real_data", words, against_set(f"{what} at {load_N}", value)))
CLAIMS += [
    (
        "real_data",
        "C10_sidewall {} MPa ± {} % and A_carcass {}e-7 m² ± {} %, after {} designs",
        of(
            "stiffnesses",
            *(("C10_sidewall", 1e-6), "C10_sidewall %", ("A_carcass", 1e7), "A_carcass %"),
            "evaluations",
        ),
    )
]


def plain(page: str) -> str:
    """A page's words in one line, without bold type."""
    text = (ROOT / "cases" / f"{page}.md").read_text(encoding="utf-8")
    return re.sub(r"\s+", " ", text.replace("\N{MINUS SIGN}", "-").replace("**", ""))


def differences(record: Record) -> Iterator[str]:
    """Claims that are not on their page, and printed figures that are not the recorded ones;
    nothing of a command that is not on record."""
    for page, words, figures in CLAIMS:
        pattern = NUMBER.join(re.escape(part) for part in words.split("{}"))
        match = re.search(pattern, plain(page))
        if not match:
            yield f"{page}: not there: {words}"
            continue
        try:
            values = figures(record)
        except KeyError as error:
            if error.args[0] not in STEPS:
                raise
            continue  # a command that was not run, which `main` tells
        for printed, value in zip(match.groups(), values, strict=True):
            digits = len(printed.partition(".")[2])
            if abs(float(printed) - value) > 0.5 * 10.0**-digits * (1 + 1e-3):
                yield f"{page}: {words}: printed {printed}, recorded {value:.6g}"


def recorded() -> dict[str, Figures]:
    """Recorded figures of the commands, by step."""
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    return {step: each["figures"] for step, each in record.items()}


def with_exact_section(folder: Path) -> Path:
    """A copy of the real tyre's case that says so of its section."""
    shutil.copytree(ROOT / "cases", folder, ignore=_all_but_tables, dirs_exist_ok=True)
    case = folder / "205_60r15.yaml"
    text = (ROOT / REAL).read_text(encoding="utf-8")
    assert "known_from: size_code" in text
    case.write_text(text.replace("known_from: size_code", "known_from: exact"), encoding="utf-8")
    return case


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


def _all_but_tables(folder: str, names: list[str]) -> list[str]:
    return [name for name in names if not name.endswith(".csv")]


def run(name: str, folder: Path) -> Figures:
    """A step's figures. Raises CalledProcessError."""
    step = STEPS[name]
    places = {each: str(folder / each.replace(" ", "_")) for each in STEPS}
    places["size"] = str(from_size_code(folder / "size"))
    places["exact"] = str(with_exact_section(folder / "exact"))
    words = shlex.split(step.command.format(**places))
    words = (
        [sys.executable, "-m", *words] if words[0] == "tyrecal" else [sys.executable, *words[1:]]
    )
    words += ["--output", places[name], "--quiet"] if step.file else []
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 4):  # 4: a fit that leaves more than it explains
        raise subprocess.CalledProcessError(done.returncode, words, done.stdout, done.stderr)
    if not step.file:
        return step.read(done.stdout)
    return step.read(json.loads((Path(places[name]) / step.file).read_text(encoding="utf-8")))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("steps", nargs="*", metavar="STEP")
    parser.add_argument(
        "--check", action="store_true", help="compare pages and record, run nothing"
    )
    options = parser.parse_args()
    if not options.check and not options.folder:
        parser.error("FOLDER, or --check")
    for name in [] if options.check else options.steps or STEPS:
        figures = run(name, options.folder.resolve())
        record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
        record[name] = {
            "command": STEPS[name].command,
            "date": date.today().isoformat(),
            "figures": {key: float(f"{value:.6g}") for key, value in figures.items()},
        }
        order = {each: record[each] for each in STEPS if each in record}
        RECORD.write_text(json.dumps(order, indent=1) + "\n", encoding="utf-8")
        print(f"{name}: {len(figures)} figures", flush=True)
    wrong = list(differences(recorded()))
    print("\n".join(wrong) or f"all {len(CLAIMS)} statements agree")
    if missing := [name for name in STEPS if name not in recorded()]:
        print(f"not on record: {', '.join(missing)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
