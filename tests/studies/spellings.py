"""Legal spellings drawn from the rules: however a deck's words are written, it is the same tyre.

python -m tests.studies.spellings [--count N] [--seed S]: each draw writes every keyword line of a
deck with beginnings that one word alone has, blanks, another case and omitted zeros. The flat deck,
and so each frequency, must be the same to the last digit.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tyrecal_solvers.language.spelling import EVERYWHERE, KEYWORD_NAMES, squeezed
from tyrecal_solvers.language.table import RULES

from tyrecal.tyre.own_deck.own_deck import read_own_deck

from ..tyre import own_decks

DECKS = {
    "plain": own_decks.plain,
    "cae": own_decks.cae,
    "generated": own_decks.generated,
    "half": own_decks.half,
    "embedded": own_decks.embedded,
}


def shortened(word: str, words: tuple[str, ...], random: Random) -> str:
    """A beginning of a word that no other of ``words`` has, in some case, with blanks."""
    whole, others = squeezed(word), {squeezed(each) for each in words} - {squeezed(word)}
    fits = [
        whole[:n]
        for n in range(1, len(whole))
        if whole[:n] not in others and not any(each.startswith(whole[:n]) for each in others)
    ]
    text = random.choice([*fits, whole])
    text = random.choice((text, text.lower(), text.title()))
    k = random.randrange(len(text))
    return random.choice((text, f"{text[:k]} {text[k:]}", f" {text} "))


def respelt(line: str, random: Random) -> str:
    """A keyword line in another legal spelling."""
    name, *parts = line[1:].split(",")
    keyword = next(each for each in KEYWORD_NAMES if squeezed(each) == squeezed(name))
    rule = RULES.get(keyword)
    known = rule.parameters if rule and rule.is_judged else {}
    words = ["*" + shortened(keyword, KEYWORD_NAMES, random)]
    for part in parts:
        key, equals, value = part.partition("=")
        option = next((each for each in known if squeezed(each) == squeezed(key)), "")
        if not option:
            words.append(part)
            continue
        allowed = tuple(known[option].split("|"))
        if equals and not known[option].islower() and squeezed(value) in map(squeezed, allowed):
            value = shortened(value, allowed, random)
        words.append(shortened(option, (*known, *EVERYWHERE), random) + equals + value)
    return ",".join(words)


def draw(count: int, seed: int) -> list[str]:
    """Texts of decks whose flat deck is another one."""
    random, wrong = Random(seed), list[str]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tyre.inp"

        def flat(text: str) -> str:
            path.write_text(text)
            return read_own_deck(path, "m").flat({}).text

        for name, deck in DECKS.items():
            lines = deck().split("\n")
            right = flat("\n".join(lines))
            for _ in range(count // len(DECKS)):
                text = "\n".join(
                    respelt(line, random) if line[:1] == "*" and line[:2] != "**" else line
                    for line in lines
                )
                if flat(text) != right:
                    wrong.append(f"{name}\n{text}")
    return wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    wrong = draw(given.count, given.seed)
    print(f"{given.count} spellings, {len(wrong)} of another tyre")
    print("\n\n".join(wrong[:3]))


if __name__ == "__main__":
    main()
