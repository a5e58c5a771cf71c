"""Solver adapters: the contract, and the registry filled by entry points."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Protocol

from ...errors import InputError
from ...files import Json
from ...tyre.case.mistakes import suggestion
from ...tyre.plugins import load_plugin
from ..program import resolve_program, why_missing
from ..settings import command_of
from .failure import SolverUnavailable

GROUP = "tyrecal.solvers"
SolverAnswer = dict[str, Any]  # plain data and arrays, see `Solver.read`


class Solver(Protocol):
    """Interface of a solver: one class, registered under the entry point group above.

    version: of the program that runs, "unknown" where it is not found; part of every record's key.
    dialect: the template folder of its decks; capabilities: of ``modes``, ``gradients``,
    ``footprint``, ``footprint_gradients``, ``loaded_modes``, ``rim_stiffness``, ``response``, and
    what effects need (`Effect.needs`): ``vibration_modulus``, a modulus in the frequency step other
    than in the static one, and those of `resolve.CAPABILITIES`; ``own_decks``: it runs a user's in
    three dimensions.
    A solver without ``gradients`` may have ``difference_step``, the step of a logarithm that suits
    its digits, for sensitivities by differences.
    A solver that starts a program has ``command`` too, a list of its words, which is the user's to
    set (`tyrecal.simulate.settings`), never the case's; the tool makes its program a whole path;
    refusals, failures: exceptions of `write`, `run` and `read` for a deck it cannot honour and
    for no solution; a failure's attribute ``cause``, where it has one, is `EvaluationFailed`'s.
    """

    name: str
    version: str
    dialect: str
    capabilities: frozenset[str]
    refusals: tuple[type[Exception], ...]
    failures: tuple[type[Exception], ...]

    def write(self, decks: Any, folder: Path) -> list[Path]:
        """Write all input files of `tyrecal.simulate.deck.decks.Decks` into an empty folder.

        ``loads_N`` is not empty only where the solver can do footprints, ``loaded_modes`` not 0
        only where it finds modes there.
        """

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Run to the end or raise."""

    def read(self, folder: Path) -> SolverAnswer:
        """pressure_Pa, mass_kg, modes [{frequency_Hz, multiplicity, n, amplitude}], gradients
        {variable: [Hz per unit, by mode]}, nodes, points (as in `HarmonicShape`), displacement (as
        in `Evaluation`) and, for fits to the mass, mass_gradients {variable: kg per unit}. A
        doublet that is split is one mode of multiplicity 2 at the mean frequency, with ``members``
        [Hz, Hz]. Where a loss factor is known, each mode has its damping_ratio, a fraction of
        critical damping.

        Where ``decks.request`` has a response {lowest_Hz, highest_Hz, lines (of frequency), patch_m
        (width under the force), excite, respond} of points [degrees, radial, tangential or
        lateral] of the tread: response {frequency_Hz (f,), receptance (respond, excite,
        f) in m/N, hub (6, excite, f) in N/N and N m/N, radius_m of the inflated tread, harmonics
        that were summed, harmonics_wanted for the patch's size}. Of the hub: force of the tyre on
        it along Theta = 0, along 90 degrees, along the axle, and moments about them; shifts in m/N
        and turns in rad/N of a rim that moves.
        With ``modes`` N in it also stiffness, mass and loss (d, d), the imaginary stiffness, on
        these six motions of the rim and at most N coordinates of modes with the rim held, and tread
        (respond, d).

        A solver in three dimensions gives each mode {frequency_Hz, multiplicity 1, displacement
        (k, 3)} at ``points`` (k, 3), as in `RingShape`; pairs are joined by the tool.

        Where loads were asked for: pressure_Pa, mass_kg, nodes, points, angles, free_radius_m,
        footprints [the fields of `Footprint`], of one load at least, and ``failure``: "" or why
        the next one was not reached (its ``cause``, if not no_equilibrium).
        """


def find_solver(name: str, command: Sequence[str] = ()) -> Solver:
    """The installed solver of that name, with the program that the user has set, or ``command``;
    `refuse_missing_program` checks that it is there. Raises InputError."""
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in entries:
        raise InputError(f"solver '{name}' is not installed{suggestion(name, sorted(entries))}")
    solver: Solver = load_plugin(entries[name], "solver", lambda solver: solver())
    if hasattr(solver, "command"):
        solver.command = resolve_program(command or command_of(name)[0] or solver.command)
    elif command:
        raise InputError(f"solver '{name}' starts no program: leave out --solver-command")
    return solver


def solver_facts(solver: Solver | None) -> Json:
    """The entries of run.json about a solver: ``solver``, its name and version; ``solver_command``,
    the words that start it, None if it starts no program."""
    return {
        "solver": solver and f"{solver.name} {solver.version}",
        "solver_command": getattr(solver, "command", None),
    }


def refuse_missing_program(solver: Solver) -> None:
    """Raises SolverUnavailable where the program that the solver starts is not there."""
    if why := _missing(solver):
        raise SolverUnavailable(
            f"solver '{solver.name}': {why}; install it or give --solver-command PATH"
            " ('tyrecal solvers' shows what each starts)"
        )


def _missing(solver: Any) -> str:
    command = getattr(solver, "command", None)
    return why_missing(command) if command else ""


def installed() -> list[Json]:
    """Every registered solver: ``name``, ``version``, ``dialect``, ``capabilities``, ``problem``:
    why it cannot be used, or None; ``command`` that it starts, or None, and ``command_from``: where
    that is set. Raises nothing."""
    return [_described(entry) for entry in sorted(entry_points(group=GROUP))]


def _described(entry: EntryPoint) -> Json:
    """Facts on an installed solver for lists; ``problem`` is the reason if it cannot be loaded."""
    facts: Json = {
        "name": entry.name,
        "version": None,
        "dialect": None,
        "capabilities": [],
        "problem": None,
        "command": None,
        "command_from": None,
    }
    try:
        solver: Any = load_plugin(entry, "solver", lambda solver: solver())
        if hasattr(solver, "command"):
            command, origin = command_of(entry.name)
            solver.command = resolve_program(command or solver.command)
            facts["command"], facts["command_from"] = solver.command, origin or "default"
        facts["dialect"], facts["capabilities"] = solver.dialect, sorted(solver.capabilities)
        facts["version"] = solver.version
        facts["problem"] = _missing(solver) or None
    except InputError as error:
        facts["problem"] = str(error)
    except Exception as error:  # whatever a stranger's code raises when it is imported
        facts["problem"] = f"{type(error).__name__}: {error}"
    return facts
