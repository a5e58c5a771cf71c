"""Every result of the shipped cases in one folder, to be compared with another commit's.

    python tests/studies/result_bytes.py FOLDER      in one checkout, then in the other
    diff -r -x run.json FOLDER OTHER                 nothing where behaviour stayed

Decks of every case for both dialects, then `modes`, `fit`, `sweep-pressure`, `footprint` and
`diagnose` on the coarse mesh, without a record, pictures or pages. Only on one machine and with
one BLAS kernel and thread are the bytes the same.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
CASES = {  # a case: measurements of such a tyre
    "p235_75r17": "p235_75r17_wheeler.csv",
    "p235_75r17_narrow_rim": "",
    "205_60r15": "205_60r15_mf_swift.csv",
}
ALONE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
QUICK = ["--mesh", "coarse", "--quiet"]


def commands(folder: Path) -> list[list[str]]:
    """The commands of each case, one after another."""
    result = []
    for name, measured in CASES.items():
        case, out = str(ROOT / "cases" / f"{name}.yaml"), folder / name
        for solver in ("bundled", "calculix"):
            result.append(["deck", case, "--solver", solver, "--output", f"{out}/decks_{solver}"])
        result.append(["deck", case, "--loads-N", "3000", "--output", f"{out}/decks_pressed"])
        study = ["--no-store", "--no-pictures", "--output", str(out), *QUICK]
        result += [[command, case, *study] for command in ("modes", "fit", "sweep-pressure")]
        result.append(["footprint", case, "--loads-N", "2000,5000", *study])
        result.append(["modes", case, "--load-N", "4000", *study])
        if measured:
            data = str(ROOT / "cases" / measured)
            result.append(["diagnose", case, "--measured", data, *study])
    return result


def run(arguments: list[str]) -> str:
    """Complaint of a command; '' where it went well."""
    command = [sys.executable, "-m", "tyrecal", *arguments]
    ended = subprocess.run(
        command, env={**os.environ, **ALONE}, capture_output=True, text=True, check=False
    )
    words = " ".join(arguments[:2])
    return f"{words}: exit code {ended.returncode}: {ended.stderr}" if ended.returncode else ""


def main() -> None:
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True)
    by_case: dict[str, list[list[str]]] = {}
    for arguments in commands(folder):
        by_case.setdefault(arguments[1], []).append(arguments)

    def one_after_another(arguments: list[list[str]]) -> list[str]:
        return [run(each) for each in arguments]

    with ThreadPoolExecutor() as threads:
        for complaints in threads.map(one_after_another, by_case.values()):
            print(*filter(None, complaints), sep="\n", end="")


if __name__ == "__main__":
    main()
