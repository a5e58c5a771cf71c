"""A tyre by stations: a section of lines and regions, which tyrecal meshes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..mistakes import CaseData
from ..parts import Rubber, SectionOrigin, Solid
from ..schema import Case
from .kind import Change, TyreKind

if TYPE_CHECKING:
    from ...section.mesh import SectionMesh
    from ...section.section import Section
    from ..document import Document

TREAD = "tread"  # part of the crown between the two outermost lines


@dataclass(frozen=True)
class Stations(TyreKind):
    """A section as stations or an outline, in a file of its own."""

    needs = frozenset()
    names_its_parts = True

    def numbers(self, case: Case) -> Mapping[str, float]:
        """None: there is no deck."""
        return {}

    def read_section(
        self, document: Document, data: dict[str, Any], folder: Path
    ) -> Section | None:
        """The section of the file that the case names; None if it is wrong, mistakes added."""
        from ..stations import read_stations

        return read_stations(document, data, folder)

    def folds(self, data: CaseData, section: Section) -> str | None:
        """Why no mesh fits at the chosen level, None if one does."""
        from ..checks import folds

        return folds(data, section)

    def files(self, case: Case, folder: Path) -> list[Path]:
        """The file of the section."""
        return [folder / case.section.file]

    def content_sha256(self, section: Section | None) -> str:
        """Hash of the drawn geometry."""
        assert section is not None
        return _sha256(section)

    def mesh(self, tyre: Any) -> SectionMesh:
        """The mesh at the case's level, its gauges applied. Raises SectionError where it folds."""
        return mesh_at_level(tyre.case, tyre.gauged)

    def section_origin(self, case: Case) -> SectionOrigin | None:
        """As the case states it, None where it does not."""
        return case.section.known_from

    def change_of(self, effect: Any, case: Case) -> Change:
        """The effect as its author wrote it."""
        change: Change = effect.add
        return change

    def check_effect(self, effect: Any, case: Any) -> None:
        """Every effect suits a section; one that a value makes impossible is refused there."""

    def shape_uncertainty(self, effect: Any) -> Change | None:
        """The effect's own, None where it has none."""
        change: Change | None = effect.shape_uncertainty
        return change

    def parts(self, case: Case, section: Section) -> tuple[Case, Mapping[str, str]]:
        """A rubber of its own in every region (the crown's in two: tread and what lies under it).

        Cords keep their materials, which are parts too. Design variables set all copies.
        """
        lines, names = section.names, [name for name, _ in section.regions]
        materials, solids, parts = dict(case.materials), [], {}
        copies: dict[str, list[str]] = {}
        for i, solid in enumerate(case.solids):
            for region in solid.regions or names:
                # name, and the two lines that bound it; None: the inner and the outer surface
                pieces: list[tuple[str, list[str] | None]] = [(region, solid.between)]
                if region == names[0] and solid.between is None:
                    pieces = [
                        (f"{region} under the tread", [lines[0], lines[-2]]),
                        (TREAD, [lines[-2], lines[-1]]),
                    ]
                for words, between in pieces:
                    copy = f"part_{i}_{words.replace(' ', '_')}"
                    materials[copy] = case.materials[solid.material]
                    copies.setdefault(solid.material, []).append(copy)
                    solids.append(Solid(material=copy, regions=[region], between=between))
                    one = len(case.solids) == 1
                    parts[copy] = words.replace("_", " ") + ("" if one else f", {solid.material}")
        for name, own in case.materials.items():
            if not isinstance(own, Rubber):
                parts[name] = name.replace("_", " ") + "s"

        def paths_of_copies(path: str) -> list[str]:
            """Paths of the same number of a material's copies; none for other numbers."""
            head, _, rest = path.partition(".")
            material, _, key = rest.partition(".")
            same = copies.get(material, []) if head == "materials" else []
            return [f"materials.{copy}.{key}" for copy in same]

        variables = {name: v.with_copies(paths_of_copies) for name, v in case.variables.items()}
        wanted = {"materials": materials, "solids": solids, "variables": variables}
        return case.model_copy(update=wanted), parts

    def moduli(self, case: Case, material: str) -> dict[str, int]:
        """Constants of a rubber, or the modulus of a cord, by path: 1 where it grows with the
        stiffness, -1 where it falls (D1)."""
        rubber = isinstance(case.materials[material], Rubber)
        signs = {"C10_Pa": 1, "C01_Pa": 1, "D1_per_Pa": -1} if rubber else {"youngs_modulus_Pa": 1}
        return {f"materials.{material}.{key}": sign for key, sign in signs.items()}

    def density(self, material: str) -> str:
        """Path of a material's density."""
        return f"materials.{material}.density_kg_per_m3"


def with_gauges_of(case: Case, section: Section) -> Section:
    """The section with the gauges of the case applied."""
    from ...section.section import with_gauges

    gauges = case.section.gauges or []
    return with_gauges(
        section,
        tuple((tuple(g.regions or ()), (g.between[0], g.between[1]), g.factor) for g in gauges),
    )


def mesh_at_level(case: Case, gauged: Section) -> SectionMesh:
    """The mesh of a gauged section at the case's level. Raises SectionError where it folds."""
    from ...section.mesh import kept_mesh

    level = case.mesh.levels[case.mesh.level]
    elements = tuple(level.elements[name] for name, _ in gauged.regions)
    grading = tuple(level.grading) if level.grading else None
    quadratic = case.mesh.element.startswith("CGAX8")
    rows, whole_bead = tuple(level.rows), case.rim.holds_whole_bead
    return kept_mesh(gauged, elements, rows, quadratic, grading, whole_bead)


@lru_cache(maxsize=8)
def _sha256(section: Section) -> str:
    """Hash of the section's geometry in m: the curves of its outline, or else its stations."""
    content: Any = [curve.tolist() for curve in section.outline]
    if not section.outline:
        points = section.points + 0.0  # -0.0 becomes 0.0
        content = [section.names, section.regions, section.rigid.tolist(), points.tolist()]
    return sha256(json.dumps(content).encode()).hexdigest()
