"""A user's decks in three dimensions, in the order in which they are run: their numbers, pressure,
crown and modes. Nothing of the tyre is read out of them: they are the solver's."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from ...errors import InputError
from .numbers import DECK_MARK, plain_number
from .own_deck import UNIT_LENGTH, UNIT_MASS, OwnDeck, Units, read_own_deck
from .own_text import Setting, own_texts
from .text import Block, OwnDeckError, Place, Row, named, split_steps

JOB_FILE = re.compile(r"[A-Za-z0-9_\-]{1,60}\.inp", re.IGNORECASE)  # a file that names a job
PRESSURE_MARK = "pressure"  # filled with the case's pressure
MARK_IT = f"write {{{{ {PRESSURE_MARK} }}}} in its place"
PRESSURE_DOF = "8"  # of a fluid cavity's reference node
NO_PRESSURE = "HP", "NU"  # in the names of hydrostatic and non-uniform loads
OF_VOLUMES = re.compile(r"C3D|CCL|DC3D|(SF)?M(3D|CL)|S\d")  # types of elements in 3-D
CONTINUES = {"SYMMETRIC MODEL GENERATION", "SYMMETRIC RESULTS TRANSFER", "IMPORT"}


@dataclass(eq=False)
class OwnDecks:
    """The decks, all of one folder and in the same units; ``crown``: their node set of the crown's
    centre line round the tyre, or of several lines."""

    decks: tuple[OwnDeck, ...]
    crown: str

    @property
    def path(self) -> Path:
        """The last one's, which finds the modes."""
        return self.decks[-1].path

    @property
    def units(self) -> Units:
        """Units of all the decks."""
        return self.decks[0].units

    @cached_property
    def blocks(self) -> list[Block]:
        """Blocks of all the decks, one deck after the other."""
        return [block for deck in self.decks for block in deck.blocks]

    @cached_property
    def texts(self) -> dict[str, str]:
        """Texts by file, relative to their folder."""
        return {file: text for deck in self.decks for file, text in deck.texts.items()}

    @cached_property
    def marks(self) -> dict[str, Block]:
        """Marks except the pressure's, each with its block."""
        by_name = {name: block for deck in self.decks for name, block in deck.marks.items()}
        return {name: block for name, block in by_name.items() if name != PRESSURE_MARK}

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Plain numbers by path; one that two decks state has a path where they agree."""
        by_path: dict[str, set[float]] = {}
        for deck in self.decks:
            for path, value in deck.numbers.items():
                by_path.setdefault(path, set()).add(value)
        return {path: min(values) for path, values in by_path.items() if len(values) == 1}

    @cached_property
    def sha256(self) -> str:
        """Hash of all their content except plain numbers, and of the set that is the crown."""
        parts = [*(deck.sha256 for deck in self.decks), self.crown]
        return sha256("\n".join(parts).encode()).hexdigest()

    @cached_property
    def jobs(self) -> list[tuple[str, str]]:
        """Each job and the one before it that it goes on from, "" where it is whole by itself.
        Raises OwnDeckError where the first goes on from a job that is not among them."""
        jobs: list[tuple[str, str]] = []
        for deck in self.decks:
            reads = next((b for b in deck.blocks if b.name in CONTINUES or _restarts(b)), None)
            if reads and not jobs:
                raise reads.refused("continues a job, and no deck before this one has its name")
            jobs.append((deck.path.stem, jobs[-1][0] if reads else ""))
        return jobs

    @cached_property
    def restarted(self) -> list[OwnDeck]:
        """The last deck and those before it whose analysis it goes on with by *RESTART, in their
        order: for ABAQUS one analysis, which has one format of its results file."""
        chain = [self.decks[-1]]
        while any(map(_restarts, chain[0].blocks)):
            chain.insert(0, self.decks[self.decks.index(chain[0]) - 1])
        return chain

    @cached_property
    def modes_step(self) -> list[Block]:
        """The last deck's step that finds the modes, *STEP to *END STEP. Raises OwnDeckError."""
        _, steps = split_steps(self.decks[-1].blocks)
        modal = [step for step in steps if any(block.name == "FREQUENCY" for block in step)]
        if len(modal) != 1:
            words = "the last deck finds the modes: it needs one step with *FREQUENCY, it has"
            raise OwnDeckError(Place(self.path.name, 1), f"{words} {len(modal)}")
        return modal[0]

    @cached_property
    def modes(self) -> int | None:
        """Number of modes that are requested; None where a range of frequencies decides. Data of
        *FREQUENCY: number, lowest, highest frequency."""
        row = next(b for b in self.modes_step if b.name == "FREQUENCY").only_row()
        return None if row.text(1) or row.text(2) or not row.text(0) else row.integer(0)

    @cached_property
    def solid_sets(self) -> list[str]:
        """Element sets that have a section, and so a mass."""
        names = [b.get("ELSET") for b in self.blocks if b.name.endswith(" SECTION")]
        return list(dict.fromkeys(name for name in names if name))

    @cached_property
    def pressures(self) -> list[tuple[OwnDeck, Row, int, float]]:
        """Deck, data line and field of each pressure, and its share of the largest, with its sign.

        Empty where `PRESSURE_MARK` says where. Raises OwnDeckError where it cannot be told.
        """
        if any(PRESSURE_MARK in deck.marks for deck in self.decks):
            return []
        # last amplitude of pairs of time and amplitude, "" if there is no pair
        tables = (b for b in self.blocks if b.name == "AMPLITUDE" and b.rows)
        ends = {b.get("NAME"): [*filter(None, b.rows[-1].fields), ""][-2] for b in tables}
        loads = [(deck, *place) for deck in self.decks for place in _pressures(deck.blocks, ends)]
        largest = max((abs(value) for *_, value in loads), default=0.0)
        if not largest:
            words = "no pressure is found in *DSLOAD, *DLOAD, or *BOUNDARY of the degree of freedom"
            place = Place(self.decks[0].path.name, 1)
            raise OwnDeckError(place, f"{words} {PRESSURE_DOF}: {MARK_IT}")
        return [(deck, row, i, value / largest) for deck, row, i, value in loads if value]

    @property
    def pressure_Pa(self) -> float:
        """The largest of theirs. Raises OwnDeckError."""
        own = max(abs(row.number(i)) for _, row, i, _ in self.pressures)
        return own * UNIT_MASS[self.units] / UNIT_LENGTH[self.units]

    def with_numbers(self, numbers: Mapping[str, float], pressure_Pa: float) -> list[list[Block]]:
        """The blocks of each deck with marks and numbers set. Raises OwnDeckError."""
        known = self._known(numbers, pressure_Pa)
        return [deck.with_numbers(known) for deck in self.decks]

    def _known(self, numbers: Mapping[str, float], pressure_Pa: float) -> dict[str, float]:
        """Numbers, and the pressure in the decks' unit, mass / (length s^2)."""
        own = pressure_Pa * UNIT_LENGTH[self.units] / UNIT_MASS[self.units]
        return {**numbers, PRESSURE_MARK: own}

    def filled(self, numbers: Mapping[str, float], pressure_Pa: float) -> dict[str, str]:
        """The texts with marks, numbers and the pressure set. Raises OwnDeckError."""
        known = self._known(numbers, pressure_Pa)
        pressure = known[PRESSURE_MARK]
        files: dict[str, str] = {}
        for deck in self.decks:
            for name, block in deck.marks.items():
                if name not in known:
                    raise block.refused(f"the mark {name} has no number: give it in deck.numbers")
            own: list[Setting] = [
                (row, i, share * pressure)
                for its, row, i, share in self.pressures
                if its is deck and abs(row.number(i) / (share * pressure or 1.0) - 1) > 1e-12
            ]
            files |= own_texts(deck, known, own)
        return files

    def check(self, numbers: Mapping[str, float]) -> None:
        """Raises OwnDeckError where they cannot be run, or have no modes to label."""
        self.modes, self.jobs  # noqa: B018
        self.filled(numbers, 1.0)  # at any pressure

    @property
    def node_sets(self) -> list[str]:
        """Names of all node sets."""
        given = (block.get(key) for block in self.blocks for key in ("NSET", "NEW SET"))
        return list(dict.fromkeys(name for name in given if name))


def stands_in_space(deck: OwnDeck) -> bool:
    """Whether a deck is of a tyre in three dimensions."""
    types = (block.get("TYPE") for block in deck.blocks if block.name == "ELEMENT")
    return any(map(OF_VOLUMES.match, types))


def _restarts(block: Block) -> bool:
    """Whether its job goes on with the analysis of another."""
    return block.name == "RESTART" and "READ" in block.parameters


def _pressures(
    blocks: Sequence[Block], ends: Mapping[str, str]
) -> Iterator[tuple[Row, int, float]]:
    """Row, field and number of each pressure; ``ends``: last values of amplitudes, as they stand.
    Raises OwnDeckError where that is not the pressure that acts at a step's end."""
    for block in blocks:
        for row in block.rows:
            kind = row.name(1)
            if block.name in ("DSLOAD", "DLOAD") and re.fullmatch(r"H?P\d?(NU)?", kind):
                place = 2
            elif (
                block.name == "BOUNDARY"
                and row.text(1) == row.text(2, PRESSURE_DOF) == PRESSURE_DOF
            ):
                place = 3
            else:
                continue
            text = row.text(place)
            if not text or DECK_MARK.search(text):
                continue
            name = block.get("AMPLITUDE")
            if any(word in kind for word in NO_PRESSURE) or not plain_number(text):
                raise block.refused(f"{kind}, {text} is no plain pressure: {MARK_IT}", row)
            if name and not (plain_number(ends.get(name, "")) and float(ends[name]) == 1.0):
                raise block.refused(
                    f"the amplitude {name} does not end at 1, so that {text} is not the pressure"
                    f" that acts: {MARK_IT}",
                    row,
                )
            yield row, place, row.number(place)


def read_own_decks(paths: Sequence[Path], units: Units, crown: str) -> OwnDecks:
    """The decks in the order in which they are run. Raises InputError, OwnDeckError, OSError."""
    stems = [path.stem.upper() for path in paths]
    for path in paths:
        if not JOB_FILE.fullmatch(path.name) or path.parent != paths[0].parent:
            raise InputError(
                f"'{path.name}' must be FILE.inp, of letters, digits, - and _, in one folder with"
                " the others, as it names a job"
            )
        if stems.count(path.stem.upper()) > 1:
            raise InputError(f"'{path.name}' is given twice")
    return OwnDecks(tuple(read_own_deck(path, units) for path in paths), named(crown))
