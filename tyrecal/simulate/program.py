"""The program that a solver starts: the user's command line in words, its program as a whole path.

`tyrecal.simulate.settings` reads commands, `find_solver` hands them to adapters. A program is
looked for once, where the command is given: the same file tells its version and runs all decks.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from ..files import open_file

WINDOWS = sys.platform == "win32"
PIECE_BYTES = 1_000_000  # bytes of a file that are read at a time


def split_command(text: str, windows: bool = WINDOWS) -> list[str]:
    """The words of a command line, as Windows or a POSIX system splits it; no shell is used. Raises
    ValueError for a quotation that does not end, which Windows lets end with the line."""
    return _split_for_windows(text) if windows else shlex.split(text)


def join_command(words: Sequence[str], windows: bool = WINDOWS) -> str:
    """The inverse of `split_command`: a line to copy."""
    return subprocess.list2cmdline(words) if windows else shlex.join(words)


def _split_for_windows(text: str) -> list[str]:
    r"""Split a command line as Microsoft documents it for C programs ("Parsing C command-line
    arguments").

    Words end at blanks outside quotation marks, and backslashes are letters, except before a
    quotation mark: 2k of them are k, 2k + 1 are k and a quotation mark that is a letter. Inside a
    quotation, "" is a quotation mark too. In the program's name, the first word, a backslash is
    always a letter: it may be a folder in quotation marks.
    """
    text = text.strip(" \t")
    program = re.match(r'(?:"[^"]*"?|[^" \t])*', text)
    assert program  # it may be empty
    words, word = [program[0].replace('"', "")], ""
    begun = quoted = ended = False  # ended: a quotation, just before
    for slashes, character in re.findall(r"(\\*)(.|$)", text[program.end() :], re.DOTALL):
        if character == '"':
            word += slashes[: len(slashes) // 2]
            doubled = ended and not slashes
            if len(slashes) % 2 or doubled:
                word += '"'
            if len(slashes) % 2 == 0:
                quoted = not quoted
            begun, ended = True, not (len(slashes) % 2 or quoted)  # begun: a word, perhaps empty
            continue
        word, begun, ended = word + slashes, begun or bool(slashes), False
        if character and (quoted or character not in " \t"):
            word, begun = word + character, True
        elif begun:
            words.append(word)
            word, begun = "", False
    return words


def resolve_program(command: Sequence[str]) -> list[str]:
    """A command with its program as a whole path.

    A name is looked for in the folders of PATH; what has a separator is a path from the present
    folder. A name that no folder holds stays as it is: another machine may have it.
    """
    program = os.path.expanduser(command[0])  # noqa: PTH111  Path raises where nobody is named so
    path = shutil.which(program)
    if path or os.path.dirname(program):  # noqa: PTH120  pathlib drops the "." of "./ccx"
        program = os.path.abspath(path or program)  # noqa: PTH100  a link stays one
    return [program, *command[1:]]


def why_missing(command: Sequence[str]) -> str:
    """Why the program of a resolved command cannot be started; empty where it can."""
    program = command[0]
    if shutil.which(program):
        return ""
    if not os.path.dirname(program):  # noqa: PTH120
        return f"no folder of PATH holds the program '{program}'"
    if Path(program).is_file():
        return f"'{program}' is not executable"
    return f"there is no program '{program}'"


def program_identity(command: Sequence[str]) -> list[str]:
    """The marks by which commands differ, wherever the program is: the hash of the program's
    file, or its name where it cannot be read, and the other words."""
    program = Path(command[0])
    try:
        about = program.stat()
        return [_file_hash(program, about.st_mtime_ns, about.st_size), *command[1:]]
    except OSError:
        return list(command)


@lru_cache
def _file_hash(path: Path, changed: int, size: int) -> str:
    """SHA-256 of a file, in hexadecimal; its time and size are only keys of the cache."""
    digest = sha256()
    with open_file(path) as file:
        while piece := file.read(PIECE_BYTES):
            digest.update(piece)
    return digest.hexdigest()
