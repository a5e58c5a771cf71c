"""Modal tables in the spellings of laboratories and spreadsheets, and their mistakes."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from math import nan, pi
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.repeats import combined
from tyrecal.measured.tables import read_measurements, read_table
from tyrecal.simulate.modes.label import Label

AXIAL = Label(0, 0, "axial")
PLAIN = "c,m,kind,pressure [kPa],frequency [Hz]\n0,0,axial,240,31.7\n2,1,,240,66.1\n"


def read(tmp_path: Path, text: str | bytes, pressure: float | None = None) -> list[Measurement]:
    path = tmp_path / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, pressure)


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        "sep=;\r\n" + PLAIN.replace(",", ";").replace("\n", "\r\n"),
        PLAIN.encode("utf-8-sig"),
        PLAIN.replace(",", "\t").encode("utf-16"),
        "n;m;Art;Fülldruck [bar];Eigenfrequenz (Hz)\n0;0;axial;2,4;31,7\n2;1;;2,4;66,1\n",
        "n;m;Art;Fülldruck [bar];Eigenfrequenz (Hz)\n0;0;axial;2,4;31,7\n2;1;;2,4;66,1\n".encode(
            "cp1252"
        ),
        "Mode,Inflation pressure (psi),f [rad/s],Damping [%],Remark\n"
        f"[0;0] lateral,{240 / 6.894757293168!r},{31.7 * 2 * pi!r},2.5,soft\n"
        f'"(2,1)",{240 / 6.894757293168!r},{66.1 * 2 * pi!r},2.5,\n',
        "Mode;c;m;kind;pressure (kPa);f\n1;0;0;axial;240;31,7\n2;2;1;;240;66,1\n",
        "label;pressure_kPa;frequency_Hz\n[0,0] axial;240;31.7\n[2,1];240;66.1\n",
        "Label;Pressure kPa;Freq Hz\n[0,0] axial;240;31.7\n[2,1];240;66.1\n",
        "\n\nc;m;kind;p [MPa];freq. [kHz]\n0;0;Axial;0,24;0,0317\n\n2;1;;0,24;0,0661\n;;;;\n",
    ],
)
def test_one_table_in_many_spellings(tmp_path: Path, text: str | bytes) -> None:
    values = read(tmp_path, text)
    assert [(v.label, v.member) for v in values] == [(AXIAL, ""), (Label(2, 1), "")]
    assert [v.value for v in values] == pytest.approx([31.7, 66.1])
    assert [v.pressure_kPa for v in values] == pytest.approx([240, 240])


@pytest.mark.parametrize(
    ("heading", "cell"),
    [
        ("Damping [%]", "2.5"),
        ("damping_percent", "2.5"),
        ("Dämpfung [%]", "2.5"),
        ("damping_ratio", "0.025"),
        ("zeta [-]", "0.025"),
        ("loss factor", "0.05"),
        ("eta [%]", "5"),
    ],
)
def test_damping_in_many_spellings(tmp_path: Path, heading: str, cell: str) -> None:
    (value,) = read(tmp_path, f"label;pressure [bar];f;{heading}\n[2,1];2.4;66.1;{cell}\n")
    assert (value.value, value.damping_ratio) == (66.1, pytest.approx(0.025))


@pytest.mark.parametrize(
    ("heading", "cell", "words"),
    [
        ("damping", "2.5", "has no unit; write it as 'damping \\[%\\]'"),
        ("damping_ratio", "2.5", "line 2: .* write percent as in 'damping \\[%\\]'"),
        ("damping [Hz]", "2.5", "the unit must be one of %, 1, -"),
    ],
)
def test_damping_of_which_nothing_states_the_unit(
    tmp_path: Path, heading: str, cell: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        read(tmp_path, f"label;pressure [bar];f;{heading}\n[2,1];2.4;66.1;{cell}\n")


@pytest.mark.parametrize("form", ["{}", "Mode {}", "{}.", "#{}"])
def test_running_numbers_are_no_labels(tmp_path: Path, form: str) -> None:
    """In each state from 1; numbers in any other order may mean modes, and are refused."""
    state = lambda bar, numbers: "".join(f"{form.format(n)};{40 + n};{bar}\n" for n in numbers)
    head = "Mode;f [Hz];p [bar]\n"
    values = read(tmp_path, head + state(2.0, (1, 2, 3)) + state(2.4, (1, 2)))
    assert [(each.label, each.value) for each in values] == [
        (None, 40 + n) for n in (1, 2, 3, 1, 2)
    ]
    with pytest.raises(InputError, match="label is"):
        read(tmp_path, head + state(2.0, (1, 3)))


def test_own_measurements_come_back(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "cases/p235_75r17_wheeler.csv").read_text()
    first = combined(read(tmp_path, text))
    again = combined(read(tmp_path, measurements_csv(first)))
    assert [(v.key, v.value, v.sigma) for v in again] == [(v.key, v.value, v.sigma) for v in first]
    assert len(first) == 9 and {v.sigma for v in first} == {0.5}


def test_other_quantities_and_loads(tmp_path: Path) -> None:
    values = read(
        tmp_path,
        "load [kN];pressure [bar];contact area [cm²];vertical stiffness [N/mm];mass [lb]\n"
        "4;2,4;180;210;\n;;;;30\n",
    )
    by_quantity = {v.quantity: (v.value, v.load_N) for v in values}
    assert by_quantity["contact_area_m2"] == pytest.approx((0.018, 4000))
    assert by_quantity["vertical_stiffness_N_per_m"] == pytest.approx((2.1e5, 4000))
    assert by_quantity["mass_kg"] == pytest.approx((13.6078, 0), rel=1e-5)


@pytest.mark.parametrize(
    ("length", "width", "values"),
    [
        ("contact length [mm]", "contact width [cm]", "132;14,1"),
        ("contact_length_m", "contact_width_m", "0,132;0,141"),
        ("patch length (cm)", "patch-width mm", "13,2;141"),
        ("Latschlänge [mm]", "Latschbreite [mm]", "132;141"),
        ("footprint length inch", "footprint width [in]", "5,19685;5,55118"),
    ],
)
def test_lengths_and_widths_of_a_patch(
    tmp_path: Path, length: str, width: str, values: str
) -> None:
    """A single sigma with a unit of length belongs to both."""
    head = f"load [N];pressure [kPa];{length};{width};sigma [mm]\n"
    read_back = {each.quantity: each for each in read(tmp_path, f"{head}4000;220;{values};2\n")}
    assert read_back["contact_length_m"].value == pytest.approx(0.132, rel=1e-5)
    assert read_back["contact_width_m"].value == pytest.approx(0.141, rel=1e-5)
    assert {each.sigma for each in read_back.values()} == {0.002} and len(read_back) == 2
    again = read(tmp_path, measurements_csv(list(read_back.values())))
    assert [each.value for each in again] == pytest.approx([0.132, 0.141], rel=1e-5)


def test_a_length_has_a_unit_and_a_mode_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no unit; write it as 'contact length \[m\]'"):
        read(tmp_path, "load [N];pressure [kPa];contact length\n4000;220;132\n")
    with pytest.raises(InputError, match="the unit must be one of m, mm, cm, inch"):
        read(tmp_path, "load [N];pressure [kPa];contact length [kPa]\n4000;220;132\n")
    head = "mode n,mode m,pressure [kPa],frequency [Hz]\n"
    with pytest.raises(InputError, match=r"label is '2', must be like \[2,1\]"):
        read(tmp_path, f"{head}2,0,240,85\n")


def test_loaded_modes_have_a_symmetry(tmp_path: Path) -> None:
    head = "c,m,member,load [N],pressure [kPa],frequency [Hz]\n"
    (row,) = read(tmp_path, f"{head}2,0,symmetric,4000,240,85\n")
    assert (row.member, row.load_N) == ("symmetric", 4000)
    with pytest.raises(InputError, match="line 2: member is '1', must be symmetric or"):
        read(tmp_path, f"{head}2,0,1,4000,240,85\n")


def test_lines_that_repeat_are_runs(tmp_path: Path) -> None:
    named = "run," + PLAIN.replace("\n0", "\n1,0").replace("\n2", "\n1,2")
    for text in (
        PLAIN + "0,0,axial,240,31.9\n2,1,,240,66.3\n",
        named + "2,0,0,axial,240,31.9\n2,2,1,,240,66.3\n",
    ):
        values = read(tmp_path, text)
        assert len({v.run for v in values}) == 2
        rows = combined(values)
        assert [(v.label, v.member) for v in rows] == [(AXIAL, ""), (Label(2, 1), "")]
        assert [v.value for v in rows] == pytest.approx([31.8, 66.2])


def test_two_of_a_label_with_waves_are_a_doublet(tmp_path: Path) -> None:
    values = read(tmp_path, PLAIN + "2,1,,240,66.4\n")
    assert [(v.label, v.member) for v in values] == [
        (AXIAL, ""),
        (Label(2, 1), "1"),
        (Label(2, 1), "2"),
    ]
    with pytest.raises(InputError, match="is given twice: add a column run"):
        read(tmp_path, "c,m,pressure [bar],f\n2,1,2.4,66.1\n2,1,2.4,66.3\n3,1,2.4,99\n")


def test_sigma_is_that_of_its_unit_or_of_all_in_percent(tmp_path: Path) -> None:
    heading, line = "c,m,pressure [bar],f [Hz],mass [kg],sigma [{}]\n", "2,1,2.4,66,12,{}\n"

    def sigmas(unit: str, sigma: str) -> dict[str, float]:
        values = read(tmp_path, heading.format(unit) + line.format(sigma))
        return {value.quantity: value.sigma for value in values}

    same = partial(pytest.approx, rel=0, abs=0, nan_ok=True)
    assert sigmas("Hz", "0.5") == same({"frequency_Hz": 0.5, "mass_kg": nan})
    assert sigmas("kg", "0.1") == same({"frequency_Hz": nan, "mass_kg": 0.1})
    assert sigmas("%", "1") == pytest.approx({"frequency_Hz": 0.66, "mass_kg": 0.12})
    assert sigmas("Hz", "") == same({"frequency_Hz": nan, "mass_kg": nan})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "c,m,pressure [bar],f,mass [kg],sigma\n2,1,2.4,66,12,0.5\n",
            "line 2: sigma can be that of frequency_Hz or mass_kg: write its unit",
        ),
        (
            "c,m,pressure [bar],f,sigma [kg]\n2,1,2.4,66,0.5\n",
            "line 2: sigma has the unit of mass_kg, which has no value here",
        ),
        ("", "the file is empty"),
        (b"PK\x03\x04 a workbook", "save the sheet as CSV"),
        ("a,b\n1,2\n", "line 1: no column holds a frequency"),
        ("c,m,f\n2,1,66\n", "line 1: no column holds the pressure; give --pressure-kPa"),
        ("c,m,f,pressure\n2,1,66,2.4\n", r"line 1: 'pressure' has no unit; write it as"),
        ("c,m,f [V],pressure [bar]\n2,1,66,2.4\n", r"line 1: 'f \[V\]': the unit must be one"),
        ("c,m,f,freq,pressure [bar]\n2,1,6,6,2.4\n", "line 1: two columns are the frequency_Hz"),
        (PLAIN.split("\n")[0], "there is no measurement in it"),
        (PLAIN + "2,0,,240\n", "line 4: 4 cells, the headings are 5$"),
        ("mode,f [Hz],p [kPa]\n[1,1],37.8,240\n", r'line 2: 4 cells, .* quotes, "\[1,1\]", or in'),
        ("mode,f [Hz],p [kPa]\nB1,37.8,240\n", r"label is 'B1', must be like \[2,1\], or \[0,0\]"),
        (PLAIN + "2,0,,240,\n", "line 4: nothing was measured"),
        (PLAIN + "2,0,,240,79.5x\n", "line 4: frequency_Hz is '79.5x', must be a number"),
        (PLAIN + "2,0,,240,-79.5\n", "line 4: frequency_Hz is -79.5, must be greater than 0"),
        (PLAIN + "2,0,,240,nan\n", "line 4: frequency_Hz is 'nan', must be a number"),
        (
            PLAIN + "2,0,,2.4,79.5\n",
            "line 4: the pressure is 2.4 kPa: usual is 20 to 2000 kPa; did you mean 2.4 bar",
        ),
        (PLAIN + "2,0,,240,79500\n", "line 4: frequency_Hz is 79500: no tyre has that"),
        (PLAIN + "2,4,,240,79.5\n", "line 4: m is '4', must be a whole number from 0 to 3"),
        (PLAIN + "2.5,0,,240,79.5\n", "line 4: c is '2.5', must be a whole number from 0 to 20"),
        (PLAIN + "0,0,,240,35\n", r"line 4: \[0,0\] needs a kind, lateral"),
        (PLAIN + "0,0,bouncing,240,35\n", "line 4: kind is 'bouncing', must be lateral"),
        ("label;pressure [bar];f\n2 waves;2,4;66\n", r"line 2: label is '2 waves', must be like"),
        (
            "c,m,frequency,pressure [kPa]\n1,0,240,58.5\n2,0,240,79.5\n2,1,240,66.1\n"
            "3,0,240,97.6\n",
            "line 2: the pressure differs from line to line, the frequency hardly; are the columns",
        ),
        (
            "m,c,f,pressure [kPa]\n2,0,79.5,240\n3,0,97.6,240\n3,1,102.7,240\n2,1,66.1,240\n",
            "line 2: most modes have m above c; are the columns c and m swapped",
        ),
        (
            "run,c,m,f,pressure [bar]\n1,0,2,99,2.4\n1,0,2,98,2.4\n",
            r"line 2: \[0,2\] is given twice",
        ),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path: Path, text: str | bytes, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(str(tmp_path / "t.csv")) and "\n" not in str(error.value)


def test_every_mistake_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        read(tmp_path, PLAIN + "2,9,,240,79.5\n2,0,,240,x\n")
    lines = str(error.value).splitlines()
    assert ["line 4" in lines[0], "line 5" in lines[1], len(lines)] == [True, True, 2]
    assert all(a != b for a, b in pairwise(lines))


def test_a_table_may_be_as_long_as_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tyrecal.measured.tables.MAX_LINES", 3)
    assert len(read(tmp_path, PLAIN)) == 2
    with pytest.raises(InputError, match="more than 3 lines"):
        read(tmp_path, PLAIN + "3,1,,240,102.7\n")


def test_a_table_of_more_than_ten_thousand_lines_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="more than 10000 lines"):
        read(tmp_path, PLAIN + "2,1,,240,66.1\n" * 9_998)


def test_a_cell_may_have_three_hundred_characters(tmp_path: Path) -> None:
    lines = lambda count: f"remark,c,m,f,pressure [kPa]\n{'x' * count},2,1,66.1,240\n"
    assert len(read(tmp_path, lines(300))) == 1
    with pytest.raises(InputError, match="line 2: a cell of 301 characters"):
        read(tmp_path, lines(301))


SPELLINGS = [  # separator, numbers of a column in text, the last one's value, or None: refused
    (";", ["79,5", "240"], 240),
    (";", ["79.5", "102"], 102),
    (";", ["79,5", "80.25"], 80.25),
    (";", ["79,500", "80,250"], 80.25),
    ("\t", ["79.500", "80.250"], 80.25),
    (",", ["79.500", "80.250"], 80.25),
    (",", ["79.5", '"80,25"'], 80.25),
    (",", ["79.5", "7.95e1"], 79.5),
    (";", ["79,5", "7,95E+01"], 79.5),
    (";", ["79,5", "0,795e2"], 79.5),
    (";", ["79,5", "+80"], 80),
    (";", ["79,5", "80,"], 80),
    (";", ["79,5", "080"], 80),
    (";", ["79,5", " 80 "], 80),
    (";", ["79,5", "80,5\u00a0"], 80.5),
    (";", ["79,5", "1.020"], None),  # 1020, or 1.02?
    ("\t", ["79.5", "1,020"], None),
    (",", ["79.5", '"1,020"'], None),
    ("\t", ["79,5", "80.2", "80.250"], None),
    (";", ["79,5", "-80"], None),
    (";", ["79,5", "\u221280"], None),
    (";", ["79,5", "80,5,1"], None),
    (";", ["79,5", "80.5.1"], None),
    (";", ["79,5", "1_00"], None),
    (";", ["79,5", "0x50"], None),
    (";", ["79,5", "80d0"], None),
    (";", ["79,5", "~80"], None),
    (";", ["79,5", "80±1"], None),
    (";", ["79,5", "80/81"], None),
    (";", ["79,5", "1.23.456"], None),
    (";", ["79,5", "inf"], None),
    (";", ["79,5", "1e999"], None),
    (";", ["79,5", "#WERT!"], None),
]


@pytest.mark.parametrize(("separator", "cells", "value"), SPELLINGS)
def test_a_number_is_read_rightly_or_refused(
    tmp_path: Path, separator: str, cells: list[str], value: float | None
) -> None:
    head = separator.join(("c", "m", "pressure [kPa]", "f [Hz]"))
    rows = [separator.join((f"{k + 1}", "0", "240", cell)) for k, cell in enumerate(cells)]
    text = "\n".join([head, *rows]) + "\n"
    if value is None:
        with pytest.raises(InputError, match=f"line {len(cells) + 1}: frequency_Hz is"):
            read(tmp_path, text)
    else:
        assert read(tmp_path, text)[-1].value == pytest.approx(value)


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        (["4000"], None),
        (["4 000"], None),
        (["4'000"], None),
        (["4\u202f000"], None),
        (["4000,0"], None),
        (["4.000,0"], None),
        (["2.500,5", "4.000"], None),  # the first shows the mark of thousands
        (["4.000"], r"line 2: load is '4.000', which can be 4000 or 4, because .* commas"),
        (["4,000"], r"line 2: the load is 4 N: usual is 100 to 60000 N; did you mean 4 kN"),
        (["40.00"], r"the load is 40 N"),
        (["150"], r"contact_area_m2 is 0.01955 under 150 N: at 240 kPa it would carry 4.69e\+03 N"),
    ],
)
def test_thousands_of_a_load(tmp_path: Path, loads: list[str], words: str | None) -> None:
    rows = "".join(f"{load};195,5;240\n" for load in loads)
    text = f"load [N];contact area [cm2];pressure [kPa]\n{rows}"
    if words:
        with pytest.raises(InputError, match=words):
            read(tmp_path, text)
    else:
        assert read(tmp_path, text)[-1].load_N == 4000


def test_empty_columns_hide_no_split_number(tmp_path: Path) -> None:
    """A decimal comma between commas makes a cell more, which must not pass for an empty one."""
    assert len(read(tmp_path, PLAIN.replace("\n", ",,\n"))) == 2
    with pytest.raises(InputError, match="line 3: '1' is in a column without a heading"):
        read(tmp_path, "c,m,pressure [kPa],f [Hz],\n0,1,240,31.7,\n2,1,240,66,1\n")
    assert len(read(tmp_path, ",c,m,pressure [kPa],f\n0,2,1,240,66.1\n1,3,1,240,102.7\n")) == 2


GAPPED = [
    "Test; hammer\n2024-05-03;\n\nMode;p;f\n;[bar];[Hz]\n[2,1];2,4;66,1\n[3,1];2,4;n.a.\n",
    "Mode;p / bar;f in Hz\n[2,1];2,4;66,1\n",
    "Mode;p;f;;\n;bar;Hz;;\n[2,1];2,4;66,1;;\n",
    "Mode;Druck;Frequenz\n[2,1];2,4 bar;66,1 Hz\n[3,1];2,4 bar;-\n",
    "Mode;Druck [bar];Frequenz [Hz]\n[2,1];2,4 bar;66,1 Hz\n",
    "Modus;Druck;Frequenz;Streuung [%]\n1. Biegung aus der Ebene;240 kPa;66,1;n.a.\n",
    "label,pressure kPa,f,kind\n2/1,240,66.1,n/a\n",
]


@pytest.mark.parametrize("text", GAPPED)
def test_titles_units_and_gaps(tmp_path: Path, text: str) -> None:
    (value,) = read(tmp_path, text)
    assert (value.label, value.value) == (Label(2, 1), pytest.approx(66.1))
    assert value.pressure_kPa == pytest.approx(240)


@pytest.mark.parametrize(
    "heading", ["sigma %", "sigma [%]", "Streuung [%]", "Streuung/%", "\u03c3 in %"]
)
def test_scatter_in_per_cent(tmp_path: Path, heading: str) -> None:
    (value,) = read(tmp_path, f"label;p [kPa];f;{heading}\n[2,1];240;66;0,5\n")
    assert value.sigma == pytest.approx(0.33)


def test_units_that_differ_from_cell_to_cell_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 1: 'p' has no unit"):
        read(tmp_path, "label;p;f\n[2,1];2,4 bar;66\n[3,1];240 kPa;102\n")
    with pytest.raises(InputError, match=r"line 2: pressure is '240 kPa', must be a number"):
        read(tmp_path, "label;p [bar];f\n[2,1];240 kPa;66\n")


def test_a_workbook_is_read_as_its_sheet(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    for row in (
        ["Modal test"],
        [],
        ["label", "pressure [bar]", "f [Hz]", "sigma"],
        ["[2,1]", 2.4, 66, 0.005],
        ["[3,1]", 2.4, "102,7", 0.005],
    ):
        sheet.append(row)
    for cell in sheet["D"][3:]:
        cell.number_format = "0.0%"
    book.create_sheet("empty")
    book.save(tmp_path / "t.xlsx")
    values = read_table(tmp_path / "t.xlsx")
    assert [each.value for each in values] == pytest.approx([66, 102.7])
    assert [each.sigma for each in values] == pytest.approx([0.33, 0.5135])
    assert values[1].place.endswith("t.xlsx, line 5")
    book["empty"].append(["more"])
    book.save(tmp_path / "t.xlsx")
    with pytest.raises(InputError, match="one sheet must hold data, got Sheet, empty: save one"):
        read_table(tmp_path / "t.xlsx")


def test_a_list_without_labels_is_imported_as_one(tmp_path: Path) -> None:
    text = "f [Hz];sigma [Hz];pressure [bar]\n66,1;0,3;2,4\n31,7;0,3;2,4\n31,7;0,3;2,0\n"
    (tmp_path / "t.csv").write_text(text)
    gathered = gather([tmp_path / "t.csv"])
    rows = [(row.label, row.pressure_kPa, row.value, row.sigma) for row in gathered.rows]
    assert rows == [(None, 200, 31.7, 0.3), (None, 240, 31.7, 0.3), (None, 240, 66.1, 0.3)]
    (tmp_path / "again.csv").write_text(measurements_csv(gathered.rows))
    again = read_measurements(tmp_path / "again.csv", labelled=False)
    assert [each.value for each in again] == [31.7, 31.7, 66.1]
    with pytest.raises(InputError, match="line 2: frequencies without labels were measured before"):
        gather([tmp_path / "t.csv", tmp_path / "again.csv"])
    with pytest.raises(InputError, match="line 2: nothing states how far frequency_Hz may be off"):
        (tmp_path / "t.csv").write_text("f [Hz],pressure [kPa]\n66.1,240\n")
        gather([tmp_path / "t.csv"])


@pytest.mark.parametrize(
    ("text", "value", "sigma"),
    [
        ("label;f [rad/s];sigma;p [bar]\n[2,0];499,5;1,3;2,4\n", 499.5 / (2 * pi), 1.3 / (2 * pi)),
        ("vertical stiffness [N/mm];sigma;load [N];p [kPa]\n215;4;4000;240\n", 2.15e5, 4e3),
        ("mass [lb];sigma\n28;0.2\n", 28 * 0.45359237, 0.2 * 0.45359237),
    ],
)
def test_a_sigma_without_a_unit_has_that_of_its_value(
    text: str, value: float, sigma: float, tmp_path: Path
) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    (row,) = read_table(path)
    assert (row.value, row.sigma) == pytest.approx((value, sigma), rel=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "label;f [Hz];p [bar];static load [N]\n[2,0];79,5;2,4;4000\n",
            "'static load [N]' has a unit of load",
        ),
        (
            "label;member;f [Hz];p [bar];load_lbf\n[2,0];symmetric;79,5;2,4;900\n",
            r"load is 900|the load is|usual",
        ),
        (
            "Radlast [N];4000\nlabel;f [Hz];sigma [Hz]\n[2,0];79,5;0,4\n",
            "'Radlast .N.' above the headings",
        ),
        (
            "quantity;value [rad/s];c;m;p [kPa]\nfrequency_Hz;499.5;2;0;240\n",
            "in the unit of their quantity",
        ),
        (
            "label;c;m;f [Hz];p [bar]\n[3,0];2;0;79,5;2,4\n",
            r"label is '\[3,0\]', but c is 2 and m is 0",
        ),
        ("label;kind;f [Hz];p [bar]\n[0,0] torsional;lateral;79,5;2,4\n", "but kind is 'lateral'"),
    ],
)
def test_what_contradicts_or_hides_a_state_is_refused(
    text: str, words: str, tmp_path: Path
) -> None:
    """A loaded mode is never read as unloaded."""
    path = tmp_path / "t.csv"
    path.write_text(text)
    if "load_lbf" in text:
        (row,) = read_table(path)
        assert row.load_N == pytest.approx(900 * 4.4482216)
        return
    with pytest.raises(InputError, match=words.replace("[N]", ".N.")):
        read_table(path, 240.0)


def test_merged_cells_of_a_workbook_hold_what_they_show(tmp_path: Path) -> None:
    """A run's name over two rows; rows that end before the last column."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    for row in (
        ["run", "label", "f [Hz]", "pressure [bar]", "remark"],
        ["A", "[2,0]", 87.8, 2.4, "first"],
        [None, "[3,0]", 105.3, 2.4],
        ["B", "[2,0]", 87.9, 2.4],
        [None, "[3,0]", 105.4, 2.4],
    ):
        sheet.append(row)
    sheet.merge_cells("A2:A3")
    sheet.merge_cells("A4:A5")
    path = tmp_path / "t.xlsx"
    book.save(path)
    rows = read_table(path)
    assert [row.run.rpartition(" ")[2] for row in rows] == ["A", "A", "B", "B"]
    assert not any(row.member for row in rows)


def test_the_lower_of_a_pair_is_its_first_member_in_every_run(tmp_path: Path) -> None:
    """Whatever the order of the lines, so that the split is not averaged away."""
    path = tmp_path / "t.csv"
    rows = [(1, "[2,0]", 87.8), (1, "[3,0]", 105.3), (1, "[3,0]", 106.1)]
    rows += [(2, "[2,0]", 87.9), (2, "[3,0]", 106.2), (2, "[3,0]", 105.4)]
    text = "\n".join(f"{run};{label};{str(f).replace('.', ',')};240" for run, label, f in rows)
    path.write_text("run;label;f [Hz];p [kPa]\n" + text + "\n")
    pairs = {(row.member, row.value) for row in read_table(path) if row.label == Label(3, 0)}
    assert pairs == {("1", 105.3), ("2", 106.1), ("1", 105.4), ("2", 106.2)}
