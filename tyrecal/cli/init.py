"""tyrecal init"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError
from . import options
from .terminal import Terminal

if TYPE_CHECKING:
    from ..tyre.case.new_case import Draft

POSITIVE = click.FloatRange(min=0, min_open=True)


def _length(flag: str, text: str, unit: str = "mm") -> Any:
    return click.option(
        f"--{flag}-{unit}",
        f"{flag}_{unit}".replace("-", "_"),
        type=POSITIVE,
        metavar=unit.upper(),
        help=text,
    )


@click.command()
@click.argument("size", required=False)
@click.option(
    "--section",
    "file",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="CSV of your own section: stations, or an outer and an inner curve.",
)
@_length("crown", "Thickness at the crown, grooves spread over the tread.")
@_length("sidewall", "Thickness at the widest point.")
@_length("bead", "Thickness at the rim's flange.")
@_length("belt-width", "Width of the wider belt, along the carcass.")
@_length("rim-width", "Width of the rim between its flanges.", "in")
@click.option(
    "--pressure-kPa",
    "pressure_kPa",
    type=float,
    metavar="P",
    help="Inflation pressure (default: usual for the type of tyre).",
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="CASE.yaml",
    help="Case file to write (default: named by the size, in this folder).",
)
@click.option("--force", is_flag=True, help="Write over files that exist.")
@options.allow_unusual
@click.option("--pictures/--no-pictures", default=True, help="Draw the section.")
@options.talking
def command(
    size: str | None,
    file: Path | None,
    crown_mm: float | None,
    sidewall_mm: float | None,
    bead_mm: float | None,
    belt_width_mm: float | None,
    rim_width_in: float | None,
    pressure_kPa: float | None,
    output: Path | None,
    force: bool,
    allow_unusual: bool,
    pictures: bool,
    terminal: Terminal,
) -> int:
    """Write the case of a tyre: from its SIZE code, or with a section of its own.

    Writes CASE.yaml with comments, its section as CSV and a picture of it. What the size code
    leaves open has usual values by type of tyre; the section is an estimate to start from.

    \b
    tyrecal init 205/60R15
    tyrecal init "LT315/70R17 121/118S" --crown-mm 20 --rim-width-in 9
    tyrecal init P235/75R17 --section my_stations.csv --output my_tyre.yaml
    tyrecal init 205/60R15 --section my_outline.csv --belt-width-mm 160 --output my_outline.yaml
    """
    from ..tyre.case.new_case import from_file, from_size
    from ..tyre.section.size import parse_size
    from ..tyre.usual import ALL_THE_SAME, GAUGES, USUAL
    from ..units import INCH

    if size is None and file is None:
        raise click.UsageError("give a SIZE, as in 'tyrecal init 205/60R15', or --section FILE")
    usual = {**GAUGES, "pressure_kPa": USUAL["pressure_kPa"]}
    stated = click.get_current_context().params
    for name, each in [] if allow_unusual else usual.items():
        if stated[name] is not None and (message := each.refusal(stated[name])):
            option = name.replace("_", "-")
            raise click.UsageError(f"--{option} {stated[name]:g}: {message}{ALL_THE_SAME}")
    tyre = parse_size(size) if size is not None else None
    given = {"crown": crown_mm, "sidewall": sidewall_mm, "bead": bead_mm, "belt": belt_width_mm}
    lengths = {key: 1e-3 * value for key, value in given.items() if value is not None}
    if rim_width_in is not None:
        lengths["rim"] = rim_width_in * INCH
    name = re.sub(r"\W", "_", tyre.text.lower()) if tyre else file.stem if file else ""
    target = output or Path(f"{name}.yaml")
    if target.suffix not in (".yaml", ".yml"):
        raise click.UsageError(f"--output '{target}' must name a case file, as in my_tyre.yaml")
    if file is not None:
        if set(lengths) - {"belt"}:
            raise click.UsageError("with --section the file holds the tyre's shape and thicknesses")
        draft = from_file(file, tyre, lengths.get("belt"), pressure_kPa)
    else:
        assert tyre is not None
        draft = from_size(tyre, lengths, pressure_kPa, target.stem)
    draft.check(allow_unusual)
    _write(draft, file, target, target.with_suffix(".png") if pictures else None, force, terminal)
    return 0


def _write(
    draft: Draft,
    file: Path | None,
    target: Path,
    picture: Path | None,
    force: bool,
    terminal: Terminal,
) -> None:
    """Write case, section and picture, none over an existing file and only what is right."""
    from ..files import whole
    from ..tyre.load import load_case

    table = target.with_name(draft.file)
    own = file is not None and file.resolve() == table.resolve()  # it is there already
    contents = {target: draft.text.encode(), **({} if own else {table: draft.content})}
    for path in [*contents, *([picture] if picture else [])]:
        if path.exists() and not force:
            raise InputError(f"'{path}' exists already; give --force to write over it")
    target.parent.mkdir(parents=True, exist_ok=True)
    for path, content in contents.items():
        with whole(path) as partial:
            partial.write_bytes(content)
    loaded = load_case(target, allow_unusual=True)
    outside = loaded.section.points[-1]
    written = {"case": str(target), "section": str(table)}
    terminal.result({**written, "picture": str(picture) if picture else None})
    terminal.say(
        f"{target}: {loaded.case.name}, outer diameter {2e3 * outside[0, 0]:.1f} mm, section width"
        f" {2e3 * outside[:, 1].max():.1f} mm, {loaded.case.pressure_kPa:g} kPa"
    )
    if picture:
        from ..report.figure import save
        from ..report.section import draw_section
        from ..report.shape_data import section_data
        from ..tyre.resolve import resolved

        section = section_data(loaded, resolved(loaded).mesh, {})
        save(draw_section(section, loaded.case.name, loaded.case.pressure_kPa), picture)
        terminal.say(f"section drawn in {picture}")
    terminal.say(f"next: tyrecal modes {shlex.quote(str(target))}")
