"""The page: folders read, chapters made, templates filled."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.resources import files
from pathlib import Path

import numpy as np
from jinja2 import FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment
from markupsafe import Markup
from matplotlib.figure import Figure

from ...errors import InputError
from ...files import Json, atomic_write, open_file
from ...studies import named, result_types
from ...studies.fit.result import FitResult
from ...studies.footprint import FootprintResult
from ...studies.loaded_result import LoadSweep
from ...studies.modes import ModesResult
from ...studies.pressure_result import PressureSweep
from ...studies.result import Deviation, Named, Result
from ...tyre.case import as_written
from ...units import signed
from ..convergence import draw_convergence, draw_deviations, draw_states
from ..correlation import MAC_WORDS, figures
from ..diagnosis_pictures import MAX_SHOWN, MIN_SHOWN_PROBABILITY, draw_residuals
from ..figure import svg
from ..footprint import draw_curves, draw_patches
from ..load import draw_load_sweep
from ..pressure import draw_pressure_sweep
from ..section import draw_section, draw_section_map
from ..shape_data import Shapes
from ..table import CLOSE, FAR, MINUS, fit_doubts, map_resolution
from .comparison import comparison
from .markdown import html
from .results import Results, RunFacts, read_results
from .shapes import packed
from .summary import sentence, summary, verdict_words

MAX_PAGE_BYTES = 5_000_000
MARK = '<meta name="generator" content="tyrecal report">'


@dataclass(frozen=True)
class Page:
    """A page that was written: bytes, and the commands whose results each folder holds."""

    path: Path
    size: int  # bytes
    found: dict[str, list[str]]  # folder to commands


Draw = Callable[[str, str, str, Callable[[], Figure]], Markup]  # see `_picture`


def write_page(path: Path, folders: Sequence[Path], author: str = "") -> Page:
    """Write the results of ``folders`` as one page that needs no network; author: a name under the
    title. Results of the same runs give the same bytes. Raises InputError; OSError."""
    results = [read_results(folder) for folder in folders]
    _refuse(path)
    try:
        content = page(results, author).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError("a name in the results is no text") from None
    size = len(content)
    if size > MAX_PAGE_BYTES:
        raise InputError(
            f"the page would have {size / 1e6:.1f} MB, more than 5: give fewer folders"
        )
    with atomic_write(path) as partial:
        partial.write_bytes(content)
    studies = {
        str(each.folder): [result_types()[name].command or name for name in each.studies]
        for each in results
    }
    return Page(path, size, studies)


def _refuse(path: Path) -> None:
    """Raises InputError where no page may be written to ``path``; OSError."""
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; give a file with --output")
    try:
        with open_file(path, follow=False) as file:
            ours = MARK.encode() in file.read(2000)
    except FileNotFoundError:
        ours = True
    if not ours:
        raise InputError(f"'{path}' is not a page of tyrecal; give another file with --output")
    if not path.parent.is_dir():
        raise InputError(f"'{path}' cannot be written: there is no folder '{path.parent}'")


def page(results: Sequence[Results], author: str = "") -> str:
    """The page as text; author: a name under the title. Raises InputError."""
    chapters = [chapter(each, f"f{k}-") for k, each in enumerate(results, 1)]
    names = list(dict.fromkeys(each.case for each in results))
    template = environment().get_template("page.html.j2")
    return template.render(
        mark=Markup(MARK),
        title=" and ".join(names),
        author=author,
        date=max(run.started[:10] for each in results for run in [*each.runs.values(), RunFacts()]),
        chapters=chapters,
        comparison=comparison(results),
        close=CLOSE,
        far=FAR,
    )


def chapter(results: Results, prefix: str) -> Json:
    """Values of the templates for one folder's results."""
    draw = partial(_picture, results, prefix)
    shapes = [
        _shapes(results, what, shapes, table) for what, shapes, table in _shown_modes(results)
    ]
    return {
        "prefix": prefix,
        "folder": results.folder.resolve().name,
        "case": results.case,
        "of": list(results.provenances.items()),
        "mixed": len({each.tyre_sha256 for each in results.provenances.values()}) > 1,
        "stale": [
            study
            for study, run in results.runs.items()
            if study in results.provenances and not run.finished
        ],
        "absent": [
            kind.command or name
            for name, kind in result_types().items()
            if name not in results.studies and not kind.is_seldom
        ],
        "studies": [_study(results, each, draw) for each in results.studies.values()],
        "shapes": shapes,
        "section": _section(results, draw),
        "diagnosis": results.diagnosis and _diagnosis(results, draw),
        "fit": results.fit,
        "history": results.history,
        "sets": results.fit_shapes.variables if results.fit_shapes else {},
        "patches": results.patches,
    }


def _study(results: Results, result: Result, draw: Draw) -> Json:
    """Words, pictures and tables that every study has."""
    doubts = fit_doubts(result.content()) if isinstance(result, FitResult) else result.doubts()
    pictures = list(_pictures(results, result, draw))
    with _lists_of(results.folder / f"{result.stem}.json"):
        return {
            "id": result.study,
            "run": results.runs.get(result.study, RunFacts()),
            "heading": result.heading,
            "summary": summary(result),
            "doubts": doubts,
            "sentences": [*map(sentence, result.sentences())],
            "pictures": pictures,
            "tables": result.tables(),
            "numbers": result.numbers(),
        }


def _pictures(results: Results, result: Result, draw: Draw) -> Iterator[Markup]:
    """The figures of a study, each with words for who does not see it."""
    fit, file = results.fit, f"{result.stem}.json"
    if isinstance(result, FitResult):
        if result.modes and not result.states:
            words = "Frequencies over their targets before and after the fit"
            yield draw("deviations", words, file, partial(draw_deviations, result.modes))
        if result.states:
            words = "Deviations from the targets after the fit, states side by side"
            yield draw("states", words, file, partial(draw_states, result))
        if results.history:
            words = "The objective and the variables, design point by design point"
            plot = partial(draw_convergence, results.history, result.objective_unit)
            yield draw("convergence", words, "fit_history.csv", plot)
        matrices = figures(result)
        for name in matrices:
            yield draw(name, MAC_WORDS, file, partial(matrices.__getitem__, name))
    elif isinstance(result, PressureSweep):
        targets = fit.over_pressure() if fit else []
        plot = partial(draw_pressure_sweep, result.rows, targets)
        yield draw("pressure", "Frequencies over the pressure", file, plot)
    elif isinstance(result, LoadSweep):
        plot = partial(draw_load_sweep, result.rows)
        yield draw("load", "Frequencies over the load", file, plot)
    elif isinstance(result, FootprintResult):
        known = {(row.design, row.load_N) for row in result.rows}
        patches = results.patches.patches if results.patches else []
        patches = [each for each in patches if (each.design, each.load_N) in known]
        words = "Contact area, deflection, stiffness and mean contact pressure over the load"
        yield draw("curves", words, file, partial(draw_curves, result.rows))
        highest = max((row.peak_pressure_Pa for row in result.rows), default=0.0) / 1e3
        for design in dict.fromkeys(patch.design for patch in patches):
            own = [patch for patch in patches if patch.design == design]
            plot = partial(draw_patches, own, highest)
            words = f"Contact pressure, {design}"
            yield draw(f"patches-{design}", words, "footprint_patches.json", plot)
    elif result.figures:
        plots = named(result.figures)(result)
        for name in plots:
            yield draw(name, result.heading, file, partial(plots.__getitem__, name))


def _picture(
    results: Results, prefix: str, name: str, words: str, file: str, draw: Callable[[], Figure]
) -> Markup:
    """A figure of the contents of ``file``, described in words. Raises InputError."""
    with _lists_of(results.folder / file):
        return svg(draw(), words, f"{prefix}{name}")


def _shapes(results: Results, what: str, shapes: Shapes | None, table: Sequence[Named]) -> Json:
    """The viewer's data, or why there are none."""
    why = ""
    if shapes is None:
        why = f"The mode shapes are not in this folder; 'tyrecal {what} --report' keeps them."
    elif not shapes.are_of(table):
        why, shapes = "The mode shapes in this folder are from another run: not shown.", None
    elif not shapes.modes:
        why = "This solver gives shapes on the crown only, so there is no section to revolve."
    data = None
    with _lists_of(results.folder / f"{what}_shapes.json"):
        if shapes and shapes.modes:
            data = packed(shapes)
    heading = {"fit": "Shapes of the fitted tyre", "modes": "Mode shapes"}[what]
    if what == "modes" and _is_initial(results):
        heading = "Mode shapes of the initial tyre"
    if shapes and shapes.load_N:
        heading += f" under {shapes.load_N:g} N, on the tread"
    if shapes and shapes.provenance and shapes.provenance.overrides:
        given = shapes.provenance.overrides.items()
        changes = (f"{name} = {as_written(value)}" for name, value in given)
        heading += f", with {', '.join(changes)}"
    return {"id": what, "heading": heading, "data": data, "why": why}


def _is_initial(results: Results) -> bool:
    """Whether the modes are those of the design that the fit started from."""
    fit, modes = results.fit, results.get(ModesResult)
    if not fit or not modes:
        return False
    start = {name: each.initial for name, each in fit.variables.items()} | fit.fixed
    return modes.variables == start


def _shown_modes(results: Results) -> Iterator[tuple[str, Shapes | None, Sequence[Named]]]:
    """For each study whose modes are shown: its name, shapes, and the table's modes."""
    if fit := results.fit:
        yield "fit", results.fit_shapes, fit.of_first_state
    if modes := results.get(ModesResult):
        yield "modes", results.modes_shapes, modes.modes


def _section(results: Results, draw: Draw) -> Markup | None:
    """The section of the fitted tyre, or of that whose modes are known."""
    for what, shapes, table in _shown_modes(results):
        if shapes and shapes.section and shapes.are_of(table):
            plot = partial(draw_section, shapes.section, shapes.case, shapes.pressure_kPa)
            return draw("section", "The section", f"{what}_shapes.json", plot)
    return None


def _diagnosis(results: Results, draw: Draw) -> Json:
    d = results.diagnosis
    assert d
    place, drawn = results.diagnosis_section, None
    if place and d.section_map:
        words = "Parts of the section by the evidence for a change of them alone"
        drawing = partial(draw_section_map, place, d.section_map)
        drawn = draw("map", words, "diagnosis_section.json", drawing)
    known = [(row, each) for each in d.gap.residuals if not each.run and (row := each.of)]
    percent = np.array([[each.percent, each.sigma_percent] for _, each in known]).T / 100
    return {
        "of": d,
        "verdict": verdict_words(d),
        "likeliest": [
            (key, p)
            for key, p in list(d.probabilities.items())[:MAX_SHOWN]
            if p >= MIN_SHOWN_PROBABILITY or key in ("none", "outside")
        ],
        "words": html(results.diagnosis_words),
        "map": drawn,
        "residuals": draw(
            "residuals",
            "What calibration leaves of each measurement",
            "diagnosis.json",
            partial(draw_residuals, [row for row, _ in known], *percent),
        )
        if known
        else None,
    }


@contextmanager
def _lists_of(path: Path) -> Iterator[None]:
    """Raises InputError where lists of the file that belong together differ in length."""
    try:
        yield
    except (ValueError, IndexError, TypeError):
        raise InputError(f"'{path}' is damaged: its lists do not go together") from None


def _range(value: float | list[float]) -> str:
    """A number, or the ends of several."""
    values = value if isinstance(value, list) else [value]
    ends = dict.fromkeys(f"{each:.6g}" for each in (min(values), max(values))) if values else ()
    return " to ".join(ends)


@lru_cache(maxsize=1)
def environment() -> ImmutableSandboxedEnvironment:
    """The sandbox of the page's templates: what comes from files is escaped."""
    made = ImmutableSandboxedEnvironment(
        loader=FileSystemLoader(str(files("tyrecal_templates") / "report")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["fixed"] = lambda value, digits: f"{value:.{digits}f}".replace("-", MINUS)
    made.filters["signed"] = lambda value, digits: signed(value, digits).replace("-", MINUS)
    made.filters["digits"] = lambda value, count: f"{value:.{count}g}"
    made.filters["range"] = _range
    made.tests["deviation"] = lambda cell: isinstance(cell, Deviation)
    made.globals["map_resolution"] = map_resolution
    return made
