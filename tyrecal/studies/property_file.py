"""The tyre as an MF-Swift 6.2 property file (.tir): the keys that its structure determines.

`tyrecal export --format tir` calls this. Stiffnesses, patch and radii are fitted over the loads and
pressures of stiffness.json; frequencies and the belt's inertia are those of the unloaded tyre with
its rim held. The comment of a key states its misfit. Coefficients of slip come from a donor file,
or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..measured.mf_swift import MFSwift
from ..measured.tir import FREQUENCY_LABELS, PropertyFile
from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.results import HarmonicShape
from ..simulate.modes.label import UNIT_MASS_SOLVERS, Mode, labelled, mean_belt_motion
from ..tyre.case import LoadedCase
from ..tyre.section.size import parse_size
from ..tyre.state import TyreState
from ..units import INCH
from .stiffness import StiffnessResult, StiffnessRow

Array = np.ndarray
MIN_FIT_LOADS = 3
MAX_OTHER_NOMINAL = 0.01  # relative, of a donor's FNOMIN and NOMPRES
TIR_DIGITS = 6  # of a key
AT_END = 1e-3  # relative distance from a limit at which a key is not determined
TIR_HEAD = """[MDI_HEADER]
FILE_TYPE = 'tir'
FILE_VERSION = 3.0
FILE_FORMAT = 'ASCII'
[UNITS]
LENGTH = 'meter'
FORCE = 'newton'
ANGLE = 'radians'
MASS = 'kg'
TIME = 'second'
[MODEL]
PROPERTY_FILE_FORMAT = 'USER'
FITTYP = 62"""
DONOR_SECTIONS = (
    *("LONG_SLIP_RANGE", "SLIP_ANGLE_RANGE", "INCLINATION_ANGLE_RANGE", "SCALING_COEFFICIENTS"),
    *("LONGITUDINAL_COEFFICIENTS", "OVERTURNING_COEFFICIENTS", "LATERAL_COEFFICIENTS"),
    *("ROLLING_COEFFICIENTS", "ALIGNING_COEFFICIENTS", "TURNSLIP_COEFFICIENTS"),
)


@dataclass(frozen=True)
class RowsOfDesign:
    """Rows of stiffness.json of one design, and FNOMIN, N, and NOMPRES, kPa."""

    rows: Sequence[StiffnessRow]
    nominal_N: float
    nominal_kPa: float

    def column(self, name: str) -> Array:
        """A field of the rows (n,)."""
        return np.array([getattr(row, name) for row in self.rows])

    @property
    def dp(self) -> Array:
        """(p - NOMPRES) / NOMPRES (n,)."""
        return self.column("pressure_kPa") / self.nominal_kPa - 1

    @property
    def nominal(self) -> StiffnessRow:
        """The row at FNOMIN and NOMPRES. Raises InputError."""
        for row in self.rows:
            if (row.load_N, row.pressure_kPa) == (self.nominal_N, self.nominal_kPa):
                return row
        raise InputError(
            f"stiffness.json has no row at {self.nominal_N:g} N and {self.nominal_kPa:g} kPa: give"
            " those of a row by --nominal-load-N and --nominal-pressure-kPa, or run 'tyrecal"
            " stiffness' there too"
        )


@dataclass(frozen=True)
class CurveFit:
    """Keys of one curve, with the values from which their fit starts."""

    section: str
    words: str  # what the curve is
    start: Mapping[str, float]
    column: str  # of the rows, which the curve follows
    curve: Callable[[MFSwift, RowsOfDesign], Array]
    pressure_key: str = ""  # determined by several pressures only
    at_nominal_load: bool = False  # fitted there, because no key states a change with the load
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def _curves(rows: RowsOfDesign) -> list[CurveFit]:
    """All curves in the order in which they need each other."""
    row = rows.nominal
    radius = row.loaded_radius_m + row.deflection_m
    # 4 Q_FZ2 is at most (VERTICAL_STIFFNESS UNLOADED_RADIUS / FNOMIN)^2, at the lower limit too
    steep = (row.vertical_sliding_N_per_m * radius / row.load_N) ** 2
    over_load = lambda formula: lambda tyre, at: formula(tyre, at.column("load_N"), at.dp)
    lateral, longitudinal = row.lateral_N_per_m, row.longitudinal_N_per_m
    return [
        CurveFit(
            "VERTICAL",
            "load over deflection",
            {"VERTICAL_STIFFNESS": row.vertical_sliding_N_per_m, "Q_FZ2": 0.0, "PFZ1": 0.5},
            "load_N",
            lambda tyre, at: np.asarray(tyre.load(at.column("deflection_m"), at.dp)),
            "PFZ1",
            limits={
                "VERTICAL_STIFFNESS": (
                    0.7 * row.vertical_sliding_N_per_m,
                    1.4 * row.vertical_sliding_N_per_m,
                ),
                "Q_FZ2": (-np.inf, 0.49 * steep / 4),
            },
        ),
        CurveFit(
            "CONTACT_PATCH",
            "length of the patch",
            {"Q_RA1": 0.6, "Q_RA2": 0.7},
            "length_m",
            over_load(MFSwift.patch_length),
        ),
        CurveFit(
            "CONTACT_PATCH",
            "width of the patch",
            {"Q_RB1": 1.0, "Q_RB2": -1.0},
            "width_m",
            over_load(MFSwift.patch_width),
        ),
        CurveFit(
            "VERTICAL",
            "rolling radius",
            {"BREFF": 8.0, "DREFF": 0.25, "FREFF": 0.1},
            "rolling_radius_m",
            over_load(MFSwift.rolling_radius),
            limits={"BREFF": (0.0, 50.0), "DREFF": (0.0, 5.0), "FREFF": (0.0, 5.0)},
        ),
        CurveFit(
            "STRUCTURAL",
            "longitudinal stiffness",
            {"LONGITUDINAL_STIFFNESS": longitudinal, "PCFX1": 0.0, "PCFX2": 0.0, "PCFX3": 0.0},
            "longitudinal_N_per_m",
            over_load(MFSwift.longitudinal),
            "PCFX3",
        ),
        CurveFit(
            "STRUCTURAL",
            "lateral stiffness",
            {"LATERAL_STIFFNESS": lateral, "PCFY1": 0.0, "PCFY2": 0.0, "PCFY3": 0.0},
            "lateral_N_per_m",
            over_load(MFSwift.lateral),
            "PCFY3",
        ),
        CurveFit(
            "STRUCTURAL",
            "torsional stiffness",
            {"YAW_STIFFNESS": row.torsional_Nm_per_rad, "PCMZ1": 0.0},
            "torsional_Nm_per_rad",
            over_load(MFSwift.yaw),
            "PCMZ1",
            at_nominal_load=True,
        ),
    ]


@dataclass
class StructuralKeys:
    """Keys by section with a comment each, and remarks for the head of the file."""

    sections: dict[str, dict[str, tuple[float, str]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add(self, section: str, comment: str, keys: Mapping[str, float]) -> None:
        """Add keys of one section, rounded as they are written."""
        entries = self.sections.setdefault(section, {})
        entries.update({k: (float(f"{x:.{TIR_DIGITS}g}"), comment) for k, x in keys.items()})

    @property
    def tyre(self) -> MFSwift:
        """The formulas at the keys, as a reader of the file has them."""
        pairs = (pair for entries in self.sections.values() for pair in entries.items())
        return MFSwift({key: value for key, (value, _) in pairs})


def structural_keys(
    case: LoadedCase,
    stiffness: StiffnessResult,
    evaluator: Evaluator,
    nominal_N: float | None = None,
    nominal_kPa: float | None = None,
) -> StructuralKeys:
    """Keys of the last design of a stiffness.json of ``case``. nominal_N, nominal_kPa: FNOMIN and
    NOMPRES, by default the middle load and the case's pressure.

    Raises InputError where the rows do not determine the keys, or a spring between belt and patch
    would be negative; what ``Evaluator.evaluate`` raises.
    """
    design = [*stiffness.designs][-1]
    own = [row for row in stiffness.rows if row.design == design]
    loads, pressures = (sorted({getattr(r, k) for r in own}) for k in ("load_N", "pressure_kPa"))
    if len(loads) < MIN_FIT_LOADS:
        raise InputError(
            f"stiffness.json has {len(loads)} loads, a curve needs {MIN_FIT_LOADS}: run 'tyrecal"
            f" stiffness {case.path} --loads-N 2000,3000,4000,5000,6000'"
        )
    rows = RowsOfDesign(
        own,
        loads[len(loads) // 2] if nominal_N is None else nominal_N,
        case.case.pressure_kPa if nominal_kPa is None else nominal_kPa,
    )
    result = StructuralKeys()
    _add_sizes(result, case, rows)
    for each in _curves(rows):
        _add_fitted(result, each, rows)
    if len(pressures) == 1:
        result.notes.append("left out: influences of the pressure: stiffness.json has only one")
    state = TyreState(rows.nominal_kPa, 0.0, "fixed")
    evaluation = evaluator.evaluate(Question(state.design(case, stiffness.designs[design])))
    result.add("INERTIA", "tyre without rim", {"MASS": evaluation.mass_kg})
    result.notes.append("left out: IXX, IYY")
    _add_modes(result, labelled(evaluation), evaluator.solver.name in UNIT_MASS_SOLVERS)
    return result


def _add_sizes(result: StructuralKeys, case: LoadedCase, rows: RowsOfDesign) -> None:
    nominal = rows.nominal
    radius = nominal.loaded_radius_m + nominal.deflection_m
    free = rows.column("loaded_radius_m") + rows.column("deflection_m")
    grows = f"at NOMPRES; {1e3 * free.min():.2f} to {1e3 * free.max():.2f} mm over the pressures"
    result.add("DIMENSION", grows, {"UNLOADED_RADIUS": radius})
    try:
        size = parse_size(case.case.size)
        aspect, rim = size.section_height / size.width, size.rim_code * INCH / 2
        sizes = {"WIDTH": size.width, "ASPECT_RATIO": aspect, "RIM_RADIUS": rim}
        result.add("DIMENSION", "of the size code", sizes)
    except InputError:
        widest = {"WIDTH": float(rows.column("width_m").max())}
        result.add("DIMENSION", "of the widest patch, as the case has no size code", widest)
    pressure = 1e3 * rows.nominal_kPa
    result.add("OPERATING_CONDITIONS", "Pa", {"INFLPRES": pressure, "NOMPRES": pressure})
    result.add("VERTICAL", "N", {"FNOMIN": rows.nominal_N})
    result.add("VERTICAL", "the wheel at rest", {"Q_RE0": 1.0})
    kPa, loads = rows.column("pressure_kPa"), rows.column("load_N")
    ends = {"PRESMIN": 1e3 * kPa.min(), "PRESMAX": 1e3 * kPa.max()}
    result.add("INFLATION_PRESSURE_RANGE", "of the fitted rows", ends)
    ends = {"FZMIN": loads.min(), "FZMAX": loads.max()}
    result.add("VERTICAL_FORCE_RANGE", "of the fitted rows", ends)


def _add_fitted(result: StructuralKeys, each: CurveFit, rows: RowsOfDesign) -> None:
    """Fit the keys of a curve by least squares of its relative deviations."""
    from scipy.optimize import least_squares  # late: longer than an export

    at = rows
    if each.at_nominal_load:
        nominal = [row for row in rows.rows if row.load_N == rows.nominal_N]
        at = RowsOfDesign(nominal, rows.nominal_N, rows.nominal_kPa)
    start = dict(each.start)
    if not np.ptp(rows.dp):
        start.pop(each.pressure_key, None)
    known, names = result.tyre.keys, [*start]

    def off(values: Array, here: RowsOfDesign = at) -> Array:
        tyre = MFSwift({**known, **dict(zip(names, values, strict=True))})
        return np.asarray(each.curve(tyre, here) / here.column(each.column) - 1)

    limits = np.array([each.limits.get(name, (-np.inf, np.inf)) for name in names]).T
    scale = [abs(x) or 1.0 for x in start.values()]
    solution = least_squares(off, [*start.values()], x_scale=scale, bounds=tuple(limits))
    result.add(each.section, "", dict(zip(names, solution.x, strict=True)))
    written = np.array([result.tyre.keys[name] for name in names])
    words = f"{each.words} within {_percent(off(written))}"
    ends = np.isclose(solution.x, limits, rtol=AT_END, atol=AT_END).any(0)
    if loose := [name for name, end in zip(names, ends, strict=True) if end]:
        words += f"; {', '.join(loose)} at the end of its range, not determined"
    if at is not rows:
        loads = np.unique(rows.column("load_N"))
        place = int(np.searchsorted(loads, rows.nominal_N))
        first, *_, last = loads[max(0, place - 1) : place + 2]
        near = replace(rows, rows=[row for row in rows.rows if first <= row.load_N <= last])
        words += (
            f" at FNOMIN; no key has its change with load: {_percent(off(written, near))} from"
            f" {first:g} to {last:g} N, {_percent(off(written, rows))} over all loads"
        )
    result.add(each.section, words, dict(zip(names, written, strict=True)))


def _percent(deviations: Array) -> str:
    """The largest one, rounded up."""
    return f"{np.ceil(1e4 * np.abs(deviations).max()) / 100:.2f} %"


def _add_modes(result: StructuralKeys, modes: Sequence[Mode], unit_mass: bool) -> None:
    """Frequencies, damping ratios and the rigid belt's inertia. Raises InputError."""
    by_label = {mode.label: mode for mode in modes}
    chosen: dict[str, Mode] = {}
    for key, label in FREQUENCY_LABELS.items():
        if label not in by_label:
            raise InputError(f"the solver gives no mode {label}, which {key} needs")
        chosen[key] = mode = by_label[label]
        result.add("STRUCTURAL", f"Hz, {label.display}, rim held", {key: mode.frequency_Hz})
    ratios = {key.replace("FREQ", "DAMP"): mode.raw.damping_ratio for key, mode in chosen.items()}
    known = {key: ratio for key, ratio in ratios.items() if ratio is not None}
    result.add("STRUCTURAL", "of critical damping, by the compounds' loss factors", known)
    if not known:
        result.notes.append("left out: DAMP_*: no compound has a loss_factor")
    shapes = {key: mode.raw.shape for key, mode in chosen.items()}
    inertia = {
        key: _belt_inertia(key, shape)
        for key, shape in shapes.items()
        if unit_mass and isinstance(shape, HarmonicShape)
    }
    if len(inertia) < len(shapes):
        result.notes.append(
            "left out: BELT_*, because this solver's shapes have no known modal mass"
        )
        return
    other = inertia["FREQ_LAT"] / inertia["FREQ_LONG"] - 1
    words = f"of the mode FREQ_LONG; that of FREQ_LAT differs by {100 * other:+.2g} %"
    result.add("INERTIA", words, {"BELT_MASS": inertia["FREQ_LONG"]})
    result.add("INERTIA", "of the mode FREQ_YAW", {"BELT_IXX": inertia["FREQ_YAW"]})
    result.add("INERTIA", "of the mode FREQ_WINDUP", {"BELT_IYY": inertia["FREQ_WINDUP"]})
    springs = result.tyre.residual_springs()
    units = {name: "N m/rad" if name == "yaw" else "N/m" for name in springs}
    words = ", ".join(f"{name} {k:.4g} {units[name]}" for name, k in springs.items())
    result.notes.append(f"springs between belt and patch: {words}")
    if negative := [name for name, k in springs.items() if k <= 0]:
        raise InputError(
            f"the spring between belt and patch along {', '.join(negative)} would be negative: at"
            " FNOMIN the tyre is stiffer than its rigid belt alone on FREQ_* and BELT_*; check the"
            " moduli of the modes and of the road (analysis.vibration_frequency_Hz)"
        )


def _belt_inertia(key: str, shape: HarmonicShape) -> float:
    """Modal mass, kg, or moment, kg m², of a shape with 1 kg whose mean belt motion is set to 1."""
    (r, theta, z), radius = mean_belt_motion(shape)
    motion = {
        "FREQ_LONG": (r - 1j * theta) / 2,  # cos and -sin of a shift
        "FREQ_LAT": z,
        "FREQ_YAW": z / radius,
        "FREQ_WINDUP": theta / radius,
    }[key]
    return float(1 / abs(motion) ** 2)


def property_text(case: LoadedCase, keys: StructuralKeys, donor: PropertyFile | None = None) -> str:
    """Text of the .tir. Raises InputError for a donor of another nominal load or pressure."""
    notes = [f"{case.case.name}, by tyrecal from its structural model", *keys.notes]
    if not donor:
        notes.append("left out: coefficients of slip: no donor file is given")
    lines = [*(f"$ {note}" for note in notes), TIR_HEAD]
    for section, own in keys.sections.items():
        lines += [f"[{section}]"]
        lines += [f"{k:<24}= {x:<14.{TIR_DIGITS}g}$ {words}" for k, (x, words) in own.items()]
    if donor:
        _refuse_donor(keys.tyre, donor)
        version = f", FITTYP {donor.model.keys['FITTYP']:g}" if "FITTYP" in donor.lines else ""
        for section in (each for each in DONOR_SECTIONS if each in donor.sections):
            lines += [f"[{section}]", f"$ from {donor.path.name}{version}"]
            lines += donor.sections[section]
    return "\n".join([*lines, ""]).encode("latin-1", "replace").decode("latin-1")


def _refuse_donor(tyre: MFSwift, donor: PropertyFile) -> None:
    """Raises InputError: coefficients of slip count from FNOMIN and NOMPRES, in SI units."""
    if not {"LONGITUDINAL_COEFFICIENTS", "LATERAL_COEFFICIENTS"} & donor.sections.keys():
        raise InputError(
            f"{donor.path}: no coefficients of slip in it, such as [LATERAL_COEFFICIENTS]"
        )
    if not donor.is_SI:
        raise InputError(f"{donor.path}: the donor's [UNITS] must be meter, newton, radians, kg")
    if "FNOMIN" not in donor.model.keys:
        raise InputError(f"{donor.path}: no FNOMIN, from which its coefficients of slip count")
    for key, option in {"FNOMIN": "load-N", "NOMPRES": "pressure-kPa"}.items():
        theirs, ours = donor.model.keys.get(key), tyre.keys[key]
        if theirs is not None and abs(theirs / ours - 1) > MAX_OTHER_NOMINAL:
            raise InputError(
                f"{donor.place(key)} is {theirs:g}, here {ours:g}: coefficients of slip count from"
                f" it; give --nominal-{option}"
            )
