"""Response functions: the force of the tyre on a hub that is held, or the motion of one that moves,
and motions of the tread, per force on it, next to measured ones. Points and directions are those of
`response_points`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..files import Json
from ..measured.universal_text import WrittenFunction, function_set, universal_text
from ..simulate.evaluate.evaluator import Evaluator
from ..tyre.case import LoadedCase
from ..tyre.state import is_free
from .measured_response import MeasuredResponse, agreement, points_of, read_measured_responses
from .response_points import (
    HUB_CHANNELS,
    HUB_MOTIONS,
    HUB_PLACES,
    TREAD_MOTIONS,
    TREAD_SYSTEM,
    ResponsePoint,
    read_points,
)
from .result import Column, CsvRow, Result, ResultPart, StudyInput, Table, csv_text

Array = np.ndarray
ResponseForm = Literal["receptance", "accelerance"]
TO_HZ, STEP_HZ, PATCH_MM = 300.0, 0.5, 20.0  # defaults of the options
ZERO_BY_SYMMETRY = 1e-10  # of the largest response of its kind
MAX_BAND_HZ, MAX_RESPONSE_STEPS = 1000.0, 5000
HUB_NODE, FIRST_TREAD_NODE = 1, 101  # numbers in universal files


def default_points(load_N: float, moves: bool) -> dict[str, str]:
    """Where the force and the response are if not given: below the hub, and under a load, whose
    patch the road holds, above it; ``moves``: the rim does."""
    point = "tread:180deg:radial" if load_N else "tread:0deg:radial"
    return {"excite": point, "respond": f"hub:{'z' if moves else 'fz'},{point}"}


def rim_moves(evaluator: Evaluator) -> bool:
    """Whether the case's wheel is free or on springs while it vibrates."""
    return "spindle" in evaluator.design.needs


def response_request(
    excite: str,
    respond: str,
    from_Hz: float,
    to_Hz: float,
    step_Hz: float,
    patch_mm: float,
    moves: bool = False,
) -> Json:
    """The request to a solver; moves: the rim does. Raises InputError."""
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
        "respond": [
            [p.angle_deg, p.channel] for p in _of_tread(read_points(respond, moves=moves), forces)
        ],
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
    # receptance, accelerance, blocked force or blocked moment; of turns of the hub in rad
    quantity: Annotated[str, Column("quantity", "")]
    unit: Annotated[str, Column("unit", "")]  # unit of the function
    # magnitude at the lowest frequency
    at_lowest: Annotated[float, Column("at the lowest Hz", ".4g")]
    peak_Hz: Annotated[float, Column("peak at Hz", ".1f")]  # frequency of the highest peak
    peak: Annotated[float, Column("peak", ".4g")]  # magnitude of the highest peak
    real: list[float]  # real part by frequency
    imag: list[float]  # imaginary part by frequency
    frac: float | None = None  # with the measured function, 0 to 1
    level_dB: float | None = None  # of the measured over the computed one, by mean squares
    measured_real: list[float] = Field(default=[])  # real part of the measured function
    measured_imag: list[float] = Field(default=[])  # imaginary part of the measured function

    @property
    def values(self) -> Array:
        """The function (f,), complex."""
        return np.array(self.real) + 1j * np.array(self.imag)

    @property
    def measured(self) -> Array:
        """The measured function (f,), complex; empty where there is none."""
        return np.array(self.measured_real) + 1j * np.array(self.measured_imag)

    def compared(self, measured: MeasuredResponse | None) -> ResponseFunctionEntry:
        """The function with a measured one, if there is one."""
        if measured is None:
            return self
        values = measured.as_form(self.quantity)
        parts = {"measured_real": values.real.tolist(), "measured_imag": values.imag.tolist()}
        return self.model_copy(update={**parts, **agreement(values, self.values)})


COMPARED = {"frac": Column("FRAC", ".3f"), "level_dB": Column("measured/computed dB", "+z.1f")}


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
    load_N: float = 0.0  # load on the road, with the patch held; absent: unloaded
    # what holds the rim; absent: held
    wheel: Literal["held", "springs", "free"] = "held"
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
        excite: str = "",
        respond: str = "",
        from_Hz: float = 0.0,
        to_Hz: float = TO_HZ,
        step_Hz: float = STEP_HZ,
        patch_mm: float = PATCH_MM,
        form: ResponseForm = "receptance",
        measured: Path | None = None,
        load_N: float = 0.0,
    ) -> FrfResult:
        """The last design, on the case's rim, or at a load with rim and patch held. With a measured
        file, at its points, unless they are given, and at its frequencies from ``from_Hz`` to
        ``to_Hz``. A free wheel has no response at 0 Hz: then ``step_Hz`` is the first. Raises
        InputError, EvaluationFailed."""
        known = read_measured_responses(measured, form, from_Hz, to_Hz) if measured else []
        moves = rim_moves(given.evaluator)
        places = points_of(known) if known else default_points(load_N, moves)
        excite, respond = excite or places["excite"], respond or places["respond"]
        if known:
            f = known[0].frequency_Hz
            from_Hz, to_Hz, step_Hz = float(f[0]), float(f[-1]), float(np.ptp(f) / (len(f) - 1))
        elif is_free(given.case):
            from_Hz = from_Hz or step_Hz
        request = response_request(excite, respond, from_Hz, to_Hz, step_Hz, patch_mm, moves)
        name, values = [*given.designs.items()][-1]
        forces, seen = read_points(excite, hub=False), read_points(respond)
        tread = _of_tread(seen, forces)
        by_points = {(each.excite, each.respond): each for each in known}
        if known and not by_points.keys() & {(force, point) for force in forces for point in seen}:
            raise InputError(
                f"{measured}: no function in it is of {excite} and {respond}; the first is of"
                f" {known[0].excite} and {known[0].respond}"
            )
        result = given.evaluator.respond(values, request, load_N)
        answer = result.response
        functions = [
            _entry(answer, force, e, point, tread, form).compared(by_points.get((force, point)))
            for e, force in enumerate(forces)
            for point in seen
        ]
        functions_of_tyre = cls(
            format=1,
            design=name,
            pressure_kPa=result.pressure_kPa,
            patch_mm=patch_mm,
            radius_m=float(answer["radius_m"]),
            harmonics=int(answer["harmonics"]),
            frequency_Hz=[float(f) for f in answer["frequency_Hz"]],
            functions=functions,
            findings=ResponseFindings(
                words=_words(answer, load_N, moves) + _compared_words(functions)
            ),
        )
        if load_N:
            functions_of_tyre = functions_of_tyre.model_copy(update={"load_N": load_N})
        if moves:
            wheel = "free" if is_free(given.case) else "springs"
            functions_of_tyre = functions_of_tyre.model_copy(update={"wheel": wheel})
        text = functions_of_tyre.universal(given.case)
        files = [measured] if measured else []
        written = functions_of_tyre.with_files({"frf.uff": text})
        return given.stamped(written, measured=files, load_N=load_N)

    def quantities(self) -> dict[str, float]:
        numbers = {}
        for each in self.functions:
            where = f"{each.respond} {each.excite}"
            numbers[f"peak_Hz {where}"] = each.peak_Hz
            numbers[f"peak {where}"] = each.peak
            if each.frac is not None:
                numbers[f"frac {where}"] = each.frac
        return numbers

    def csv(self) -> str:
        keys = ["excite", "respond", "quantity", "unit", "frequency_Hz", "real", "imag"]
        keys += ["measured_real", "measured_imag"] * self._is_compared
        return csv_text(keys, self._csv_lines())

    def _csv_lines(self) -> list[CsvRow]:
        parts = ("real", "imag", "measured_real", "measured_imag")
        return [
            {**each.model_dump(exclude={*parts}), "frequency_Hz": f}
            | {key: getattr(each, key)[i] for key in parts if getattr(each, key)}
            for each in self.functions
            for i, f in enumerate(self.frequency_Hz)
        ]

    @property
    def _is_compared(self) -> bool:
        return any(each.measured_real for each in self.functions)

    def tables(self) -> list[Table]:
        more = COMPARED if self._is_compared else {}
        columns = [*ResponseFunctionEntry.columns().values(), *more.values()]
        rim = {"held": "rim held", "springs": "wheel on springs", "free": "wheel free"}
        held = f"{self.load_N:g} N, rim and contact held" if self.load_N else rim[self.wheel]
        title = f"{self.design}, {self.pressure_kPa:g} kPa, {held}, patch {self.patch_mm:g} mm"
        rows = [
            [*each.cells(), *(column.cell(getattr(each, key)) for key, column in more.items())]
            for each in self.functions
        ]
        return [Table(columns, rows, title)]

    def universal(self, case: LoadedCase) -> str:
        """Text of the universal file: the hub is node 1, points of the tread are from 101 on."""
        ends = [(read_points(x.excite)[0], read_points(x.respond)[0]) for x in self.functions]
        angles = [p.angle_deg for pair in ends for p in pair if p.angle_deg is not None]
        numbers = {a: FIRST_TREAD_NODE + i for i, a in enumerate(dict.fromkeys(angles))}
        place = lambda a: TREAD_SYSTEM.place([self.radius_m, a, 0.0])
        nodes = {HUB_NODE: [0.0] * 3, **{n: place(a).tolist() for a, n in numbers.items()}}

        def signal(point: ResponsePoint) -> tuple[int, int]:
            if point.angle_deg is None:
                return HUB_NODE, 1 + [*HUB_PLACES].index(point.channel) % len(HUB_CHANNELS)
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
        row, sign = HUB_PLACES[point.channel]
        values = sign * of_kind[row, e]
        is_force = point.channel[0] == "f"
        quantity, unit = ("blocked force", "N/N") if is_force else ("blocked moment", "N m/N")
        if point.channel in HUB_MOTIONS:
            quantity, unit = form, "rad/N" if point.channel[0] == "r" else "m/N"
    else:
        values, quantity, unit = of_kind[tread.index(point), e], form, "m/N"
    if np.abs(values).max() < ZERO_BY_SYMMETRY * np.abs(of_kind).max():
        values = 0 * values
    if quantity == "accelerance":
        values, unit = -((2 * np.pi * frequencies) ** 2) * values, unit.replace("/N", "/s²/N")
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


def _compared_words(functions: Sequence[ResponseFunctionEntry]) -> list[str]:
    """A sentence on how well computed and measured functions agree."""
    known = [each.frac for each in functions if each.frac is not None]
    if not known:
        return []
    span = " to ".join(dict.fromkeys(f"{x:.3f}" for x in (min(known), max(known))))
    return [f"{len(known)} functions were measured: FRAC {span} (1: equal up to a factor)"]


def _words(answer: Mapping[str, Any], load_N: float, moves: bool) -> list[str]:
    words = []
    if load_N:
        words.append(
            f"the contact sticks; waves up to {int(answer['harmonics']) - 1} round the"
            " circumference are in the motions: those of the tread near its own force lack the"
            " shorter ones"
        )
    if not np.imag(answer["hub"]).any():
        words.append(
            "no compound has a loss factor, so peaks are as high as the frequency steps happen to"
            " meet them: add materials.NAME.loss_factor to the case (a Prony series adds no loss)"
        )
    if moves:
        words.append(
            "the wheel moves, so that no force on the hub is blocked: hub:x to hub:rz move"
        )
    if answer["harmonics"] < answer["harmonics_wanted"]:
        words.append(
            f"only waves up to {answer['harmonics'] - 1} round the circumference are in the motion"
            " at the excited point: in shorter ones the model's cords buckle"
        )
    return words
