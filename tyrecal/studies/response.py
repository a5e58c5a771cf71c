"""Response functions: the force of the tyre on the hub, and motions of the tread, per force on it.

Directions at the hub are those of ISO 8855: x forward, y to the left along the axle, z upwards. The
angle 0 of the tread is below the hub, where it would touch the road. Angles grow as the wheel
turns when it rolls forward: 90 degrees is behind the hub.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..files import Json
from ..measured.coordinates import CYLINDRICAL, CoordinateSystem
from ..measured.universal_text import WrittenFunction, function_set, universal_text
from ..tyre.case import LoadedCase
from .result import Column, CsvRow, Result, ResultPart, StudyInput, Table, csv_text

Array = np.ndarray
ResponseForm = Literal["receptance", "accelerance"]
EXCITE, RESPOND = "tread:0deg:radial", "hub:fz,tread:0deg:radial"
TO_HZ, STEP_HZ, PATCH_MM = 300.0, 0.5, 20.0  # defaults of the options
ZERO_BY_SYMMETRY = 1e-10  # of the largest response of its kind
MAX_BAND_HZ, MAX_RESPONSE_STEPS = 1000.0, 5000
TREAD_POINT = re.compile(r"tread:([+-]?\d+(?:\.\d+)?)deg:(radial|tangential|lateral)")
TREAD_MOTIONS = "radial", "tangential", "lateral"
HUB_CHANNELS = {  # place among the solver's forces and moments, and the sign of it
    **{"fx": (1, -1), "fy": (2, 1), "fz": (0, -1)},
    **{"mx": (4, -1), "my": (5, 1), "mz": (3, -1)},
}
HUB_NODE, FIRST_TREAD_NODE = 1, 101  # numbers in universal files
EXAMPLES = "such as tread:0deg:radial, tread:90deg:lateral"
# axes of the tread's r, theta, z at the angle 0: down, backwards, along the axle
TREAD_SYSTEM = CoordinateSystem(
    CYLINDRICAL, np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]), np.zeros(3)
)


@dataclass(frozen=True)
class ResponsePoint:
    """A place and direction of the tread, or a channel of the hub.

    >>> print(*read_points("tread:90deg:radial,hub:fz"))
    tread:90deg:radial hub:fz
    """

    channel: str  # direction of the tread, or fx to mz of the hub
    angle_deg: float | None = None  # None: the hub

    def __str__(self) -> str:
        if self.angle_deg is None:
            return f"hub:{self.channel}"
        return f"tread:{self.angle_deg:g}deg:{self.channel}"


def read_points(text: str, hub: bool = True) -> list[ResponsePoint]:
    """Points of a list with commas; ``hub``: whether it may have the hub's. Raises InputError."""
    points = []
    for word in text.replace(" ", "").split(","):
        place, _, channel = word.partition(":")
        if match := TREAD_POINT.fullmatch(word):
            points.append(ResponsePoint(match[2], float(match[1])))
        elif hub and place == "hub" and channel in HUB_CHANNELS:
            points.append(ResponsePoint(channel))
        else:
            of_hub = f", or hub:fz with one of {', '.join(HUB_CHANNELS)}" if hub else ""
            raise InputError(
                f"'{word}' is no point: give tread:ANGLEdeg:DIRECTION, {EXAMPLES}{of_hub};"
                f" directions are {', '.join(TREAD_MOTIONS)}"
            )
    if len(set(points)) < len(points):
        raise InputError(f"'{text}' has a point twice")
    return points


def response_request(
    excite: str, respond: str, from_Hz: float, to_Hz: float, step_Hz: float, patch_mm: float
) -> Json:
    """The request to a solver. Raises InputError."""
    lines = (to_Hz - from_Hz) / step_Hz if step_Hz > 0 else 0.0
    if not 0 <= from_Hz < to_Hz <= MAX_BAND_HZ or lines < 1 or abs(lines - round(lines)) > 1e-6:
        raise InputError(
            f"frequencies from {from_Hz:g} to {to_Hz:g} Hz in steps of {step_Hz:g} Hz: must be a"
            f" whole number of steps from 0 or more to at most {MAX_BAND_HZ:g}, as 0 to 300 by 0.5"
        )
    if lines >= MAX_RESPONSE_STEPS:
        raise InputError(f"step {step_Hz:g} Hz: gives more than {MAX_RESPONSE_STEPS} frequencies")
    if not 1 <= patch_mm <= 200:
        raise InputError(f"patch {patch_mm:g} mm: must be from 1 to 200 mm, such as 20")
    forces = read_points(excite, hub=False)
    return {
        "lowest_Hz": from_Hz,
        "highest_Hz": to_Hz,
        "lines": round(lines) + 1,
        "patch_m": patch_mm / 1e3,
        "excite": [[point.angle_deg, point.channel] for point in forces],
        "respond": [[p.angle_deg, p.channel] for p in _of_tread(read_points(respond), forces)],
    }


def _of_tread(
    seen: Sequence[ResponsePoint], forces: Sequence[ResponsePoint]
) -> list[ResponsePoint]:
    """The points of the tread that a solver is asked for: one at least."""
    return [point for point in seen if point.angle_deg is not None] or [*forces[:1]]


class ResponseFunctionEntry(ResultPart):
    """A function of frequency: response per unit force."""

    excite: Annotated[str, Column("force at", "")]  # where the force acts, and its direction
    respond: Annotated[str, Column("response at", "")]  # where the response is, and its direction
    quantity: Annotated[
        str, Column("quantity", "")
    ]  # receptance, accelerance, blocked force or moment
    unit: Annotated[str, Column("unit", "")]  # unit of the function
    # magnitude at the lowest frequency
    at_lowest: Annotated[float, Column("at the lowest Hz", ".4g")]
    peak_Hz: Annotated[float, Column("peak at Hz", ".1f")]  # frequency of the highest peak
    peak: Annotated[float, Column("peak", ".4g")]  # magnitude of the highest peak
    real: list[float]  # real part by frequency
    imag: list[float]  # imaginary part by frequency

    @property
    def values(self) -> Array:
        """The function (f,), complex."""
        return np.array(self.real) + 1j * np.array(self.imag)


class ResponseFindings(ResultPart):
    """Limits of the functions, in words."""

    words: list[str] = Field(default=[])  # limits in words


class FrfResult(Result):
    """frf.json"""

    study, stem, heading = "frf", "frf", "Response functions"
    figures = "tyrecal.report.response:draw_responses"
    is_seldom = True
    follows_fit = True

    design: str  # name of the design: initial, fitted or set
    pressure_kPa: float
    patch_mm: float  # width of the patch of the tread on which the force acts
    radius_m: float  # radius of the tread's points
    harmonics: int  # harmonics in the sum
    frequency_Hz: list[float]  # frequencies
    functions: list[ResponseFunctionEntry]  # response functions
    findings: ResponseFindings = ResponseFindings()  # limits of the functions

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        excite: str = EXCITE,
        respond: str = RESPOND,
        from_Hz: float = 0.0,
        to_Hz: float = TO_HZ,
        step_Hz: float = STEP_HZ,
        patch_mm: float = PATCH_MM,
        form: ResponseForm = "receptance",
    ) -> FrfResult:
        """The last design, rim held, unloaded. Raises InputError, EvaluationFailed."""
        request = response_request(excite, respond, from_Hz, to_Hz, step_Hz, patch_mm)
        given.evaluator.needs_response()
        name, values = [*given.designs.items()][-1]
        forces, seen = read_points(excite, hub=False), read_points(respond)
        tread = _of_tread(seen, forces)
        result = _evaluated(given, values, request)
        answer = result.response
        functions = [
            _entry(answer, force, e, point, tread, form)
            for e, force in enumerate(forces)
            for point in seen
        ]
        functions_of_tyre = cls(
            format=1,
            design=name,
            pressure_kPa=result.pressure_kPa,
            patch_mm=patch_mm,
            radius_m=answer["radius_m"],
            harmonics=int(answer["harmonics"]),
            frequency_Hz=[float(f) for f in answer["frequency_Hz"]],
            functions=functions,
            findings=ResponseFindings(words=_words(answer, result.modes[0].damping_ratio)),
        )
        text = functions_of_tyre.universal(given.case)
        return given.stamped(functions_of_tyre.with_files({"frf.uff": text}))

    def quantities(self) -> dict[str, float]:
        numbers = {}
        for each in self.functions:
            where = f"{each.respond} {each.excite}"
            numbers[f"peak_Hz {where}"] = each.peak_Hz
            numbers[f"peak {where}"] = each.peak
        return numbers

    def csv(self) -> str:
        keys = ["excite", "respond", "quantity", "unit", "frequency_Hz", "real", "imag"]
        return csv_text(keys, self._csv_lines())

    def _csv_lines(self) -> list[CsvRow]:
        return [
            {**each.model_dump(), "frequency_Hz": f, "real": real, "imag": imag}
            for each in self.functions
            for f, real, imag in zip(self.frequency_Hz, each.real, each.imag, strict=True)
        ]

    def tables(self) -> list[Table]:
        columns = list(ResponseFunctionEntry.columns().values())
        title = f"{self.design}, {self.pressure_kPa:g} kPa, rim held, patch {self.patch_mm:g} mm"
        return [Table(columns, [each.cells() for each in self.functions], title)]

    def universal(self, case: LoadedCase) -> str:
        """Text of the universal file: the hub is node 1, points of the tread are from 101 on."""
        ends = [(read_points(x.excite)[0], read_points(x.respond)[0]) for x in self.functions]
        angles = [p.angle_deg for pair in ends for p in pair if p.angle_deg is not None]
        numbers = {a: FIRST_TREAD_NODE + i for i, a in enumerate(dict.fromkeys(angles))}
        place = lambda a: TREAD_SYSTEM.place([self.radius_m, a, 0.0])
        nodes = {HUB_NODE: [0.0] * 3, **{n: place(a).tolist() for a, n in numbers.items()}}

        def signal(point: ResponsePoint) -> tuple[int, int]:
            if point.angle_deg is None:
                return HUB_NODE, 1 + [*HUB_CHANNELS].index(point.channel)
            return numbers[point.angle_deg], 1 + TREAD_MOTIONS.index(point.channel)

        kinds = {"receptance": "displacement", "accelerance": "acceleration"}
        functions = [
            WrittenFunction(
                f"{each.quantity} {each.respond} over {each.excite}",
                signal(respond),
                signal(force),
                kinds.get(each.quantity, each.quantity.removeprefix("blocked ")),
                each.values,
            )
            for each, (force, respond) in zip(self.functions, ends, strict=True)
        ]
        title, frequencies = case.case.name, np.array(self.frequency_Hz)
        sets = [function_set(title, each, frequencies) for each in functions]
        return universal_text(title, nodes, sets, TREAD_SYSTEM, numbers.values())


def _evaluated(given: StudyInput, values: Mapping[str, float], request: Json) -> Any:
    from ..simulate.evaluate.evaluator import Question  # late: not for those who read results

    return given.evaluator.evaluate(Question(values, response=request))


def _entry(
    answer: Mapping[str, Any],
    force: ResponsePoint,
    e: int,
    point: ResponsePoint,
    tread: Sequence[ResponsePoint],
    form: ResponseForm,
) -> ResponseFunctionEntry:
    frequencies = np.asarray(answer["frequency_Hz"])
    is_hub = point.angle_deg is None
    of_kind = np.asarray(answer["hub" if is_hub else "receptance"])
    if is_hub:
        row, sign = HUB_CHANNELS[point.channel]
        values = sign * of_kind[row, e]
        is_force = point.channel[0] == "f"
        quantity, unit = ("blocked force", "N/N") if is_force else ("blocked moment", "N m/N")
    else:
        values, quantity, unit = of_kind[tread.index(point), e], form, "m/N"
    if np.abs(values).max() < ZERO_BY_SYMMETRY * np.abs(of_kind).max():
        values = 0 * values
    if quantity == "accelerance":
        values, unit = -((2 * np.pi * frequencies) ** 2) * values, "m/s²/N"
    size = np.abs(values)
    peak = int(size.argmax())
    return ResponseFunctionEntry(
        excite=str(force),
        respond=str(point),
        quantity=quantity,
        unit=unit,
        at_lowest=float(size[0]),
        peak_Hz=float(frequencies[peak]),
        peak=float(size[peak]),
        real=[float(x) + 0.0 for x in values.real],
        imag=[float(x) + 0.0 for x in values.imag],
    )


def _words(answer: Mapping[str, Any], damping: float | None) -> list[str]:
    words = []
    if damping is None:
        words.append(
            "no compound has a loss factor, so peaks are as high as the frequency steps happen to"
            " meet them: add materials.NAME.loss_factor to the case (a Prony series adds no loss)"
        )
    if answer["harmonics"] < answer["harmonics_wanted"]:
        words.append(
            f"only waves up to {answer['harmonics'] - 1} round the circumference are in the motion"
            " at the excited point: in shorter ones the model's cords buckle"
        )
    return words
