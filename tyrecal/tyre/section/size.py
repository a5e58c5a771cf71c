"""Size codes: what 205/60R15 91V, P235/75R17, LT315/70R17 and 31x10.50R15LT say of a tyre.

Design dimensions: UN Regulations 30 and 54, paragraph 6.1 (the rules of ETRTO and of the Tire and
Rim Association), lengths in m:

    overall diameter  D = d + 2 H,  H = S1 Ra / 100    d = 25.4 mm x rim code, Ra the aspect ratio
    section width     S = S1 + 0.4 (A - A1)            A the rim's width, A1 = x S1

x is 0.70 from aspect ratio 50 up, 0.85 at 40 and 45, 0.90 below. Flotation codes state D and S1
themselves, in inches; D is half an inch less than the code, and x = 0.80.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...errors import InputError
from ...units import INCH

TRUCK_RIM = r"(17|19|22|24)\.5"
RIM_CODES = (10, *range(12, 25))
NOMINAL_WIDTHS, ASPECTS = range(125, 400, 10), range(25, 90, 5)  # of cars: widths end in 5
PRESSURES_KPA = {
    "": 250.0,
    "P": 240.0,
    "XL": 290.0,
    "LT": 350.0,
    "C": 400.0,
    "T": 420.0,
    "HL": 290.0,
}
LOAD_RANGES_KPA = {"B": 240.0, "C": 350.0, "D": 450.0, "E": 550.0, "F": 660.0}
"""Standard cold pressures by kind of tyre and, of LT tyres, by load range (50, 65, 80, 95 psi)."""

METRIC = re.compile(
    r"(?P<kind>P|LT|T|HL|) ?(?P<width>\d{3}) ?/ ?(?P<aspect>\d{2,3})"
    r" ?(?P<build>-|[A-Z]{1,3}) ?(?P<rim>\d{2}(?:\.\d+)?) ?(?P<suffix>LT|C|)(?![A-Z\d.])"
)
FLOTATION = re.compile(
    r"(?P<diameter>\d{2}(?:\.\d+)?) ?X ?(?P<width>\d{1,2}(?:\.\d+)?)"
    r" ?(?P<build>-|[A-Z]{1,3}) ?(?P<rim>\d{2}(?:\.\d+)?) ?(?P<suffix>LT|)(?![A-Z\d.])"
)
SERVICE = re.compile(  # load index and speed symbol, load range, strength, tubeless, mud and snow
    r"\(?\d{2,3}(/\d{2,3})?([A-Z]\d?)?\)?|\(?[A-Z]\)?|LR ?[A-H]|XL|SL|TL|M\+S|3PMSF"
)


@dataclass(frozen=True)
class TyreSize:
    """A size code read. width: nominal section width S1, m; rim_code: diameter, inch;
    overall_diameter: D, m; theoretical: x; measuring: widest usual share of S1 in the rim."""

    text: str
    kind: str
    width: float
    overall_diameter: float
    rim_code: int
    theoretical: float
    measuring: float
    pressure_kPa: float

    @property
    def light_truck(self) -> bool:
        """Built with two plies of carcass and thicker gauges."""
        return self.kind in ("LT", "C")

    @property
    def section_height(self) -> float:
        """H, m: from the nominal rim diameter to the tread."""
        return (self.overall_diameter - self.rim_code * INCH) / 2

    @property
    def measuring_rim(self) -> float:
        """Width of the rim on which the tyre is measured, m: a multiple of half an inch."""
        return round(2 * self.measuring * self.width / INCH) / 2 * INCH

    def section_width(self, rim_width: float) -> float:
        """S on a rim of a width, both m."""
        return self.width + 0.4 * (rim_width - self.theoretical * self.width)

    @property
    def bead_seat_radius(self) -> float:
        """Of the 5 degree drop centre rim, m: specified diameters of ISO 4000-2."""
        return (self.rim_code * INCH + (4.8e-3 if self.rim_code > 16 else -0.8e-3)) / 2

    def flange_radius(self, rim_width: float) -> float:
        """To the top of the rim's flange, m: contour J, or B on rims narrower than 5 inches."""
        return self.bead_seat_radius + (17.3e-3 if rim_width > 4.9 * INCH else 14.2e-3)


def parse_size(text: str) -> TyreSize:
    """A size code in any case, with blanks or a service description. Raises InputError."""
    text = " ".join(text.split())[:60]
    code = re.sub(r"(?<=\d)XL\b", " XL", text.upper().replace("×", "X"))
    code = re.sub(r"^(LT.+R ?\d{2}) ?(?=[B-F]\b)", r"\1/", code)  # LT245/75R16E: load range E
    found = METRIC.match(code) or FLOTATION.match(code)
    if not found and re.match(rf"\d{{1,3}}(\.\d+)? ?R ?{TRUCK_RIM}", code):
        raise InputError(_truck(text))
    if not found:
        raise InputError(f"'{text}' is not a tyre size that is known{_hint(code)}")
    parts = found.groupdict()
    name = found.group(0).replace(" ", "")
    service = re.sub(r"LOAD RANGE ?|/(?=[B-H]\b)|LR ", "LR", code[found.end() :])
    service = re.sub(r"EXTRA LOAD|REINFORCED|REINF\b", "XL", service)
    for word in service.split():
        if not SERVICE.fullmatch(word):
            raise InputError(
                f"'{text}': '{word}' after the size is no service description, as 91V is"
            )
    _check_build(name, parts["build"])
    if re.fullmatch(TRUCK_RIM, parts["rim"]):
        raise InputError(_truck(name))
    if not parts["rim"].isdigit() or int(parts["rim"]) not in RIM_CODES:
        raise InputError(
            f"'{name}': no rim of code {parts['rim']}, known are {RIM_CODES[0]}"
            f" to {RIM_CODES[-1]} inches, 5 degree drop centre"
        )
    size = _metric(name, parts) if found.re is METRIC else _flotation(name, parts)
    return _with_pressure(size, service)


def _metric(name: str, parts: dict[str, str]) -> TyreSize:
    width, aspect = int(parts["width"]), int(parts["aspect"])
    if width not in NOMINAL_WIDTHS:
        if 70 <= width <= 240 and width % 10 == 0:
            raise InputError(
                f"'{name}' is a motorcycle tyre's, whose widths end in 0: only passenger car and"
                " light truck tyres are built from a size"
            )
        raise InputError(f"'{name}': section widths are 125 to 395 mm in steps of 10, not {width}")
    if aspect not in ASPECTS:
        raise InputError(f"'{name}': aspect ratios are 25 to 85 % in steps of 5, not {aspect}")
    kind = parts["suffix"] or parts["kind"]
    theoretical = 0.70 if aspect >= 50 else 0.85 if aspect >= 40 else 0.90
    shares = ((75, 0.70), (60, 0.75), (50, 0.80), (45, 0.85), (30, 0.90), (0, 0.92))
    measuring = next(share for lowest, share in shares if aspect >= lowest)
    rim = int(parts["rim"])
    diameter = rim * INCH + 2 * width * 1e-3 * aspect / 100
    return TyreSize(name, kind, width * 1e-3, diameter, rim, theoretical, measuring, 0.0)


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


def _with_pressure(size: TyreSize, service: str) -> TyreSize:
    stated = re.search(r"LR(?P<a>[A-H])", service)
    if not stated and size.light_truck:  # a lone letter: speed symbols of road tyres start at J
        stated = re.search(r"(?:^|\s)(?P<a>[B-F])$", service)
    letter = stated["a"] if stated else ""
    if letter and letter not in LOAD_RANGES_KPA:
        raise InputError(f"'{size.text}': load range {letter} is not known, B to F are")
    pressure = LOAD_RANGES_KPA.get(letter) or PRESSURES_KPA["XL" if "XL" in service else size.kind]
    return TyreSize(**{**size.__dict__, "pressure_kPa": pressure})


def _check_build(name: str, build: str) -> None:
    """Radial, whatever speed symbol stands before the R."""
    if build in ("D", "-", "B"):
        raise InputError(f"'{name}' is a bias-ply tyre: only radial ones (R) can be built")
    if build.endswith("RF"):
        raise InputError(
            f"'{name}' has self-supporting sidewalls: give the size with R, and their --sidewall-mm"
        )
    if not re.fullmatch(r"[A-Z]?R", build):
        raise InputError(f"'{name}': '{build}' is no construction, R is for radial tyres")


def _truck(name: str) -> str:
    return (
        f"'{name}' is a truck tyre, on a 15 degree rim: only passenger car and light truck tyres"
        " are built from a size; give its section with --section"
    )


def _hint(code: str) -> str:
    if re.match(r"\d{3} ?[A-Z]?R ?\d{2}", code):
        return ": the aspect ratio is missing, write it as in 175/80R14"
    if re.match(r"\d+\.\d+ ?(-|[A-Z]?R) ?\d{2}", code):
        return ": sizes in inches need the diameter too, as in 31x10.50R15LT"
    return "; write it as 205/60R15, P235/75R17, LT315/70R17 or 31x10.50R15LT"
