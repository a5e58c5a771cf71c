"""The bundled solver behind the tool's evaluator: write, run, read. Imports nothing of the tool."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..decks import WrittenDecks, save_texts
from ..errors import Refused, RunFailed
from . import VERSION
from .deck.start import PressedStart, write_pressed_start, write_start

JOB, PRESS, OLDJOB = "modes", "press", "inflate"
RESPONSE_ARRAYS = (
    *("frequency_Hz", "receptance", "hub"),  # as `modes.response.ResponseResult` has them
    *("stiffness", "mass", "loss", "tread"),  # `modes.superelement.Superelement`, if requested
)
# of the tool's request, as in `request.Request`
REQUEST_KEYS = ("own_frequency", "cavity", "sector", "response")


class RoadDecks(WrittenDecks, Protocol):
    """Decks with loads on the road, with places of the variables in them, and with a start."""

    loads_N: tuple[float, ...]  # empty: no road
    start: np.ndarray | None  # as `write_start` takes it
    pressed_start: PressedStart | None

    def tangents(self, dialect: str) -> dict[str, list[tuple[str, int, int, float]]]:
        """Variable to [job, 1-based line, 0-based field, d number / d variable] rows."""


class Bundled:
    """Adapter of the bundled solver (see the tool's solver contract)."""

    name = "bundled"
    version = VERSION
    dialect = "abaqus"
    capabilities = frozenset(
        {
            "modes",
            "gradients",
            "footprint",
            "footprint_gradients",
            "loaded_modes",
            "rim_stiffness",
            "vibration_modulus",
            "spindle",
            "frequency_modulus",
            "cavity",
            "coupled",
            "rotation",
            "start",
            "pressed_start",
            "own_deck",
            "response",
        }
    )
    refusals = (Refused,)
    failures = (RunFailed,)

    def write(self, decks: RoadDecks, folder: Path) -> list[Path]:
        """Write the decks and, next to them, the requests that only this solver reads."""
        texts = dict(decks.texts(self.dialect))
        if decks.start is not None and f"{OLDJOB}.inp" in texts:
            texts[f"{OLDJOB}.inp"] += write_start(folder, decks.start)
        if decks.pressed_start is not None and f"{PRESS}.inp" in texts:
            texts[f"{PRESS}.inp"] += write_pressed_start(folder, decks.pressed_start)
        paths = save_texts(texts, folder)
        request = {k: decks.request[k] for k in REQUEST_KEYS if k in decks.request}
        if decks.loads_N:
            loaded, slopes = bool(decks.request.get("loaded_modes")), decks.tangents(self.dialect)
            request = {k: request[k] for k in ("cavity", "response") if loaded and k in request}
            if slopes:
                request["sensitivities"] = slopes
            if not request:
                return paths
        else:
            request = {
                "harmonics": list(range(decks.request["highest_harmonic"] + 1)),
                "modes_per_harmonic": decks.request["modes_per_harmonic"],
                "sensitivities": decks.tangents(self.dialect),
                **request,
            }
        paths.append(folder / f"{PRESS if decks.loads_N else JOB}.request.json")
        paths[-1].write_text(json.dumps(request), encoding="utf-8", newline="")
        return paths

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Run in this process. Raises ``refusals`` and ``failures``."""
        from .job import run  # late: an answer from the record needs none of it

        job = PRESS if (folder / f"{PRESS}.inp").exists() else JOB
        run(folder, job, OLDJOB, time_limit_s)

    def read(self, folder: Path) -> dict[str, Any]:
        """Results as plain data: the last frequency step of the job, or the footprints."""
        if (folder / f"{PRESS}.inp").exists():
            from .road import footprint_job

            return footprint_job.read(folder / PRESS)
        step = json.loads((folder / f"{JOB}.json").read_text(encoding="utf-8"))["steps"][-1]
        with np.load(folder / f"{JOB}.npz", allow_pickle=False) as arrays:
            nodes, points = arrays["nodes"], arrays["points"]
            displacement = arrays[f"displacement_{step['step']}"]
            shapes = arrays[f"shapes_{step['step']}"] if step["modes"] else []
            response = {
                name: arrays[f"response_{name}_{step['step']}"]
                for name in RESPONSE_ARRAYS
                if f"response_{name}_{step['step']}" in arrays
            }
        # modes of the file by place; the two that a doublet has split into count as one: its
        # frequency, damping and sensitivities are their means
        members: dict[object, list[int]] = {}
        for i, mode in enumerate(step["modes"]):
            doublet = (mode["n"], mode["doublet"]) if "doublet" in mode else i
            members.setdefault(doublet, []).append(i)
        modes = []
        for places in members.values():
            first, hertz = places[0], [step["modes"][i]["frequency_Hz"] for i in places]
            mode = {key: step["modes"][first][key] for key in ("frequency_Hz", "multiplicity", "n")}
            modes.append({**mode, "amplitude": shapes[first]})
            ratios = [step["modes"][i].get("damping_ratio") for i in places]
            if ratios[0] is not None:
                modes[-1]["damping_ratio"] = sum(ratios) / len(ratios)
            if len(places) > 1:
                both = {"frequency_Hz": sum(hertz) / 2, "multiplicity": 2, "members": hertz}
                modes[-1] |= both
        return {
            **({"response": {**response, **step["response"]}} if response else {}),
            "pressure_Pa": step["pressure_Pa"],
            "mass_kg": step["mass_kg"],
            "modes": modes,
            "gradients": {
                name: [sum(slopes[i] for i in own) / len(own) for own in members.values()]
                for name, slopes in step["sensitivities"].items()
            },
            "mass_gradients": step["mass_sensitivities"],
            "nodes": nodes,
            "points": points,
            "displacement": displacement,
        }


def examine(text: str, long_term: bool) -> float | tuple[int, str]:
    """The mass, kg, of the tyre in a section job's model, or a refusal: its line and words.
    long_term: as in `section.model.build`."""
    from ..language.text import DeckError, read_keywords
    from .deck.steps import check
    from .section.mechanics import total_mass
    from .section.model import build

    try:
        section, _ = check(read_keywords(text), revolve=False)
        return total_mass(build(section, None, long_term)).real
    except DeckError as error:
        return error.place.line, error.message
