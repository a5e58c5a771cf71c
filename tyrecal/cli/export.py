"""tyrecal export"""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from . import arguments, complete, options
from .parameters import FileOrFolder, Number, OneOf, WholeNumber, option
from .terminal import Terminal

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator
    from ..studies.result import Result
    from ..tyre.case import LoadedCase

STUDY_OF_FORMS = {  # study whose result each format is made from
    **dict.fromkeys(("case", "deck", "matrices"), "fit"),
    "tir": "stiffness",
    "uff": "modes",
}
SAME_HZ = 1e-4  # relative difference up to which a result's frequency is that of this run
OPTIONS_OF_FORMS = {  # formats that an option goes with
    "--solver": ("deck", "matrices"),
    **dict.fromkeys(("--modes", "--points", "--pressure-kPa", "--load-N"), ("matrices",)),
    **dict.fromkeys(("--nominal-load-N", "--nominal-pressure-kPa", "--donor"), ("tir",)),
}


@dataclass(frozen=True)
class MatrixOptions:
    """Options of the reduced matrices."""

    modes: int  # most coordinates in addition to the hub's six
    points: str | None
    load_N: float | None


@dataclass(frozen=True)
class TirOptions:
    """Options of a tyre property file."""

    nominal_N: float | None
    nominal_kPa: float | None
    donor: Path | None


@click.command()
@click.argument("folder", metavar="DIR", type=FileOrFolder(exists=True))
@option(
    "--format",
    "form",
    type=OneOf([*STUDY_OF_FORMS]),
    default="case",
    show_default=True,
    help="Files to write: the case file with what it names; the decks; a tyre property file"
    " (MF-Swift 6.2); a universal file of the mode shapes; reduced matrices.",
)
@option(
    "--modes",
    type=WholeNumber(9, 900),
    default=194,
    show_default=True,
    metavar="N",
    help="With --format matrices: largest number of coordinates in addition to the hub's six.",
)
@option(
    "--points",
    metavar="P,...",
    help="With --format matrices: points and directions of the tread, such as tread:0deg:radial"
    " (default: five angles, radial and lateral).",
)
@options.pressure
@options.one_load
@option(
    "--case",
    "case",
    type=FileOrFolder(),
    metavar="CASE",
    shell_complete=complete.cases,
    help="Case of the results (default: the one in run.json of DIR).",
)
@option(
    "--nominal-load-N",
    "nominal_N",
    type=Number(),
    metavar="F",
    help="FNOMIN of a tir, N: one of the loads in DIR (default: the middle one).",
)
@option(
    "--nominal-pressure-kPa",
    "nominal_kPa",
    type=Number(),
    metavar="P",
    help="NOMPRES of a tir, kPa: one of the pressures in DIR (default: the case's).",
)
@option(
    "--donor",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE.tir",
    help="Property file from which a tir takes its coefficients of slip.",
)
@option("--force", is_flag=True, help="Write over files that exist.")
@option(
    "--output",
    type=FileOrFolder(),
    metavar="FOLDER",
    help="Folder for the files (default: export in DIR).",
)
@options.solver
@options.packed("matrices", MatrixOptions)
@options.packed("tir", TirOptions)
@options.with_study
def command(
    folder: Path,
    form: str,
    matrices: MatrixOptions,
    case: Path | None,
    tir: TirOptions,
    force: bool,
    study: options.Study,
) -> int:
    """Write the tyre of DIR to files, in DIR/export or --output.

    A case is written as CASE_fitted.yaml: your text with the fitted values, and the files that it
    names. Decks are those of the case's solver. If the case has your own deck, that is written:
    your text, units and numbering, only the numbers changed.

    A tir has the keys that a structure determines, fitted to the stiffness.json in DIR, of the
    fitted design if it has one. The comment of a key states its misfit. Run 'tyrecal stiffness' at
    three loads or more, and at several pressures, first.

    A uff has the modes of the modes.json in DIR, unloaded or on the road: points and lines of the
    surface, and two shapes for a pair (data sets 151, 164, 2411, 82, 55; SI; x forward, y left, z
    up).

    Matrices are those of the tyre at a pressure, and at a load with its contact held: stiffness,
    mass and loss on the six motions of the hub and its modes (Craig and Bampton), as Matrix Market
    and for ABAQUS, with a README of coordinates and units. A case, decks and matrices need the
    fit.json in DIR; for matrices DIR may also be a case file.

    \b
    tyrecal export p235_75r17
    tyrecal export p235_75r17 --format deck --solver calculix --output decks
    tyrecal modes p235_75r17/export/p235_75r17_fitted.yaml
    tyrecal export p235_75r17 --format tir --nominal-load-N 4000 --donor slip.tir
    tyrecal export p235_75r17 --format matrices --pressure-kPa 200 --load-N 4000
    """
    for name in set(options.given()) & OPTIONS_OF_FORMS.keys():
        if form not in OPTIONS_OF_FORMS[name]:
            raise click.UsageError(
                f"{name} goes with --format {' or '.join(OPTIONS_OF_FORMS[name])}"
            )
    from ..files import atomic_write, private_dir
    from ..measured.load import load_case
    from ..simulate.settings import root
    from ..studies.export import case_files, deck_files, parts_left_out, settings_left_out
    from ..studies.matrices import MATRIX_POINTS, matrix_files
    from .output import Run

    terminal, before = study.terminal, STUDY_OF_FORMS[form]
    results = folder / f"{before}.json" if folder.is_dir() else folder
    if not results.is_file():
        advice = f": run 'tyrecal {before}' first"
        raise click.UsageError(f"there is no {before}.json in the folder '{folder}'{advice}")
    of_case = form == "matrices" and results.suffix in (".yaml", ".yml")
    case = results if of_case else case or _case_of(results, before)
    loaded = load_case(case, allow_unusual=not of_case)  # accepted for the results
    if form == "tir":
        files = _property_file(loaded, results, tir)
    elif form == "uff":
        files = _universal_file(loaded, results)
    else:
        if not of_case:
            loaded = _as_fitted(results, loaded, terminal)
        if form == "matrices":
            load = arguments.one_load(loaded, matrices.load_N, not of_case)
            wanted, kPa = matrices.points or MATRIX_POINTS, study.pressure_kPa
            files = matrix_files(loaded, study.solver, kPa, matrices.modes, wanted, load)
        else:
            files = case_files(loaded) if form == "case" else deck_files(loaded, study.solver)
    target = study.output or (root() / results.stem if of_case else results.parent) / "export"
    for name, content in files.items():
        place = target / name
        if place.exists() and not force and place.read_bytes() != content:
            raise InputError(f"'{place}' exists already; give --force to write over it")
    run = Run(case, target, "export", loaded=loaded)
    paths = []
    for name, content in files.items():
        place = run.folder / name
        for above in reversed(place.relative_to(run.folder).parents[:-1]):
            private_dir(run.folder / above)
        paths.append(str(place))
        with atomic_write(place) as partial:
            partial.write_bytes(content)
    run.finish()
    terminal.result(paths)
    if not terminal.as_json:
        terminal.say("\n".join(paths))
    if form == "case" and (left := settings_left_out(loaded)):
        terminal.note(f"settings of the state are not in the case: {', '.join(left)}")
    if form == "deck" and (left := parts_left_out(loaded)):
        terminal.warn(f"your deck does not contain {' and '.join(left)}: the case adds that")
    return 0


def _as_fitted(fit: Path, case: LoadedCase, terminal: Terminal) -> LoadedCase:
    """The case with the fit's values; a fit that did not converge gives a warning."""
    from ..files import read_json
    from ..studies.fitted import as_fitted, is_good

    loaded = as_fitted(fit, case)
    if not is_good(read_json(fit)):
        terminal.warn(f"the fit in '{fit}' did not converge: its values are not calibrated")
    return loaded


def _property_file(case: LoadedCase, results: Path, tir: TirOptions) -> dict[str, bytes]:
    """Name and content of the .tir by the stiffnesses in ``results``. Raises InputError."""
    from ..measured.tir import read_property_file
    from ..studies.fitted import read_result
    from ..studies.property_file import property_text, structural_keys
    from ..studies.stiffness import StiffnessResult

    loaded, stiffness = read_result(results, case, StiffnessResult)
    evaluator = _evaluator_of(loaded, stiffness, results.parent)
    keys = structural_keys(loaded, stiffness, evaluator, tir.nominal_N, tir.nominal_kPa)
    text = property_text(loaded, keys, read_property_file(tir.donor) if tir.donor else None)
    return {f"{case.path.stem}.tir": text.encode("latin-1")}


def _universal_file(case: LoadedCase, results: Path) -> dict[str, bytes]:
    """Name and content of the universal file of the modes in ``results``. Raises InputError."""
    from ..report.universal_shapes import loaded_shapes_text, shapes_text
    from ..simulate.evaluate.evaluator import Question
    from ..simulate.modes.label import UNIT_MASS_SOLVERS, labelled
    from ..studies.fitted import read_result
    from ..studies.loaded import LoadedTyre, load_tyres
    from ..studies.modes import ModesResult

    loaded, modes = read_result(results, case, ModesResult)
    evaluator = _evaluator_of(loaded, modes, results.parent)
    unit_mass = evaluator.solver.name in UNIT_MASS_SOLVERS
    if modes.load_N:
        designs = {"initial": modes.variables}
        tyre = load_tyres(loaded, evaluator, designs, [modes.load_N])["initial"]
        if not isinstance(tyre, LoadedTyre):
            raise tyre
        computed_Hz = [mode.frequency_Hz for mode in tyre.loads[-1].modes]
        text = loaded_shapes_text(loaded, tyre, unit_mass)
    else:
        evaluation = evaluator.evaluate(Question(modes.variables))
        computed_Hz = [mode.frequency_Hz for mode in labelled(evaluation)]
        text = shapes_text(loaded, evaluation, labelled(evaluation), unit_mass)
    stated_Hz = [each.frequency_Hz for each in modes.modes if each.member is None]
    if not all(any(isclose(f, x, rel_tol=SAME_HZ) for x in computed_Hz) for f in stated_Hz):
        raise InputError(f"'{results}' has other frequencies: run 'tyrecal modes' again")
    return {f"{case.path.stem}.uff": text.encode()}


def _evaluator_of(case: LoadedCase, result: Result, folder: Path) -> Evaluator:
    """The evaluator with the solver of a result; it reads the evaluation store next to it."""
    from ..simulate.deck.decks_design import design_of
    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.store import Store

    evaluator = Evaluator(design_of(case), result.provenance.solver if result.provenance else "")
    if (folder / "record").is_dir():
        evaluator.store = Store((folder / "record").resolve())
    return evaluator


def _case_of(results: Path, study: str) -> Path:
    """The case that run.json next to results of a study names. Raises click.UsageError."""
    from ..files import read_runs
    from ..simulate.case_folder import named_case

    path = named_case(read_runs(results.parent).get(study, {}), results.parent)
    if path is None or not path.is_file():
        raise click.UsageError(
            f"the case of '{results}' is not at its place: give it by --case CASE"
        )
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
