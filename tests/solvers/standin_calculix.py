"""A stand-in for ccx in a folder of CalculiX's decks: it ends well, or fails as it is told."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tyrecal_solvers.calculix.adapter import CalculiX

# a folder of one deck of diameter 1, and what ccx 2.20 would leave there
INFLATE = "*STEP, NLGEOM\n*DLOAD\nCAVITY, P6, 240000\n"
DECK = "*RESTART, READ, STEP=1\n*FREQUENCY\n2\n*DLOAD\nCAVITY, P6, 120000\n"
SECTOR = "*CYCLIC SYMMETRY MODEL, N=60, TIE=SECTORS\n"
MASS = """
 total mass for set EVERYTHING and time  0.1000000E+01

        2.130910E-01
"""
DAT = """
     E I G E N V A L U E   O U T P U T

  NODAL   MODE NO    EIGENVALUE                      FREQUENCY
 DIAMETER                                    REAL PART            IMAGINARY PART
                                    (RAD/TIME)      (CYCLES/TIME)   (RAD/TIME)

    1          1   0.1000000E+06   0.3162278E+03   0.5032921E+02   0.0000000E+00
    1          2   0.1000000E+06   0.3162278E+03   0.5032921E+02   0.0000000E+00

     P A R T I C I P A T I O N   F A C T O R S

    1          1   0.2000000E+01   0.0000000E+00   0.0000000E+00   0.0000000E+00
"""
NODES = [(1, (0.3, 0.0, -0.1)), (2, (0.3, 0.0, 0.1)), (3, (0.29983, -0.01, 0.1))]
STATIC = [(1, (0.001, 0.0, 0.0)), (2, (0.0, 0.0, 0.0)), (3, (0.0, 0.0, 0.0))]
REAL = [(1, (0.0, -2.0, -0.5)), (2, (0.0, 1.0, 0.0))]  # (3 stands behind: it has no shape)
IMAGINARY = [(1, (-4.0, 0.0, 0.0)), (2, (0.5, 0.0, -0.25))]


def rows(table: list) -> str:
    """Node lines in fixed columns, which touch where numbers are negative."""
    return "".join(f" -1{n:10d}" + "".join(f"{x:12.5E}" for x in v) + "\n" for n, v in table)


def block(name: str, table: list, mode: int) -> str:
    head = f"    1PHID{1:27d}\n    1PMODE{mode:26d}\n" if mode else ""
    return f"{head}  100CL  101 50.3\n -4  {name:8s}4    1\n -5  D1\n{rows(table)} -3\n"


def frd(*blocks: str) -> str:
    return "    1C\n    2C\n" + rows(NODES) + " -3\n" + "".join(blocks) + " 9999\n"


LEFT = {  # file: its content after a run that went well
    "inflate.dat": MASS,
    "inflate.frd": frd(block("DISP", STATIC, 0)),
    "inflate.rout": "state",
    "modes_1.dat": DAT,
    "modes_1.frd": frd(block("DISP", REAL, 1), block("DISPI", IMAGINARY, 1)),
}
STAND_IN = """import sys, time
from pathlib import Path
fault, job = sys.argv[1], sys.argv[2]
here = Path(__file__).parent
with (here / "jobs").open("a") as jobs: jobs.write(job + " ")
if job != "inflate" and Path(f"{job}.rin").read_text() != "state": sys.exit("not this state")
if (job == "inflate") != fault.startswith("inflation: "): fault = "none"
fault = fault.removeprefix("inflation: ")
left = {p.suffix[1:]: p.read_text() for p in here.glob(f"{job}.*")}
dat, frd = left["dat"], left["frd"]
code = 0
said = "CalculiX Version 2.20\\n Job finished\\n"
if fault == "crash": sys.exit(139)
if fault == "code": code, said = 201, "*ERROR reading *NODE:\\n  a node is wrong\\n"
if fault == "together" and job != "inflate":  # ends when another runs as well
    while len((here / "jobs").read_text().split()) < 3: time.sleep(0.02)
if fault == "one of two" and job == "modes_1":  # fails while another runs
    while "modes_2" not in (here / "jobs").read_text(): time.sleep(0.02)
    sys.exit(139)
if fault == "one of two" and job == "modes_2": time.sleep(0.7); (here / "ended").touch()
if fault == "hang": print("Newton goes on", flush=True); time.sleep(60)
if fault == "silent": dat = frd = None
if fault == "no shapes": frd = None
if fault == "empty": dat = ""
if fault == "unfinished": said = "CalculiX Version 2.20\\n"
if fault == "error": said = " *ERROR in linstatic: a is wrong\\n" + said
if fault == "skipped": said = " *WARNING reading *STEP. Card image:\\n   *STEP,NLGEO\\n" + said
if fault == "cutbacks": code, said = 201, " *ERROR: too many cutbacks\\n"
if fault == "no state": del left["rout"]
if fault == "empty state": left["rout"] = ""
if fault == "fewer": dat = dat.replace("    1          2   0.1000000E+06", "x")
if fault == "zeros": dat = dat.replace("0.1000000E+06", "0.0000000E+00")
if fault == "nan": dat = dat.replace("0.1000000E+06", "          NaN")
if fault == "nan mass": dat = dat.replace("2.130910E-01", "NaN")
if fault == "negative": dat = dat.replace(" 0.1000000E+06", "-0.1000000E+06")
if fault == "unpaired": dat = dat.replace("2   0.1000000E+06", "2   0.1010000E+06")
if fault == "cut": frd = frd[: len(frd) * 3 // 4 - 5]
if fault == "doubled": frd += frd
if fault == "nan shape": frd = frd.replace("-2.00000E+00", "         NaN")
if fault == "nan displacement": frd = frd.replace(" 1.00000E-03", "         NaN")
if fault == "buckled": frd = frd.replace(" 3 0.00000E+00", " 3 2.00000E-06")
if fault == "stars": frd = frd.replace("-2.00000E+00", "************")
if fault == "one part": frd = frd.replace("DISPI", "NDISP")
if fault == "missing node": frd = frd.replace(" -1         2 5.0", " -9         2 5.0")
for suffix, text in {**left, "dat": dat, "frd": frd}.items():
    if text is not None: Path(f"{job}.{suffix}").write_text(text)
if job != "inflate": Path(f"{job}.rout").write_text("another state")
print(said)
sys.exit(code)
"""


def folder_for(tmp_path: Path, fault: str) -> Path:
    """A folder as `CalculiX.write` leaves it, run by a stand-in for ccx with ``fault``."""
    tools, folder = tmp_path / "tools", tmp_path / "run"
    tools.mkdir(parents=True)
    folder.mkdir()
    (tools / "ccx.py").write_text(STAND_IN)
    for name, text in LEFT.items():
        (tools / name).write_text(text)
    (folder / "sector.inp").write_text(SECTOR)
    (folder / "inflate.inp").write_text(INFLATE)
    (folder / "modes_1.inp").write_text(DECK)
    (folder / "calculix.json").write_text(json.dumps({"parallel": 1, "fault": fault}))
    return folder


def with_two_diameters(tmp_path: Path, fault: str, parallel: int) -> Path:
    """`folder_for` with a deck of diameter 2 as well."""
    folder = folder_for(tmp_path, fault)
    (folder / "modes_2.inp").write_text(DECK)
    for suffix in ("dat", "frd"):
        text = LEFT[f"modes_1.{suffix}"]
        other = text.replace(
            "    1PHID                          1", "    1PHID                          2"
        )
        (tmp_path / "tools" / f"modes_2.{suffix}").write_text(
            other.replace("    1     ", "    2     ")
        )
    settings = json.loads((folder / "calculix.json").read_text())
    (folder / "calculix.json").write_text(json.dumps({**settings, "parallel": parallel}))
    return folder


def evaluate(folder: Path, time_limit_s: float = 30.0) -> dict:
    solver = CalculiX()
    fault = json.loads((folder / "calculix.json").read_text())["fault"]
    solver.command = [sys.executable, str(folder.with_name("tools") / "ccx.py"), fault]
    solver.run(folder, time_limit_s)
    return solver.read(folder)
