"""Where cords are compressed a finer mesh is no better: a layer without bending stiffness wrinkles.

    python -m tests.studies.wrinkles 11R22.5 275/40R20

A layer under the compression N per width, in rubber of shear modulus G on both sides, gives way
sideways in waves of the wave number q from N = 2 G / q on (the rubber resists with 2 G q): at any
N, if the mesh has waves that are short enough. Printed: [0,0] axial and torsional, [1,1] and [4,0]
of the tyre that `tyrecal init` writes, in Hz, at a twentieth of its pressure and at all of it, with
the whole bead held and with its surface, with more and more elements and rows between the plies.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.new_case import from_size
from tyrecal.tyre.case.parts import Level
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.load import load_case
from tyrecal.tyre.section.size import parse_size

LABELS = [(0, 0, "axial"), (0, 0, "torsional"), (1, 1, None), (4, 0, None)]
MESHES = [(1, 1), (1, 4), (2, 2), (3, 3)]  # elements and rows inside, times the default's
LOW = 0.05  # of the tyre's pressure


def finer(case: LoadedCase, along: int, rows: int) -> LoadedCase:
    """More elements, and more rows between all lines but the outermost two."""
    mesh = case.case.mesh
    default = mesh.levels["default"]
    level = Level(
        elements={region: along * n for region, n in default.elements.items()},
        rows=[*(rows * n for n in default.rows[:-1]), default.rows[-1]],
        grading=default.grading,
    )
    levels = {**mesh.levels, "finer": level}
    return changed(case, mesh=with_part(mesh, levels=levels, level="finer"))


def told(case: LoadedCase, pressure_kPa: float) -> str:
    values = start_values(case)
    question = Question(values | {"pressure_kPa": pressure_kPa})
    try:
        found = Evaluator(TyreDesign(case)).evaluate(question)
    except (EvaluationFailed, InputError) as failure:
        return str(failure)[:60]
    modes = {(m.c, m.m, m.kind): m.frequency_Hz for m in modes_result(case, values, found)[0].modes}
    return " | ".join(f"{modes[label]:.2f}" if label in modes else "-" for label in LABELS)


def main(codes: list[str]) -> None:
    print("| size | held | kPa | elements, rows | axial | torsional | [1,1] | [4,0] |")
    print("|---" * 8 + "|")
    for code in codes:
        draft = from_size(parse_size(code), {}, None, "tyre")
        with TemporaryDirectory() as folder:
            Path(folder, draft.file).write_bytes(draft.content)
            Path(folder, "tyre.yaml").write_text(draft.text)
            case = load_case(Path(folder, "tyre.yaml"))
        for holds in ("whole_bead", "bead_surface"):
            held = changed(case, rim=with_part(case.case.rim, holds=holds))
            for share in (LOW, 1.0):
                kPa = share * case.case.pressure_kPa
                for along, rows in MESHES:
                    frequencies = told(finer(held, along, rows), kPa)
                    name = holds.replace("_", " ")
                    print(f"| {code} | {name} | {kPa:.0f} | x {along}, x {rows} | {frequencies} |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("codes", nargs="+")
    main(parser.parse_args().codes)
