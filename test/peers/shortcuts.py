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
# Of a length: where two answers are equally near, rounding chooses one.
ROUNDING = 1e-12


class Differences:
    """What two processes answered differently to one question."""

    def __init__(self, kind: str, limit: float):
        self.kind, self.limit = kind, limit
        self.asked, self.other_bits, self.wrong, self.worst = 0, 0, 0, 0.0

    def add(self, with_it, without_it, units) -> None:
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
        self.wrong += not apart.max() <= self.limit


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


def compare_cases(whole: Worker, other: Worker, question: str, numbers: range) -> Differences:
    found = Differences(KINDS[question], ROUNDING)
    for variant in whole.variants(question):
        for begin in range(0, len(numbers), BATCH):
            works = [cases.make(question, n)[1] for n in numbers[begin : begin + BATCH]]
            answers = [w.call("cases", question, variant, works) for w in (whole, other)]
            for work, *both in zip(works, *answers):
                found.add(*both, units_of(question, work))
    return found


def compare_scenes(whole: Worker, other: Worker, name: str) -> Differences:
    question = QUESTIONS[name]
    found = Differences(question.kind, max(question.limit, ROUNDING))
    for variant in whole.variants(name):
        for number in range(len(question.scenes)):
            scene = number, 1, 4, 2000
            both = [w.call("measure", name, variant, scene) for w in (whole, other)]
            if "missing" not in both[0]:
                found.add(both[0]["answer"], both[1]["answer"], 1.0)
    return found


def compare_all(whole: Worker, other: Worker, works: int):
    """Yields the name of each question, and what was compared."""
    for question in KINDS:
        yield question, compare_cases(whole, other, question, range(works))
    for question in QUESTIONS:
        yield f"{question}, scenes", compare_scenes(whole, other, question)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shortcuts", nargs="*", default=SHORTCUTS, help="to leave out, one by one")
    parser.add_argument("--works", type=int, default=2000, help="small inputs of each question")
    options = parser.parse_args()
    check_build()
    whole, wrong = ours(""), 0
    form = "{:18} {:28} {:>6} {:>10} {:>6} {:>9}"
    print(form.format("without", "question", "works", "other bits", "wrong", "by"))
    for shortcut in options.shortcuts:
        other = ours(shortcut)
        for name, found in compare_all(whole, other, options.works):
            wrong += found.wrong
            row = [found.asked, found.other_bits, found.wrong, f"{found.worst:.2g}"]
            print(form.format(shortcut, name, *row), flush=True)
        other.stop()
    whole.stop()
    if wrong:
        raise SystemExit(f"{wrong} answers differ by more than rounding")


if __name__ == "__main__":
    main()
