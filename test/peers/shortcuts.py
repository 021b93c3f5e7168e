"""This library against itself: the same questions without one of its shortcuts, bit by bit.

Needs the Python module of a build with ADAPTIVE_BVH_SHORTCUT_TESTS. Asks the numbered small inputs
of the differential tests, then the scenes of measure.py.
"""

from __future__ import annotations

import argparse

import numpy as np

import cases
from differential import KINDS, units_of
from questions import QUESTIONS
from worker import Crash, Worker

SHORTCUTS = ["Supports", "FlatPatches", "SinglePrecision", "Avx2", "Coherence", "Alignment"]
SHORTCUTS += ["Threads", "RoundedPredicates"]
THREADS = 2
BATCH = 500
# Of each scene; the last step is compared.
STEPS, POINTS = 3, 1000
# Of a length: where two answers are equally near, rounding chooses one.
ROUNDING = 1e-12
# Of t where a ray meets a needle nearly in its plane: less accurate, with the rounded determinants
# as with the exact ones.
ROUNDING_ON_NEEDLES = 1e-10


class Differences:
    """What two processes answered differently to one question."""

    def __init__(self, kind: str):
        self.kind = kind
        self.asked, self.other_bits, self.wrong, self.worst = 0, 0, 0, 0.0

    def add(self, with_it, without_it, units, limit: float) -> None:
        self.asked += 1
        if isinstance(with_it, str) or isinstance(without_it, str):
            self.wrong += 1
            return
        if self.kind == "pairs":
            with_it, without_it = (_sorted_rows(x) for x in (with_it, without_it))
        if with_it.shape == without_it.shape and with_it.tobytes() == without_it.tobytes():
            return
        self.other_bits += 1
        if self.kind not in ("lengths", "numbers", "times") or with_it.shape != without_it.shape:
            self.wrong += 1
            return
        with np.errstate(invalid="ignore"):
            apart = np.where(with_it == without_it, 0, np.abs(with_it - without_it)) / units
        self.worst = max(self.worst, float(apart.max()))
        self.wrong += not apart.max() <= limit


def rounding_of(question: str, family: str) -> float:
    return ROUNDING_ON_NEEDLES if (question, family) == ("first hits", "needles") else ROUNDING


def _sorted_rows(pairs: np.ndarray) -> np.ndarray:
    rows = pairs.reshape(-1, 2)
    return rows[np.lexsort(rows.T)]


def ours(shortcut: str) -> Worker:
    """This library without a shortcut; all others and "" for the whole library."""
    worker = Worker("ours", THREADS, ADAPTIVE_BVH_WITHOUT=shortcut)
    if worker.failed:
        raise SystemExit(f"this library's module cannot be imported: {worker.failed}")
    return worker


def check_build() -> None:
    """A build with the option refuses a shortcut that is not there."""
    worker = ours("nothing")
    work = cases.make("distance", 0)[1]
    try:
        is_refused = isinstance(worker.call("cases", "contacts", "", [work])[0], str)
    except Crash:
        is_refused = True
    worker.stop()
    if not is_refused:
        raise SystemExit("the module was built without ADAPTIVE_BVH_SHORTCUT_TESTS")


def compare_cases(workers: list[Worker], question: str, numbers: range) -> list[Differences]:
    """Compares the first worker with each other one."""
    found = [Differences(KINDS[question]) for _ in workers[1:]]
    for begin in range(0, len(numbers), BATCH):
        made = [cases.make(question, n) for n in numbers[begin : begin + BATCH]]
        works = [work for _, work in made]
        limits = [rounding_of(question, family) for family, _ in made]
        units = [units_of(question, work) for work in works]
        for variant in workers[0].variants(question):
            whole, *others = [w.call("cases", question, variant, works) for w in workers]
            for d, answers in zip(found, others):
                for each in zip(whole, answers, units, limits):
                    d.add(*each)
    return found


def compare_scenes(workers: list[Worker], name: str) -> list[Differences]:
    question = QUESTIONS[name]
    found = [Differences(question.kind) for _ in workers[1:]]
    for number in range(len(question.scenes)):
        scene = number, 1, STEPS, POINTS
        for variant in workers[0].variants(name):
            whole, *others = [w.call("measure", name, variant, scene) for w in workers]
            for d, other in zip(found, others):
                if "missing" not in whole:
                    d.add(whole["answer"], other["answer"], 1.0, max(question.limit, ROUNDING))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shortcuts", nargs="*", default=SHORTCUTS, help="to leave out, one by one")
    parser.add_argument("--works", type=int, default=2000, help="small inputs of each question")
    options = parser.parse_args()
    check_build()
    workers = [ours(shortcut) for shortcut in ["", *options.shortcuts]]
    rows = [(q, lambda q=q: compare_cases(workers, q, range(options.works))) for q in KINDS]
    rows += [(f"{q}, scenes", lambda q=q: compare_scenes(workers, q)) for q in QUESTIONS]
    form = "{:28} {:18} {:>6} {:>10} {:>6} {:>9}"
    print(form.format("question", "without", "works", "other bits", "wrong", "by"))
    wrong = 0
    for name, compare in rows:
        for shortcut, found in zip(options.shortcuts, compare()):
            wrong += found.wrong
            row = [found.asked, found.other_bits, found.wrong, f"{found.worst:.2g}"]
            print(form.format(name, shortcut, *row), flush=True)
    for worker in workers:
        worker.stop()
    if wrong:
        raise SystemExit(f"{wrong} answers differ by more than rounding")


if __name__ == "__main__":
    main()
