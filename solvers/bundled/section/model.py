"""Parts of the section, with their constants, that fill the mesh."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from ...language.text import Block
from .half_mesh import half_mesh
from .laws.energy_law import EnergyLaw
from .materials import MATERIAL_READERS, Material, ModulusTable, read_materials
from .mesh import OF_THE_MESH, DeckMesh, read_mesh
from .parts import cords, membrane, rubber
from .parts.elastic import Elastic
from .parts.part import SectionJob, TyrePart

READERS = (rubber.read, membrane.read, cords.read)  # take materials by `SectionJob.material`
# keywords that assign no properties to elements
NO_SECTIONS = {*OF_THE_MESH, "MATERIAL", *MATERIAL_READERS}


@dataclass
class Model:
    """The tyre's section, ready for mechanics."""

    mesh: DeckMesh
    parts: list[TyrePart]
    tables: list[ModulusTable] = field(default_factory=list)  # moduli at each mode's own frequency
    lossy: list[Material] = field(default_factory=list)  # materials with a loss factor

    def with_laws(self, change: Callable[[EnergyLaw], EnergyLaw]) -> Model:
        """The model with changed laws."""
        parts = [replace(p, law=change(p.law)) if isinstance(p, Elastic) else p for p in self.parts]
        return replace(self, parts=parts)

    def frequency_dependent_models(self) -> list[Model]:
        """Per table a model with the tangent that grows with its modulus: the rubber's own, without
        its initial stress."""
        grown = [
            [part.frequency_dependent_part(i) for part in self.parts]
            for i in range(len(self.tables))
        ]
        return [replace(self, parts=[p for p in parts if p is not None]) for parts in grown]

    def material_parts(self, compound: int, modulus: int) -> list[TyrePart]:
        """The parts of the stiffness that are proportional to a modulus (0: shear, 1: bulk) of a
        lossy material, without its initial stress."""
        parts = [part.material_part(compound, modulus) for part in self.parts]
        return [part for part in parts if part is not None]


def build(
    keywords: list[Block],
    dynamic_Hz: float | None,
    long_term: bool,
    own_frequency: bool = False,
    half: bool = False,
) -> Model:
    """The model of a section job.

    ``dynamic_Hz``: evaluate the rubber's vibration modulus at this frequency, None = static;
    ``long_term``: the static state is relaxed (else instantaneous moduli); ``own_frequency``:
    rubber with a table of moduli keeps its static modulus, the table is in the model's; ``half``:
    the elements of z >= 0, which stand for all (see `symmetry`).
    Raises DeckError.
    """
    mesh = read_mesh(keywords)
    if half:
        folded = half_mesh(mesh)
        assert folded is not None  # `boundary.keeps_half_turn` has been asked
        mesh = folded
    materials = read_materials(keywords)
    known = [m.table for m in materials.values() if m.table is not None]
    tables = list(dict.fromkeys(known)) if own_frequency else []
    lossy = [m for m in materials.values() if m.loss is not None]
    job = SectionJob(keywords, mesh, materials, tables, lossy, dynamic_Hz, long_term)
    return Model(mesh, [part for read in READERS for part in _parts(read, job)], tables, lossy)


@dataclass(frozen=True)
class _Known:
    """Parts that one of `READERS` has read of a job that carries no tangent."""

    read: Callable[[SectionJob], list[TyrePart]]
    job: SectionJob
    parts: list[TyrePart]

    def same(self, read: Callable[[SectionJob], list[TyrePart]], job: SectionJob) -> bool:
        """Whether the parts that ``read`` reads of ``job`` are these."""
        own = self.job
        return (
            read is self.read
            and job.mesh is own.mesh
            and _sections(job) == _sections(own)
            and (job.tables, job.lossy) == (own.tables, own.lossy)
            and (job.dynamic_Hz, job.long_term) == (own.dynamic_Hz, own.long_term)
            and all(job.materials.get(name) is m for name, m in own.used.items())
        )


_KNOWN: deque[_Known] = deque(maxlen=12)


def _sections(job: SectionJob) -> list[Block]:
    """The blocks of a job without those of its materials and of its mesh."""
    return [k for k in job.keywords if k.name not in NO_SECTIONS]


def _parts(read: Callable[[SectionJob], list[TyrePart]], job: SectionJob) -> list[TyrePart]:
    """The parts that a reader reads; where a tangent changes none of them, those that are known."""
    for known in _KNOWN:
        if known.same(read, job):
            return known.parts
    own = replace(job, used={})
    parts = read(own)
    if not any(k.is_seeded for k in job.keywords):
        _KNOWN.append(_Known(read, own, parts))
    return parts
