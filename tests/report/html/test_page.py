"""The page as text: all that the folders hold, escaped, the same bytes, and nothing invented."""

from __future__ import annotations

import json
import re
import shutil
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from random import Random

import pytest

from tyrecal.errors import InputError
from tyrecal.report.html import page as page_module
from tyrecal.report.html.page import page, write_page
from tyrecal.report.html.results import read_results

from . import toy
from .ring import TABLE_2

ROOT = Path(__file__).parents[3]
TRIALS = 30
DATA = "data:text/csv;charset=utf-8,"
VOID = {"meta", "input", "br", "path", "rect", "use"}
HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror=alert(1)>\"'{{ 7*7 }}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return toy.write(tmp_path_factory.mktemp("toy") / "results")


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    """A folder of the same name and content, to be spoilt."""
    return Path(shutil.copytree(folder, tmp_path / "results"))


def text_of(*folders: Path) -> str:
    return page([read_results(each) for each in folders])


@cache
def kept_text_of(folder: Path) -> str:
    """The page of a folder that no test changes, made once."""
    return text_of(folder)


@cache
def kept_words_of(folder: Path) -> str:
    return words_of(kept_text_of(folder))


class Nesting(HTMLParser):
    """Collects ids and links; fails where tags do not nest."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        assert len(attributes) == len(attrs), (tag, attrs)
        self.ids += [attributes["id"] or ""] if "id" in attributes else []
        self.links += [attributes["href"] or ""] if "href" in attributes else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag, (tag, self.getpos())

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("script", "style"):
            self.words.append(data)


def parsed(text: str) -> Nesting:
    parser = Nesting()
    parser.feed(text)
    assert not parser.open
    return parser


def words_of(text: str) -> str:
    return " ".join("".join(parsed(text).words).split())


def test_tags_nest_ids_are_unique_and_links_lead_somewhere(folder: Path) -> None:
    links_lead_to_ids(parsed(kept_text_of(folder)))


def links_lead_to_ids(tags: Nesting) -> None:
    assert len(set(tags.ids)) == len(tags.ids)
    places = {link.removeprefix("#") for link in tags.links if not link.startswith(DATA)}
    assert places and places <= set(tags.ids)


def test_table_2_is_there(folder: Path) -> None:
    """The page has each row of the paper's table, its figures in their order."""
    words = kept_words_of(folder)
    for c, m, kind, initial, fitted, target in TABLE_2:
        off = 100 * (fitted / target - 1)
        grade = "○" if abs(off) <= 2 else "◐" if abs(off) <= 5 else "●"
        figures = f"{initial:.2f}{fitted:.2f}{target:.2f}{grade} {off:+.2f}".replace("-", "\u2212")
        assert re.search(rf"\[{c},{m}\][^\[]*{re.escape(figures)}", words), (kind, figures)
    assert "The objective (equation (1), slsqp) went from 33.13 to 8.60 Hz" in words


@pytest.mark.parametrize(
    "words",
    [
        "Fit",
        "Shapes of the fitted tyre",
        "Mode shapes under 1000 N, on the tread",
        "Section",
        "Frequencies over pressure",
        "Footprint",
        "Frequencies over load",
        "Diagnosis",
        "Mind: C10 ended at a bound",
        "Mind: 1 design could not be evaluated",
        "Mind: not reached: fitted, 10 kPa: it buckles",
        "Mind: not reached: initial, 900000 N",
        "Mind: not reached: fitted, 30000 N: rim on road",
        "Fitted: every mode rises; every curve",
        "Named: rim_width explains the gap. Probability 0.71",
        "Diagnosis Named: rim_width",
        "Initial: Hz at each pressure, kPa",
        "weigh the tyre",
        "<b>measure</b> again",
        "upper sidewall",
        "contact area, cm²",
        "A_belt sets rebar_layers.belt_1.area_m2",
        "Toy & sons",
    ],
)
def test_what_was_found_is_told(folder: Path, words: str) -> None:
    assert words in kept_words_of(folder)


def test_every_mode_is_in_its_viewer(folder: Path) -> None:
    results, text = read_results(folder), kept_text_of(folder)
    for study, shapes in (("fit", results.fit_shapes), ("modes", results.modes_shapes)):
        match = re.search(rf'id="f1-{study}-data">(.*?)</script>', text, re.DOTALL)
        assert shapes and match
        shown = [mode["hertz"] for mode in json.loads(match[1])["modes"]]
        assert shown == [f"{mode.frequency_Hz:.2f} Hz" for mode in shapes.modes]


def test_the_page_stands_alone(folder: Path) -> None:
    text = kept_text_of(folder)
    assert not re.search(r"https?:|//[a-z]|\bsrc=|@import|fetch\(|XMLHttp|import\(", text)
    assert all(url.startswith("#") for url in re.findall(r"url\((.*?)\)", text))
    assert "default-src 'none'" in text


def test_what_comes_from_files_is_escaped(tmp_path: Path) -> None:
    folder = toy.write(tmp_path / "x", HOSTILE, HOSTILE)
    text = text_of(folder)
    assert "<script>window" not in text and "<img" not in text and "49" not in words_of(text)[:200]
    assert parsed(text).open == [] and HOSTILE in "".join(parsed(text).words)


def test_the_same_results_give_the_same_bytes(copy: Path, tmp_path: Path) -> None:
    """Wherever they stand, and however long they took."""
    write_page(tmp_path / "one.html", [copy])
    run = json.loads((copy / "run.json").read_text())
    run["fit"] |= {"seconds": 99.0}
    (copy / "run.json").write_text(json.dumps(run))
    moved = Path(shutil.move(copy, tmp_path / "elsewhere" / "results"))
    write_page(tmp_path / "two.html", [moved])
    write_page(tmp_path / "two.html", [moved])
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("fit.json", "Not in it: results of fit."),
        ("fit_shapes.json", "'tyrecal fit --report' keeps them"),
        ("fit_history.csv", "The history of the fit (fit_history.csv) is not in this folder"),
        ("modes.json", "Not in it: results of modes."),
        ("modes_shapes.json", "'tyrecal modes --report' keeps them"),
        ("pressure_sweep.json", "Not in it: results of sweep-pressure."),
        ("load_sweep.json", "Not in it: results of modes --sweep-load."),
        ("footprint.json", "Not in it: results of footprint."),
        ("footprint_patches.json", "The pressure in the patches"),
        ("effects.json", "Not in it: results of effects."),
        ("diagnosis.json", "Not in it: results of diagnose."),
        ("diagnosis.md", "The page in words (diagnosis.md) is not in this folder"),
        ("diagnosis_section.json", "One part changed alone"),
        ("run.json", "Folder results."),
    ],
)
def test_what_is_not_there_is_said(copy: Path, file: str, words: str) -> None:
    (copy / file).unlink()
    assert words in words_of(text_of(copy))


def test_effects_stand_with_what_calibration_leaves_of_them(copy: Path) -> None:
    words = words_of(text_of(copy))
    assert "Change of frequency, %, at 200 kPa" in words
    assert "Filler of Toy & sons e = 3 K+5.0+1.5\N{MINUS SIGN}2.5+1.589 " in words
    assert "Heat e = 3 K+5.0–––– " in words
    assert "Filler of Toy & sons, e = 3 K: 4.5 % (rms), 1.5 % once the variables" in words
    (copy / "effects.json").write_text("[]")
    assert "Not in it: results of effects." in words_of(text_of(copy))


def test_each_study_alone(copy: Path) -> None:
    for file in copy.glob("*.json"):
        if file.stem in (
            "fit",
            "modes",
            "pressure_sweep",
            "load_sweep",
            "footprint",
            "effects",
            "diagnosis",
        ):
            alone = copy / "alone" / file.stem
            alone.mkdir(parents=True)
            shutil.copy(file, alone)
            parsed(text_of(alone))


def test_several_folders_stand_side_by_side(folder: Path, copy: Path) -> None:
    """Figures of the paper's Table 2 and Table 3, those of the other folder beside them; one
    folder, or only one with a fit or a diagnosis, has no table."""
    fit = json.loads((copy / "fit.json").read_text())
    fit |= {"objective_Hz": 0.7, "objective_unit": "sigma", "converged": False, "footprint": []}
    fit["variables"] = {"D1": {**fit["variables"]["A_belt"], "standard_error": 7.2e-7}}
    fit["modes"] = fit["modes"][:2]
    (copy / "fit.json").write_text(json.dumps(fit))
    (copy / "diagnosis.json").unlink()
    page = text_of(folder, copy)
    links_lead_to_ids(parsed(page))
    both = words_of(page).replace("\u2212", "-")
    for words in (
        "objective initial33.13 Hz33.13 sigmas",
        "objective fitted8.60 Hz0.70 sigmas",
        "worst target[3,1] ● +5.06 %[0,0] lateral ◐ -2.65 %",
        "design pointsyes, 9no, 9",
        "A_belt0.36 mm² ± 10 %–",
        "C100.8 MPa, at bound–",
        "D1–0.36 mm² ± 200 %",
        "angle70 degrees held70 degrees held",
        "[2,0] ovalisation○ -0.10–",
        "4000 N contact area◐ -3.70–",
        "verdictNamed–",
        "likeliest probabilityrim_width 0.71–",
    ):
        assert words in both, words
    assert "Side by side" not in kept_words_of(folder)
    (copy / "fit.json").unlink()
    assert "Side by side" not in words_of(text_of(folder, copy))


def test_a_fit_to_footprints_alone(copy: Path) -> None:
    fit = json.loads((copy / "fit.json").read_text())
    (copy / "fit.json").write_text(json.dumps(fit | {"modes": []}))
    (copy / "fit_shapes.json").unlink()
    words = words_of(text_of(copy, copy))
    assert "4000 N contact area, cm²120.0" in words and "worst targetcontact area 4000 N" in words
    without = "fit-deviations", "Deviations of frequencies"
    assert not [each for each in without if each in words]


def test_the_reason_of_a_misfit_is_there_once(copy: Path) -> None:
    fit = json.loads((copy / "fit.json").read_text())
    reason = {"kind": "value", "words": "line 2: did you mean 31.7 Hz?", "chi2_per_dof": 1.25}
    judged = {"verdict": "does_not_fit", "chi2_per_dof": 491.0, "reason": reason}
    (copy / "fit.json").write_text(json.dumps(fit | judged))
    words = words_of(text_of(copy))
    assert words.count("did you mean 31.7 Hz?") == 1 and "Does not fit" in words


def test_shapes_of_another_run_are_not_shown(copy: Path) -> None:
    fit = json.loads((copy / "fit.json").read_text())
    fit["modes"][2]["frequency_Hz"] += 0.01
    (copy / "fit.json").write_text(json.dumps(fit))
    assert "are from another run: not shown" in words_of(text_of(copy))
    assert text_of(copy).count('class="viewer"') == 1


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "null", "{}", "\ud800", '{"format": 1}', "7", '{"format": ' + "1" * 5000 + "}"],
)
def test_a_damaged_file_is_named(copy: Path, content: str) -> None:
    for file in sorted(copy.glob("*.json")):
        if file.name == "run.json" or (file.name, content) == ("effects.json", "[]"):
            continue  # an empty list is whole: no effect had an answer
        before = file.read_bytes()
        file.write_bytes(content.encode("utf-8", "surrogatepass"))
        with pytest.raises(InputError, match=re.escape(file.name)) as error:
            text_of(copy)
        assert "\n" not in str(error.value)
        file.write_bytes(before)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("fit.json", '"objective_Hz": 8.603', '"objective_Hz": NaN'),
        ("fit.json", '"format": 1', '"format": 2'),
        ("fit.json", '"target_Hz": 31.7', '"target_Hz": 0'),
        ("fit.json", '"fitted_Hz": 30.86', '"fitted_Hz": "fast"'),
        ("footprint.json", '"area_m2": 0.003', '"area_m2": -1'),
        ("modes.json", '"c": 1', '"c": 100000'),
        ("diagnosis.json", '"named"', '"certain"'),
        ("fit_history.csv", "900000.0", "many"),
        ("fit_history.csv", "start", "stop"),
    ],
)
def test_a_number_that_cannot_be(copy: Path, file: str, old: str, new: str) -> None:
    text = (copy / file).read_text()
    assert old in text
    (copy / file).write_text(text.replace(old, new))
    with pytest.raises(InputError, match=re.escape(file)):
        text_of(copy)


@pytest.mark.parametrize(
    ("file", "path"),
    [
        ("fit_shapes.json", ("R_m",)),
        ("fit_shapes.json", ("modes", 0, "real")),
        ("fit_shapes.json", ("section", "outline")),
        ("fit_shapes.json", ("section", "areas", "crown", 0)),
        ("modes_shapes.json", ("angles",)),
        ("modes_shapes.json", ("modes", 0, "displacement", 0)),
        ("footprint_patches.json", ("patches", 0, "across_mm", 0)),
        ("footprint_patches.json", ("patches", 1, "pressure_kPa")),
        ("footprint_patches.json", ("patches", 1, "edge_mm", 0)),
        ("diagnosis_section.json", ("areas", "crown", 0)),
    ],
)
def test_lists_of_unequal_length(copy: Path, file: str, path: tuple[str | int, ...]) -> None:
    content = json.loads((copy / file).read_text())
    place = content
    for key in path:
        place = place[key]
    del place[-1]
    (copy / file).write_text(json.dumps(content))
    with pytest.raises(InputError, match=re.escape(file)):
        text_of(copy)


@pytest.mark.slow
def test_whatever_is_spoilt_the_page_is_whole_or_refused(copy: Path, tmp_path: Path) -> None:
    """Any leaf of any file is replaced or removed: no traceback, no broken page."""
    random = Random(1)
    odd = [None, 0, -1, 1e300, -1e-300, "", "<b>", "\ud800", [], {}, [[1.0]], True, 5, "fit"]
    outcomes = {True: 0, False: 0}
    files = sorted(file for file in copy.glob("*.json") if file.name != "run.json")
    for _ in range(TRIALS):
        file = random.choice(files)
        before = file.read_text()
        content = place = json.loads(before)
        while True:
            key = random.choice(list(place) if isinstance(place, dict) else range(len(place)))
            if not (isinstance(place[key], dict | list) and place[key] and random.random() < 0.85):
                break
            place = place[key]
        if random.random() < 0.2:
            del place[key]
        else:
            place[key] = random.choice(odd)
        file.write_text(json.dumps(content))
        try:
            written = write_page(tmp_path / "page.html", [copy])
            parsed(written.path.read_text())
            outcomes[True] += 1
        except InputError as error:
            assert "\n" not in str(error)
            outcomes[False] += 1
        file.write_text(before)
    assert min(outcomes.values()) > TRIALS / 10, outcomes


def test_a_page_too_large_and_places_not_to_write_to(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "fit.json"
    other.write_text("precious")
    with pytest.raises(InputError, match="not a page of tyrecal"):
        write_page(other, [folder])
    assert other.read_text() == "precious"
    with pytest.raises(InputError, match="is a folder"):
        write_page(tmp_path, [folder])
    monkeypatch.setattr(page_module, "MAX_PAGE_BYTES", 1000)
    with pytest.raises(InputError, match="give fewer folders"):
        write_page(tmp_path / "large.html", [folder])
    assert not (tmp_path / "large.html").exists()


def _luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.2)."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _contrast(a: str, b: str) -> float:
    low, high = sorted((_luminance(a), _luminance(b)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_aa() -> None:
    """Text 4.5 : 1, what is drawn 3 : 1, on paper and panels, in light, dark and print."""
    css = (ROOT / "templates/report/style.css").read_text()
    themes = [
        dict(re.findall(r"--(\w[\w-]*): (#\w{6});", block))
        for block in re.findall(r":root \{(.*?)\}", css, re.S)
    ]
    assert len(themes) == 3 and themes[0].keys() == themes[1].keys() == themes[2].keys()
    assert _contrast("#ffffff", "#000000") == pytest.approx(21)
    for theme in themes:
        for ground in ("paper", "panel"):
            for ink in ("ink", "soft", "link", "mind"):
                assert _contrast(theme[ink], theme[ground]) >= 4.5, (ink, ground, theme)
            for drawn in ("edge", "accent", *(f"s{k}" for k in range(6))):
                assert _contrast(theme[drawn], theme[ground]) >= 3, (drawn, ground, theme)
        assert _contrast(theme["on-accent"], theme["accent"]) >= 4.5


def test_the_page_says_what_its_results_are_of(copy: Path) -> None:
    words = words_of(text_of(copy))
    for entry in (
        "01234567",
        "rim.mass_kg = 12.5",
        "200",
        "1000 to 4000",
        "coarse",
        "ring 1.0",
        "tyrecal0.1.0",
        "a drum",
        "fedcba98",
        "tyrecal report, 2026-01-01 Toy",
        "toy.yaml",
        "2026-01-01 00:00 UTC, here",
        "tyrecal fit 'my cases/toy.yaml'",
    ):
        assert entry in words, entry
    doubts = "belong to different tyres", "different meshes", "did not finish"
    assert not [each for each in doubts if each in words]
    modes = json.loads((copy / "modes.json").read_text())
    modes["provenance"]["tyre_sha256"] = "f" * 64
    (copy / "modes.json").write_text(json.dumps(modes))
    runs = json.loads((copy / "run.json").read_text())
    runs["modes"] = {**runs["fit"], "finished": False}
    (copy / "run.json").write_text(json.dumps(runs))
    words = words_of(text_of(copy))
    assert "belong to different tyres" in words and "ffffffff" in words
    assert "The last run of modes did not finish" in words and words.count("00:00 UTC") == 1
    named = words_of(page([read_results(copy)], "A. <Engineer>", "Wheel & <tyre>"))
    assert "2026-01-01, A. <Engineer> Wheel & <tyre> Summary" in named
