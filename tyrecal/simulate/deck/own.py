"""A user's deck as ABAQUS gets it, and solvers' refusals in the user's places."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import import_module
from math import isclose
from typing import Any

from ...tyre.case.kinds.section_deck import pressure_in_deck
from ...tyre.own_deck.own_deck import UNIT_LENGTH
from ...tyre.own_deck.text import Block, named
from ...tyre.resolve import Tyre
from ...tyre.templates import TemplateFailed

# lines of templates/abaqus/inflate.inp.j2 before the mesh: heading, its text, *RESTART
BEFORE = 3
PLACE = re.compile(r"^inflate\.inp, line (\d+): ")


def own_jobs(tyre: Tyre) -> tuple[dict[str, str], dict[str, Any]]:
    """Texts of the job that inflates, which is the user's deck, and of what it includes; and what
    the job that revolves it takes over, in the deck's own units: its step, from 1, the rim's
    reference node and place, sets, surfaces and pressure. Raises TemplateFailed."""
    kind, flat, c = tyre.written.kind, tyre.flat, tyre.case
    deck = kind.deck
    _refuse_unrevolved(tyre)
    (body,) = (block for block in flat.blocks.model if block.name == "RIGID BODY")
    steps = [block.place for block in deck.blocks if block.name == "STEP"]
    files = kind.own_texts(tyre)
    files["inflate.inp"] = files.pop(deck.path.name)
    loads = [block for block in flat.blocks.inflation if block.name == "DSLOAD"]
    node, (r, z) = flat.model.reference
    return files, {
        "step": 1 + steps.index(flat.blocks.inflation[0].place),
        "node": node,
        "r": r,
        "z": z,
        "rim": body.need("TIE NSET"),
        "surfaces": [row.name(0) for block in loads for row in block.rows],
        "pressure": pressure_in_deck(tyre),
        "crown": named(kind.source(c).crown),
    }


def _refuse_unrevolved(tyre: Tyre) -> None:
    """Raises TemplateFailed where ABAQUS would not revolve the deck as it stands, or into the tyre
    that the case describes."""
    deck, flat, c = tyre.written.kind.deck, tyre.flat, tyre.case
    source = tyre.written.kind.source(c)
    blocks = {block.name: block for block in deck.blocks}
    length = UNIT_LENGTH[deck.units]
    saved = any("WRITE" in block.parameters for block in deck.blocks if block.name == "RESTART")
    bodies = [block for block in deck.blocks if block.name == "RIGID BODY"]
    r, z = flat.model.reference[1]
    point = c.rim.reference_point_m
    # capabilities that take keywords which the deck does not have
    extras = {"spindle", "cavity", "coupled", "rotation"} & set(tyre.needs)
    why = {
        "a revolve takes no *PART: have it written without (in ABAQUS/CAE: Model, Edit Attributes,"
        " 'Do not use parts and assemblies in input files')": "PART" in blocks,
        "a half is not revolved: write the whole section": "SYMMETRIC MODEL GENERATION" in blocks,
        "a revolve continues from the restart file: put *RESTART, WRITE into the deck": not saved,
        "a revolve needs the rim again: hold it by one *RIGID BODY with TIE NSET": (
            len(bodies) != 1 or "TIE NSET" not in bodies[0].parameters
        ),
        "a revolve keeps the contact, which is left out here: delete it": bool(flat.blocks.contact),
        "the pressure must be a *DSLOAD": any(b.name == "DLOAD" for b in flat.blocks.inflation),
        f"it has no node set {source.crown}: name that of its crown in deck.crown": (
            named(source.crown) not in flat.model.node_sets
        ),
        "rim.reference_point_m must be the reference node's place": not (
            isclose(point.r, r * length, abs_tol=1e-9)
            and isclose(point.z, z * length, abs_tol=1e-9)
        ),
        "analysis.static_moduli must be those of its *STATIC": (
            (c.analysis.static_moduli == "long_term") != flat.long_term
        ),
        "ABAQUS gets the deck's own text with its nodes: deck.gauges must be 1": bool(
            source.thickened
        ),
        f"ABAQUS gets the deck's own text, which cannot express: {', '.join(sorted(extras))}": bool(
            extras
        ),
        "it includes a file of the name of a job": bool(
            {"inflate.inp", "modes.inp"} & ({*deck.texts} - {deck.path.name})
        ),
    }
    for reason in (words for words, so in why.items() if so):
        raise TemplateFailed(f"{deck.path.name}: {reason}")


def asked_by_abaqus(blocks: Sequence[Block], before: Sequence[Block] = ()) -> dict[str, list[str]]:
    """Sentences, with file and line, on what ABAQUS ``refuses`` by its manual of a user's deck,
    which goes on from the model of ``before``, and on what is ``unknown`` to our grammar of it."""
    check = import_module("tyrecal_solvers.abaqus.check")
    sentences: dict[str, list[str]] = {"refuses": [], "unknown": []}
    for each in check.findings(blocks, before):
        sentence = str(each.block.refused(each.words, each.row))
        sentences["refuses" if each.sure else "unknown"].append(sentence)
    return sentences


def lacking_in_calculix(blocks: Sequence[Block]) -> list[str]:
    """Sentences, with file and line, on what CalculiX lacks."""
    check = import_module("tyrecal_solvers.calculix.check")
    return [str(block.refused(why)) for block, why in check.lacking(blocks)]


def explained(tyre: Tyre, words: str, header_lines: int) -> str:
    """A solver's refusal with the line of the user's deck in place of that of the flat one, which
    comes after ``header_lines`` comments and `BEFORE`; -1: no line."""
    match = PLACE.match(words)
    line = int(match[1]) - header_lines - BEFORE - 1 if match else -1
    place = tyre.written.kind.place_of_line(tyre, line)
    return f"{place.file}, line {place.line}: {PLACE.sub('', words)}" if place else words
