"""A process for each peer: it loads the peer's module, keeps steps, measures them and answers.

Peers run in processes of their own: libraries that contain the same dependencies in different
versions do not meet, and a crash of one is a result, not the end of the run.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import threading
import time
import traceback
import warnings

import numpy as np

PEERS = [
    "ours",
    "ipctk",
    "coal",
    "fcl",
    "trimesh",
    "warp",
    "mujoco",
    "newton",
    "meshlib",
    "igl",
    "open3d",
    "pcu",
    "vtk",
    "embreex",
    "fcpw",
    "drake",
]

_LIMITS = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"]
_LIMITS += ["IGL_NUM_THREADS", "NUMBA_NUM_THREADS", "VTK_SMP_MAX_THREADS"]


def factory_of(module, question: str) -> dict:
    """Returns the factories of a peer for a question, by variant."""
    made = module.answers.get(question, {})
    return made if isinstance(made, dict) else {"": made}


def build(make, work) -> tuple:
    """Returns (step, read): step(frame) is measured, read(what it returned) is not."""
    made = make(work)
    return made if isinstance(made, tuple) else (made, lambda answer: answer)


class _Server:
    def __init__(self, peer: str, threads: int):
        self.module = importlib.import_module(f"peer_{peer}")
        if hasattr(self.module, "set_threads"):
            self.module.set_threads(threads)
        self.key, self.kept = None, None

    def describe(self) -> dict:
        m = self.module
        return {
            "questions": {q: list(factory_of(m, q)) for q in m.answers},
            "absent": m.absent,
            "precision": m.precision,
            "update": m.update,
        }

    def measure(self, question: str, variant: str, scene: tuple) -> dict:
        """Runs all frames of a scene once. Returns milliseconds of each step, and the answers."""
        number, size, steps, points = scene
        if self.key != (question, variant, scene):
            self.kept = None
            from questions import QUESTIONS
            from scenes import add_points, tiny

            if number < 0:
                work = add_points(tiny(steps), 1)
            else:
                work = QUESTIONS[question].scenes[number](size, steps, points)
            if work is None:
                return {"missing": True}
            step, read = build(factory_of(self.module, question)[variant], work)
            self.key, self.kept = (question, variant, scene), (work, step, read)
        work, step, read = self.kept
        spent, raw = [], []
        for frame in work.frames:
            begin = time.perf_counter()
            answer = step(frame)
            spent.append(1e3 * (time.perf_counter() - begin))
            raw.append(answer)
        last = np.atleast_1d(np.asarray(read(raw[-1])))
        return {
            "milliseconds": spent,
            "answer": last,
            "triangles": work.triangles,
            "scene": work.scene,
            "digest": work.digest(),
        }

    def cases(self, question: str, variant: str, works: list) -> list:
        """Answers works of one frame, one after the other; an exception becomes a string."""
        make = factory_of(self.module, question)[variant]
        found = []
        for work in works:
            try:
                step, read = build(make, work)
                found.append(np.atleast_1d(np.asarray(read(step(work.frames[0])))))
            except Exception as error:
                found.append(f"{type(error).__name__}: {error}"[:200])
        return found


def _serve(peer: str, threads: int, first: int, pipe) -> None:
    warnings.simplefilter("ignore")
    if threads < (os.cpu_count() or 1) and hasattr(os, "sched_setaffinity"):
        # What no setting of a library limits is limited by the processors that it may use.
        usable = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {usable[(first + i) % len(usable)] for i in range(threads)})
    try:
        server = _Server(peer, threads)
    except BaseException as error:
        pipe.send({"failed": f"{type(error).__name__}: {error}"[:300]})
        return
    pipe.send(server.describe())
    while True:
        try:
            call, arguments = pipe.recv()
        except EOFError:
            return
        try:
            pipe.send((True, getattr(server, call)(*arguments)))
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            text = f"{type(error).__name__}: {error}"[:300]
            pipe.send((False, f"{text} ({os.path.basename(where.filename)}:{where.lineno})"))


class Crash(Exception):
    """The process of a peer died or did not answer in time."""


class Failure(Exception):
    """A peer raised an exception."""


class Worker:
    """One peer's process, seen from outside. It starts anew after a crash.

    first: the first of the processors that it may use; environment: variables of its own.
    """

    def __init__(self, peer: str, threads: int = 1, first: int = 0, **environment: str):
        self.peer, self.threads, self.first = peer, threads, first
        self.environment = environment
        self.patience = 600.0
        self.lock = threading.Lock()
        self.process = None
        self.about = {}
        self.start()

    def start(self) -> None:
        for name in _LIMITS:
            os.environ[name] = str(self.threads)
        os.environ.update(self.environment)
        context = multiprocessing.get_context("spawn")
        self.pipe, child = context.Pipe()
        self.process = context.Process(
            target=_serve, args=(self.peer, self.threads, self.first, child), daemon=True
        )
        self.process.start()
        for name in self.environment:
            del os.environ[name]
        child.close()
        try:
            self.about = self._receive(self.patience)
        except Crash as crash:
            self.about = {"failed": str(crash)}

    @property
    def failed(self) -> str:
        """Why the peer cannot be used; empty if it can."""
        return self.about.get("failed", "")

    def variants(self, question: str) -> list[str]:
        """Variants with which the peer answers a question; empty if it does not."""
        return self.about.get("questions", {}).get(question, [])

    def label(self, variant: str) -> str:
        """The peer's name in tables."""
        return f"{self.peer} ({variant})" if variant else self.peer

    def _receive(self, seconds: float):
        if not self.pipe.poll(seconds):
            self.stop()
            raise Crash(f"no answer in {seconds:.0f} s")
        try:
            return self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self.process.join(10)
            raise Crash(f"died with exit code {self.process.exitcode}") from None

    def call(self, name: str, *arguments):
        """Calls a method of the server. Raises Crash or Failure; after a Crash it runs anew.

        Threads may call; one waits for the other.
        """
        with self.lock:
            try:
                self.pipe.send((name, arguments))
                good, answer = self._receive(self.patience)
            except (Crash, BrokenPipeError) as crash:
                self.stop()
                self.start()
                raise Crash(str(crash)) from None
        if not good:
            raise Failure(answer)
        return answer

    def stop(self) -> None:
        """Ends this process, and no other."""
        if self.process is not None and self.process.is_alive():
            self.process.terminate()
            self.process.join(5)
            if self.process.is_alive():
                self.process.kill()
