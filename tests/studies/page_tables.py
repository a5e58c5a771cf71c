"""Tables and blocks of output that a document marks as `checked`: the figures of their rows.

A mark is a comment above the table, `<!-- checked: fit -->`. A row's figures are all the numbers
behind its first cell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .both_columns import PAPER_HZ
from .page_sentences import (
    AXIAL,
    CHANGED,
    LABELS,
    MEASURED_HZ,
    change,
    distance,
    of,
    pressed,
    rises,
)
from .page_steps import LOADS_N, Record

Row = Callable[[Record], list[float] | None]  # None: figures of others
Rows = Callable[[Record], Sequence[list[float] | None]]
NAMES = ("A_belt", "A_carcass", "C10")
FAMILIES = {  # of the tables of pressure
    "out-of-plane": (AXIAL, "[1,1]", "[2,1]", "[3,1]", "[4,1]"),
    "in-plane": ("[0,0] torsional", "[1,0]", "[2,0]", "[3,0]", "[4,0]"),
}


def rows(*each: Row) -> Rows:
    """A table of rows."""
    return lambda record: [row(record) for row in each]


def fitted_modes(step: str, sigma_Hz: dict[str, float | None]) -> Rows:
    """Initial, fitted and target frequency of each mode, sigma if there is one, deviation in %."""

    def row(label: str) -> Row:
        values = of(step, *(f"{key} {label}" for key in ("initial", "fitted", "target")))
        sigma = sigma_Hz[label]
        return lambda r: [*values(r), *([] if sigma is None else [sigma]), r[step][f"off {label}"]]

    return rows(*map(row, sigma_Hz))


def both_columns(record: Record) -> list[list[float]]:
    """The paper's Table 2: both columns of the paper and of tyrecal."""
    printed: list[list[float]] = []
    for label, (first, second) in zip(LABELS, zip(*PAPER_HZ, strict=True), strict=True):
        ours = record["initial"][label], record["optimum"][label]
        printed.append(
            [
                *(first, ours[0], 100 * ours[0] / first - 100),
                *(second, ours[1], 100 * ours[1] / second - 100),
                *(100 * second / first - 100, 100 * ours[1] / ours[0] - 100),
            ]
        )
    sums = [
        [distance({"hz": column(c)}, "hz", MEASURED_HZ) for c in (0, 1)]
        for column in (
            lambda c: dict(zip(LABELS, PAPER_HZ[c], strict=True)),
            lambda c: dict(record[("initial", "optimum")[c]]),
        )
    ]
    return [*printed, [sums[0][0], sums[1][0], sums[0][1], sums[1][1]]]


def columns(step: str) -> Callable[[Record], list[float]]:
    """A row of the table of sections for both columns."""
    line = [f"line 13 {k}" for k in (1, 2, 4, 5)]
    return of(step, *line[:2], *(f"2: {label} 2" for label in CHANGED), *line[2:])


def as_the_case(record: Record) -> list[float]:
    """The first row of that table."""
    return [
        distance(record, "initial", PAPER_HZ[0]),
        distance(record, "optimum", PAPER_HZ[1]),
        *(change(record, "optimum", label) for label in CHANGED),
        *(distance(record, step, MEASURED_HZ) for step in ("initial", "optimum")),
    ]


def paper_itself(record: Record) -> list[float]:
    """Row of the table of sections for the paper's own columns."""
    del record
    first, second = (dict(zip(LABELS, column, strict=True)) for column in PAPER_HZ)
    return [
        *(100 * second[label] / first[label] - 100 for label in CHANGED),
        *(distance({"": each}, "", MEASURED_HZ) for each in (first, second)),
    ]


def labelled(record: Record) -> list[list[float]]:
    """Expected frequency, deviation, probability, rivals' probabilities, of the real tyre's six."""
    wanted = {
        114: ("[3,0]", "[3,1]", "[4,0]"),
        137: ("[4,0]", "[4,1]", "[5,0]"),
        165: ("[5,0]", "[5,1]", "[6,0]"),
        196: ("[6,0]", "[7,0]", "[6,1]"),
        228: ("[7,0]", "[8,0]", "[7,1]"),
        260: ("[8,0]", "[9,0]", "[8,1]"),
    }
    figures = record["labels"]
    return [
        [
            figures[f"{hertz} Hz"],
            100 * figures[f"{hertz} Hz"] / hertz - 100,
            *(figures[f"{hertz} {label}"] for label in labels),
        ]
        for hertz, labels in wanted.items()
    ]


EFFECTS = (  # rows of `real_data` in the order of the page
    "nothing",
    "frequency_stiffening 0.2",
    "tread_modulus 20",
)
PUBLIC_SET = (  # rows of `real_prior` in the order of the page
    *(
        f"{name} 220 kPa {load_N} N"
        for name in ("vertical_stiffness_N_per_m", "contact_length_m", "contact_width_m")
        for load_N in (2000, 4000, 6000)
    ),
    *(
        f"{label} 220 kPa 0 N{which}"
        for label in ("[0,0] axial", "[0,0] torsional", "[1,1]")
        for which in ("", ", set B")
    ),
    *(f"[{c},0] 160 kPa 0 N" for c in range(3, 9)),
)
PUBLIC_DAMPING = ("[1,0]", "[0,0] axial", "[1,1]", "[0,0] torsional")
PUBLIC_RIM = (
    *(
        f"{way}_N_per_m {state} kPa"
        for way in ("lateral", "longitudinal")
        for state in ("2000 N 220", "4000 N 220", "6000 N 220", "4000 N 198", "4000 N 242")
    ),
    *(f"torsional_Nm_per_rad {load_N} N 220 kPa" for load_N in (2000, 4000, 6000)),
)
MF_SWIFT = {  # deflection in mm and area in cm2, by load in N
    1000: (5.33, 59.0),
    2000: (10.48, 105.5),
    3000: (15.47, 147.4),
    4000: (20.31, 186.0),
    5000: (25.02, 221.9),
    6000: (29.59, 255.4),
}


def predicted(load_N: int) -> Callable[[Record], list[float]]:
    """Deflection and area of the fitted real tyre next to the MF-Swift set's, and deviations."""

    def figures(record: Record) -> list[float]:
        ours = [record["real, pressed"][f"{what} at {load_N}"] for what in ("deflection", "cm2")]
        pairs = zip(ours, MF_SWIFT[load_N], strict=True)
        return [x for value, public in pairs for x in (value, public, 100 * value / public - 100)]

    return figures


def on_road(*keys: str | tuple[str, float]) -> list[Callable[[Record], list[float]]]:
    """Rows of the table of what the road's stiffness determines, a column for each set."""
    steps = ("four modes", "and stiffness", "and area")
    pairs = [(key, 1.0) if isinstance(key, str) else key for key in keys]
    return [lambda r: [r[step][key] * factor for step in steps for key, factor in pairs]]


def rises_of(family: str) -> Rows:
    """Rise in Hz of a family of modes over the pressure, by case and design."""
    return rows(
        *(
            of(step, *(f"{design} {label} rise" for label in FAMILIES[family]))
            for step in ("sweep", "narrow rim, sweep")
            for design in ("initial", "fitted")
        )
    )


def swept(label: str) -> Callable[[Record], list[float]]:
    """First and last frequency of a mode over the pressure, and the rise in %, of both designs."""

    def figures(record: Record) -> list[float]:
        row: list[float] = []
        for design in ("initial", "fitted"):
            first, last = (record["sweep"][f"{design} {label} {end}"] for end in ("from", "to"))
            row += [first, last, 100 * last / first - 100]
        return row

    return figures


def imported(label: str) -> Callable[[Record], list[float]]:
    """Truth, measured frequency, sigma, and probability of the label, at 240 kPa."""
    name = label.replace("axial", "lateral")

    def figures(record: Record) -> list[float]:
        at = record["at 240"]
        return [
            record["true tyre"][label],
            at[f"{label} 240"],
            at[f"{label} 240 sigma"],
            record["shapes at 240"][f"{name} sure"],
        ]

    return figures


def refitted(name: str, true: float, factor: float) -> Callable[[Record], list[float]]:
    """A variable of the synthetic tyre: truth, fitted, its scatter in %, that of one state."""
    return lambda record: [
        true,
        record["three states"][name] * factor,
        record["three states"][f"{name} %"],
        record["one of three states"][f"{name} %"],
    ]


def drawn(name: str) -> Callable[[Record], list[float]]:
    """A row of the table that `sample` prints."""
    factor = 1e-6 if name == "C10" else 1e6  # MPa and mm²
    values = [(f"{name} {key}", factor) for key in ("median", "low", "high", "best")]
    return of("sample", *values[:3], f"{name} %", f"{name} linear %", values[3])


def points(*steps: str) -> Callable[[Record], list[float]]:
    """Objective, and design points of both methods: all, and to within 0.05 of the end."""
    keys = ("evaluations", "evaluations_to_0.05_Hz")
    return lambda r: [
        r[steps[0]]["objective_Hz"],
        *(r[step][key] for step in steps for key in keys),
    ]


def with_worst(*steps: str) -> Callable[[Record], list[float]]:
    """The same and the largest deviation of a mode in %."""

    def figures(record: Record) -> list[float]:
        off = [abs(v) for key, v in record[steps[0]].items() if key.startswith("off [")]
        return [*points(*steps)(record), max(off)]

    return figures


def by_load(what: str) -> Callable[[Record], list[float]]:
    """A row of the table of eight loads."""
    return of("eight loads", *(f"{what} at {x}" for x in (500, 1000, 2000, 3000, 4000, 6000, 8000)))


EFFECT_SIZES: dict[str, tuple[float, ...]] = {  # of EFFECTS.md: the numbers of each size
    "dynamic_stiffening": (1,),
    "frequency_stiffening": (0.2,),
    "tread_density": (-0.25,),
    "tread_wear": (0.5,),
    "bead_filler": (3,),
    "cap_ply": (2,),
    "belt_angle": (3,),
    "belt_width": (10,),
    "carcass_fanning": (1,),
    "carcass_turn_up": (1,),
    "sidewall_gauge": (15,),
    "rim_width": (12.7,),
    "bead_seat": (0.5,),
    "pressure_offset": (10,),
    "temperature": (15,),
    "temperature_drift": (5, 100),
    "cavity_air": (1.5,),
    "spindle_lateral": (0.4,),
    "spindle_radial": (0.1,),
    "spindle_torsional": (2,),
    "spindle_tilt": (4,),
    "wheel_free": (0.1, 1),
    "stiffness_splice": (1,),
    "point_mass": (0.1,),
    "road_contact": (0.6,),
    "rotation": (80,),
}


def effects_table(record: Record) -> list[list[float]]:
    """Size, rms change before and after the new fit, and the absorbed share, of each effect."""
    figures = record["effects"]
    return [
        [*size, *(figures[f"2: `{id}` {k}"] for k in (1, 2, 3))]
        for id, size in EFFECT_SIZES.items()
    ]


CLUSTER = {  # figures of the printed lines of `tests/benchmarks/cluster.py`
    **{"idle to": "line 0 0", "idle from": "line 0 1", "worker MB": "line 2 0"},
    **{"evaluations": "line 3 0", "evaluation kB": "line 3 1", "files": "line 3 2"},
    **{"files kB": "line 3 3", "batch kB": "line 3 4", "tasks": "line 4 0", "task ms": "line 4 3"},
    **{"start MB": "line 4 4", "most MB": "line 4 5"},
    **{"task to": "line 4 6", "task from": "line 4 7"},
}


def cluster_table(record: Record) -> list[list[float]]:
    """Bytes, times and memory of a batch on a cluster: measured, and for 10,000 cases."""
    figures = record["cluster"]
    get = {name: figures[place] for name, place in CLUSTER.items()}
    kept = get["evaluations"] * get["evaluation kB"] / 1e3
    start, growth = get["start MB"], 1e3 * (get["most MB"] - get["start MB"]) / get["tasks"]
    return [
        [get["task to"], get["task from"], 10 * (get["task to"] + get["task from"])],
        [get["idle to"], get["idle from"], (get["idle to"] + get["idle from"]) / 10, 100],
        [get["task ms"], 10 * get["task ms"]],
        [start, growth, start + 10 * growth],
        [get["worker MB"]],
        [get["evaluations"], kept, 10 * kept],
        [get["files"], get["files kB"], 10 * get["files kB"]],
        [get["batch kB"], 10 * get["batch kB"]],
    ]


SLIPS = (
    *("digit", "decimal place", "exchanged digits", "exchanged rows", "exchanged pressures"),
    *("with a slip", "clean: something named"),
)
# of `tyrecal fit cases/p235_75r17.yaml --solver calculix --method gauss-newton`
CALCULIX_FIT = {
    "initial_objective_Hz": 31.394,
    "objective_Hz": 3.123,
    f"fitted {AXIAL}": 33.173,
    "fitted [0,0] torsional": 33.395,
    "A_belt": 2.654e-7,
    "A_carcass": 6.253e-8,
    "C10": 5.313e5,
}


def calculix_fit(record: Record) -> list[list[float] | None]:
    """The fit by the bundled solver, by CalculiX, and the difference in %."""
    figures = record["fit gauss-newton"]
    rows: list[list[float] | None] = []
    for name, other in CALCULIX_FIT.items():
        own = figures[name]
        is_objective = "objective" in name
        rows.append([own, other, *([] if is_objective else [100 * other / own - 100])])
        if name.endswith("torsional"):
            rows.append(None)  # range over seven other modes
    return rows


SIZES = (
    *("145/80R13 75T", "205/55R16 91V", "P235/75R17 108S", "255/55R18 105V"),
    *("LT265/70R17/C 112/109S", "11R22.5 144/142L", "315/80R22.5 156/150L"),
)
LOADED = (
    AXIAL,
    "[0,0] torsional",
    *(f"[1,{m}] {s}" for m in (1, 0) for s in ("symmetric", "antisymmetric")),
)
TABLES: dict[str, Rows] = {
    "fit": fitted_modes("fit", dict.fromkeys(LABELS)),
    "real": fitted_modes("real", {AXIAL: 0.5, "[0,0] torsional": 4.4, "[1,1]": 0.5, "[1,0]": 0.8}),
    "table 2": both_columns,
    "pressed": rows(
        pressed("pressed", "cm2"),
        pressed("pressed optimum", "cm2"),
        lambda r: rises(r, "cm2"),
        pressed("pressed", "N/mm"),
        pressed("pressed optimum", "N/mm"),
    ),
    "both columns": rows(paper_itself, as_the_case, columns("section"), columns("inferred")),
    "labels": labelled,
    "one effect": rows(
        *(of("one effect", *(f"1: {row} {k}" for k in (0, 1, *range(3, 10)))) for row in EFFECTS)
    ),
    "both": rows(
        of(
            "both",
            *(f"off {x}" for x in (AXIAL, "[0,0] torsional", "[1,1]", "[1,0]")),
            *(f"off [{c},0]" for c in range(3, 9)),
        )
    ),
    "public set": rows(
        *(of("public", *(f"3: {row} {k}" for k in (0, 1, 4, 5, 6))) for row in PUBLIC_SET)
    ),
    "public damping": rows(
        *(of("public", *(f"1: {row} {k}" for k in range(5))) for row in PUBLIC_DAMPING)
    ),
    "public rim": rows(*(of("public", *(f"2: {row} {k}" for k in range(5))) for row in PUBLIC_RIM)),
    "as built": rows(
        lambda record: None,
        *(
            of(step, AXIAL, "[0,0] torsional", "[1,1]", "[1,0]")
            for step in ("as built", "as built, surface")
        ),
    ),
    "more modes": rows(
        *(of("more modes", *(f"1: {name} {k}" for k in range(3))) for name in (*NAMES, "least"))
    ),
    "real, pressed": rows(*map(predicted, LOADS_N)),
    "stiffness and area": rows(
        *on_road("A_belt", "A_belt %"),
        *on_road("A_carcass", "A_carcass %"),
        *on_road(("C10", 1e-6), "C10 %"),
        *on_road("A_belt and C10 correlated"),
        *on_road("objective_Hz"),
        *on_road("mass_kg"),
        lambda record: None,  # processor time
    ),
    "rises, out-of-plane": rises_of("out-of-plane"),
    "rises, in-plane": rises_of("in-plane"),
    "pressure": rows(*map(swept, (AXIAL, "[0,0] torsional", "[1,0]", "[1,1]", "[4,0]"))),
    "imported": rows(*map(imported, LABELS)),
    "three states": rows(
        refitted("A_belt", 2.6e-7, 1.0),
        refitted("A_carcass", 3.6e-7, 1.0),
        refitted("C10", 1.08, 1e-6),
    ),
    "sample": rows(*map(drawn, NAMES)),
    "design points": rows(
        with_worst("fit", "fit gauss-newton"),
        with_worst("narrow rim, fit", "narrow rim, gauss-newton"),
        with_worst("real, free", "real, gauss-newton"),
    ),
    "eight loads": rows(*map(by_load, ("deflection", "N/mm", "cm2", "length", "width"))),
    "loaded": rows(
        *(
            lambda r, name=name: [
                *(r["loaded"][f"{name} at {load_N}"] for load_N in (0, 1000, 4000)),
                r["loaded"][f"{name} sliding at 1000"],
            ]
            for name in LOADED
        )
    ),
    "effects": effects_table,
    "cluster": cluster_table,
    "calculix fit": calculix_fit,
    "slips": rows(
        *(of("slips", *(f"1: {name} {k}" for k in range(3))) for name in SLIPS),
        of("slips", "1: 'fits' with chi2/dof above 5 0"),
    ),
    "sizes": rows(
        *(of("sizes", *(f"1: {size} {k}" for k in (0, 2, 3, 4, 5, 7))) for size in SIZES)
    ),
}
