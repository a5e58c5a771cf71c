"""Measurements from one line of a table, whose columns `columns.read_columns` has identified."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite, nan

from ..errors import InputError
from ..simulate.modes.label import Label
from ..simulate.settings import settings
from ..tyre.case.parts import RimSupport
from ..tyre.number_table import NumberMarks
from ..tyre.state import RIMS
from ..tyre.usual import USUAL_MEASUREMENTS
from ..units import QUANTITIES
from .columns import DAMPING_RATIO_OF, TableColumn
from .measurement import AS_CASE, DAMPING_RATIO, OF_A_MODE, Measurement
from .mode_names import label_parts

MAX_ORDERS = {"c": 20, "m": 3}  # largest numbers of a label in a table
KIND_WORDS = {"": None, "axial": "axial", "lateral": "axial"}
KIND_WORDS |= dict.fromkeys(("torsional", "torsion", "rotational"), "torsional")
# member of a pair by the words of its cell; "": one value for both
DOUBLET_WORDS = {"": "", "1": "1", "2": "2", "a": "1", "b": "2", "lower": "1", "upper": "2"}
LOADED_MEMBERS = ("symmetric", "antisymmetric")


@dataclass(frozen=True)
class Line:
    """A line of a table. Its methods raise InputError, whose text says what is wrong."""

    place: str  # file and line
    # by meaning, a key of `columns.HEADINGS`: a quantity, "pressure", "label", "sigma", ...
    cells: Mapping[str, str]
    # by meaning: index of the column, and the factor from its unit to that of the meaning
    columns: Mapping[str, TableColumn]
    marks: NumberMarks  # decimal mark and separator of thousands of the file
    labelled: bool = True  # whether a frequency must have a label

    def cell(self, meaning: str) -> str:
        """Text of a cell; "" if there is no such column."""
        return self.cells.get(meaning, "")

    def number(self, meaning: str, default: float | None = None) -> float:
        """Number of a cell in the unit of `TableColumn.factor`; ``default`` if it is empty."""
        cell = self.cell(meaning)
        if not cell and default is not None:
            return default
        try:
            value = self.marks.number(cell)
        except InputError as error:
            raise InputError(f"{meaning} is '{cell}', {error}") from None
        if not isfinite(value):
            raise InputError(f"{meaning} is '{cell}', must be a number")
        return value * self.columns[meaning].factor

    def measurements(self, pressure_kPa: float, run: str) -> Iterator[Measurement]:
        """One measurement for each quantity of the line.

        pressure_kPa: used if the line has none; run: name of the test, before the line's own run.
        """
        pressure, load = self.number("pressure", pressure_kPa), self.number("load", 0.0)
        if load < 0:
            raise InputError(f"load is {load:g}, must be at least 0")
        quantities = self._quantities()
        sigma = self.columns["sigma"] if self.cell("sigma") else None
        if sigma and sigma.of and not {*sigma.of} & {*quantities}:
            which = " or ".join(sigma.of)
            raise InputError(f"sigma has the unit of {which}, which has no value here")
        if sigma and not sigma.of and not sigma.percent and len(quantities) > 1:
            raise InputError(
                f"sigma can be that of {' or '.join(quantities)}: write its unit, as in"
                " 'sigma [Hz]', or 'sigma [%]' for all of them"
            )
        for quantity in quantities:
            value = self.number("value" if self.cell("value") else quantity)
            label, member = None, ""
            if quantity in OF_A_MODE:
                label = self._label()
                member = self._member(label, bool(load)) if label else ""
            has_sigma = sigma and (not sigma.of or quantity in sigma.of)
            deviation = self.number("sigma") if has_sigma else nan
            if sigma and sigma.percent:
                deviation *= 0.01 * value
            elif sigma and not sigma.of:  # without a unit: in that of the value
                deviation *= self.columns["value" if self.cell("value") else quantity].factor
            rim = self._rim()
            is_modal = quantity == "frequency_Hz"
            is_mass = quantity == "mass_kg"  # which neither the pressure nor the rim changes
            yield Measurement(
                quantity=quantity,
                label=label,
                member=member,
                pressure_kPa=0.0 if is_mass else pressure,
                load_N=load,
                value=value,
                sigma=deviation,
                run=f"{run} {self.cell('run')}".rstrip(),
                place=self.place,
                rim=None if is_mass else rim,
                damping_ratio=self._damping_ratio() if is_modal else nan,
            )

    def _damping_ratio(self) -> float:
        """Damping ratio of the line's mode, NaN where none is given. Raises InputError."""
        given = [meaning for meaning in DAMPING_RATIO_OF if self.cell(meaning)]
        if not given:
            return nan
        ratio = DAMPING_RATIO_OF[given[0]] * self.number(given[0])
        if refusal := USUAL_MEASUREMENTS[DAMPING_RATIO].refusal(ratio):
            raise InputError(
                f"{given[0]} is '{self.cell(given[0])}', a damping ratio of {ratio:g}: {refusal};"
                " write percent as in 'damping [%]'"
            )
        return ratio

    def _quantities(self) -> list[str]:
        """Quantities that the line states: the one named, or each that has a column. Raises
        InputError."""
        if not self.cell("value"):
            if quantities := [quantity for quantity in QUANTITIES if self.cell(quantity)]:
                return quantities
            raise InputError(
                "nothing was measured: the cell of the value is empty; write n.a. if that is meant"
            )
        quantity = self.cell("quantity")
        known = [*QUANTITIES, DAMPING_RATIO]
        if quantity not in known:
            raise InputError(f"quantity is '{quantity}', must be one of {', '.join(known)}")
        if quantity == DAMPING_RATIO and not self.cell("c"):
            raise InputError(f"c is '', must be a whole number for {quantity}")
        if quantity not in OF_A_MODE and any(map(self.cell, ("c", "m", "kind", "member"))):
            raise InputError(f"c, m, kind and member must be empty for {quantity}")
        return [quantity]

    def _rim(self) -> RimSupport | None:
        """State of the rim: None, the case's, if there is no column; fixed if the cell is empty."""
        word = self.cell("rim").strip().lower() or RIMS[0]
        if "rim" not in self.columns or word == AS_CASE:
            return None
        for rim in RIMS:
            if word == rim:
                return rim
        known = ", ".join((*RIMS, AS_CASE))
        raise InputError(
            f"rim is '{self.cell('rim')}', must be one of {known} (as the case has it)"
        )

    def _label(self) -> Label | None:
        """Label by the cells ``label``, ``c``, ``m`` and ``kind``; None if the line has none.
        Raises InputError."""
        c, m, kind = self.cell("c"), self.cell("m"), self.cell("kind")
        if not self.labelled and not any(map(self.cell, ("label", "c", "m", "kind", "member"))):
            return None
        parts = label_parts(self.cell("label"), settings().mode_names) or ()
        if parts and c and m and (c, m) != parts[:2]:
            raise InputError(f"label is '{self.cell('label')}', but c is {c} and m is {m}")
        if parts and kind and parts[2] and KIND_WORDS.get(kind) != KIND_WORDS.get(parts[2]):
            raise InputError(f"label is '{self.cell('label')}', but kind is '{kind}'")
        # in a table that has a column c, the label is the running number of the mode
        if self.cell("label") and "c" not in self.cells:
            if not parts:
                raise InputError(
                    f"label is '{self.cell('label')}', must be like [2,1], or [0,0] lateral or"
                    " torsional, vertical, '2nd in-plane bending'; the settings file may add others"
                    " under mode_names"
                )
            c, m, kind = *parts[:2], kind or parts[2]
        for name, cell in (("c", c), ("m", m)):
            if not (cell.isdecimal() and int(cell) <= MAX_ORDERS[name]):
                raise InputError(
                    f"{name} is '{cell}', must be a whole number from 0 to {MAX_ORDERS[name]}"
                )
        word = kind.strip().lower()
        if word not in KIND_WORDS:
            raise InputError(f"kind is '{kind}', must be lateral (axial), torsional or empty")
        zero = int(c) == int(m) == 0
        if zero and not word:
            raise InputError("[0,0] needs a kind, lateral (axial) or torsional")
        # in tables of other programs the column may describe every mode; only [0,0] needs it
        if word and not zero and self.cell("value"):
            raise InputError(f"kind is '{kind}', must be empty: only [0,0] has one")
        return Label(int(c), int(m), KIND_WORDS[word] if zero else None)

    def _member(self, label: Label, loaded: bool) -> str:
        """Member of a pair, or symmetry under load, by the cell ``member``. Raises InputError."""
        word = self.cell("member").lower()
        if loaded and word in LOADED_MEMBERS:
            return word
        if not loaded and word in DOUBLET_WORDS and (label.c or not word):
            return DOUBLET_WORDS[word]
        wanted = "1, 2 or empty" if label.c else f"empty for {label}"
        wanted = "symmetric or antisymmetric under load" if loaded else wanted
        raise InputError(f"member is '{self.cell('member')}', must be {wanted}")
