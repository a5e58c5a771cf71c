"""Names of modes as laboratories write them, and the label [c,m] that each means.

A name is compared without case, accents, marks and words such as "mode". Only names with one
meaning are here: "radial", "pitch" and "first bending" alone are refused. Orders of bending count
as tyrecal prints them: the first in-plane one is [2,0]. ``mode_names`` of the settings file adds a
laboratory's own.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping

from ..simulate.modes.label import KNOWN, ORDINALS

BRACKETED_LABEL = re.compile(r"^[\[(]?\s*(\d+)\s*[,;/ ]\s*(\d+)\s*[\])]?\s*(.*)$")
LETTERED = re.compile(r"^c\s*=?\s*(\d+)\s*[,;/]?\s*m\s*=?\s*(\d+)$", re.IGNORECASE)
DOUBLET = re.compile(r"\s*\(?[x\u00d7]\s*2\)?$")  # ' x2', which some write behind both of a pair
NOISE_WORDS = {
    *("mode", "modes", "mod", "modus", "modo", "moda", "eigenform", "eigenmode", "shape", "forma"),
    *("forme", "de", "di", "del", "der", "des", "von", "of", "the", "tyre", "tire", "belt"),
}
MODE_NAMES = {  # r0, l0, t0: radial, lateral, torsional with so many waves
    "[0,0] axial": "lateral axial laterale axiale lateralmode axialmode lateralschwingung l0"
    " lateral_translation axial_translation",
    "[0,0] torsional": "torsional torsion torsionale torsione torsionsmode torsionsschwingung t0"
    " torsionnel rotational rotation windup wind_up drehschwingung",
    "[1,0]": "vertical verticale vertikal vertikalmode vertikalschwingung fore_aft longitudinal"
    " longitudinale vertical_fore_aft fore_aft_vertical r1 hubschwingung vertical_longitudinal",
    "[1,1]": "yaw camber yaw_camber pitch_yaw_camber camber_yaw l1 sturz"
    " sturzmode giermode lacet carrossage imbardata campanatura guinada",
    "[2,0]": "ovalisation ovalization oval ovalisierung ovalizzazione ovalizacion ovale r2",
    "[2,1]": "l2",
} | {f"[{c},{m}]": f"{letter}{c}" for c in range(3, 10) for m, letter in ((0, "r"), (1, "l"))}
PLANES = {  # m: longer phrases first, as "out of plane" holds "plane"
    1: "out_plane hors_plan hors_du_plan fuori_piano fuori_dal_piano fuera_plano fuera_el_plano"
    " aus_ebene ausser_ebene outofplane",
    0: "in_plane dans_le_plan dans_plan nel_piano en_el_plano en_plano in_ebene inplane",
}
BENDING_WORDS = {
    "bending",
    "biegung",
    "biegemode",
    "biegeschwingung",
    "flexion",
    "flessione",
    "flexural",
}
ORDER_WORDS = {
    word: order
    for order, words in enumerate(
        (
            "first erste erster premier premiere primo prima primero primera",
            "second zweite zweiter deuxieme seconde secondo seconda segundo segunda",
            "third dritte dritter troisieme terzo terza tercero tercera",
            "fourth vierte vierter quatrieme quarto quarta cuarto cuarta",
            "fifth funfte funfter cinquieme quinto quinta",
        ),
        start=1,
    )
    for word in words.split()
} | {word: order for order, word in enumerate(ORDINALS, start=1)}
ORDER_NUMBER = re.compile(r"^(\d{1,2})(st|nd|rd|th|er|ere|re|e|eme|o|a)?$")


def label_parts(text: str, aliases: Mapping[str, str]) -> tuple[str, str, str] | None:
    """c, m and kind, as text, of a label or name; None where it is neither, or has more than one
    meaning. aliases: names that the user adds, and their labels."""
    own = {_words(name): label for name, label in aliases.items()}
    text = own.get(_words(text), text.strip())
    text = DOUBLET.sub("", text)
    if match := BRACKETED_LABEL.match(text) or LETTERED.match(text):
        c, m, rest = (*match.groups(), "")[:3]
        # a name after the numbers gives the kind if it means the same label
        named = {_named(rest)} - {None} or {_named(word) for word in rest.split()}
        if len(named) == 1 and (parts := named.pop()) and parts[:2] == (c, m):
            return parts
        return c, m, rest
    return _named(text)


def _named(text: str) -> tuple[str, str, str] | None:
    """c, m and kind, as text, of a mode's name in words; None if it is unknown."""
    words = _words(text)
    for label, names in MODE_NAMES.items():
        match = BRACKETED_LABEL.match(label)
        if match and words and (words in names.split() or words == _words(label)):
            return match[1], match[2], match[3]
    for (c, m, kind), motion in KNOWN.items():
        if words == _words(motion):
            return str(c), str(m), kind or ""
    return _bending(words)


def _bending(words: str) -> tuple[str, str, str] | None:
    """The label of 'first out-of-plane bending' and the like."""
    padded = f"_{words}_"
    for m, phrases in PLANES.items():
        phrase = next((each for each in phrases.split() if f"_{each}_" in padded), None)
        if phrase is None:
            continue
        rest = [each for each in padded.replace(f"_{phrase}_", "_").split("_") if each]
        orders = [word for word in rest if word not in BENDING_WORDS]
        if len(orders) != 1 or len(rest) != 2:
            return None
        number = ORDER_NUMBER.match(orders[0])
        order = ORDER_WORDS.get(orders[0]) or (int(number[1]) if number else 0)
        return (str(order + 1), str(m), "") if order else None
    return None


def _words(text: str) -> str:
    """Words without case, accents, marks and noise, joined by underscores."""
    plain = unicodedata.normalize("NFKD", text.casefold().replace("ß", "ss"))
    plain = "".join(each for each in plain if not unicodedata.combining(each))
    return "_".join(w for w in re.findall(r"[a-z0-9]+", plain) if w not in NOISE_WORDS)
