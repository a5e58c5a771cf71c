"""Cases of other tyres, ready to be written: from a size code, or with a section of one's own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...errors import InputError
from ...files import read_bytes
from ...units import INCH
from ..load import validate
from ..number_table import read_named_table
from ..section.construction import PASSENGER, TRUCK
from ..section.from_size import BELOW, build, construction, usual
from ..section.section import Section, SectionError
from ..section.size import TyreSize
from .case_text import NewCase
from .made_of import ConstructionParts, constructed, one_rubber
from .parts import Outline, SectionSource
from .stations import read_section_of

FLANGE = 17.3e-3  # m, height of the rim's flange, contour J of ETRTO
PRESSURE_KPA = 250.0  # where no size code gives one
LOAD_SHARES = (0.25, 0.5, 0.75, 1.0, 1.25)  # of the size code's load
MAX_USUAL_LOAD_N = 6e4  # the largest load that `validate` does not call unusual


@dataclass(frozen=True)
class Draft:
    """A case's text and the file that its section is in: name next to the case, and content."""

    text: str
    file: str
    content: bytes

    def check(self, allow_unusual: bool = False) -> None:
        """Raises InputError where the case is not right, a mistake a line."""
        with TemporaryDirectory() as folder:
            Path(folder, self.file).write_bytes(self.content)
            path = Path(folder, "case.yaml")
            path.write_text(self.text, encoding="utf-8")
            mistakes = validate(path, allow_unusual)
        if mistakes:
            raise InputError("\n".join(f"{m.key} is {m.value}: {m.message}" for m in mistakes))


def from_size(
    size: TyreSize, lengths: Mapping[str, float], pressure_kPa: float | None, stem: str
) -> Draft:
    """A case with a section built from a size; ``lengths``: fields of Gauges that differ from the
    usual, m; pressure_kPa None: the size's; ``stem``: name of the section's file, without .csv.
    Raises InputError."""
    try:
        gauges = replace(usual(size, lengths.get("rim")), **lengths)
        table = build(size, gauges)
    except SectionError as error:
        raise InputError(str(error)) from None
    mm = {k: f"{1e3 * getattr(gauges, k):.1f}" for k in ("crown", "sidewall", "bead", "belt")}
    made = construction(size)
    section = table.section()
    case = NewCase(
        section,
        constructed(made, section),
        f"{stem}.csv",
        f"{size.text} on a {gauges.rim / INCH:g} inch rim",
        size.text,
        size.pressure_kPa if pressure_kPa is None else pressure_kPa,
        "size_code",
        f"section from the size code, as {made.name} tyres are built:\n"
        f"# crown {mm['crown']}, sidewall {mm['sidewall']}, bead {mm['bead']} mm thick, belt"
        f" {mm['belt']} mm wide. An estimate to start from.",
        loads_N=[_rounded(min(share * size.load_N, MAX_USUAL_LOAD_N)) for share in LOAD_SHARES],
    )
    return Draft(case.text(), f"{stem}.csv", table.csv().encode())


def _rounded(load_N: float) -> float:
    """Round to two significant digits."""
    return float(f"{load_N:.2g}")


def from_file(
    file: Path, size: TyreSize | None, belt: float | None, pressure_kPa: float | None
) -> Draft:
    """A case with the section in ``file``: a station table, or two curves with a belt of width
    ``belt``, m (None: usual). Raises InputError, OSError."""
    content = read_bytes(file)  # before others open it: it may be a pipe
    with _place_named(file):
        outline = _is_outline(file)
    if belt is not None and not outline:
        raise InputError("--belt-width-mm goes with an outline: a station table has its belts")
    with _place_named(file):
        keys = _outline_keys(file, size, belt) if outline else None
        given: dict[str, Any] = (
            {"outline": {"file": file.name, **keys}} if keys else {"stations": file.name}
        )
        source = SectionSource.model_validate(given)
        usual_kPa = size.pressure_kPa if size else PRESSURE_KPA
        section = read_section_of(source, file.parent)
        case = NewCase(
            section,
            _made_of(section, size),
            file.name,
            size.text + " with a section of its own" if size else file.stem,
            size.text if size else "not given",
            usual_kPa if pressure_kPa is None else pressure_kPa,
            "drawing",
            outline=keys,
        )
    return Draft(case.text(), file.name, content)


@contextmanager
def _place_named(file: Path) -> Iterator[None]:
    """Raises InputError with the file, and its line, before the words."""
    try:
        yield
    except InputError as error:
        line = f", line {error.line}" if error.line else ""
        raise InputError(f"{file}{line}: {error}") from None


def _made_of(section: Section, size: TyreSize | None) -> ConstructionParts:
    """Compounds where the lines and regions are those that a size gives, else one rubber."""
    regions = {name for name, _ in section.regions}
    for made in [construction(size)] if size else [PASSENGER, TRUCK]:
        if section.names == made.lines and regions.issuperset(BELOW):
            return constructed(made, section)
    return one_rubber(section, 2 if size and size.light_truck else 1)


def _is_outline(file: Path) -> bool:
    return "curve" in read_named_table(file).headings


def _outline_keys(file: Path, size: TyreSize | None, belt: float | None) -> dict[str, float]:
    """Keys of an outline that its curves do not show, in m: as far as known, else usual values; the
    belt is 3/4 as wide as the section."""
    from ..section.outline import read_outline

    curves = read_outline(file)
    if not size:
        width = 2 * float(curves["outer"][:, 1].max())
        keys = {
            "belt_width_m": belt or 0.75 * width,
            "rim_radius_m": float(curves["inner"][-1, 0]) + FLANGE,
        }
        defaults = {k: f.default for k, f in Outline.model_fields.items() if not f.is_required()}
        return {k: round(v, 5) for k, v in {**keys, **defaults}.items()}
    g = usual(size)
    return {
        "belt_width_m": round(belt or g.belt, 5),
        "rim_radius_m": round(size.flange_radius(g.rim), 5),
        "carcass_depth_m": g.liner,
        "belt_depth_m": g.ply,
        "belt_spacing_m": g.belts,
        "belt_step_m": g.step,
    }
