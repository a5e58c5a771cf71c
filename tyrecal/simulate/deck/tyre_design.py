"""The design of a case: its tyre resolved once, written by the templates of a dialect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import takewhile
from math import ceil
from typing import Any

from ...errors import InputError
from ...tyre.case import LoadedCase, number_at, start_values
from ...tyre.case.hints import lossless_hint, slack_cord_hint
from ...tyre.case.schema import SolverChoice
from ...tyre.effects import catalogue
from ...tyre.resolve import Tyre, resolved
from ...tyre.templates import TemplateFailed, TemplateNames, environment, render
from ...tyre.values import set_values
from .abaqus import aside, context
from .calculix import calculix_context
from .decks import HEADER_LINES, DesignEvaluator, header, refuse_outside, steps
from .own import explained, own_jobs
from .template_process import TemplateProcess

ELEMENTS_A_WAVE = 7.5  # of quadratic ones: the frequencies are right to 0.4 %
WAVES_OF_STIFFNESS = 4  # round the circumference, that a motion of the rim bends the tyre into
# round the circumference: half as many more change forces on the hub up to 300 Hz by 0.5 % of the
# largest, motions at their own force by 3 %
WAVES_OF_RESPONSE = 8
DeckRequest = Mapping[str, Any]  # what is asked of a deck, see `Decks.request`
OWN_TEXT = "own deck"  # of a user's deck, as it stands
NEAR_ZERO = 1e-4  # of a variable's span: below, steps are shares of this
DECK_STEP = 1e-4  # of a variable, to see which numbers of the deck it moves and how fast


class TyreDesign:
    """A case at values of its variables, or of any of its numbers (see `decks.Design`)."""

    def __init__(
        self,
        case: LoadedCase,
        values: Mapping[str, float] | None = None,
        plain: LoadedCase | None = None,
    ):
        """plain: the case that other values were set in before.

        Raises ValueError for an unknown name, or a value that the case cannot have."""
        self.values: Mapping[str, float] = dict(values or {})
        self.plain = plain or case
        self.case = set_values(case, self.values)
        self.tyre = resolved(self.case)
        self.case.kind.check(self.tyre)

    def at(self, values: Mapping[str, float]) -> TyreDesign:
        """The case with these values. Raises ValueError."""
        return TyreDesign(self.case, values, self.plain)

    @cached_property
    def nominal(self) -> TyreDesign | None:
        """The case with its variables' starts, pressure and effects as its file has them."""
        read = self.plain.as_read or self.plain
        update = {"pressure_kPa": read.case.pressure_kPa, "effects": read.case.effects}
        case = replace(self.plain, case=self.plain.case.model_copy(update=update))
        try:
            return TyreDesign(case, start_values(read))
        except InputError:  # only with what was set is it a tyre
            return None

    @property
    def is_nominal(self) -> bool:
        """Whether nothing is set."""
        nominal = self.nominal
        return nominal is not None and nominal.case.case == self.case.case

    @property
    def header(self) -> str:
        """Comment lines that identify the tyre of the decks."""
        return header(self.case)

    @property
    def pressure_kPa(self) -> float:
        """The inflation pressure, effects on it counted."""
        return self.tyre.case.pressure_kPa

    @property
    def request(self) -> dict[str, Any]:
        """The case's ``analysis``, and requests that no deck of keywords holds."""
        analysis = self.case.case.analysis
        return {
            "highest_harmonic": analysis.highest_harmonic,
            "modes_per_harmonic": analysis.modes_per_harmonic,
            **aside(self.tyre),
        }

    @property
    def needs(self) -> dict[str, str]:
        """Capabilities that its effects, and the tyre's own parts, need of a solver, each with the
        reason."""
        lacks = {}
        for id, value in self.case.case.effects.items():
            if value and (need := catalogue()[id].needs):
                lacks[need] = f"the effect '{id}'; 'tyrecal effects' shows which one can"
        for need, words in self.tyre.needs.items():
            lacks.setdefault(need, f"{words}; 'tyrecal solvers' shows which one can ({need})")
        return lacks

    @property
    def has_slopes(self) -> bool:
        """No solver gives those of a tyre with a splice."""
        return not self.tyre.case.splice.share

    @property
    def solver(self) -> SolverChoice:
        """The case's."""
        return self.case.case.solver

    def neighbour(self, name: str, side: int) -> tuple[TyreDesign, float]:
        """The design a small step to one side of a variable, or at it where that side is none.

        The step is a share of the value or, where that is next to nothing beside the variable's
        span, of the span, as the deck's digits would not show it else; it leads to no other sign.
        """
        value = self.values[name]
        variable = self.case.case.variables.get(name)
        span, least = 1.0, 0.0
        if variable:
            span = max(abs(variable.lower), abs(variable.upper))
            least = 0.0 if variable.scale == "log" else NEAR_ZERO * span
        elif name.startswith("effects."):
            effect = catalogue()[name.removeprefix("effects.")]
            span = max(abs(effect.low), abs(effect.high))
            least = NEAR_ZERO * span
        moved = value + side * DECK_STEP * (max(abs(value), least) if value else span)
        if moved * value < 0:
            moved = value
        try:
            other = self.at({name: moved})
        except InputError:
            return self.at({name: value}), value
        return (other if self.tyre.case.splice.share else other._all_round()), moved

    def steps(self, name: str, value: float, step: float) -> list[float]:
        """Values of a number for differences."""
        return steps(self.case, name, value, step)

    def _all_round(self) -> TyreDesign:
        """The design with its splice's change all round in place of it, less by the share of the
        circumference that the splice takes up: the mean of its change, which is all that the means
        of frequencies depend on to first order."""
        splice = self.tyre.case.splice
        if not splice.share:
            return self
        other = copy(self)
        other.tyre = _with_splice_of(self.tyre, splice.share * splice.width_deg / 360)
        return other

    @property
    def section_nodes(self) -> int:
        """Number of nodes of the mesh."""
        return len(self.tyre.mesh.nodes)

    def check(self, evaluator: DesignEvaluator) -> None:
        """Raises OwnDeckError if the case's solver is the bundled one and refuses a user's deck."""
        if self.solver.name == "bundled":
            self.case.kind.check_with_solver(self.tyre)

    def remarks(self, evaluator: DesignEvaluator) -> Iterator[str]:
        """Compounds whose losses are not stated, where others are."""
        return lossless_hint(self.case)

    def explained(self, refusal: str) -> str:
        """A solver's refusal of a line, in the lines of the user's own deck."""
        return explained(self.tyre, refusal, HEADER_LINES)

    @property
    def advice_on_buckling(self) -> str:
        """The lines that let thin cords go slack, where they bear compression."""
        return slack_cord_hint(self.case)

    def texts(self, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        """File name to text, without the header. Raises TemplateFailed."""
        own = self.case.case.templates
        shipped = "abaqus" if dialect == OWN_TEXT else dialect
        env = (
            TemplateProcess(dialect, self.case.folder / own) if own else environment(shipped, None)
        )
        texts = DIALECTS[dialect](self.tyre, env, request)
        if own or dialect == OWN_TEXT:
            for file, text in texts.items():
                refuse_outside(file, text)
        return texts


def _abaqus(tyre: Tyre, env: Any, request: DeckRequest) -> dict[str, str]:
    """Texts of the ABAQUS decks by file name. Raises TemplateFailed."""
    names = _with_mesh(tyre, env)
    # modes of harmonics from 1 on come in pairs; those of harmonic 0 leave some to spare
    names["modes"] = 2 * request["modes_per_harmonic"] * (request["highest_harmonic"] + 1)
    names["loads"], names["loaded_modes"] = request["loads_N"], request["loaded_modes"]
    names["rim_motions"] = range(1, 7) if request["rim_stiffness"] else ()
    waves = request["highest_harmonic"] if names["loaded_modes"] else 0
    if names["rim_motions"]:
        waves = max(waves, WAVES_OF_STIFFNESS)
    if request.get("response"):
        waves = max(waves, WAVES_OF_RESPONSE)
        names["road"]["wheel"] = None
    if names["loaded_modes"] or names["rim_motions"]:
        half = fine_enough(tyre.case.road.element_angles_deg, waves)
        names["road"]["angles"] = half + half[::-1]
    jobs = ("inflate", "press" if names["loads"] else "modes")
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in jobs}
    if tyre.case.splice.share:
        if names["loads"]:
            raise TemplateFailed("splice: a tyre with a splice cannot be pressed on a road")
        names = _with_mesh(_with_splice_of(tyre, tyre.case.splice.share), env)
        texts["splice.inp"] = render(env, "inflate.inp.j2", names)
    return texts


def _with_mesh(tyre: Tyre, env: Any) -> TemplateNames:
    names = context(tyre)
    if "mesh_block" not in names:  # of a deck the block is the user's
        names["mesh_block"] = _mesh_block(env, names["mesh"])
    return names


def _with_splice_of(tyre: Tyre, share: float) -> Tyre:
    """The tyre all of which has its splice's numbers larger by ``share`` of themselves, and no
    splice. Raises TemplateFailed."""
    splice, case = tyre.case.splice, tyre.written
    try:
        values = {path: number_at(case, path) * (1 + share) for path in splice.numbers}
        return Tyre(set_values(case, {**values, "splice.share": 0.0}))
    except InputError as error:
        raise TemplateFailed(f"splice.numbers: {error}") from None


def fine_enough(angles_deg: Sequence[float], waves: int) -> list[float]:
    """Elements' lengths from the patch's middle to the top, those from the first one on that is
    too long for ``waves`` round the circumference made equal."""
    longest = 360 / (ELEMENTS_A_WAVE * max(waves, 1))
    kept = list(takewhile(lambda angle: angle <= longest, angles_deg))
    rest = 180 - sum(kept)
    more = ceil(rest / longest - 1e-9)
    return [*kept, *(rest / more for _ in range(more))]


def _calculix(tyre: Tyre, env: Any, request: DeckRequest) -> dict[str, str]:
    """The sector, its inflation, and a deck per nodal diameter that goes on from there."""
    if tyre.case.analysis.sectors < 4 * request["highest_harmonic"]:
        raise TemplateFailed(
            f"analysis.sectors is {tyre.case.analysis.sectors}, must be at least 4 times"
            " highest_harmonic for CalculiX"
        )
    names = calculix_context(tyre)
    names["modes"] = 2 * request["modes_per_harmonic"]  # they come in pairs, n = 0 too
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in ("sector", "inflate")}
    for n in range(request["highest_harmonic"] + 1):
        texts[f"modes_{n}.inp"] = render(env, "diameter.inp.j2", {**names, "diameter": n})
    return texts


def _own_text(tyre: Tyre, env: Any, request: DeckRequest) -> dict[str, str]:
    """A user's own deck, and the job that revolves it."""
    files, inflation = own_jobs(tyre)
    names = {**context(tyre), "inflation": inflation}
    names["modes"] = 2 * request["modes_per_harmonic"] * (request["highest_harmonic"] + 1)
    return {**files, "modes.inp": render(env, "revolve.inp.j2", names)}


DIALECTS: dict[str, Callable[[Tyre, Any, DeckRequest], dict[str, str]]] = {
    "abaqus": _abaqus,
    "calculix": _calculix,
    OWN_TEXT: _own_text,
}
_BLOCKS: dict[tuple[int, int], tuple[Any, Any, str]] = {}


def _mesh_block(env: Any, mesh: TemplateNames) -> str:
    """The mesh's text, which stays the same from one evaluation of a fit to the next."""
    key = id(env), id(mesh)
    if key not in _BLOCKS or env.auto_reload:
        if len(_BLOCKS) >= 32:
            _BLOCKS.clear()
        text = render(env, "mesh.inp.j2", {"mesh": mesh}).rstrip("\n")
        _BLOCKS[key] = env, mesh, text  # holding both keeps their ids from being reused
    return _BLOCKS[key][2]
