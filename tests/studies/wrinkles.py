"""Wrinkles of a layer without bending stiffness: if cords are compressed, a finer mesh is no
better.

    python -m tests.studies.wrinkles 11R22.5 275/40R20
    python -m tests.studies.wrinkles 11R22.5 --tension_only

A layer under the compression N per width, in rubber of shear modulus G on both sides, gives way
sideways in waves of the wave number q from N = 2 G / q on (the rubber resists with 2 G q): at any
N, if the mesh has waves that are short enough. Printed: [0,0] axial and torsional, [1,1] and [4,0]
of the tyre that `tyrecal init` writes, but all of its cords bearing compression, in Hz, at a
twentieth of its pressure and at all of it, with the whole bead held and with its surface, with more
and more elements and rows between the plies.
With --tension_only no cord bears compression, which is what ever finer wrinkles come to.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.new_case import from_size
from tyrecal.tyre.case.parts import Cord, Level
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


def with_compression(case: LoadedCase, bears: bool) -> LoadedCase:
    """Case in which all cords bear compression, or none."""
    materials = {
        name: with_part(m, bears_compression=bears) if isinstance(m, Cord) else m
        for name, m in case.case.materials.items()
    }
    return changed(case, materials=materials)


def frequencies(case: LoadedCase, pressure_kPa: float) -> dict[tuple, float]:
    """Hz by c, m and kind. Raises EvaluationFailed."""
    values = start_values(case)
    evaluation = Evaluator(TyreDesign(case)).evaluate(
        Question(values | {"pressure_kPa": pressure_kPa})
    )
    return {
        (m.c, m.m, m.kind): m.frequency_Hz for m in modes_result(case, values, evaluation)[0].modes
    }


def told(case: LoadedCase, pressure_kPa: float) -> str:
    try:
        modes = frequencies(case, pressure_kPa)
    except (EvaluationFailed, InputError) as failure:
        return str(failure)[:60]
    return " | ".join(f"{modes[label]:.2f}" if label in modes else "-" for label in LABELS)


def by_size(code: str, lengths: Mapping[str, float] | None = None) -> LoadedCase:
    """Case that `tyrecal init` writes for a size code; lengths: its own gauges, m."""
    draft = from_size(parse_size(code), lengths or {}, None, "tyre")
    with TemporaryDirectory() as folder:
        Path(folder, draft.file).write_bytes(draft.content)
        Path(folder, "tyre.yaml").write_text(draft.text)
        return load_case(Path(folder, "tyre.yaml"))


def main(codes: list[str], slack: bool) -> None:
    print("| size | held | kPa | elements, rows | axial | torsional | [1,1] | [4,0] |")
    print("|---" * 8 + "|")
    for code in codes:
        case = with_compression(by_size(code), not slack)
        for holds in ("whole_bead", "bead_surface"):
            held = changed(case, rim=with_part(case.case.rim, holds=holds))
            for share in (LOW, 1.0):
                kPa = share * case.case.pressure_kPa
                for along, rows in MESHES:
                    line = told(finer(held, along, rows), kPa)
                    name = holds.replace("_", " ")
                    print(f"| {code} | {name} | {kPa:.0f} | x {along}, x {rows} | {line} |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("codes", nargs="+")
    parser.add_argument("--tension_only", action="store_true")
    given = parser.parse_args()
    main(given.codes, given.tension_only)
