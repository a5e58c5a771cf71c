"""The page: folders read, chapters made, templates filled."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment
from markupsafe import Markup
from matplotlib.figure import Figure

from ...diagnose.where import Place
from ...errors import InputError
from ...files import open_file, whole
from ...modes.mode import Label
from ...studies.result import Named
from ..convergence import draw_convergence, draw_deviations
from ..diagnosis_pictures import draw_residuals
from ..figure import svg
from ..footprint import draw_curves, draw_patches
from ..load import draw_load_sweep
from ..pressure import draw_pressure_sweep
from ..section import draw_section, draw_section_map
from ..shape_data import Patch, Shapes
from ..table import FOOTPRINT, QUANTITIES, percent
from ..words import CLOSE, FAR, MINUS, map_resolution, motion
from .comparison import comparison
from .contents import Effects, LoadSweep, PressureRow
from .markdown import html
from .results import Results, read_results
from .shapes import packed
from .summary import VERDICTS, design_words, summary

LARGEST = 5_000_000  # bytes of a page
SHOWN, LEAST = 12, 0.005  # explanations, and the probability below which one is not shown
MARK = '<meta name="generator" content="tyrecal report">'
STUDIES = {
    "fit": "fit",
    "modes": "modes",
    "pressure": "sweep-pressure",
    "footprint": "footprint",
    "effects": "effects",
    "load": "modes --sweep-load",
    "diagnosis": "diagnose",
}


@dataclass(frozen=True)
class Page:
    """A page that was written: bytes, and the commands whose results each folder holds."""

    path: Path
    size: int
    found: dict[str, list[str]]


Draw = Callable[[str, str, str, Callable[[], Figure]], Markup]  # see `_picture`


def write_page(path: Path, folders: Sequence[Path]) -> Page:
    """Write the results of ``folders`` as one page that needs no network. The same results give
    the same bytes. Raises InputError; OSError."""
    results = [read_results(folder) for folder in folders]
    try:
        content = page(results).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError("a name in the results is no text") from None
    size = len(content)
    if size > LARGEST:
        raise InputError(
            f"the page would have {size / 1e6:.1f} MB, more than 5: give fewer folders"
        )
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; give a file with --output")
    try:
        with open_file(path, follow=False) as file:
            ours = MARK.encode() in file.read(2000)
    except FileNotFoundError:
        ours = True
    if not ours:
        raise InputError(f"'{path}' is no page of tyrecal's; give another file with --output")
    with whole(path) as partial:
        partial.write_bytes(content)
    found = {str(each.folder): _commands(each) for each in results}
    return Page(path, size, found)


def page(results: Sequence[Results]) -> str:
    """The page as text. Raises InputError."""
    chapters = [chapter(each, f"f{k}-") for k, each in enumerate(results, 1)]
    names = list(dict.fromkeys(each.case for each in results))
    template = environment().get_template("page.html.j2")
    return template.render(
        mark=Markup(MARK),
        title=" and ".join(names),
        chapters=chapters,
        comparison=comparison(results),
        close=CLOSE,
        far=FAR,
    )


def chapter(found: Results, prefix: str) -> dict[str, Any]:
    """What the templates ask of one folder's results."""
    shapes = []
    if found.fit:
        shapes.append(_shapes(found, "fit", found.fit_shapes, found.fit.modes))
    if found.modes:
        shapes.append(_shapes(found, "modes", found.modes_shapes, found.modes.modes))
    draw = partial(_picture, found, prefix)
    return {
        "prefix": prefix,
        "folder": found.folder.resolve().name,
        "case": found.case,
        "told": summary(found),
        "of": list(found.provenances.items()),
        "mixed": len({each.tyre_sha256 for each in found.provenances.values()}) > 1,
        "stale": [
            study
            for study, run in found.runs.items()
            if study in found.provenances and not run.finished
        ],
        "absent": [name for key, name in STUDIES.items() if not getattr(found, key)],
        "fit": found.fit and _fit(found, draw),
        "shapes": shapes,
        "section": _section(found, draw),
        "modes": found.modes,
        "pressure": found.pressure and _pressure(found, draw),
        "load": found.load and _load(found.load, draw),
        "footprint": found.footprint and _footprint(found, draw),
        "effects": found.effects and _effects(found.effects),
        "diagnosis": found.diagnosis and _diagnosis(found, draw),
    }


def _effects(found: Effects) -> dict[str, Any]:
    """One row an effect, at the pressure in the middle."""
    first = found.entries[0].rows
    middle = first[len(first) // 2].pressure_kPa
    labels = list(
        dict.fromkeys(
            (m.c, m.m, m.kind) for each in found.entries for row in each.rows for m in row.modes
        )
    )
    rows = []
    for each in found.entries:
        modes = [m for row in each.rows if row.pressure_kPa == middle for m in row.modes]
        known = {(m.c, m.m, m.kind): (m.before_percent, m.after_percent) for m in modes}
        rows.append((each, [known.get(label, (None, None)) for label in labels]))
    names = [Label(*label).said for label in labels]
    return {"pressure_kPa": middle, "names": names, "rows": rows}


def _picture(
    found: Results, prefix: str, name: str, words: str, file: str, draw: Callable[[], Figure]
) -> Markup:
    """A figure of what stands in ``file``, told in words. Raises InputError."""
    with _lists_of(found.folder / file):
        return svg(draw(), words, f"{prefix}{name}")


def _shapes(
    found: Results, what: str, shapes: Shapes | None, table: Sequence[Named]
) -> dict[str, Any]:
    """The viewer's data, or why there are none."""
    why = ""
    if shapes is None:
        why = f"The mode shapes are not in this folder; 'tyrecal {what} --report' keeps them."
    elif not shapes.of(table):
        why, shapes = "The mode shapes in this folder are those of another run: not shown.", None
    elif not shapes.modes:
        why = "This solver gives shapes on the crown alone, so there is no section to revolve."
    data = None
    with _lists_of(found.folder / f"{what}_shapes.json"):
        if shapes and shapes.modes:
            data = packed(shapes)
    heading = {"fit": "Shapes of the fitted tyre", "modes": "Mode shapes"}[what]
    if shapes and shapes.load_N:
        heading = f"Mode shapes under {shapes.load_N:g} N, on the tread"
    if shapes and shapes.provenance and shapes.provenance.overrides:
        changes = (f"{name} = {value:g}" for name, value in shapes.provenance.overrides.items())
        heading += f", with {', '.join(changes)}"
    return {"id": what, "heading": heading, "data": data, "why": why}


def _section(found: Results, draw: Draw) -> Markup | None:
    """The section of the fitted tyre, or of that whose modes are known."""
    for what, shapes, result in (
        ("fit", found.fit_shapes, found.fit),
        ("modes", found.modes_shapes, found.modes),
    ):
        if shapes and shapes.section and result and shapes.of(result.modes):
            args = shapes.section, shapes.case, shapes.pressure_kPa
            file = f"{what}_shapes.json"
            return draw("section", "The section", file, partial(draw_section, *args))
    return None


def _fit(found: Results, draw: Draw) -> dict[str, Any]:
    fit, history = found.fit, found.history
    assert fit
    modes = [mode.model_dump() for mode in fit.modes]
    convergence = partial(draw_convergence, history, fit.objective_unit)
    words = "The objective and the variables, design point by design point"
    return {
        "of": fit,
        "sets": found.fit_shapes.variables if found.fit_shapes else {},
        "deviations": draw(
            "deviations",
            "Frequencies over their targets before and after the fit",
            "fit.json",
            partial(draw_deviations, modes),
        )
        if modes
        else None,
        "convergence": draw("convergence", words, "fit_history.csv", convergence)
        if history
        else None,
        "quantities": QUANTITIES,
    }


def _pressure(found: Results, draw: Draw) -> dict[str, Any]:
    assert found.pressure
    fit, rows = found.fit, found.pressure.rows
    targets = {m.label: m.target_Hz for m in fit.modes} if fit else {}
    told = found.pressure.model_dump()["rows"]
    sweep = partial(draw_pressure_sweep, told, targets, fit.pressure_kPa if fit else 0.0)
    return {
        "picture": draw("pressure", "Frequencies over the pressure", "pressure_sweep.json", sweep),
        "words": design_words(found.pressure),
        "tables": _tables(rows),
    }


def _load(found: LoadSweep, draw: Draw) -> dict[str, Any]:
    sweep = partial(draw_load_sweep, found.model_dump()["rows"])
    return {
        "rows": found.rows,
        "words": design_words(found),
        "picture": draw("load", "Frequencies over the load", "load_sweep.json", sweep),
    }


def _tables(rows: Sequence[PressureRow]) -> list[dict[str, Any]]:
    """A table a design: modes by rows, frequencies at each pressure by columns."""
    tables = []
    for design in dict.fromkeys(row.design for row in rows):
        own = [row for row in rows if row.design == design]
        found: dict[str, list[float | None]] = {}
        for k, row in enumerate(own):
            for mode in row.modes:
                found.setdefault(mode.label.said, [None] * len(own))[k] = mode.frequency_Hz
        columns = [row.pressure_kPa for row in own]
        tables.append({"design": design, "columns": columns, "rows": found})
    return tables


def _footprint(found: Results, draw: Draw) -> dict[str, Any]:
    assert found.footprint
    rows = found.footprint.rows
    known = {(row.design, row.load_N) for row in rows}
    designs: dict[str, list[Patch]] = {}
    for patch in found.patches.patches if found.patches else []:
        if (patch.design, patch.load_N) in known:
            designs.setdefault(patch.design, []).append(patch)
    highest = max(row.peak_pressure_Pa for row in rows) / 1e3
    return {
        "rows": rows,
        "columns": FOOTPRINT,
        "curves": draw(
            "curves",
            "Contact area, deflection, stiffness and mean contact pressure over the load",
            "footprint.json",
            partial(draw_curves, found.footprint.model_dump()["rows"]),
        ),
        "patches": [
            draw(
                f"patches-{k}",
                f"Contact pressure, {design}",
                "footprint_patches.json",
                partial(draw_patches, patches, highest),
            )
            for k, (design, patches) in enumerate(designs.items())
        ],
    }


def _diagnosis(found: Results, draw: Draw) -> dict[str, Any]:
    d = found.diagnosis
    assert d
    place, drawn = found.diagnosis_section, None
    if place and d.section_map:
        told = "Parts of the section by the evidence for a change of them alone"
        places = [Place(**region.model_dump()) for region in d.section_map]
        drawing = partial(draw_section_map, place, places)
        drawn = draw("map", told, "diagnosis_section.json", drawing)
    known = [(row, each) for each in d.gap.residuals if not each.run and (row := each.of)]
    percent = np.array([[each.percent, each.sigma_percent] for _, each in known]).T / 100
    return {
        "of": d,
        "verdict": VERDICTS[d.verdict],
        "likeliest": [
            (key, p)
            for key, p in list(d.probabilities.items())[:SHOWN]
            if p >= LEAST or key in ("none", "outside")
        ],
        "words": html(found.diagnosis_words),
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


def _commands(found: Results) -> list[str]:
    return [name for key, name in STUDIES.items() if getattr(found, key)]


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
    made.filters["signed"] = lambda value, digits: f"{value:+.{digits}f}".replace("-", MINUS)
    made.filters["digits"] = lambda value, count: f"{value:.{count}g}"
    made.filters["percent"] = percent
    made.filters["range"] = _range
    made.globals["map_resolution"] = map_resolution
    made.filters["motion"] = lambda mode: motion(mode.c, mode.m, mode.kind)
    made.filters["label"] = lambda mode: mode.label.said
    return made
