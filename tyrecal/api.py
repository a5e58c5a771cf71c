"""Functions for other programs: cases read and changed, modes, fits, sweeps, footprints, diagnoses.

``case`` is a `LoadedCase`, or the path of a case file. Those functions that evaluate designs take
``solver``, the name of an installed solver ("": the case's), and ``record``, a folder that answers
what was evaluated before and keeps what is new (None: neither). ``jobs`` is how many designs are
evaluated at a time, where they are independent. Values of variables are in the units of the numbers
that they set; those not given are the case's start values. A wrong argument raises InputError in a
sentence that names it, a case with mistakes CaseError, a solver that fails EvaluationFailed.

Numbers that no tyre has, most often slips of unit, are wrong input of `load_case`, `with_values`,
`sweep_pressure` and `evaluate_footprint`, unless ``allow_unusual``. Values of designs to evaluate
are free: a search may try what it likes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from inspect import signature
from itertools import pairwise
from math import inf, log
from numbers import Integral, Real
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeVar, get_args

from .errors import InputError
from .files import printable, read_json
from .measured.load import load_case as _load_case
from .simulate.deck.decks_design import design_of
from .simulate.deck.tyre_design import TyreDesign
from .simulate.evaluate.evaluator import Evaluator, Question
from .simulate.evaluate.failure import EvaluationFailed
from .simulate.evaluate.pressed import Pressed
from .simulate.evaluate.store import Store
from .simulate.modes.label import Mode, labelled
from .studies import study_class
from .studies.diagnose.diagnosis import Diagnosis
from .studies.emulator import Emulator
from .studies.fit.calibrate import METHODS, Fit
from .studies.fit.study import FitStudy
from .studies.fit.targets import target_labels
from .studies.pressure import State
from .studies.response import ResponseForm
from .studies.result import Result, StudyInput
from .tyre.case import CaseError, LoadedCase, as_written, start_values, with_level
from .tyre.case.mistakes import suggestion
from .tyre.case.parts import Setting
from .tyre.effects import Effect, catalogue
from .tyre.state import pressure_name
from .tyre.values import overridden, unusual_value
from .tyre.values import with_values as _with_values

__all__ = [
    "CaseError",
    "Diagnosis",
    "Effect",
    "Emulator",
    "EvaluationFailed",
    "Fit",
    "InputError",
    "LoadedCase",
    "Mode",
    "Result",
    "State",
    "diagnose_case",
    "emulate",
    "evaluate_footprint",
    "evaluate_modes",
    "fit_case",
    "list_effects",
    "load_case",
    "read_results",
    "run",
    "sweep_pressure",
    "with_values",
]
MAX_SHOWN_CHARACTERS = 60  # characters of a wrong argument
_SettingValue = TypeVar("_SettingValue", bound=Setting)


def load_case(path: Path | str, mesh: str = "", allow_unusual: bool = False) -> LoadedCase:
    """Read a case file; ``mesh`` is one of its mesh levels ("": the one it names).

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> case.case.name, case.case.pressure_kPa
    ('P235/75R17 on an 8 inch rim', 240.0)

    `with_values` sets variables, or any number by its path:

    >>> softer = with_values(case, {"pressure_kPa": 200, "rebar_layers.belt_1.angle_deg": 68})
    >>> softer.case.pressure_kPa
    200.0
    """
    loaded = _load_case(_path("path", path), allow_unusual)
    return with_level(loaded, mesh) if _text("mesh", mesh) else loaded


def with_values(
    case: LoadedCase | Path | str, values: Mapping[str, Setting], allow_unusual: bool = False
) -> LoadedCase:
    """The case with any of its numbers set, by path, and with variables that start at other values,
    by name; ``overrides`` and the provenance of results list them. A path takes None, and a word
    among those of its key, where the case file does. Raises InputError for an unknown name, an
    impossible value, or one that no tyre has.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> with_values(case, {"rebar_layers.belt_1.angle_deg": 68}).overrides
    {'rebar_layers.belt_1.angle_deg': 68.0}
    >>> with_values(case, {"pressure_kPa": 2.2})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    tyrecal.errors.InputError: pressure_kPa is 2.2: usual is 50 to 1200 kPa; did you mean 2.2 ...
    """
    given = _mapping("values", values)
    changed = overridden(_case(case), given)
    for name, value in given.items():
        _refuse_unusual(changed, name, name, value, allow_unusual)
    return changed


def evaluate_modes(
    case: LoadedCase | Path | str,
    values: Mapping[str, float] | None = None,
    *,
    solver: str = "",
    record: Path | str | None = None,
) -> list[Mode]:
    """Modes of one design by rising frequency, each with ``label`` [c, m], ``frequency_Hz``,
    ``multiplicity`` and ``clarity`` of its label, 0 to 1.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> modes = evaluate_modes(case, {"C10": 1.2e6})
    >>> f"{modes[0].label} {modes[0].frequency_Hz:.1f} Hz"
    '[0,0] axial 37.3 Hz'
    """
    case = _case(case)
    design = _design(case, values)
    return labelled(_evaluator(case, solver, record).evaluate(Question(design)))


def fit_case(
    case: LoadedCase | Path | str,
    measured: Path | str | None = None,
    *,
    method: str = "slsqp",
    fixed: Mapping[str, float] | Iterable[str] | str | None = None,
    free: Iterable[str] | str = (),
    prior: bool = False,
    starts: int = 1,
    seed: int = 0,
    jobs: int = 1,
    solver: str = "",
    record: Path | str | None = None,
) -> Fit:
    """Calibrate the case's variables to its targets, or to a file of measurements (CSV) in their
    place, as ``tyrecal fit --measured`` does: frequencies without labels get the likeliest ones.

    ``fixed`` holds variables at values, or at their start where it is a name or several. ``free``
    frees uncertain numbers, one or several, within what is known of them. ``prior`` includes what
    is known of the variables, the section and the constants.
    ``method`` is "slsqp" (SciPy's) or "gauss-newton", which needs about half the designs.
    ``result`` holds what fit.json does, ``provenance`` too, ``fitted`` the design: ``values``,
    ``objective`` in Hz, ``modes`` by label and, of targets in several states, ``states``: modes of
    each. ``left_out`` lists the measurements that are no targets.

    >>> fit = fit_case(load_case("cases/p235_75r17.yaml", mesh="coarse"), fixed="C10")
    >>> fit.result["converged"], f"{fit.initial.objective:.0f} to {fit.fitted.objective:.0f} Hz"
    (True, '33 to 6 Hz')
    """
    case, method = _case(case), _method("method", method)
    held = _held(case, fixed)
    file = None if measured is None else _file("measured", measured)
    counts = _count("starts", starts, 1), _count("seed", seed, 0), _count("jobs", jobs, 1)
    freed, known = _names("free", free), _flag("prior", prior)
    study = FitStudy(case, _evaluator(case, solver, record), file, held, freed, known)
    return study.run(method, *counts)


def sweep_pressure(
    case: LoadedCase | Path | str,
    pressures_kPa: float | Iterable[float],
    values: Mapping[str, float] | None = None,
    *,
    allow_unusual: bool = False,
    jobs: int = 1,
    solver: str = "",
    record: Path | str | None = None,
) -> list[State]:
    """Modes at each pressure (kPa), or at one: ``modes`` by rising frequency, ``frequencies`` by
    label, and ``slopes`` d ln f / d ln p by label, None where the solver has none.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> for state in sweep_pressure(case, [160, 240]):
    ...     print(f"{state.pressure_kPa:g} kPa: {state.modes[0].frequency_Hz:.1f} Hz")
    160 kPa: 31.1 Hz
    240 kPa: 37.0 Hz
    """
    from .studies.pressure import sweep

    def stop_at_failure(words: str, failure: EvaluationFailed | None) -> None:
        if failure:
            raise failure

    case = _case(case)
    design, jobs = _design(case, values), _count("jobs", jobs, 1)
    pressures = _pressures(case, "pressures_kPa", pressures_kPa, allow_unusual)
    evaluator = _evaluator(case, solver, record)
    outcomes = sweep(case, evaluator, {"": design}, pressures, jobs, stop_at_failure)
    return [each for each in outcomes if isinstance(each, State)]


def evaluate_footprint(
    case: LoadedCase | Path | str,
    loads_N: float | Iterable[float],
    values: Mapping[str, float] | None = None,
    *,
    allow_unusual: bool = False,
    solver: str = "",
    record: Path | str | None = None,
) -> list[dict[str, float]]:
    """The tyre on a flat road at rising loads (N), or at one, an entry each: ``load_N``,
    ``deflection_m``, ``area_m2``, ``length_m``, ``width_m``, ``mean_pressure_Pa``,
    ``peak_pressure_Pa``, ``vertical_stiffness_N_per_m``.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> (at_1_kN,) = evaluate_footprint(case, [1000])
    >>> f"{1e4 * at_1_kN['area_m2']:.0f} cm2, {1e3 * at_1_kN['deflection_m']:.1f} mm"
    '41 cm2, 5.4 mm'
    """
    from .studies.footprint import footprint_row

    case = _case(case)
    design, loads = _design(case, values), _loads(case, "loads_N", loads_N, allow_unusual)
    pressed: Pressed = _evaluator(case, solver, record).press(design, loads)
    if pressed.failed:
        raise pressed.failed
    mesh = TyreDesign(case, design).tyre.mesh
    return [footprint_row(pressed, footprint, mesh) for footprint in pressed.footprints]


def diagnose_case(
    case: LoadedCase | Path | str,
    measured: Path | str | None = None,
    *,
    repeats: Path | str | Iterable[Path | str] = (),
    effects: str | Iterable[str] | None = None,
    jobs: int = 1,
    solver: str = "",
    record: Path | str | None = None,
) -> Diagnosis:
    """Where the case and measurements part, and which effect explains it. ``measured`` is a CSV
    file (None: the one that the case's targets stand in).

    ``repeats`` are the same measurements after mounting anew, a file or several; ``effects`` the
    ids to consider, one or several (None: all). ``verdict`` says what can be told, in ``words``
    too; ``probabilities`` are by effect, "none" and "outside" among them; ``gap`` is what
    calibration leaves.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> diagnosis = diagnose_case(case, "cases/p235_75r17_wheeler.csv", effects="rim_width")
    >>> diagnosis.verdict.kind, diagnosis.verdict.key
    ('undecided', None)
    """
    from .studies.diagnose.study import study

    case = _case(case)
    file = case.measured if measured is None else _file("measured", measured)
    if file is None:
        raise InputError("measured must be given: the case's targets are not in a file")
    others = _files("repeats", repeats)
    ids = None if effects is None else _names("effects", effects)
    jobs, evaluator = _count("jobs", jobs, 1), _evaluator(case, solver, record)
    return study(case, evaluator, file, others, jobs=jobs, effects=ids).diagnosis


def emulate(
    case: LoadedCase | Path | str,
    *,
    reach: float = 0.3,
    evaluations: int = 0,
    pressures_kPa: tuple[float, float] | None = None,
    jobs: int = 1,
    solver: str = "",
    record: Path | str | None = None,
) -> Emulator:
    """Frequencies for any design near the case's own, 1e5 of them in a second: polynomials of a few
    dozen evaluations (0: ten for each variable) with their slopes.

    The box: ``reach`` in the logarithm of each variable, that share of its bounds where it is
    linear, to either side within the bounds; with ``pressures_kPa`` from one to another, too.
    ``frequencies`` of values tells Hz by label and refuses designs outside the box; ``ln_f``
    takes many, as rows of logarithms. ``stated_error``, relative, holds for 99 % of designs.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> found = emulate(case, reach=0.1, evaluations=8)
    >>> hertz = found.frequencies({"C10": 1.05e6})
    >>> exact = evaluate_modes(case, {"C10": 1.05e6})[0]
    >>> abs(hertz[exact.label] / exact.frequency_Hz - 1) < found.stated_error < 1e-3
    True
    """
    from .studies.emulator import emulator
    from .studies.variable import DesignVariable, read_variables

    case = _case(case)
    if not _number("reach", reach) > 0:
        raise InputError(f"reach must be above 0, got {reach:g}")
    evaluations, jobs = _count("evaluations", evaluations, 0), _count("jobs", jobs, 1)
    variables = read_variables(case)
    if not variables:
        raise InputError("the case has no variables: there is nothing to emulate")
    box = [
        (max(x - reach, v.scaled(v.lower)), min(x + reach, v.scaled(v.upper)))
        for v in variables
        for x in [v.scaled(v.start)]
    ]
    if pressures_kPa is not None:
        ends = _numbers("pressures_kPa", pressures_kPa)
        if len(ends) != 2:
            raise InputError(f"pressures_kPa must be two, from one to another, got {ends}")
        low, high = ends
        if not 0 < low < high < inf:
            raise InputError(f"pressures_kPa must rise from above 0, got {low:g} to {high:g}")
        start = min(max(case.case.pressure_kPa, low), high)
        variables.append(DesignVariable("pressure_kPa", start, low, high))
        box.append((log(low), log(high)))
    labels = target_labels(case)
    count = evaluations or 10 * len(variables)
    return emulator(_evaluator(case, solver, record), variables, box, labels, count, jobs)


def run(
    study: str,
    case: LoadedCase | Path | str,
    values: Mapping[str, float] | None = None,
    *,
    jobs: int = 1,
    solver: str = "",
    record: Path | str | None = None,
    **options: Any,
) -> Result:
    """Run a study by its name, of the tool or from outside. ``values`` are the design's; options
    are the study's own, such as ``pressures_kPa`` of "sweep-pressure", ``loads_N`` of "footprint",
    ``measured`` of "fit", "sample" and "diagnose", and ``ranges`` of "sweep", as C10=8e5:1.2e6:5.

    The result has the numbers of its file as attributes, ``texts()`` its files by name and
    ``quantities()`` what a batch compares.

    >>> case = load_case("cases/p235_75r17.yaml", mesh="coarse")
    >>> result = run("sweep-pressure", case, pressures_kPa=[160, 240])
    >>> [f"{row.pressure_kPa:g} kPa: {row.modes[0].frequency_Hz:.1f} Hz" for row in result.rows]
    ['160 kPa: 31.1 Hz', '240 kPa: 37.0 Hz']
    """
    kind, case = study_class(_text("study", study)), _case(case)
    known = list(signature(kind.run).parameters)[1:]
    for name, value in options.items():
        if name not in known:
            raise InputError(f"{study} has no option '{name}': it has {', '.join(known) or 'none'}")
        if name in OPTION_READERS:
            options[name] = OPTION_READERS[name](case, name, value)
    given = StudyInput(case, _evaluator(case, solver, record), {"initial": _design(case, values)})
    given.jobs = _count("jobs", jobs, 1)
    return kind.run(given, **options)


def list_effects() -> dict[str, Effect]:
    """Effects that a plain model leaves out, by id: ``title``, ``unit``, ``low`` and ``high`` of
    the parameter, ``signature``, ``toggle``, ``aliases``. In a case an effect is the number
    ``effects.ID``.

    >>> filler = list_effects()["bead_filler"]
    >>> filler.title, filler.low, filler.high
    ('Bead filler', 0.0, 3.0)
    """
    return dict(catalogue())


def read_results(folder: Path | str) -> dict[str, Any]:
    """The result files of a folder that the command line wrote, by name without ``.json``.

    Raises FileNotFoundError where the folder holds none; ValueError for a file that is no JSON.

    >>> import subprocess, sys, tempfile
    >>> folder = tempfile.mkdtemp()
    >>> command = "tyrecal modes cases/p235_75r17.yaml --mesh coarse --quiet --output".split()
    >>> _ = subprocess.run([sys.executable, "-m", *command, folder], check=True)
    >>> results = read_results(folder)
    >>> sorted(results), results["modes"]["pressure_kPa"]
    (['modes', 'modes_shapes', 'run'], 240.0)
    """
    paths = sorted(_path("folder", folder).glob("*.json"))
    if not paths:
        raise FileNotFoundError(f"there are no results in the folder '{folder}'")
    return {path.stem: read_json(path, follow=False) for path in paths}


def _design(case: LoadedCase, values: Mapping[str, float] | None) -> dict[str, float]:
    """The whole design. Raises InputError where the case cannot have it."""
    design = {**start_values(case), **({} if values is None else _mapping("values", values))}
    _with_values(case, design)
    return design


def _held(
    case: LoadedCase, fixed: Mapping[str, float] | Iterable[str] | str | None
) -> dict[str, float]:
    """Values of the variables that are held. Raises InputError."""
    if fixed is None or isinstance(fixed, Mapping):
        held = {} if fixed is None else _mapping("fixed", fixed)
    else:
        held = {name: start_values(case).get(name, 0.0) for name in _names("fixed", fixed)}
    for name in held:
        if name not in case.case.variables:
            known = suggestion(name, case.case.variables)
            raise InputError(f"fixed: there is no variable '{name}'{known}")
    _with_values(case, {**start_values(case), **held})
    return held


def _refuse_unusual(
    case: LoadedCase, what: str, name: str, value: Setting, allowed: bool = False
) -> None:
    """Raises InputError where no tyre has such a value of ``name``; the message calls it
    ``what``."""
    if not allowed and (message := unusual_value(case, name, value)):
        raise InputError(f"{what} is {as_written(value)}: {message}")


def _evaluator(case: LoadedCase, solver: str, record: Path | str | None) -> Evaluator:
    store = None
    if record is not None:
        folder = _path("record", record)
        if folder.exists() and not folder.is_dir():
            raise InputError(f"record must be a folder, '{folder}' is a file")
        store = Store(folder.resolve())
    evaluator = Evaluator(design_of(case), _text("solver", solver), store=store)
    evaluator.solver  # noqa: B018  a solver that is not there is refused before anything else
    return evaluator


# Arguments as callers write them. Each function raises InputError in a sentence that names one.


def _case(case: LoadedCase | Path | str) -> LoadedCase:
    if isinstance(case, LoadedCase):
        return case
    return load_case(_path("case", case, "a LoadedCase, or the path of a case file"))


def _path(name: str, value: Path | str, wanted: str = "a path") -> Path:
    if isinstance(value, str | PathLike) and (text := fspath(value)) and isinstance(text, str):
        return Path(text)
    raise _wrong(name, wanted, value)


def _file(name: str, value: Path | str) -> Path:
    path = _path(name, value, "the path of a file")
    if not path.is_file():
        raise InputError(f"{name}: there is no file '{path}'")
    return path


def _files(name: str, values: Path | str | Iterable[Path | str]) -> list[Path]:
    several = [values] if isinstance(values, str | PathLike) else values
    return [_file(name, path) for path in _listed(name, several, "a file")]


def _method(name: str, value: str) -> str:
    return _one_of(name, value, METHODS)


def _one_of(name: str, value: str, known: Collection[str]) -> str:
    if _text(name, value) not in known:
        raise InputError(f"{name} '{value}' is none of {', '.join(known)}")
    return value


def _flag(name: str, value: bool) -> bool:
    if isinstance(value, bool):
        return value
    raise _wrong(name, "True or False", value)


def _pressures(
    case: LoadedCase, name: str, values: float | Iterable[float], allowed: bool = False
) -> list[float]:
    pressures, path = _numbers(name, values), pressure_name(case)
    for pressure in pressures:
        try:
            _with_values(case, {**start_values(case), path: pressure})
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
        _refuse_unusual(case, name, path, pressure, allowed)
    return pressures


def _loads(
    case: LoadedCase, name: str, values: float | Iterable[float], allowed: bool = False
) -> list[float]:
    loads = _numbers(name, values)
    rise = [after - before for before, after in pairwise([0.0, *loads])]
    if not rise or not all(0 < each < inf for each in rise):
        raise InputError(f"{name} must be above 0 and rise, got {loads}")
    for load in loads:
        _refuse_unusual(case, name, "road.loads_N.0", load, allowed)
    return loads


def _text(name: str, value: str) -> str:
    if isinstance(value, str):
        return value
    raise _wrong(name, "text", value)


def _number(name: str, value: float) -> float:
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    raise _wrong(name, "a number", value)


def _count(name: str, value: int, least: int) -> int:
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise _wrong(name, "a whole number", value)
    if value < least:
        raise InputError(f"{name} must be at least {least}, got {value}")
    return int(value)


def _mapping(name: str, values: Mapping[str, _SettingValue]) -> dict[str, _SettingValue]:
    if isinstance(values, Mapping) and all(isinstance(key, str) for key in values):
        return dict(values)
    raise _wrong(name, "names with values, as in {'C10': 1e6}", values)


def _numbers(name: str, values: float | Iterable[float]) -> list[float]:
    several = [values] if isinstance(values, Real) else values
    return [_number(name, each) for each in _listed(name, several, "a number")]


def _names(name: str, values: str | Iterable[str]) -> list[str]:
    several = [values] if isinstance(values, str) else values
    return [_text(name, each) for each in _listed(name, several, "a name")]


def _listed(name: str, values: Any, one: str) -> list[Any]:
    """All of several values; ``one``: what a single one is."""
    if not isinstance(values, str | bytes | Mapping):
        try:
            return list(values)
        except TypeError:
            pass
    raise _wrong(name, f"{one}, or a list of several", values)


def _wrong(name: str, wanted: str, value: object) -> InputError:
    text = printable(repr(value))
    shown = text if len(text) <= MAX_SHOWN_CHARACTERS else f"{text[:MAX_SHOWN_CHARACTERS]}..."
    return InputError(f"{name} must be {wanted}, got {shown}")


# how `run` reads an option, by its name: case, name and value; others are passed on as they are
OPTION_READERS: dict[str, Callable[[LoadedCase, str, Any], Any]] = {
    "pressures_kPa": _pressures,
    "at_kPa": _pressures,
    "loads_N": _loads,
    "fixed": lambda case, name, value: _held(case, value),
    "measured": lambda case, name, value: _file(name, value),
    "repeats": lambda case, name, value: _files(name, value),
    "effects": lambda case, name, value: _names(name, value),
    "free": lambda case, name, value: _names(name, value),
    "by": lambda case, name, value: _names(name, value),
    "of": lambda case, name, value: _names(name, value),
    "ranges": lambda case, name, value: _names(name, value),
    "latin_hypercube": lambda case, name, value: _count(name, value, 0),
    "allow_unusual": lambda case, name, value: _flag(name, value),
    "excite": lambda case, name, value: _text(name, value),
    "respond": lambda case, name, value: _text(name, value),
    "form": lambda case, name, value: _one_of(name, value, get_args(ResponseForm)),
    "from_Hz": lambda case, name, value: _number(name, value),
    "to_Hz": lambda case, name, value: _number(name, value),
    "step_Hz": lambda case, name, value: _number(name, value),
    "patch_mm": lambda case, name, value: _number(name, value),
    "prior": lambda case, name, value: _flag(name, value),
    "method": lambda case, name, value: _method(name, value),
    "starts": lambda case, name, value: _count(name, value, 1),
    "draws": lambda case, name, value: _count(name, value, 1000),
    "seed": lambda case, name, value: _count(name, value, 0),
}
