"""Sentences of the documents with figures in them, each with what the record has for it;
and figures of the record as the documents print them: in other units, as changes, in rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .page_steps import LOADS_N, Record


def change(record: Record, step: str, label: str) -> float:
    """Per cent, from the initial design."""
    return 100 * record[step][label] / record["initial"][label] - 100


def of(step: str, *keys: str | tuple[str, float]) -> Callable[[Record], list[float]]:
    """Recorded figures, each times its factor."""
    pairs = [(key, 1.0) if isinstance(key, str) else key for key in keys]
    return lambda record: [record[step][key] * factor for key, factor in pairs]


def pressed(step: str, what: str) -> Callable[[Record], list[float]]:
    """Figures at every load."""
    return of(step, *(f"{what} at {load}" for load in LOADS_N))


def rises(record: Record, what: str) -> list[float]:
    """Changes from the initial design to the paper's optimum, %, at every load."""
    after, before = (pressed(step, what)(record) for step in ("pressed optimum", "pressed"))
    return [100 * a / b - 100 for a, b in zip(after, before, strict=True)]


def too_low(record: Record) -> list[float]:
    """Least and largest shortfall, %, of the six predicted frequencies of the real tyre."""
    figures = record["labels"]
    off = [100 - 100 * figures[f"{hertz} Hz"] / hertz for hertz in (114, 137, 165, 196, 228, 260)]
    return [min(off), max(off)]


def distance(record: Record, step: str, hertz: Sequence[float]) -> float:
    """Equation (1) to the paper's frequencies, Hz."""
    twice = [1 + (not label.startswith("[0,0]")) for label in LABELS]
    off = (record[step][label] - f for label, f in zip(LABELS, hertz, strict=True))
    return math.sqrt(sum(w * d**2 for w, d in zip(twice, off, strict=True)))


AXIAL = "[0,0] axial"
LABELS = (AXIAL, "[0,0] torsional")
LABELS += ("[1,1]", "[1,0]", "[2,1]", "[2,0]", "[3,0]", "[3,1]", "[4,0]")
MEASURED_HZ = (31.7, 35.0, 37.8, 58.5, 66.1, 79.5, 97.6, 102.7, 115.9)
CHANGED = (AXIAL, "[1,1]", "[2,1]", "[3,1]", "[1,0]")  # changes of both columns' table

VARIABLES = (("A_belt", 1e7), "A_belt %", ("A_carcass", 1e8), "A_carcass %")


PAPER, REAL_DATA, OWN_TYRE = "cases/paper.md", "cases/real_data.md", "cases/own_tyre.md"
SAMPLING, GUIDE = "cases/sampling.md", "cases/README.md"
# page, its words with {} for each figure, what the record has for them
SENTENCES: list[tuple[str, str, Callable[[Record], list[float]]]] = [
    (PAPER, "SLSQP, exact sensitivities, {} evaluations", of("fit", "evaluations")),
    (
        PAPER,
        "Gauss-Newton method, exact sensitivities, {} evaluations",
        of("fit gauss-newton", "evaluations"),
    ),
    (
        PAPER,
        "with C10 held {}e-7 ± {} % and {}e-8 m² ± {} %, {} Hz",
        of("fit C10 held", *VARIABLES, "objective_Hz"),
    ),
    (
        PAPER,
        "C10 falls to {} MPa ± {} %, A_belt {}e-7, A_carcass {}e-8 m², {} Hz",
        of("fit", ("C10", 1e-6), "C10 %", VARIABLES[0], VARIABLES[2], "objective_Hz"),
    ),
    (
        PAPER,
        "{} % ([3,1]) with C10 held; {} % ([0,0] lateral) with all three",
        lambda r: [abs(r["fit C10 held"]["off [3,1]"]), abs(r["fit"][f"off {AXIAL}"])],
    ),
    (
        PAPER,
        "| {}, with exact sensitivities; {} with C10 held; {} to within 0.05 Hz |",
        lambda r: [
            r["fit"]["evaluations"],
            r["fit C10 held"]["evaluations"],
            r["fit"]["evaluations_to_0.05_Hz"],
        ],
    ),
    (
        PAPER,
        "it moves [0,0] lateral by {} % and [1,0] by {} %, A_belt alone by {} and {} %. On [3,0]"
        " and [4,0] A_belt has more effect ({} and {} % for {} and {} %)",
        lambda r: [
            change(r, step, label)
            for labels in ((AXIAL, "[1,0]"), ("[3,0]", "[4,0]"))
            for step in (("A_carcass", "A_belt") if AXIAL in labels else ("A_belt", "A_carcass"))
            for label in labels
        ],
    ),
    (
        PAPER,
        "standard errors of {} (A_belt), {} (A_carcass) and {} % (C10)",
        of("fit", "A_belt %", "A_carcass %", "C10 %"),
    ),
    (
        PAPER,
        "the belt's added mass ({} to {} kg)",
        lambda r: [r["initial"]["mass_kg"], r["optimum"]["mass_kg"]],
    ),
    (
        PAPER,
        "the vertical stiffness falls by {} to {} %",
        lambda r: [-max(rises(r, "N/mm")), -min(rises(r, "N/mm"))],
    ),
    (
        PAPER,
        "each frequency within {} %",
        lambda r: [max(abs(r["inferred"][f"2: {x} {k}"]) for x in LABELS for k in (0, 1))],
    ),
    (
        PAPER,
        "sidewalls {} % thinner. Its belt cords have steel's density ({} g/cm³ for the example's"
        " 5.9) and modulus ({} GPa, the bound). Its carcass cords are softer ({} GPa for 9.87), and"
        " its rubber is denser ({},",
        of(
            "inferred",
            *(("line 25 0", -100.0), ("line 33 0", 1e-3), ("line 31 0", 1e-9)),
            *(("line 32 0", 1e-9), ("line 35 0", 1e-3)),
        ),
    ),
    (
        PAPER,
        "The narrow rim's section ends at {} and {} Hz",
        of("narrow rim", "line 13 1", "line 13 2"),
    ),
    (REAL_DATA, "Modes of a free 205/60R15 are predicted {} to {} % too low", too_low),
    (REAL_DATA, "All six together are {} % probable", of("labels", "labeling 0")),
    (REAL_DATA, "next, with {} %, is [9,0]", of("labels", "labeling 1")),
    (
        REAL_DATA,
        'calibration leaves {} % (rms), p = {}. "Nothing" has {} %, "not explained" {} %, the'
        " likeliest effect {} %",
        of("diagnosed", "rms %", "p", "none %", "outside %", "effect %"),
    ),
    (
        REAL_DATA,
        "The labels [3,0] to [8,0] have a probability of {} %, and {} standard deviations of the"
        " scatter are left. As the section is hardly known, the verdict is `fits`, χ² per degree of"
        " freedom {}. By the scatter, A_belt is {}e-7 m² ± {} %, A_carcass {}e-7 m² ± {} %, C10 {}"
        " MPa ± {} %",
        of(
            "both",
            *("labels %", "objective_Hz", "chi2", ("A_belt", 1e7), "A_belt %"),
            *(("A_carcass", 1e7), "A_carcass %", ("C10", 1e-6), "C10 %"),
        ),
    ),
    (
        REAL_DATA,
        "carcass cords ({} and {} kg, for",
        of("one effect", "1: tread_modulus 10 2", "1: tread_modulus 20 2"),
    ),
    (
        REAL_DATA,
        "the two areas move by {} and {} %, the two compounds by {} and {} %",
        lambda r: [
            abs(100 * r["few"][name] / start - 100)
            for name, start in (
                *(("A_belt", 1.96e-7), ("A_carcass", 2.42e-7)),
                *(("C10_sidewall", 4.78e5), ("C10_tread", 7.41e5)),
            )
        ],
    ),
    (
        OWN_TYRE,
        "F falls from {} to {} standard deviations. The model weighs {} kg",
        of("real", "initial_objective_Hz", "objective_Hz", "mass_kg"),
    ),
    (OWN_TYRE, "A_carcass, {}e-7 m²", of("real", ("A_carcass", 1e7))),
    (OWN_TYRE, "have the correlation {}.", of("real, free", "A_belt and C10 correlated")),
    (
        SAMPLING,
        "C10 is {} MPa ± {} % by `fit` and {} MPa ± {} % by `sample`",
        lambda r: [
            *of("fit", ("C10", 1e-6), "C10 total %")(r),
            *of("sample", ("C10 median", 1e-6), "C10 %")(r),
        ],
    ),
    (
        "cases/measured_data.md",
        "The total standard errors are {}, {} and {} %",
        of("three states", *(f"{name} total %" for name in ("A_belt", "A_carcass", "C10"))),
    ),
    ("cases/diagnosis.md", "the p-value of the fit is {}.", of("paper diagnosed", "p")),
    (
        "cases/diagnosis.md",
        '"none" has {}, and no effect exceeds',
        of("paper diagnosed", ("none %", 0.01)),
    ),
    (
        GUIDE,
        "The sensitivities d ln f / d ln p are between {} and {};",
        lambda r: [
            choose(
                r[step][f"{design} {name} rate"]
                for step in ("sweep", "narrow rim, sweep")
                for design in ("initial", "fitted")
            )
            for choose, name in ((min, "least"), (max, "largest"))
        ],
    ),
]
