"""Size codes: what 205/60R15 91V, P235/75R17, LT315/70R17, 31x10.50R15LT, 315/80R22.5 and 11R22.5
say of a tyre.

Design dimensions: UN Regulations 30 and 54, paragraph 6.1 (the rules of ETRTO and of the Tire and
Rim Association), lengths in m:

    overall diameter  D = d + 2 H,  H = S1 Ra / 100    d = 25.4 mm x rim code, Ra the aspect ratio
    section width     S = S1 + 0.4 (A - A1)            A the rim's width, A1 = x S1

x is 0.70 from aspect ratio 50 up, 0.85 at 40 and 45, 0.90 below; on the 15 degree rims of trucks
(17.5, 19.5, 22.5 and 24.5 inches) 0.75. Flotation codes state D and S1 themselves, in inches; D is
half an inch less than the code, and x = 0.80. Trucks' codes in inches leave the height to a table.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from ...errors import InputError
from ...units import INCH

RIM_CODES = (10, *range(12, 25))
TRUCK_RIM_CODES = (17.5, 19.5, 22.5, 24.5)  # 15 degree drop centre
TRUCK_RIM_WIDTHS = (5.25, 6.0, 6.75, 7.5, 8.25, 9.0, 9.75, 10.5, 11.75, 13.0, 14.0)  # inch
TRUCK_HEIGHTS_MM = {  # H by nominal width, inch, on rims of 22.5 and 24.5, and of 17.5 and 19.5
    8.0: (182, 171),
    8.5: (None, 179),
    9.0: (201, None),
    9.5: (None, 199),
    10.0: (224, 207),
    11.0: (241, None),
    12.0: (256, None),
    13.0: (276, None),
}
NOMINAL_WIDTHS, ASPECTS = range(125, 400, 10), range(25, 90, 5)  # of cars: widths end in 5
TRUCK_WIDTHS = range(205, 500, 10)
PRESSURES_KPA = {
    "": 250.0,
    "P": 240.0,
    "XL": 290.0,
    "LT": 350.0,
    "C": 400.0,
    "T": 420.0,
    "HL": 290.0,
    "truck": 850.0,
    "small truck": 725.0,
    "truck in inches": 720.0,
}
LOAD_RANGES_KPA = {"B": 240.0, "C": 350.0, "D": 450.0, "E": 550.0, "F": 660.0}
TRUCK_RANGES_KPA = {"F": 620.0, "G": 720.0, "H": 830.0, "J": 850.0, "L": 900.0}
"""Standard cold pressures by kind of tyre and, of LT and of truck tyres, by load range."""
# of the load that a tyre bears over p S1 D, as published loads have it: 205/55R16 91, 145/80R13 75,
# P235/75R17 108 and 225/45R17 91; LT245/75R16 120, 315/80R22.5 156, 11R22.5 144
LOADED_SHARE = {"car": 0.19, "truck": 0.13}

RUN_FLAT = re.compile(r"RFT|ROF|RSC|SSR|ZP|ZPS|EMT|HRS|DSST|RUN ?FLAT")
TUBE_RIMS = ("20", "24")  # of trucks' tyres with tubes, as 12.00R20
MOTORCYCLE = re.compile(  # 120/70ZR17, whose widths end in 0, 150/80B16M/C, MT90B16, 3.00-18
    r"([7-9]0|1\d0|2[0-4]0) ?/ ?\d{2}|.*M/C\b|M[A-Z]\d{2}|[2-4]\.\d{2} ?- ?\d{2}"
)
METRIC = re.compile(
    r"(?P<kind>P|LT|T|HL|) ?(?P<width>\d{3}) ?/ ?(?P<aspect>\d{2,3})"
    r" ?(?P<build>-|[A-Z]{1,3}) ?(?P<rim>\d{2}(?:\.\d+)?) ?(?P<suffix>LT|C|)(?![A-Z\d.])"
)
FLOTATION = re.compile(
    r"(?P<diameter>\d{2}(?:\.\d+)?) ?X ?(?P<width>\d{1,2}(?:\.\d+)?)"
    r" ?(?P<build>-|[A-Z]{1,3}) ?(?P<rim>\d{2}(?:\.\d+)?) ?(?P<suffix>LT|)(?![A-Z\d.])"
)
INCHES = re.compile(
    r"(?P<width>\d{1,2}(?:\.\d+)?) ?(?P<build>-|[A-Z]{1,3}) ?(?P<rim>\d{2}(?:\.5)?)(?![A-Z\d.])"
)
SERVICE = re.compile(  # load index and speed symbol, load range, strength, tubeless, mud and snow
    r"\(?\d{2,3}(/\d{2,3})?([A-Z]\d?)?\)?|\(?[A-Z]\)?|LR ?[A-L]|XL|SL|TL|M\+S|3PMSF"
)


@dataclass(frozen=True)
class TyreSize:
    """A size code read."""

    text: str
    kind: str  # key of `PRESSURES_KPA`
    width: float  # nominal section width S1, m
    overall_diameter: float  # D, m
    rim_code: float  # diameter, inch
    theoretical: float  # x
    measuring: float  # width of the measuring rim over S1, before it is rounded to a rim's width
    pressure_kPa: float
    load_index: int | None = None  # of a single tyre, None where it is not stated

    @property
    def light_truck(self) -> bool:
        """Built with two plies of carcass and thicker gauges."""
        return self.kind in ("LT", "C")

    @property
    def truck(self) -> bool:
        """Built with a carcass of steel and four belts, on a 15 degree rim."""
        return "truck" in self.kind

    @property
    def load_N(self) -> float:
        """The load that it bears at its pressure, as its load index says or about as usual."""
        if self.load_index is not None:  # 45 kg at 0, 80 steps to ten times as much, within 1 %
            return 9.81 * 45 * 10 ** (self.load_index / 80)
        share = LOADED_SHARE["truck" if self.truck or self.light_truck else "car"]
        return share * 1e3 * self.pressure_kPa * self.width * self.overall_diameter

    @property
    def section_height(self) -> float:
        """H, m: from the nominal rim diameter to the tread."""
        return (self.overall_diameter - self.rim_code * INCH) / 2

    @property
    def measuring_rim(self) -> float:
        """Width of the rim on which the tyre is measured, m: one of a truck's, or a multiple of
        half an inch."""
        if self.truck:
            wanted = self.measuring * self.width / INCH
            return min(TRUCK_RIM_WIDTHS, key=lambda inches: abs(inches - wanted)) * INCH
        return round(2 * self.measuring * self.width / INCH) / 2 * INCH

    def section_width(self, rim_width: float) -> float:
        """S on a rim of a width, both m."""
        return self.width + 0.4 * (rim_width - self.theoretical * self.width)

    @property
    def bead_seat_radius(self) -> float:
        """Bead seat radius of the 5 degree drop centre rim, m: specified diameters of ISO 4000-2;
        of the 15 degree rim the code's own, at the flange."""
        if self.truck:
            return self.rim_code * INCH / 2
        return (self.rim_code * INCH + (4.8e-3 if self.rim_code > 16 else -0.8e-3)) / 2

    def flange_radius(self, rim_width: float) -> float:
        """Radius of the top of the rim's flange, m: contour J, or B on rims narrower than 5 inches;
        of the 15 degree rim half an inch."""
        if self.truck:
            return self.bead_seat_radius + INCH / 2
        return self.bead_seat_radius + (17.3e-3 if rim_width > 4.9 * INCH else 14.2e-3)


def parse_size(text: str) -> TyreSize:
    """A size code in any case, with blanks or a service description. Raises InputError."""
    text = " ".join(text.split())[:60]
    code = re.sub(r"(?<=\d)XL\b", " XL", text.upper().replace("×", "X"))
    code = re.sub(r"^(LT.+R ?\d{2}) ?(?=[B-F]\b)", r"\1/", code)  # LT245/75R16E: load range E
    if MOTORCYCLE.match(code):
        raise InputError(_motorcycle(text))
    match = METRIC.match(code) or FLOTATION.match(code) or INCHES.match(code)
    if not match or (match.re is INCHES and not _is_truck(match.groupdict())):
        raise InputError(f"'{text}' is not a tyre size that is known{_hint(code)}")
    parts = match.groupdict()
    name = match.group(0).replace(" ", "")
    service = re.sub(r"LOAD RANGE ?|/(?=[B-L]\b)|LR ", "LR", code[match.end() :])
    service = re.sub(r"EXTRA LOAD|REINFORCED|REINF\b", "XL", service)
    if RUN_FLAT.search(service):
        raise InputError(_run_flat(name))
    for word in service.split():
        if not SERVICE.fullmatch(word):
            raise InputError(
                f"'{text}': '{word}' after the size is no service description, as 91V is"
            )
    _check_build(name, parts["build"])
    truck = _is_truck(parts) and match.re is not FLOTATION
    if not truck and not (parts["rim"].isdigit() and int(parts["rim"]) in RIM_CODES):
        raise InputError(
            f"'{name}': no rim of code {parts['rim']}, known are {RIM_CODES[0]} to {RIM_CODES[-1]}"
            f" inches, 5 degree drop centre, and {', '.join(map(str, TRUCK_RIM_CODES))}, 15 degree"
        )
    read = {METRIC: _metric, FLOTATION: _flotation, INCHES: _inches}[match.re]
    return _with_service(read(name, parts), service)


def _is_truck(parts: dict[str, str]) -> bool:
    return parts["rim"] in map(str, TRUCK_RIM_CODES)


def _metric(name: str, parts: dict[str, str]) -> TyreSize:
    width, aspect, truck = int(parts["width"]), int(parts["aspect"]), _is_truck(parts)
    widest = 495 if truck else 395
    if width not in NOMINAL_WIDTHS and not (truck and width in TRUCK_WIDTHS):
        raise InputError(
            f"'{name}': section widths are 125 to {widest} mm in steps of 10, not {width}"
        )
    if aspect not in ASPECTS:
        raise InputError(f"'{name}': aspect ratios are 25 to 85 % in steps of 5, not {aspect}")
    diameter = float(parts["rim"]) * INCH + 2 * width * 1e-3 * aspect / 100
    if truck:
        return _truck(name, width * 1e-3, diameter, float(parts["rim"]))
    kind = parts["suffix"] or parts["kind"]
    theoretical = 0.70 if aspect >= 50 else 0.85 if aspect >= 40 else 0.90
    shares = ((75, 0.70), (60, 0.75), (50, 0.80), (45, 0.85), (30, 0.90), (0, 0.92))
    measuring = next(share for lowest, share in shares if aspect >= lowest)
    return TyreSize(
        name, kind, width * 1e-3, diameter, int(parts["rim"]), theoretical, measuring, 0.0
    )


def _inches(name: str, parts: dict[str, str]) -> TyreSize:
    width, rim = float(parts["width"]), float(parts["rim"])
    height = TRUCK_HEIGHTS_MM.get(width, (None, None))[rim < 20]
    if height is None:
        known = ", ".join(f"{w:g}" for w, each in TRUCK_HEIGHTS_MM.items() if each[rim < 20])
        raise InputError(f"'{name}': widths known on a {rim:g} inch rim are {known}, not {width:g}")
    size = _truck(name, width * INCH, rim * INCH + 2e-3 * height, rim)
    return replace(size, kind="truck in inches") if rim > 20 else size


def _truck(name: str, width: float, diameter: float, rim: float) -> TyreSize:
    kind = "truck" if rim > 20 else "small truck"
    return TyreSize(name, kind, width, diameter, rim, 0.75, 0.75, 0.0)


def _flotation(name: str, parts: dict[str, str]) -> TyreSize:
    diameter, width, rim = float(parts["diameter"]), float(parts["width"]), int(parts["rim"])
    if not 8 <= width <= 16:
        raise InputError(f"'{name}': flotation tyres are 8 to 16 inches wide, not {width:g}")
    height = (diameter - 0.5 - rim) / 2
    if not 0.4 * width <= height <= width:
        raise InputError(
            f"'{name}': from a {rim} inch rim to {diameter:g} inches leaves sidewalls of"
            f" {height:.3g} inches, which is no tyre {width:g} inches wide"
        )
    return TyreSize(
        name.replace("X", "x"), "LT", width * INCH, (diameter - 0.5) * INCH, rim, 0.8, 0.8, 0.0
    )


def _with_service(size: TyreSize, service: str) -> TyreSize:
    """Pressure and load index, as far as they are stated."""
    ranges = TRUCK_RANGES_KPA if size.truck else LOAD_RANGES_KPA
    stated = re.search(r"LR(?P<a>[A-L])", service)
    if not stated and (size.light_truck or size.truck):
        # a lone letter: speed symbols of road tyres start at J
        stated = re.search(r"(?:^|\s)(?P<a>[B-H])$", service)
    letter = stated["a"] if stated else ""
    if letter and letter not in ranges:
        known = ", ".join(ranges)
        raise InputError(f"'{size.text}': load range {letter} is not known, {known} are")
    pressure = ranges.get(letter) or PRESSURES_KPA["XL" if "XL" in service else size.kind]
    index = re.search(r"(?:^|[ (])(\d{2,3})(?:/\d{2,3})?[A-Z]", service)
    return replace(size, pressure_kPa=pressure, load_index=int(index[1]) if index else None)


def _check_build(name: str, build: str) -> None:
    """Check that the build is radial, with any speed symbol before the R."""
    if build in ("D", "-", "B"):
        raise InputError(f"'{name}' is a bias-ply tyre: only radial ones (R) can be built")
    if build.endswith("RF"):
        raise InputError(_run_flat(name))
    if not re.fullmatch(r"[A-Z]?R", build):
        raise InputError(f"'{name}': '{build}' is no construction, R is for radial tyres")


def _run_flat(name: str) -> str:
    return (
        f"'{name}' is a run-flat tyre: its sidewall insert is not built, because usual gauges and"
        " rubbers are not known; give its section with --section or --deck, or the size"
        " with R for the tyre without it"
    )


def _motorcycle(name: str) -> str:
    return (
        f"'{name}' is a motorcycle tyre, with a crown round to its edges: only tyres of passenger"
        " cars, light trucks and trucks are built from a size; give its section with --section"
    )


def _hint(code: str) -> str:
    if re.match(r"\d{3} ?[A-Z]?R ?\d{2}", code):
        return ": the aspect ratio is missing, write it as in 175/80R14"
    if re.match(rf"\d+(\.\d+)? ?[A-Z]?R ?({'|'.join(TUBE_RIMS)})\b", code):
        return (
            ": a truck tyre with a tube, on a flat base rim; those of 22.5 inches are, as 11R22.5"
        )
    if re.match(r"\d+\.\d+ ?(-|[A-Z]?R) ?\d{2}", code):
        return ": sizes in inches need the diameter too, as in 31x10.50R15LT"
    return "; write it as 205/60R15, P235/75R17, LT315/70R17, 31x10.50R15LT, 315/80R22.5 or 11R22.5"
