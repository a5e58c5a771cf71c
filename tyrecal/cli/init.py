"""tyrecal init"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from ..errors import InputError
from . import options
from .parameters import FileOrFolder, Number, NumberWithin, OneOf, option
from .terminal import Terminal

if TYPE_CHECKING:
    from ..tyre.case.new_case import Draft
    from ..tyre.own_deck.own_deck import OwnDeck
    from ..tyre.own_deck.own_decks import OwnDecks

POSITIVE = NumberWithin(min=0, min_open=True)


def _length(flag: str, text: str, unit: str = "mm") -> Any:
    """The option for a length of the section in ``unit``."""
    return option(
        f"--{flag}-{unit}",
        f"{flag}_{unit}".replace("-", "_"),
        type=POSITIVE,
        metavar=unit.upper(),
        help=text,
    )


@dataclass(frozen=True)
class DeckFiles:
    """Your own decks, and how they are read."""

    files: tuple[Path, ...]
    crown_set: str | None
    units: Literal["m", "mm"] | None
    assigned: tuple[str, ...]  # of --set, numbers of marks


@dataclass(frozen=True)
class Lengths:
    """Lengths of a section that differ from the usual ones."""

    crown_mm: float | None
    sidewall_mm: float | None
    bead_mm: float | None
    belt_width_mm: float | None
    rim_width_in: float | None

    def in_m(self) -> dict[str, float]:
        """The given ones, m, by their names in `Gauges`."""
        from ..units import INCH

        lengths = {
            "crown": (self.crown_mm, 1e-3),
            "sidewall": (self.sidewall_mm, 1e-3),
            "bead": (self.bead_mm, 1e-3),
            "belt": (self.belt_width_mm, 1e-3),
            "rim": (self.rim_width_in, INCH),
        }
        return {name: value * unit for name, (value, unit) in lengths.items() if value is not None}


@click.command()
@click.argument("size", required=False)
@option(
    "--section",
    "file",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="CSV of your own section: stations, or an outer and an inner curve.",
)
@option(
    "--deck",
    "files",
    type=FileOrFolder(exists=True, folder=False),
    multiple=True,
    metavar="FILE.inp",
    help="ABAQUS deck of your axisymmetric section, or those of your tyre in three dimensions in"
    " the order of their runs, each with --deck.",
)
@option(
    "--crown-set",
    metavar="NSET",
    help="Node set round the tyre, for decks in three dimensions (default: CROWN).",
)
@option(
    "--units",
    type=OneOf(["m", "mm"]),
    help="Units of the deck: m, kg, s, Pa, or mm, t, s, MPa (default: inferred from its"
    " densities).",
)
@option(
    "--set",
    "assigned",
    multiple=True,
    metavar="NAME=VALUE",
    help="Number of a mark {{ NAME }} of the deck, in the deck's units; repeatable.",
)
@_length("crown", "Thickness at the crown, grooves spread over the tread.")
@_length("sidewall", "Thickness at the widest point.")
@_length("bead", "Thickness at the rim's flange.")
@_length("belt-width", "Width of the wider belt, along the carcass.")
@_length("rim-width", "Width of the rim between its flanges.", "in")
@option(
    "--pressure-kPa",
    "pressure_kPa",
    type=Number(),
    metavar="P",
    help="Inflation pressure (default: usual for the type of tyre).",
)
@option(
    "--output",
    type=FileOrFolder(),
    metavar="CASE.yaml",
    help="Case file to write (default: named by the size, in this folder).",
)
@option("--force", is_flag=True, help="Write over files that exist.")
@options.allow_unusual
@option("--pictures/--no-pictures", default=True, help="Draw the section.")
@options.figure_format
@options.packed("deck", DeckFiles)
@options.packed("gauges", Lengths)
@options.with_study
def command(
    size: str | None,
    file: Path | None,
    deck: DeckFiles,
    gauges: Lengths,
    force: bool,
    study: options.Study,
) -> int:
    """Write the case of a tyre: from its SIZE code, your section or your deck.

    Writes CASE.yaml with comments, its section as CSV and a picture of it. With case.schema.json
    next to them, editors complete and explain the keys. Values that the size code does not give
    are usual ones for the type of tyre. The section is an estimate to start from.

    \b
    tyrecal init 205/60R15
    tyrecal init "LT315/70R17 121/118S" --crown-mm 20 --rim-width-in 9
    tyrecal init P235/75R17 --section my_stations.csv --output my_tyre.yaml
    tyrecal init 205/60R15 --section my_outline.csv --belt-width-mm 160 --output my_outline.yaml
    tyrecal init --deck my_tyre.inp
    tyrecal init --deck my_marked_tyre.inp --set A_belt=0.21
    tyrecal init --deck inflate.inp --deck modes.inp --crown-set TREAD_LINE
    """
    from ..tyre.case.new_case import from_file, from_size
    from ..tyre.own_deck.own_deck import read_own_deck
    from ..tyre.own_deck.own_decks import read_own_decks, stands_in_space
    from ..tyre.section.size import parse_size
    from ..tyre.usual import ALL_THE_SAME, GAUGES, USUAL

    terminal, pressure_kPa, allow_unusual = study.terminal, study.pressure_kPa, study.allow_unusual
    if size is None and file is None and not deck.files:
        raise click.UsageError(
            "give a SIZE, as in 'tyrecal init 205/60R15', --section FILE or --deck FILE.inp"
        )
    of_decks = {"units": deck.units, "crown-set": deck.crown_set, "set": deck.assigned}
    for flag, value in of_decks.items():
        if value and not deck.files:
            raise click.UsageError(f"--{flag} goes with --deck")
    usual = {**GAUGES, "pressure_kPa": USUAL["pressure_kPa"]}
    stated = click.get_current_context().params
    for name, each in [] if allow_unusual else usual.items():
        if stated[name] is not None and (message := each.refusal(stated[name])):
            option = name.replace("_", "-")
            raise click.UsageError(f"--{option} {stated[name]:g}: {message}{ALL_THE_SAME}")
    suffix = f".{study.figure_format}" if study.pictures else ""
    lengths = gauges.in_m()
    tyre = parse_size(size) if size is not None else None
    if deck.files:
        if file or lengths:
            raise click.UsageError("with --deck the file holds the tyre's shape and thicknesses")
        words = tyre.text if tyre else "not given"
        read = read_own_deck(deck.files[0], deck.units)
        if len(deck.files) > 1 or stands_in_space(read):
            decks = read_own_decks(deck.files, read.units, deck.crown_set or "CROWN")
            numbers = _numbers_of_marks(decks, deck.assigned)
            new = NewFiles(study.output, "", force)
            _from_decks(decks, numbers, words, pressure_kPa, new, terminal)
        elif deck.crown_set:
            raise click.UsageError("--crown-set is for decks in three dimensions")
        else:
            numbers = _numbers_of_marks(read, deck.assigned)
            new = NewFiles(study.output, suffix, force)
            _from_deck(read, numbers, words, pressure_kPa, new, allow_unusual, terminal)
        return 0
    name = re.sub(r"\W", "_", tyre.text.lower()) if tyre else file.stem if file else ""
    target = study.output or Path(f"{name}.yaml")
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
    _write(draft, file, target, target.with_suffix(suffix) if suffix else None, force, terminal)
    return 0


def _write(
    draft: Draft,
    file: Path | None,
    target: Path,
    picture: Path | None,
    force: bool,
    terminal: Terminal,
) -> None:
    """Write the checked draft's case, section (m) and schema, and draw it. Raises InputError if a
    file exists and ``force`` is not given."""
    from ..files import atomic_write, make_folder
    from ..tyre.case.editor import SCHEMA_FILE, case_schema
    from ..tyre.load import load_case

    table = target.with_name(draft.file)
    in_place = file is not None and file.resolve() == table.resolve()
    contents = {target: draft.text.encode(), **({} if in_place else {table: draft.content})}
    for path in [*contents, *([picture] if picture else [])]:
        if path.exists() and not force:
            raise InputError(f"'{path}' exists already; give --force to write over it")
    make_folder(target.parent)
    contents[target.with_name(SCHEMA_FILE)] = case_schema().encode()
    for path, content in contents.items():
        with atomic_write(path) as partial:
            partial.write_bytes(content)
    loaded = load_case(target, allow_unusual=True)
    outside = loaded.section.points[-1]  # (stations, 2): r, z, m, of the outermost line
    written = {"case": str(target), "section": str(table)}
    terminal.result({**written, "picture": str(picture) if picture else None})
    terminal.say(
        f"{target}: {loaded.case.name}, outer diameter {2e3 * outside[0, 0]:.1f} mm, section width"
        f" {2e3 * outside[:, 1].max():.1f} mm, {loaded.case.pressure_kPa:g} kPa"
    )
    if picture:
        _draw(loaded, picture, terminal)
    terminal.say(f"next: {_modes(target)}")


def _modes(case: Path) -> str:
    """The command that computes the modes of a case."""
    from ..simulate.program import join_command

    return join_command(["tyrecal", "modes", str(case)])


def _draw(loaded: Any, picture: Path, terminal: Terminal) -> None:
    """Draw the section of a new case."""
    from ..report.figure import save
    from ..report.section import draw_section
    from ..report.shape_data import section_data
    from ..tyre.resolve import resolved

    section = section_data(loaded, resolved(loaded).mesh, {})
    save(draw_section(section, loaded.case.name, loaded.case.pressure_kPa), picture)
    terminal.say(f"section drawn in {picture}")


def _numbers_of_marks(deck: OwnDeck | OwnDecks, assigned: tuple[str, ...]) -> dict[str, float]:
    """Numbers of marks by --set. Raises UsageError; InputError if a mark has no number."""
    from ..tyre.case import parse_assignment

    try:
        given = dict(parse_assignment(text) for text in assigned)
    except InputError as error:
        raise click.UsageError(f"--set: {error}") from None
    for name in given.keys() - deck.marks.keys():
        known = ", ".join(deck.marks) or "none"
        raise click.UsageError(f"--set {name}: the deck has no mark of this name, but {known}")
    lacking = [name for name in deck.marks if name not in given]
    if lacking:
        places = ", ".join(f"{{{{ {name} }}}} ({deck.marks[name].place})" for name in lacking)
        example = " ".join(f"--set {name}=VALUE" for name in lacking)
        raise InputError(f"marks without a number: {places}; give each: {example}")
    return given


@dataclass(frozen=True)
class NewFiles:
    """Where the case of a deck and its picture are written."""

    output: Path | None  # of the case; None: next to the deck
    suffix: str  # of the picture; "": none
    force: bool  # write over files that exist

    def of_deck(self, file: Path) -> tuple[Path, Path | None]:
        """Paths of the case of a deck, and of its picture. Raises InputError, UsageError."""
        target = self.output or file.with_suffix(".yaml")
        if target.resolve().parent != file.resolve().parent:
            raise click.UsageError(f"--output '{target}': the case must be in its deck's folder")
        picture = target.with_suffix(self.suffix) if self.suffix else None
        for path in [target, *([picture] if picture else [])]:
            if path.exists() and not self.force:
                raise InputError(f"'{path}' exists already; give --force to write over it")
        return target, picture


def _from_deck(
    deck: OwnDeck,
    numbers: dict[str, float],
    size: str,
    pressure_kPa: float | None,
    new: NewFiles,
    allow_unusual: bool,
    terminal: Terminal,
) -> None:
    """Write the case of a deck next to it, print what is in the deck, and draw it."""
    from ..files import write_text
    from ..tyre.case.editor import SCHEMA_FILE, case_schema
    from ..tyre.case.kinds.section_deck import trial
    from ..tyre.case.own_case import own_case
    from ..tyre.load import load_case
    from ..tyre.own_deck.summary import contents, words
    from ..tyre.usual_deck import deck_slips

    flat = deck.flat(numbers)
    if not allow_unusual and (slips := list(deck_slips(deck, {**deck.numbers, **numbers}))):
        raise InputError("\n".join(map(str, slips)))
    text = own_case(deck, flat, size, pressure_kPa, numbers)
    target, picture = new.of_deck(deck.path)
    mass_kg = trial(flat)
    write_text(target, text)
    write_text(target.with_name(SCHEMA_FILE), case_schema())
    content = contents(deck, flat)
    terminal.result({"case": str(target), "mass_kg": mass_kg, **content})
    for sentence in words(content, mass_kg):
        terminal.say(sentence)
    loaded = load_case(target, allow_unusual=True)
    if picture:
        _draw(loaded, picture, terminal)
    terminal.say(f"next: {_modes(target)}")


def _from_decks(
    decks: OwnDecks,
    numbers: dict[str, float],
    size: str,
    pressure_kPa: float | None,
    new: NewFiles,
    terminal: Terminal,
) -> None:
    """Write the case of decks in three dimensions next to them, and print what is known of them."""
    from ..files import write_text
    from ..tyre.case.editor import SCHEMA_FILE, case_schema
    from ..tyre.case.own_case import own_decks_case
    from ..tyre.load import load_case
    from .deck import describe_decks

    text = own_decks_case(decks, size, pressure_kPa, numbers)
    target, _ = new.of_deck(decks.path)
    write_text(target, text)
    write_text(target.with_name(SCHEMA_FILE), case_schema())
    loaded = load_case(target, allow_unusual=True)
    terminal.result({"case": str(target), **describe_decks(loaded, decks, terminal)})
    terminal.say(f"next: {_modes(target)} --solver abaqus")
