"""tyrecal measured import, sensors, label"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from . import arguments, options
from .parameters import FileOrFolder, Number, NumberWithin, OneOf, WholeNumber, option

if TYPE_CHECKING:
    from ..measured.modal import Layout

files = click.argument(
    "files",
    nargs=-1,
    required=True,
    metavar="FILE...",
    type=FileOrFolder(exists=True, folder=False),
)
axle = option(
    "--axle",
    type=OneOf(["x", "y", "z"]),
    help="Axis of the test's coordinates along the axle (default: inferred from the sensors'"
    " places).",
)
centre = option(
    "--centre",
    metavar="X,Y,Z",
    default="0,0,0",
    show_default=True,
    help="The wheel's centre in the test's coordinates, m.",
)
directions = option(
    "--directions",
    type=OneOf(["stated", "cartesian", "cylindrical"]),
    help="Directions 1, 2, 3 of a sensor: those of the file's coordinate systems, along x, y, z,"
    " or radial, tangential, lateral (default: as stated in the file, else those that fit the"
    " shapes).",
)
leave_out = option(
    "--leave-out",
    multiple=True,
    metavar="CHANNEL",
    help="Channel to leave out: NODE, NODE:DIRECTION or COMPONENT, such as 12:3 or hub;"
    " repeatable.",
)
highest = option(
    "--highest-harmonic",
    "highest",
    type=WholeNumber(0, 20),
    metavar="C",
    help="Largest number of waves round the circumference of a mode in the band (default: 12).",
)

band = option(
    "--band",
    metavar="F1,F2",
    help="Frequency band to search for modes, Hz (default: all). Example: 25,135.",
)
assumed = option(
    "--sigma-percent",
    "assumed",
    type=NumberWithin(0, 20, min_open=True),
    metavar="P",
    help="Standard deviation of one run without a stated one, per cent.",
)
response = option(
    "--response",
    type=OneOf(["receptance", "mobility", "accelerance"]),
    help="Type of the response functions if the file does not state it.",
)


@dataclass(frozen=True)
class Setup:
    """How a test was made and how its files are read, by the options above."""

    axle: str | None
    centre: str
    directions: str | None
    highest: int | None
    leave_out: tuple[str, ...] = ()
    band: str | None = None
    response: str | None = None
    assumed: float | None = None  # sigma of one run, per cent
    labels: bool = True

    @property
    def sigma(self) -> float:
        """Relative standard deviation of one run; 0: not stated."""
        return (self.assumed or 0.0) / 100

    def layout(self) -> Layout:
        """Layout of the sensors. Raises click.UsageError."""
        from ..measured.modal import Layout
        from ..simulate.modes.label import MAX_SAMPLED_HARMONIC

        x, y, z = arguments.parse_numbers("--centre", self.centre, count=3)
        limits = arguments.parse_numbers("--band", self.band, "Hz", 2) if self.band else None
        if limits and not 0 <= limits[0] < limits[1]:
            raise click.UsageError(f"--band {self.band}: must rise from 0 or more")
        most = MAX_SAMPLED_HARMONIC if self.highest is None else self.highest
        within = (limits[0], limits[1]) if limits else None
        axle, directions, response = self.axle or "", self.directions or "", self.response or ""
        return Layout(axle, (x, y, z), directions, most, within, response, self.labels)


@click.group()
def command() -> None:
    """Turn modal tables, mode shapes and frequency-response functions into measurements.

    \b
    tyrecal measured import table.csv --pressure-kPa 240 --output measured.csv
    tyrecal measured import run1.uff run2.uff run3.uff --pressure-kPa 240 --band 25,135
    tyrecal measured sensors run1.uff --highest-harmonic 6
    tyrecal measured label cases/p235_75r17.yaml unlabelled.csv
    """


@command.command("import")
@files
@option(
    "--output",
    type=FileOrFolder(folder=False),
    metavar="FILE",
    default="measured.csv",
    show_default=True,
    help="Measurements file to write (CSV).",
)
@option(
    "--pressure-kPa",
    "pressure_kPa",
    type=Number(),
    metavar="P",
    help="Inflation pressure if the files do not state it.",
)
@options.every(band, assumed)
@option(
    "--floor-percent",
    "floor",
    type=NumberWithin(0, 20),
    default=0.1,
    show_default=True,
    metavar="P",
    help="Smallest sigma, per cent: scatter that repeats do not show.",
)
@options.every(axle, centre, directions, highest, leave_out, response)
@option(
    "--labels/--no-labels",
    default=True,
    help="Whether shapes alone give labels; without, 'tyrecal diagnose', 'fit' and 'measured label'"
    " judge shapes and frequencies together.",
)
@option(
    "--keep-going",
    is_flag=True,
    help="Leave out repeats that contradict each other, and list them, instead of stopping.",
)
@option("--pictures/--no-pictures", default=True, help="Draw functions and shapes next to the CSV.")
@options.figure_format
@options.packed("setup", Setup)
@options.with_study
def import_files(
    files: tuple[Path, ...], setup: Setup, floor: float, keep_going: bool, study: options.Study
) -> int:
    """Write the measurements in FILEs to one CSV, for --measured of 'tyrecal fit' and 'diagnose'.

    FILE: a modal table (CSV), or a universal file with mode shapes (data sets 55, 2414) or
    frequency-response functions (58) and their geometry (15, 2411, 18, 2420), a tyre property file
    (.tir: frequencies, damping, mass; vertical stiffness and patch at 0.5, 1 and 1.5 FNOMIN), or
    TYDEX 1.3 (load against deflection: vertical stiffness). Several measurements of one quantity
    are repeats: the value is their mean, sigma that mean's standard deviation.
    Repeats that differ by more than the file's other repeats stop the import. Frequencies that fall
    with pressure, labels that look exchanged and single values far from a smooth curve are
    reported. If the sensors do not determine a label, the frequency is written without one;
    'tyrecal fit' and 'tyrecal measured label' label it by the model. Files with a common reference
    and different channels are parts of one test. Shapes are kept next to OUTPUT, in a file
    NAME_at_sensors.json: a fit to OUTPUT compares them with the fitted tyre's (MAC, COMAC). AutoMAC
    shows which modes look alike at the sensors.

    \b
    tyrecal measured import modes.csv --pressure-kPa 240 --sigma-percent 0.3
    tyrecal measured import run1.uff run2.uff --pressure-kPa 240 --directions cylindrical
    tyrecal measured import geometry.uff part*.uff --pressure-kPa 240 --leave-out 12:3
    tyrecal measured import at_200.csv at_240.csv --output both.csv
    tyrecal measured import tyre.tir vertical.tdx --sigma-percent 2
    """
    from ..files import write_text
    from ..measured.correlation import auto_mac, auto_mac_words
    from ..measured.gather import gather, result
    from ..measured.measurement import measurements_csv
    from ..measured.shapes import read_shapes, shapes_of, shapes_path, shapes_text

    output, pressure_kPa, terminal = study.output, study.pressure_kPa, study.terminal
    assert output is not None
    if output.resolve() in [path.resolve() for path in files]:
        raise click.UsageError(f"--output {output}: is one of the files to read")
    sigmas = floor / 100, setup.sigma  # relative: smallest, and of one run
    gathered = gather(files, pressure_kPa, setup.layout(), *sigmas, setup.leave_out, keep_going)
    shapes = [each for path in files for each in read_shapes(path)]
    for run in gathered.runs:
        assert pressure_kPa is not None
        shapes += shapes_of(run, pressure_kPa)
    write_text(output, measurements_csv(gathered.rows))
    shapes_path(output).unlink(missing_ok=True)  # those of other measurements
    if shapes:
        write_text(shapes_path(output), shapes_text(shapes))
    alike = [auto_mac(each) for each in shapes]
    if study.pictures and gathered.runs:
        from ..report.figure import save
        from ..report.measured import draw_measured
        from ..report.sensitivities import draw_auto_mac

        kind = study.figure_format
        draw_measured(output.with_suffix(f".{kind}"), gathered.runs)
        save(draw_auto_mac(alike[-1]), output.with_name(f"{output.stem}_mac.{kind}"))
    for note in gathered.notes:
        terminal.note(note)
    if not setup.labels:
        terminal.note("damping is left out with --no-labels: it belongs to a mode")
    for doubt in gathered.doubts:
        terminal.warn(doubt)
    terminal.result({**result(gathered), "auto_mac": alike})
    if gathered.runs:
        from ..report.measured import measured_table

        terminal.show(measured_table(gathered.runs))
        terminal.say("\n".join(map(auto_mac_words, alike)))
    terminal.say(f"{len(gathered.rows)} measurements in {output}")
    return 0


@command.command()
@click.argument("file", metavar="FILE|CASE", type=FileOrFolder(exists=True, folder=False))
@option(
    "--place",
    type=WholeNumber(2, 500),
    metavar="N",
    help="Number of sensors to place on the tread of CASE.",
)
@option(
    "--axes",
    type=OneOf(["r", "rt", "rz", "rtz"]),
    default="rtz",
    show_default=True,
    help="With --place: directions that each sensor measures: radial, tangential, lateral.",
)
@option(
    "--sensor-mass-g",
    "mass_g",
    type=NumberWithin(0, 100),
    default=5.0,
    show_default=True,
    metavar="M",
    help="With --place: mass of a sensor.",
)
@options.every(options.assignments, options.fitted(", with --place"))
@options.every(axle, centre, directions, highest, leave_out)
@options.packed("setup", Setup)
@options.study_one_by_one
def sensors(
    file: Path, place: int | None, axes: str, mass_g: float, setup: Setup, study: options.Study
) -> int:
    """List the modes that the sensors of a universal FILE can distinguish, or place N sensors on
    the tread of CASE.

    Rough data are enough: run it on a first measurement, and move sensors before the others.

    --place: each sensor is put where it adds most to what those before it see of the case's modes,
    up to --highest-harmonic (default: the case's). Writes sensors.json and sensors.csv: the share
    of tests in which 'measured import' labels each mode, drawn with 5 % noise and places 2 mm off,
    and the shift of its frequency by the sensors' mass.

    \b
    tyrecal measured sensors run1.uff --directions cylindrical
    tyrecal measured sensors cases/p235_75r17.yaml --place 8
    """
    terminal, of_test = study.terminal, {"--axle", "--centre", "--directions", "--leave-out"}
    known = {*of_test, "--highest-harmonic", "--json", "--quiet", "--verbose"}
    refused = [o for o in options.given() if (o in of_test if place else o not in known)]
    if refused:
        raise click.UsageError(f"{refused[0]} goes {'without' if place else 'with'} --place")
    if place:
        return _place_sensors(file, place, axes, mass_g / 1e3, setup.highest, study)
    from ..measured.arrangement import arrange
    from ..measured.gather import label_entry
    from ..measured.modal import sensors_in
    from ..measured.universal import read_universal
    from ..report.measured import sensors_words

    layout = setup.layout()
    (test,), notes = arrange([read_universal(file)], setup.leave_out)
    for note in notes:
        terminal.note(note)
    alike_labels = sensors_in(test, layout).looks_like()
    if terminal.as_json:
        similar = [
            {**label_entry(label), "told": not alike, "looks_like": [str(x) for x in alike]}
            for label, alike in alike_labels.items()
        ]
        terminal.result(similar)
    else:
        terminal.say(sensors_words(alike_labels))
    return 0


def _place_sensors(
    case: Path, count: int, axes: str, mass_kg: float, highest: int | None, study: options.Study
) -> int:
    """Place ``count`` sensors for the modes [c,0] and [c,1] of a case."""
    from ..measured.case_modes import evaluate_case_modes
    from ..studies.run_plan import plan_evaluations
    from ..studies.sensors import place

    loaded, values = study.load(case)
    values = study.fitted_values(loaded).get("fitted", values)
    evaluator = study.evaluator(loaded)
    plan = plan_evaluations(loaded, evaluator, [values])
    run = study.run(loaded, "measured sensors", evaluator, "sensors", plan=plan)
    most = loaded.case.analysis.highest_harmonic if highest is None else highest
    every = evaluate_case_modes(loaded, evaluator, values, most)
    modes = sorted((m for m in every.modes if m.label.m < 2), key=lambda m: m.frequency_Hz)
    return study.present(run, place(every, modes, count, axes, mass_kg, seed=0), {})


@command.command("label")
@options.case_argument
@click.argument("file", type=FileOrFolder(exists=True, folder=False))
@options.every(
    options.assignments,
    options.fitted(", within its standard errors"),
    axle,
    centre,
    directions,
    highest,
    band,
    response,
    assumed,
)
@options.packed("setup", Setup)
@options.study
def label_file(case: Path, file: Path, setup: Setup, study: options.Study) -> int:
    """Find the mode of each frequency in FILE by the model of CASE, and its probability.

    FILE: a measurements CSV without labels (c and m), or a universal file as for 'tyrecal measured
    import', measured at the case's pressure. All frequencies are judged together and, where shapes
    were measured (a universal file, or a CSV that was imported from one), with the shapes.

    Writes labels.json, labels.csv, and labelled.csv: the measurements with the likeliest labels.
    Frequencies that are no mode of the tyre are left out. The variables are expected near their
    start values, within a factor of 1.6 (a standard deviation), or near those of --fitted.

    \b
    tyrecal measured label cases/p235_75r17.yaml unlabelled.csv
    tyrecal measured label cases/205_60r15.yaml cases/205_60r15_vervoort.csv --fitted fit.json
    tyrecal measured label cases/p235_75r17.yaml run1.uff --set pressure_kPa=200
    """
    from ..files import read_json
    from ..measured.gather import unlabelled
    from ..measured.measurement import measurements_csv
    from ..measured.shapes import read_shapes
    from ..measured.tables import read_measurements
    from ..measured.universal import is_universal
    from ..report.sensitivities import mac_figures as figures
    from ..report.table import shown
    from ..studies.fit.result import FitResult
    from ..studies.labelling.label import fitted_prior, label
    from ..studies.labelling.result import labels_result
    from ..studies.run_plan import DESIGNS_OF_LABELS, PlannedState, plan_runs

    loaded, values = study.load(case)
    if is_universal(file):
        kPa = loaded.case.pressure_kPa
        readings, shapes, notes = unlabelled(file, kPa, setup.layout(), setup.sigma)
        for note in notes:
            study.terminal.note(note)
    else:
        _refuse_universal_options(file)
        readings, shapes = read_measurements(file, labelled=False), read_shapes(file)
    if not any(each.is_unlabelled for each in readings):
        raise click.UsageError(f"{file}: every frequency has a label")
    prior, fixed = None, dict[str, float]()
    if fitted := study.fitted:
        study.fitted_values(loaded)  # refuses a fit of another tyre
        path = fitted / "fit.json" if fitted.is_dir() else fitted
        fit = FitResult.model_validate(read_json(path))
        fixed, prior = fit.fixed, fitted_prior(loaded, fit)
    evaluator = study.evaluator(loaded)
    states = {each.state.of(loaded) for each in readings if not each.load_N}
    slopes = PlannedState(sensitivities=len(values))
    designs = DESIGNS_OF_LABELS
    plan = plan_runs(loaded, evaluator, [slopes] * len(states), designs, study.jobs, True)
    run = study.run(loaded, "measured label", evaluator, "labels", measured=[file], plan=plan)
    labelled = label(
        loaded, evaluator, readings, prior, fixed=fixed, jobs=study.jobs, shapes=shapes
    )
    written = run.write(labels_result(loaded, labelled))
    run.write_figures(figures(written))
    run.write_text("labelled.csv", measurements_csv(labelled.readings))
    run.finish()
    terminal = study.terminal
    terminal.result(written.content())
    for table in written.tables():
        terminal.show(shown(table))
    terminal.say("\n".join(written.sentences()))
    for doubt in written.doubts():
        terminal.warn(doubt)
    study.finish(run)
    return 0


def _refuse_universal_options(file: Path) -> None:
    """Raises click.UsageError if an option was given that only universal files take."""
    context = click.get_current_context()
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if parameter.name in Setup.__dataclass_fields__ and source is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{parameter.opts[0]}: {file} is a table, not a universal file")
