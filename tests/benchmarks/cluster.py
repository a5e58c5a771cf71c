"""Cost of a batch on a Dask scheduler: bytes moved and stored per case, tasks per second, memory.

    python tests/benchmarks/cluster.py [--cases 6] [--tasks 10000]

Starts a scheduler and two workers; all that client and workers say to the scheduler goes through a
counter of bytes. First nothing for a while, then a batch of real cases (fits on the default mesh),
then tasks that do nothing but return a report of the size of a real one.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.batch.support import vary
from tyrecal.simulate.evaluate.executor import executor

IDLE_S = 20
MOVED: Counter[str] = Counter()  # bytes by direction


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def answers(port: int) -> bool:
    """Return whether somebody listens at the port."""
    with socket.socket() as there:
        return there.connect_ex(("127.0.0.1", port)) == 0


async def _pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, way: str) -> None:
    while data := await reader.read(1 << 16):
        MOVED[way] += len(data)
        writer.write(data)
        await writer.drain()
    writer.close()


def count_between(port: int, scheduler: int) -> None:
    """Serve ``port``, pass everything on to the scheduler's, count."""

    async def serve() -> None:
        async def connect(r: asyncio.StreamReader, w: asyncio.StreamWriter) -> None:
            far_r, far_w = await asyncio.open_connection("127.0.0.1", scheduler)
            ways = _pass_on(r, far_w, "to the scheduler"), _pass_on(far_r, w, "from it")
            await asyncio.gather(*ways, return_exceptions=True)

        server = await asyncio.start_server(connect, "127.0.0.1", port)
        await server.serve_forever()

    threading.Thread(target=lambda: asyncio.run(serve()), daemon=True).start()


def memory_MB(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def answer(task: tuple[int, str]) -> str:
    """A report, without the work."""
    return task[1]


def moved(before: Counter[str], count: int) -> str:
    return ", ".join(f"{(MOVED[k] - before[k]) / count / 1e3:.2f} kB {k}" for k in MOVED)


def size(paths: list[Path]) -> int:
    return sum(path.stat().st_size for path in paths if path.is_file())


def main(cases: int, tasks: int, folder: Path) -> None:
    inner, outer = free_port(), free_port()
    dask = [sys.executable, "-m", "dask"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    options: dict = {"env": environment, "stderr": subprocess.DEVNULL, "cwd": folder}
    where = ["--host", "127.0.0.1", "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", "--port", str(inner), *where], **options)
    while not answers(inner):
        time.sleep(0.1)
    count_between(outer, inner)
    address = f"tcp://127.0.0.1:{outer}"
    worker = [*dask, "worker", address, "--nthreads", "1", "--no-nanny", *where]
    workers = [subprocess.Popen(worker, **options) for _ in range(2)]
    try:
        with executor(scheduler=address) as ready:
            list(ready.each(answer, [(i, "") for i in range(4)]))
        before = MOVED.copy()
        time.sleep(IDLE_S)
        print(f"idle: {moved(before, IDLE_S * len(workers))} per worker and second")
        before, clock = MOVED.copy(), time.perf_counter()
        out = folder / "out"
        command = [
            sys.executable,
            "-m",
            "tyrecal",
            "batch",
            *map(str, vary(folder / "c", cases, coarse=False)),
        ]
        subprocess.run([*command, "--quiet", "--scheduler", address, "--output", out], check=True)
        print(
            f"{cases} fits in {time.perf_counter() - clock:.1f} s; network: "
            f"{moved(before, cases)} per case"
        )
        print(f"memory of a worker: {max(memory_MB(each.pid) for each in workers):.0f} MB")
        records, results = list(out.glob("record/*/*")), list(out.glob("tyre_*/*"))
        print(
            f"file system per case: {len(records) / cases:.1f} records of "
            f"{size(records) / len(records) / 1e3:.0f} kB, {len(results) / cases:.0f} results of "
            f"{size(results) / cases / 1e3:.1f} kB in all; batch.json "
            f"{size([out / 'batch.json']) / cases / 1e3:.2f} kB per case"
        )
        report = json.dumps(json.loads((out / "batch.json").read_text())["cases"][0])
        before, clock = MOVED.copy(), time.perf_counter()
        used, start_MB, most_MB = cpu_s(scheduler.pid), memory_MB(scheduler.pid), 0.0
        with executor(scheduler=address) as ready:
            for _ in ready.each(answer, [(i, report) for i in range(tasks)]):
                most_MB = max(most_MB, memory_MB(scheduler.pid))
        seconds = time.perf_counter() - clock
        print(
            f"{tasks} empty tasks in {seconds:.1f} s, {tasks / seconds:.0f} a second; scheduler: "
            f"{1e3 * (cpu_s(scheduler.pid) - used) / tasks:.2f} ms of a core per task, "
            f"{start_MB:.0f} MB before, at most {most_MB:.0f} MB; network: "
            f"{moved(before, tasks)} per task"
        )
    finally:
        for process in [*workers, scheduler]:
            process.kill()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=6)
    parser.add_argument("--tasks", type=int, default=10000)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        main(given.cases, given.tasks, Path(place))
