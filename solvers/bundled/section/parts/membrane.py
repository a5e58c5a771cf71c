"""The compound of membranes, in which a tyre maker's pre-processor lays the cords of a ply.

The rows are the columns of F along the meridian and around; cords are those of `cords`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....language.text import WHOLE_DECK, DeckError
from .. import shapes
from ..elements import Lines
from ..laws.hyperelastic import Hyperelastic
from ..laws.plane_stress import PlaneStress
from .cords import cord_rows
from .elastic import Elastic
from .part import Rows, SectionJob, TyrePart, consistent_mass


def read(job: SectionJob) -> list[TyrePart]:
    """The membranes of each element type and law. Raises DeckError."""
    owned: dict[str, set[int]] = {}
    groups: dict[tuple[str, type[Hyperelastic]], list[tuple[np.ndarray, list]]] = {}
    for kind, rows, law, numbers in _sections(job):
        before = owned.setdefault(kind, set())
        if before & set(rows.tolist()):
            raise DeckError(WHOLE_DECK, f"a {kind} element has two *MEMBRANE SECTION")
        before |= set(rows.tolist())
        groups.setdefault((kind, type(law)), []).append((rows, [law, *numbers]))
    for kind, connectivity in job.mesh.connectivity.items():
        if kind in shapes.MEMBRANES and len(owned.get(kind, ())) < len(connectivity):
            raise DeckError(WHOLE_DECK, f"a {kind} element has no *MEMBRANE SECTION")
    return [_part(job, kind, own) for (kind, _), own in groups.items()]


def _sections(job: SectionJob) -> Iterator[tuple[str, np.ndarray, Hyperelastic, list]]:
    """Element type, rows (e,) of its block, law of the material; thickness (m), density (kg/m3),
    dynamic over static shear and bulk modulus. Raises DeckError."""
    for k in job.keywords:
        if k.name != "MEMBRANE SECTION":
            continue
        material = job.material(k, k.need("MATERIAL"))
        law, thickness = material.law, k.only_row().value(0)
        if law is None:
            raise DeckError(k.place, f"material {material.name} of a membrane is no solid's")
        if material.table in job.tables:
            words = f"material {material.name} of a membrane needs a Prony series, no table"
            raise DeckError(k.place, words)
        if material in job.lossy:
            raise DeckError(
                k.place, f"the damping of material {material.name}, of a membrane, is not honoured"
            )
        if not np.real(thickness) > 0:
            raise DeckError(k.place, "the thickness of a membrane must be positive")
        law = law.scaled(*material.static_scale(job.long_term))
        law = law.nearly_incompressible() if law.incompressible else law
        ratios = material.dynamic_ratio(job.dynamic_Hz, job.long_term)
        for kind, rows in job.by_type(k, shapes.MEMBRANES).items():
            yield kind, rows, law, [thickness, material.density, *ratios]


def _part(job: SectionJob, kind: str, sections: list[tuple[np.ndarray, list]]) -> TyrePart:
    """The membranes of one element type, each row of ``sections`` with its law and thickness."""
    block = job.mesh.blocks[kind]
    assert isinstance(block, Lines)
    lines = block.pick(np.concatenate([rows for rows, _ in sections]))
    owner = np.repeat(np.arange(len(sections)), [len(rows) for rows, _ in sections])
    laws = [own[0] for _, own in sections]
    thickness, density, shear, bulk = np.array([own[1:] for _, own in sections]).T[:, owner]
    points = lines.R.shape[1]
    law = laws[0].of_points(laws, np.repeat(owner, points))
    if np.any(shear != 1) or np.any(bulk != 1):
        ratios = {"shear_ratio": np.repeat(shear, points), "bulk_ratio": np.repeat(bulk, points)}
        law = type(law)(**{**vars(law), **ratios})
    along, around = cord_rows(lines, cos=1.0, sin=0.0), cord_rows(lines, cos=0.0, sin=1.0)
    volume = thickness[:, None] * along.weights  # m3 per radian
    rows = Rows(
        B0=np.concatenate([along.B0, around.B0], 2),
        hoop=around.hoop,
        around=slice(3, 6),  # du/dTheta changes the column around alone
        rest=np.concatenate([along.rest, around.rest], 2),
        weights=volume,
    )
    mass = consistent_mass(lines.N, density[:, None] * volume)
    return Elastic(lines.connectivity, rows, PlaneStress(law), mass)
