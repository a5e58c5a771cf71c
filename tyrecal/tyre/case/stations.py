"""Checks of the files that a case names, and the section that is read from its stations or outline.

Files must be in the folder of the case. Mistakes are added to the `Document` of the case file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from ...errors import InputError
from .document import MAX_TABLE_BYTES, Document
from .mistakes import Keys, Mistake, dotted, shortened
from .parts import WRONG, SectionSource
from .shape import table

if TYPE_CHECKING:
    from ..section.section import Section

MIN_RADIUS_MM, MAX_RADIUS_MM = 50, 5000  # outer radius of a tyre


def inside(folder: Path, name: str) -> Path:
    """The path of ``name`` in ``folder``. Raises InputError if it leads outside, also by a link."""
    path = Path(name)
    if not name.strip() or path.is_absolute() or ".." in path.parts:
        raise InputError("must be a path inside the case's folder")
    try:
        if not (folder / path).resolve().is_relative_to(folder.resolve()):
            raise InputError("must not link to a place outside the case's folder")
        (folder / path).exists()
    except (OSError, RuntimeError) as error:
        raise InputError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return folder / path


def check_templates(document: Document, data: dict[str, Any], folder: Path) -> None:
    """Add a mistake to ``document`` if the case names a folder of templates that is not usable."""
    name = data.get("templates")
    if isinstance(name, str):
        try:
            if not inside(folder, name).is_dir():
                document.add(("templates",), "must be a folder, there is none of this name")
        except InputError as error:
            document.add(("templates",), str(error))


def measured_file(document: Document, data: dict[str, Any], folder: Path) -> Path | None:
    """The file of measurements with the case's targets; None if the case names none, or if it is
    not usable, with a mistake added to ``document``."""
    name = table(data, "targets").get("file")
    if not isinstance(name, str):
        return None
    try:
        path = inside(folder, name)
        if not path.is_file():
            raise InputError("must be a file, there is none of this name")
        if path.stat().st_size > MAX_TABLE_BYTES:
            raise InputError(f"the file is larger than {MAX_TABLE_BYTES} bytes")
    except InputError as error:
        document.add(("targets", "file"), str(error))
        return None
    return path


def read_stations(document: Document, data: dict[str, Any], folder: Path) -> Section | None:
    """The section that the case names; None if it is wrong, with mistakes added to ``document``."""
    source = data.get("section")
    source = source if isinstance(source, dict) else {}
    outline = source.get("outline")
    keys: Keys = ("section", "outline", "file") if outline else ("section", "stations")
    name = outline.get("file") if isinstance(outline, dict) else source.get("stations")
    if not isinstance(name, str):
        return None
    try:
        path = inside(folder, name)
        if not path.is_file():
            raise InputError("must be a file, there is none of this name")
        if outline is WRONG or (outline and WRONG in outline.values()):
            return None  # reported by the schema already
        given = {"outline": outline} if outline else {"stations": name}
        section = read_section_of(SectionSource.model_validate(given), folder)
    except ValidationError:  # the schema has reported this already
        return None
    except InputError as error:
        message = shortened(str(error), 300)
        if error.line:
            _, value = document.places.get(keys, (1, name))  # line and text in the case file
            document.mistakes.append(Mistake(str(path), error.line, dotted(keys), value, message))
        else:
            document.add(keys, message)
    except OSError as error:
        document.add(keys, f"cannot be read: {error.strerror}")
    else:
        return section
    return None


def read_section_of(source: SectionSource, folder: Path) -> Section:
    """The section of the part ``section`` of a case. Raises InputError, OSError."""
    from ..section.section import fill_lines, read_section

    path = inside(folder, source.file)
    if path.stat().st_size > MAX_TABLE_BYTES:
        raise InputError(f"the table of the section is larger than {MAX_TABLE_BYTES} bytes")
    given = source.outline
    if not given:
        _check_columns(path)
        section = read_section(path)
        fill_lines(section)  # raises SectionError if its lines cannot be meshed
    else:
        from ..section.outline import read_outline, section_of_outline

        section = section_of_outline(
            read_outline(path),
            given.belt_width_m,
            given.rim_radius_m,
            given.carcass_depth_m,
            given.belt_depth_m,
            given.belt_spacing_m,
            given.belt_step_m,
        )
    _check_section(section)
    return section


def _check_columns(path: Path) -> None:
    """Refuse columns that are not known, because a misspelled one would be ignored. Raises
    InputError."""
    from ..number_table import read_named_table
    from ..section.section import GAUGE, gauged_lines

    header = read_named_table(path).headings
    names = [column[: -len("_r_mm")] for column in header if column[-5:] in ("_r_mm", "_z_mm")]
    known = ["region", "rigid", *(f"{name}_{axis}_mm" for name in names for axis in "rz")]
    known += [f"{name}{GAUGE}" for name in gauged_lines(header)]
    for column in known:
        if column not in header:
            raise InputError(f"column '{shortened(column)}' is missing", 1)
    for column in header:
        if column not in [*known, "station"]:
            raise InputError(f"column '{shortened(column)}' is not known", 1)


def _check_section(section: Section) -> None:
    """Raises SectionError for names, regions, sizes or a rim that no mesh can have."""
    from ..section.section import SectionError

    for name in [*section.names, *(region for region, _ in section.regions)]:
        if not name.isascii() or not name.replace("_", "").replace("-", "").isalnum():
            raise SectionError(
                f"the name '{shortened(name)}' of a line or region must be one word of"
                " letters, digits, - and _"
            )
    for name, count in section.regions:
        if count < 1:
            raise SectionError(f"region '{name}' has no two stations: it needs one more")
    # mm, of the outer surface at the crown; its limits refuse inches, cm and m
    reach = 1e3 * section.points[-1, 0, 0]
    if not MIN_RADIUS_MM < reach < MAX_RADIUS_MM:
        raise SectionError(
            f"the tyre's outer radius is {reach:.3g} mm: r and z must be in mm, and a tyre's radius"
            f" between {MIN_RADIUS_MM} and {MAX_RADIUS_MM} mm"
        )
    if not section.rigid.any():
        raise SectionError("no station is held by the rim, rigid must be 1 somewhere")
