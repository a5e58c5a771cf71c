"""Completion as it is typed: each shell on a terminal, the line that it makes of words and Tab."""

from __future__ import annotations

import fcntl
import os
import pty
import shutil
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ..conftest import CASES

CTRL_T, CTRL_U = b"\x14", b"\x15"
START = {
    "bash": ["bash", "--norc", "--noprofile", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--no-config", "-i"],
}
SET_UP = {  # as the command's help says; and Ctrl-T writes the line to a file
    "bash": """eval "$(tyrecal completion bash)"; bind -x '"\\C-t": echo "$READLINE_LINE" >line'""",
    "zsh": 'autoload -Uz compinit; compinit -u -D; eval "$(tyrecal completion zsh)"; '
    'tell() { echo -E - "$BUFFER" >line }; zle -N tell; bindkey "^T" tell',
    "fish": "tyrecal completion fish | source; bind \\ct 'commandline >line'",
}
TYPED = {
    "tyrecal val": "tyrecal validate ",
    "tyrecal fit a": "tyrecal fit a,b.yaml ",
    "tyrecal fit deep": "tyrecal fit deep/case.yaml ",
    "tyrecal fit my": r"tyrecal fit my\ tyre.yaml ",
    'tyrecal fit "my t': 'tyrecal fit "my tyre.yaml" ',
    "tyrecal fit ./a": "tyrecal fit ./a,b.yaml ",
    "tyrecal fit a,b.yaml --solver b": "tyrecal fit a,b.yaml --solver bundled ",
    r"tyrecal modes my\ tyre.yaml --set A_b": r"tyrecal modes my\ tyre.yaml --set A_belt=",
    "tyrecal modes a,b.yaml --set A_belt=": "tyrecal modes a,b.yaml --set A_belt=",
    "tyrecal modes a,b.yaml --set rim.ref": "tyrecal modes a,b.yaml --set rim.reference_point_m.",
    "tyrecal effects bead_f": "tyrecal effects bead_filler ",
    "tyrecal report dee": "tyrecal report deep/",
}


@contextmanager
def terminal(shell: str, folder: Path) -> Iterator[int]:
    """The shell in the folder: the other end of its terminal."""
    ours, theirs = pty.openpty()
    there = {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    process = subprocess.Popen(
        START[shell],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        cwd=folder,
        env={**os.environ, **there, "PATH": path, "TERM": "xterm"},
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    os.close(theirs)
    os.set_blocking(ours, False)
    try:
        yield ours
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def words_after(end: int, keys: bytes, answer: Path) -> str:
    """Words that the shell writes to the file after these keys."""
    os.write(end, keys)
    output, until = b"", time.monotonic() + 60
    while not (answer.exists() and answer.read_bytes().endswith(b"\n")):
        assert time.monotonic() < until, output.decode(errors="replace")
        try:  # else the shell waits for its words to be read
            output += os.read(end, 65536)
        except BlockingIOError:
            time.sleep(0.01)
    text = answer.read_text().removesuffix("\n")
    answer.unlink()
    return text


@pytest.mark.slow
@pytest.mark.parametrize(
    "shell",
    [pytest.param(shell, marks=() if shell == "bash" else pytest.mark.slow) for shell in START],
)
def test_lines_are_completed(shell: str, tmp_path: Path) -> None:
    if not shutil.which(shell):
        pytest.skip(f"no {shell} here")
    (tmp_path / "deep").mkdir()
    for name in ("my tyre.yaml", "a,b.yaml", "deep/case.yaml"):
        shutil.copy(CASES / "p235_75r17.yaml", tmp_path / name)
    with terminal(shell, tmp_path) as end:
        assert words_after(end, f"{SET_UP[shell]}; echo up >up\n".encode(), tmp_path / "up") == "up"
        for typed, line in TYPED.items():
            keys = CTRL_U + typed.encode() + b"\t" + CTRL_T
            completed = words_after(end, keys, tmp_path / "line")
            assert completed in (line, f"{line} ")  # a space after NAME= of bash and zsh
