"""A case's own templates, rendered in a separate process, which is ended if they take too much.

A template may loop for ever, or ask for all memory in one expression: nothing in this process could
end that, in a thread or on Windows. The process is kept for the next deck, and ends with this one.
It inherits no environment variables: they may hold the user's passwords, and decks are sent to
others. A request is a pickled tuple, a reply is `GOOD` or `BAD` and a text; both are preceded by
their length in 8 bytes.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO

from ...tyre.templates import TemplateFailed, TemplateNames, environment, render

CPU_S, WALL_S = 5, 60.0  # s of a core, and in all, per template; shipped ones take 0.1 s
MEMORY = 2_000_000_000  # bytes of address space, where the system limits it
MAX_TEXT_BYTES = 50_000_000  # bytes of text
GOOD, BAD = b"+", b"-"  # first byte of a reply: the text is the deck, or the error
# without these some interpreters do not start; the process forgets them before it renders
TO_START = ("SYSTEMROOT", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONHOME")
_own = threading.local()


class TemplateProcess:
    """Templates of a dialect (abaqus or calculix), the user's own in ``folder`` before the tool's.

    It has the two members of a Jinja environment that `tyre_design` uses.
    """

    auto_reload = True  # templates are read anew for each deck

    def __init__(self, dialect: str, folder: Path):
        self.dialect, self.folder = dialect, folder.absolute()

    def render(self, template: str, names: TemplateNames) -> str:
        """The deck by a template, given the values of its ``names``. Raises TemplateFailed."""
        request = pickle.dumps((self.dialect, self.folder, template, names))
        process = _process()
        timer = threading.Timer(WALL_S, process.kill)
        timer.start()
        try:
            assert process.stdin and process.stdout
            process.stdin.write(len(request).to_bytes(8, "big") + request)
            process.stdin.flush()
            kind = process.stdout.read(1)
            text = _read(process.stdout, MAX_TEXT_BYTES)
        except (OSError, ValueError, EOFError):
            _end(process)
            raise TemplateFailed(
                f"template '{template}' was stopped: it takes more than {CPU_S} s of a core,"
                f" {MEMORY / 1e9:g} GB of memory or {MAX_TEXT_BYTES / 1e6:g} MB of text"
            ) from None
        except BaseException:  # its answer must not be taken for that to the next question
            _end(process)
            raise
        finally:
            timer.cancel()
        if kind == BAD:
            raise TemplateFailed(text.decode())
        return text.decode()


def _process() -> subprocess.Popen[bytes]:
    """This thread's process; another one after a fork, or where it has ended."""
    process: subprocess.Popen[bytes] | None = getattr(_own, "process", None)
    if process is None or _own.pid != os.getpid() or process.poll() is not None:
        places = sys.path if sys.flags.safe_path else sys.path[1:]  # PYTHONPATH is not inherited
        code = f"import sys; sys.path = {places!r}; from {__name__} import serve; serve()"
        process = subprocess.Popen(
            # -P: what lies in the present folder, perhaps a stranger's, is not imported
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={name: os.environ[name] for name in TO_START if name in os.environ},
            start_new_session=True,  # Ctrl-C is for this process, and ends that one too
        )
        _own.process, _own.pid = process, os.getpid()
        atexit.register(_end, process)
    return process


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill the process and close its pipes."""
    atexit.unregister(_end)
    process.kill()
    with contextlib.suppress(Exception):
        process.wait(5)
        for pipe in (process.stdin, process.stdout):
            pipe.close()  # type: ignore[union-attr]


def _read(stream: IO[bytes], most: int) -> bytes:
    """A message: its length in 8 bytes, then itself. Raises EOFError, ValueError."""
    size = int.from_bytes(_exactly(stream, 8), "big")
    if size > most:
        raise ValueError("too long")
    return _exactly(stream, size)


def _exactly(stream: IO[bytes], count: int) -> bytes:
    """``count`` bytes. Raises EOFError if the stream ends before."""
    data = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data


def serve() -> None:
    """Serve as the separate process: render templates until no further request comes."""
    os.environ.clear()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # each thread reserves some of MEMORY
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever is printed is no answer
    while True:
        try:
            request = _read(sys.stdin.buffer, sys.maxsize)
        except EOFError:
            return
        dialect, folder, template, names = pickle.loads(request)
        _limit()
        try:
            kind, text = GOOD, render(environment(dialect, folder), template, names).encode()
        except TemplateFailed as error:
            kind, text = BAD, str(error)[:2000].encode("utf-8", "replace")
        except UnicodeEncodeError:
            kind, text = BAD, f"template '{template}' does not give text".encode()
        answers.write(kind + len(text).to_bytes(8, "big"))
        answers.write(text)
        answers.flush()


def _limit() -> None:
    """Limit this process' memory, and its processor time from now on, if the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF)
        end = int(used.ru_utime + used.ru_stime) + 1 + CPU_S
        resource.setrlimit(resource.RLIMIT_CPU, (end, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
