"""Names of modes mean one label, or are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.mode_names import label_parts
from tyrecal.measured.tables import read_table
from tyrecal.simulate.modes.label import Label

NAMES = {
    "[0,0] axial": [
        "lateral translation",
        "axial mode",
        "Lateralschwingung",
        "axiale Mode",
        "mode axial",
        "modo laterale",
        "0,0 lateral",
        "[0,0]_lateral",
        "laterale Eigenform",
        *("lateral", "Lateral mode", "LATERAL", "axial", "L0", "[0,0] lateral", "[0;0] axial"),
        *("Lateralmode", "laterale", "Mode latéral", "modo lateral", "(0,0) lateral", "Axialmode"),
    ],
    "[0,0] torsional": [
        "Drehschwingung",
        "Torsionsschwingung",
        "mode torsionnel",
        "modo torsionale",
        "modo torsional",
        "modo di torsione",
        "torsional mode",
        "wind up",
        "Rotation",
        *("torsional", "Torsion", "Torsionsmode", "torsione", "torsión", "T0", "[0,0] torsional"),
        *("rotational", "wind-up", "mode de torsion", "torsionale", "0/0 torsion", "Torsion mode"),
    ],
    "[1,0]": [
        "vertical mode",
        "Vertikalschwingung",
        "mode vertical",
        "modo verticale",
        "modo vertical",
        "Hubschwingung",
        "fore aft",
        "longitudinal mode",
        "c1m0",
        *("vertical", "Vertikalmode", "verticale", "fore-aft", "vertical / fore-aft", "R1"),
        *("[1,0] vertical / fore-aft", "longitudinal", "[1,0]x2", "[1,0] x2", "1,0", "c=1, m=0"),
    ],
    "[1,1]": [
        "camber mode",
        "Sturzmode",
        "Giermode",
        "mode de lacet",
        "modo di imbardata",
        *("yaw-camber", "pitch / yaw-camber", "L1", "camber", "Sturz", "[1,1] x2", "carrossage"),
        *("campanatura", "guiñada", "yaw", "imbardata", "lacet"),
    ],
    "[2,0]": [
        "oval",
        "modo di ovalizzazione",
        "in-plane bending 1",
        "1. in-plane bending",
        "1st in plane bending",
        "in-plane bending mode 1",
        "first bending in plane",
        "Ovalisation",
        "(2,0)",
        *("ovalisation", "ovalization", "Ovalisierung", "ovalizzazione", "ovalización", "R2"),
        *("1st in-plane bending", "first in plane bending mode", "1. Biegung in der Ebene"),
        *("1er mode de flexion dans le plan", "prima flessione nel piano", "c2m0"),
        *("primera flexión en el plano", "1st bending (in-plane)", "erste Biegung in der Ebene"),
    ],
    "[2,1]": [
        "1. out-of-plane bending",
        "first out of plane bending mode",
        "1st bending out of plane",
        "1. Biegemode aus der Ebene",
        "[2,1] (x2)",
        "2,1 x2",
        *("[2,1]", "[2,1]x2", "[2,1] ×2", "2/1", "2 1", "first out-of-plane bending", "L2"),
        *("1. Biegung aus der Ebene", "1re flexion hors plan", "prima flessione fuori piano"),
        *("primera flexión fuera del plano", "1st out of plane bending"),
    ],
    "[3,0]": [
        "second in plane bending",
        "2. Biegung in der Ebene",
        "2e mode de flexion dans le plan",
        "seconda flessione nel piano",
        "segunda flexión en el plano",
        "second in-plane bending",
        "2nd in-plane bending",
        "R3",
        "2. Biegemode in der Ebene",
    ],
    "[3,1]": [
        "second out of plane bending",
        "2. Biegung aus der Ebene",
        "seconda flessione fuori dal piano",
        "second out-of-plane bending",
        "2ème flexion hors du plan",
        "L3",
    ],
    "[4,0]": [
        "third in-plane bending",
        "3rd in-plane bending",
        "3. Biegung in der Ebene",
        "R4",
        "terza flessione nel piano",
        "[4;0]",
    ],
    "[5,1]": ["fourth out-of-plane bending", "4th out-of-plane bending"],
}
NO_NAMES = [
    *("radial", "bending", "1st bending", "first", "overtone", "belt bends across its width"),
    *("in-plane bending", "R0", "B1", "7", "2nd lateral", "cavity", "rim mode", "lateral vertical"),
    *("first in-plane", "pitch", "0th in-plane bending", "1st in-plane bending 2", "", "[2]", "?"),
    *("1st 2nd in-plane bending", "torsional 2", "out of plane", "structure"),
]


@pytest.mark.parametrize("label", NAMES)
def test_a_name_has_one_label(label: str) -> None:
    wanted = label_parts(label, {})
    assert wanted
    for name in NAMES[label]:
        parts = label_parts(name, {})
        assert parts, name
        kind = parts[2].replace("lateral", "axial").replace("torsion", "torsional")
        assert (*parts[:2], kind.replace("torsionalal", "torsional")) == wanted, name


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_name_with_no_or_several_labels_is_refused(name: str) -> None:
    assert label_parts(name, {}) is None


def test_all_names_that_tyrecal_prints() -> None:
    labels = [Label(0, 0, "axial"), Label(0, 0, "torsional")]
    labels += [Label(c, m) for c in range(1, 10) for m in (0, 1)]
    for label in labels:
        for name in (
            str(label),
            label.display,
            label.motion,
            f"{label}x2",
            f"{label} {label.motion}",
        ):
            c, m, kind = label_parts(name, {}) or ("", "", "")
            assert (int(c), int(m)) == (label.c, label.m), name
            assert kind.replace("lateral", "axial") == (label.kind or ""), name


def test_the_settings_file_adds_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "t.csv"
    path.write_text("mode,f [Hz],p [kPa]\nBiege 4a,66.1,240\n")
    with pytest.raises(InputError, match=r"line 2: label is 'Biege 4a', must .* mode_names"):
        read_table(path)
    (tmp_path / "settings.yaml").write_text('mode_names: {biege 4A: "[2,1]"}\n')
    monkeypatch.setenv("TYRECAL_SETTINGS", str(tmp_path / "settings.yaml"))
    assert read_table(path)[0].label == Label(2, 1)
