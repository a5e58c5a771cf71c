"""Wrong cases made from a right one, and the words that their refusal must contain. Wrong
files are listed here: YAML that is none or too much, places, station tables."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

CASES = Path(__file__).parents[2] / "cases"
GOOD = (CASES / "p235_75r17.yaml").read_text()
TABLE = (CASES / "p235_75r17.csv").read_text()
CSV = "p235_75r17.csv"
STATIONS = "section.stations"


@dataclass(frozen=True)
class Bad:
    """``key`` and ``words`` that a mistake must have; ``write`` makes the case in a folder."""

    key: str
    words: str
    write: Callable[[Path], Path]


BAD: dict[str, Bad] = {}


def write(name: str, folder: Path) -> Path:
    """Put the wrong case ``name`` into ``folder``, its station table too; the path to give."""
    (folder / CSV).write_text(TABLE)
    return BAD[name].write(folder)


def content(name: str, key: str, words: str, text: str | bytes) -> None:
    """A case file of this text."""

    def put(folder: Path) -> Path:
        path = folder / "case.yaml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    assert name not in BAD
    BAD[name] = Bad(key, words, put)


def edit(name: str, key: str, words: str, *edits: str) -> None:
    """Edits are pairs: text of the good case, text in its place (first occurrence)."""
    text = GOOD
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    content(name, key, words, text)


def table(name: str, words: str, table: str | bytes) -> None:
    """The good case with another station table."""

    def put(folder: Path) -> Path:
        (folder / CSV).write_bytes(table.encode() if isinstance(table, str) else table)
        path = folder / "case.yaml"
        path.write_text(GOOD)
        return path

    BAD[name] = Bad(STATIONS, words, put)


def made(name: str, key: str, words: str, put: Callable[[Path], Path]) -> None:
    """Whatever ``put`` leaves in a folder; it returns the path to give."""
    BAD[name] = Bad(key, words, put)


PRESSURE = "pressure_kPa: 240.0"
NAME = "stations: p235_75r17.csv"


# YAML
edit("duplicate_key", "pressure_kPa", "on line 6 already", PRESSURE, f"{PRESSURE}\n{PRESSURE}")
edit("python_tag", "", "tag", "name: P235", "name: !!python/object/apply:os.system [x] #")
edit("anchor_tag", "", "tag", PRESSURE, "pressure_kPa: !!float 240.0")
edit("alias", "", "alias", "crown: 16", "crown: &a 16", "upper_sidewall: 16", "upper_sidewall: *a")
edit("merge_key", "", "plain word", PRESSURE, f"{PRESSURE}\n<<: {{a: 1}}")
edit("number_key", "", "plain word", PRESSURE, f"{PRESSURE}\n3: 4")
edit("comma_in_braces", "", "'frequency_Hz' before it a comma", "31.7}", "31,7}")
edit("list_key", "", "plain word", PRESSURE, f"{PRESSURE}\n? [a]\n: 4")
edit("tabs", "", "spaces, not tabs", "  stations:", "\tstations:")
edit("open_bracket", "", "not YAML", "prony: [{g", "prony: [[{g")
edit("control_character", "", "not YAML", "bundled", "bund\x01led")
edit("two_documents", "", "not YAML", "solver:", "---\nuncertainties:")
LAUGHS = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
content("alias_bomb", "", "alias", "\n".join(["a0: &a0 [x]", *LAUGHS]))
content("deep_nest", "", "deep", "a: " + "[" * 5000)
content("directive", "", "directive", "%YAML 1.1\n---\na: 1:1")
content("many_values", "", "more than 20000", "a: [" + ",".join(["1"] * 30_000) + "]")
content("empty", "", "empty", "")
content("comments_only", "", "keys and values", "# nothing\n")
content("text_only", "", "keys and values", "hello")
content("list_only", "", "keys and values", "- 1\n- 2\n")
content("binary", "", "UTF-8", b"\x7fELF\xff\xfe\x00\x01")
content("latin_1", "", "UTF-8", GOOD.replace("P235", "Größe", 1).encode("latin-1"))
content("huge", "", "larger than", GOOD + "#" * 1_000_000)
# files
made("missing_file", "", "no such file", lambda folder: folder / "nothing.yaml")
made("directory", "", "folder", lambda folder: folder)
edit("absolute_path", STATIONS, "inside the case's folder", NAME, "stations: /etc/passwd")
edit("parent_path", STATIONS, "inside the case's folder", NAME, "stations: ../p235_75r17.csv")
edit("missing_table", STATIONS, "none of this name", NAME, "stations: other.csv")
edit("long_path", STATIONS, "cannot be read", NAME, "stations: " + "x" * 290)
edit("parent_templates", "templates", "inside the case's", PRESSURE, f"{PRESSURE}\ntemplates: ../t")
edit("missing_templates", "templates", "must be a folder", PRESSURE, f"{PRESSURE}\ntemplates: t")


# files of measurements
MODES = GOOD[GOOD.index("  modes:\n") : GOOD.index("uncertainties:")]
FILE = "targets.file"
edit("absolute_file", FILE, "inside the case's folder", MODES, "  file: /etc/passwd\n")
edit("parent_file", FILE, "inside the case's folder", MODES, "  file: ../measured.csv\n")
edit("missing_file_of_targets", FILE, "none of this name", MODES, "  file: measured.csv\n")
edit("folder_of_targets", FILE, "none of this name", MODES, "  file: .\n")
edit("number_for_file", FILE, "must be text", MODES, "  file: 5\n")
edit("file_and_modes", "targets.modes", "absent with file", MODES, f"  file: {CSV}\n{MODES}")
edit(
    "file_and_mass",
    "targets.mass",
    "absent with file",
    MODES,
    f"  file: {CSV}\n  mass: {{mass_kg: 1, sigma_kg: 1}}\n",
)


def _linked_measurements(folder: Path) -> Path:
    (folder / "measured.csv").symlink_to(CASES / "p235_75r17_wheeler.csv")
    (folder / "case.yaml").write_text(GOOD.replace(MODES, "  file: measured.csv\n"))
    return folder / "case.yaml"


def _many_measurements(folder: Path) -> Path:
    (folder / "measured.csv").write_bytes(b"1" * 1_000_001)
    (folder / "case.yaml").write_text(GOOD.replace(MODES, "  file: measured.csv\n"))
    return folder / "case.yaml"


made("linked_measurements", FILE, "link to a place outside", _linked_measurements)
made("many_measurements", FILE, "larger than", _many_measurements)


def _link(folder: Path) -> Path:
    (folder / CSV).unlink()
    (folder / CSV).symlink_to(CASES / CSV)
    shutil.copy(CASES / "p235_75r17.yaml", folder / "case.yaml")
    return folder / "case.yaml"


made("link_outside", STATIONS, "link to a place outside", _link)


# station tables
ROW = TABLE.splitlines()


def _row(number: int, row: str) -> str:
    return "\n".join([*ROW[:number], row, *ROW[number + 1 :]]) + "\n"


METRES = re.sub(r"(\d+\.\d+)", lambda mm: f"{float(mm[1]) / 1000:.8f}", TABLE)
table("metres", "must be in mm", METRES)
table("column_missing", "'ply_z_mm' is missing", TABLE.replace("ply_z_mm", "ply_x_mm", 1))
table("line_missing", "'ply_r_mm' is missing", TABLE.replace("ply_r_mm", "ply_rmm", 1))
table("column_twice", "given 2 times", TABLE.replace("station,", "region,", 1))
table("text_in_table", "must be a number in mm", _row(3, ROW[3].replace("376.24637", "wide")))
table("nan_in_table", "must be a number in mm", _row(3, ROW[3].replace("376.24637", "nan")))
table("rigid_two", "rigid is '2'", _row(3, ROW[3][:-1] + "2"))
table("off_centre", "z = 0", _row(1, ROW[2]))
table("gap_in_inner", "every station", _row(3, ROW[3].replace("376.24637", "")))
table("short_row", "the headings are 13", _row(3, ROW[3].rpartition(",")[0]))
table("comma_in_row", "the headings are 13", _row(3, ROW[3].replace("376.24637", "376,24637")))
table("three_stations", "too few", "\n".join(ROW[:3]))
table(
    "region_returns", "follow one another", _row(100, ROW[100].replace("upper_sidewall", "crown"))
)
table("empty_table", "empty", "")
table("binary_table", "neither text", b"\xff\xfe\x00")
table("huge_table", "larger than", TABLE + " " * 1_000_000)
table("not_held", "held by the rim", "\n".join([ROW[0], *(r[:-1] + "0" for r in ROW[1:])]))
BACK = [
    f"{a.split(',')[0]},{b.partition(',')[2]}"
    for a, b in zip(ROW[20:60], ROW[59:19:-1], strict=True)
]
table("folds_over", "folds over", "\n".join([*ROW[:20], *BACK, *ROW[60:]]))
