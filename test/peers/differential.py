"""Asks all peers the same small questions, and a third judge who is wrong where they differ.

Prints a table: peer, question, family, cases, differences, how often each side is wrong and by how
much at most. Writes these counts as CSV, and inputs of differences, made smaller, as JSON.
"""

from __future__ import annotations

import argparse
import copy
import csv
import json
import math
import os
from collections import defaultdict
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

import cases
import judge
from measure import chosen, start
from questions import DOUBLE, SINGLE, differing, scale
from scenes import Frame, Work
from worker import PEERS, Crash, Failure, Worker

KINDS = {
    "closest points": "lengths",
    "distance": "lengths",
    "contacts": "pairs",
    "winding numbers": "numbers",
    "first hits": "lengths",
}
# Of one peer and family.
KEPT = 3
BATCH = 50 * len(cases.FAMILIES)
COLUMNS = ["question", "peer", "family", "cases", "differ", "ours wrong", "theirs wrong"]
COLUMNS += ["ours by", "theirs by", "fails", "remark"]


@dataclass
class Count:
    """What happened in all cases of one peer, question and family."""

    cases: int = 0
    differences: int = 0
    ours_wrong: int = 0
    theirs_wrong: int = 0
    ours_worst: float = 0.0
    theirs_worst: float = 0.0
    failures: int = 0
    remark: str = ""
    kept: list = field(default_factory=list)

    def add_row(self, row: dict) -> None:
        """Adds the row of an earlier run."""
        numbers = [int(row[name]) for name in [*COLUMNS[3:7], "fails"]]
        self.cases += numbers[0]
        self.differences += numbers[1]
        self.ours_wrong += numbers[2]
        self.theirs_wrong += numbers[3]
        self.failures += numbers[4]
        self.ours_worst = max(self.ours_worst, float(row["ours by"]))
        self.theirs_worst = max(self.theirs_worst, float(row["theirs by"]))
        self.remark = self.remark or row["remark"]

    def row(self, *key: str) -> dict:
        numbers = [self.cases, self.differences, self.ours_wrong, self.theirs_wrong]
        worst = [f"{x:.2g}" for x in (self.ours_worst, self.theirs_worst)]
        return dict(zip(COLUMNS, [*key, *numbers, *worst, self.failures, self.remark]))


@dataclass
class Case:
    """A work with its number, and the length of 1 in each of its answers: errors are relative."""

    number: int
    family: str
    work: Work
    units: np.ndarray
    truth: np.ndarray | None = None


def made(question: str, number: int) -> Case:
    family, work = cases.make(question, number)
    return Case(number, family, work, units_of(question, work))


def units_of(question: str, work: Work) -> np.ndarray:
    if question == "first hits":
        return scale(work) / np.linalg.norm(work.directions, axis=1)
    count = len(work.points) if question in ("closest points", "winding numbers") else 1
    return np.full(count, 1.0 if question == "winding numbers" else scale(work))


def answers_in(question: str) -> int:
    """Cases in a work: each point and each ray is one."""
    return 1 if question in ("distance", "contacts") else 8


def limit_of(question: str, precision: str, variant: str = "") -> float:
    """Fast winding numbers are approximations; sums of angles lose digits near edges."""
    if question == "winding numbers":
        return 1e-6 if "exact" in (precision, variant) else 5e-2
    return {"single": SINGLE, "double": DOUBLE, "exact": 1e-12}[precision]


def part(work: Work, faces=None, other=None, entry: int | None = None) -> Work:
    """Returns a work with some of the faces, and one of the points and rays."""
    small = copy.copy(work)
    frame = work.frames[0]
    first, small.faces = _used(frame.first, work.faces if faces is None else work.faces[faces])
    second, small.other_faces = _used(
        frame.second, work.other_faces if other is None else work.other_faces[other]
    )
    small.frames = [Frame(first=first, second=second)]
    if entry is not None:
        keep = slice(entry, entry + 1)
        small.points, small.origins = work.points[keep], work.origins[keep]
        small.directions = work.directions[keep]
    return small


def _used(positions: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    keep, new = np.unique(faces, return_inverse=True)
    return positions[keep], new.reshape(-1, 3).astype(np.int32)


def reduced(is_wrong, work: Work, needs_other: bool) -> Work:
    """Leaves out faces, one by one, while `is_wrong` holds."""
    for name in ("faces", "other_faces") if needs_other else ("faces",):
        k = 0
        while len(getattr(work, name)) > 1 and k < len(getattr(work, name)):
            keep = np.arange(len(getattr(work, name))) != k
            smaller = part(work, *((keep, None) if name == "faces" else (None, keep)))
            if is_wrong(smaller):
                work = smaller
            else:
                k += 1
    return work


def as_json(question: str, work: Work) -> dict:
    frame = work.frames[0]
    text = {"question": question, "vertices": frame.first.tolist(), "faces": work.faces.tolist()}
    if question in ("distance", "contacts"):
        text["other_vertices"] = frame.second.tolist()
        text["other_faces"] = work.other_faces.tolist()
    elif question == "first hits":
        text["origins"], text["directions"] = work.origins.tolist(), work.directions.tolist()
    else:
        text["points"] = work.points.tolist()
    return text


def load(text: dict) -> tuple[str, Work]:
    """Returns the question and the work that as_json has saved."""
    vertices, faces = np.array(text["vertices"], float), np.array(text["faces"], np.int32)
    second = np.array(text.get("other_vertices", vertices), float)
    other = np.array(text.get("other_faces", faces), np.int32)
    work = Work("saved", len(faces), [Frame(first=vertices, second=second)], faces, other)
    work.points = np.array(text.get("points", [[0, 0, 0]]), float)
    work.origins = np.array(text.get("origins", [[0, 0, 0]]), float)
    work.directions = np.array(text.get("directions", [[0, 0, 1]]), float)
    return text["question"], work


class Comparison:
    """Compares one variant of one peer with this library for one question."""

    def __init__(self, peer: Worker, variant: str, question: str):
        self.peer, self.variant, self.question = peer, variant, question
        self.limit = limit_of(question, chosen(peer, "precision", question), variant)
        self.our_limit = limit_of(question, "double", "exact")
        self.counts: dict[str, Count] = defaultdict(Count)

    def compare(self, case: Case, ours, theirs) -> None:
        count = self.counts[case.family]
        count.cases += len(case.units)
        if isinstance(theirs, str):
            count.failures += len(case.units)
            count.remark = theirs
            self._keep(count, case, case.work, {"failure": theirs})
        elif isinstance(ours, str):
            count.ours_wrong += len(case.units)
            count.remark = f"ours: {ours}"
            self._keep(count, case, case.work, {"ours": ours}, True)
        elif KINDS[self.question] == "pairs":
            self._compare_pairs(count, case, ours, theirs)
        elif np.shape(ours) != np.shape(theirs):
            count.failures += len(case.units)
            count.remark = f"shape {np.shape(theirs)}"
        else:
            self._compare_numbers(count, case, ours, theirs)

    def _compare_pairs(self, count: Count, case: Case, ours, theirs) -> None:
        a, b = _set(ours), _set(theirs)
        if a == b:
            return
        if case.truth is None:
            case.truth = judge.answer(self.question, case.work)
        truth = _set(case.truth)
        count.differences += 1
        wrong = {"ours": sorted((a ^ truth) - (a & b)), "theirs": sorted((b ^ truth) - (a & b))}
        count.ours_wrong += bool(wrong["ours"])
        count.theirs_wrong += bool(wrong["theirs"])
        count.ours_worst = max(count.ours_worst, len(wrong["ours"]))
        count.theirs_worst = max(count.theirs_worst, len(wrong["theirs"]))
        is_ours = bool(wrong["ours"])
        i, j = pair = wrong["ours" if is_ours else "theirs"][0]
        if is_ours or len(count.kept) < KEPT:
            says = {"touch": pair in truth, "ours": pair in a, "theirs": pair in b}
            self._keep(count, case, part(case.work, [i], [j]), says, is_ours)

    def _compare_numbers(self, count: Count, case: Case, ours, theirs) -> None:
        units = case.units
        entries = np.flatnonzero(differing("lengths", ours, theirs, self.limit * units))
        for i in map(int, entries):
            count.differences += 1
            truth = None if case.truth is None else case.truth[i]
            truths = truths_of(self.question, case.work, i, self.limit, truth)
            ours_error = _apart(ours[i], truths[0]) / units[i]
            theirs_error = _outside(theirs[i], truths) / units[i]
            is_ours = bool(ours_error > self.our_limit)
            is_theirs = bool(theirs_error > self.limit)
            count.ours_wrong += is_ours
            count.theirs_wrong += is_theirs
            count.ours_worst = max(count.ours_worst, ours_error)
            count.theirs_worst = max(count.theirs_worst, theirs_error)
            # Otherwise both answers are right: at a corner, or on a surface.
            if is_ours or (is_theirs and len(count.kept) < KEPT):
                says = {"truth": truths[0], "ours": float(ours[i]), "theirs": float(theirs[i])}
                self._keep_number(count, case, i, says, is_ours)

    def _keep_number(self, count: Count, case: Case, entry: int, says: dict, is_ours: bool) -> None:
        work = part(case.work, entry=None if self.question == "distance" else entry)
        if not is_ours:
            work, says = self._reduce(work, says)
        self._keep(count, case, work, says, is_ours)

    def _reduce(self, work: Work, says: dict) -> tuple[Work, dict]:
        best = dict(says)

        def is_wrong(smaller: Work) -> bool:
            try:
                theirs = self.peer.call("cases", self.question, self.variant, [smaller])[0]
            except (Crash, Failure):
                return False
            if isinstance(theirs, str) or not len(theirs):
                return False
            truths = truths_of(self.question, smaller, 0, self.limit)
            unit = units_of(self.question, smaller)[0]
            if _outside(theirs[0], truths) <= self.limit * unit:
                return False
            best.update(truth=truths[0], theirs=float(theirs[0]))
            best.pop("ours", None)
            return True

        return reduced(is_wrong, work, self.question == "distance"), best

    def _keep(self, count: Count, case: Case, work: Work, says: dict, is_ours: bool = False):
        if is_ours or len(count.kept) < KEPT:
            text = {"peer": self.peer.label(self.variant), "case": case.number}
            text.update({"ours is wrong": is_ours, **says, **as_json(self.question, work)})
            count.kept.append(text)


def truths_of(
    question: str, work: Work, entry: int, shift: float, truth: float | None = None
) -> list[float]:
    """The true answer, and those of rays beside a ray. nan: on a surface, where numbers jump."""
    if question == "first hits":
        return judge.hits_near(work, entry, shift * scale(work))
    if question == "winding numbers":
        nearest = judge.answer("closest points", work, entry)[0]
        if nearest <= 1e-5 * scale(work):
            return [math.nan]
    if truth is None:
        truth = judge.answer(question, work, None if question == "distance" else entry)[0]
    return [float(truth)]


def _outside(answer: float, truths: list[float]) -> float:
    """How far an answer is from the interval of finite truths, and from an infinite one."""
    finite = [t for t in truths if math.isfinite(t)]
    if len(truths) == 1 or not finite or not math.isfinite(answer):
        return min(_apart(answer, t) for t in truths)
    return max(0.0, min(finite) - answer, answer - max(finite))


def _set(pairs) -> set[tuple[int, int]]:
    return set(map(tuple, np.reshape(pairs, (-1, 2)).tolist()))


def _apart(a: float, b: float) -> float:
    if a == b or math.isnan(b):
        return 0.0
    apart = abs(float(a) - float(b))
    return math.inf if math.isnan(apart) else apart


def answered(worker: Worker, question: str, variant: str, works: list[Work]) -> list:
    """Answers of works; where a process dies, the work that kills it is found by halving."""
    try:
        return worker.call("cases", question, variant, works)
    except Failure as failure:
        return [str(failure)] * len(works)
    except Crash as crash:
        if len(works) == 1:
            return [f"crash: {crash}"]
        half = len(works) // 2
        parts = works[:half], works[half:]
        return [answer for part in parts for answer in answered(worker, question, variant, part)]


def run(workers: list[Worker], question: str, numbers: range):
    """Asks all works with these numbers, all peers at once. Yields the comparisons so far.

    Peers answer a batch while the one before it is compared.
    """
    asked = [(w, v) for w in workers for v in w.variants(question)]
    compared = [Comparison(*each, question) for each in asked[1:]]
    before: list[Case] = []
    futures: list[Future] = []
    with ThreadPoolExecutor(len(workers)) as pool:
        for begin in range(0, len(numbers) + BATCH, BATCH):
            batch = [made(question, number) for number in numbers[begin : begin + BATCH]]
            works = [case.work for case in batch]
            found = [answers for future in futures for answers in future.result()]
            futures = [pool.submit(all_answers, w, question, works) for w in workers if batch]
            if before:
                compare_batch(compared, before, found)
                yield compared
            before = batch


def all_answers(worker: Worker, question: str, works: list[Work]) -> list[list]:
    """Answers of each variant of a peer."""
    return [answered(worker, question, variant, works) for variant in worker.variants(question)]


def compare_batch(compared: list[Comparison], batch: list[Case], found: list[list]) -> None:
    """found: answers of this library, then those of each comparison."""
    ours, *others = found
    for comparison, answers in zip(compared, others):
        if comparison.peer.peer == "judge":
            for case, answer in zip(batch, answers):
                case.truth = answer
    for comparison, answers in zip(compared, others):
        for i, case in enumerate(batch):
            comparison.compare(case, ours[i], answers[i])


class Report:
    """Counts of all questions, added to those of the file that is there; inputs that are kept."""

    def __init__(self, csv_path: str, json_path: str):
        self.csv_path, self.json_path = csv_path, json_path
        self.before: list[dict] = []
        self.rows: dict[str, dict] = {}
        self.kept: dict[str, list] = {}
        if csv_path and os.path.exists(csv_path):
            self.add(csv_path)

    def add(self, path: str) -> None:
        with open(path, newline="") as file:
            self.before += csv.DictReader(file)

    def save(self, question: str, compared: list[Comparison]) -> None:
        counts: dict[tuple, Count] = defaultdict(Count)
        self.kept[question] = []
        for comparison in compared:
            label = comparison.peer.label(comparison.variant)
            for family, count in comparison.counts.items():
                counts[question, label, family].add_row(count.row(question, label, family))
                self.kept[question] += [{"family": family, **each} for each in count.kept]
        self.rows[question] = counts
        with open(self.json_path, "w") as file:
            json.dump([each for kept in self.kept.values() for each in kept], file, indent=1)
        if self.csv_path:
            self.write_csv()

    def write_csv(self) -> None:
        total: dict[tuple, Count] = defaultdict(Count)
        rows = [c.row(*key) for counts in self.rows.values() for key, c in counts.items()]
        for row in self.before + rows:
            total[row["question"], row["peer"], row["family"]].add_row(row)
        with open(self.csv_path, "w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(total[key].row(*key) for key in sorted(total, key=_place))

    def show(self, question: str) -> None:
        """Prints the rows of families with differences, and who had none."""
        form = "{:16} {:33} {:13} {:>7} {:>7} {:>6} {:>6} {:>9} {:>9} {:>5}  {}"
        head = ["question", "peer", "family", "cases", "differ", "ours", "theirs"]
        print(form.format(*head, "by", "by", "fails", "").rstrip())
        total: dict[str, Count] = defaultdict(Count)
        for (_, peer, family), count in self.rows[question].items():
            total[peer].add_row(count.row(question, peer, "all"))
            if count.differences or count.failures:
                print(form.format(*count.row(question, peer, family).values()).rstrip())
        for peer, count in total.items():
            print(form.format(*count.row(question, peer, "all").values()).rstrip(), flush=True)


def _place(key: tuple) -> tuple:
    question, peer, family = key
    name = peer.split(" (")[0]
    order = [*PEERS, "judge"].index(name)
    return list(KINDS).index(question), order, peer, cases.FAMILIES.index(family)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1800, help="cases of each question")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--peers", nargs="*", default=[*PEERS, "judge"])
    parser.add_argument("--questions", nargs="*", default=list(KINDS))
    parser.add_argument("--csv", default="", help="counts are added to this file")
    parser.add_argument("--add", nargs="*", help="adds these files to that of --csv, and ends")
    parser.add_argument("--json", default="differences.json")
    parser.add_argument("--replay", help="a JSON file of inputs: prints what each peer answers")
    options = parser.parse_args()
    report = Report(options.csv, options.json)
    if options.add:
        for path in options.add:
            report.add(path)
        report.write_csv()
        return
    workers = start(options.peers, 1, spread=True)
    if options.replay:
        replay(workers, options.replay)
    else:
        for question in options.questions:
            each = answers_in(question)
            last = options.first + options.cases
            for compared in run(workers, question, range(options.first // each, -(-last // each))):
                report.save(question, compared)
            report.show(question)
        print(f"inputs of differences: {os.path.abspath(options.json)}")
    for worker in workers:
        worker.stop()


def replay(workers: list[Worker], path: str) -> None:
    """Prints, for each saved input, the judge's answer and that of every peer."""
    with open(path) as file:
        saved = json.load(file)
    for each in saved:
        question, work = load(each)
        print(f"{question}: truth {judge.answer(question, work).tolist()}")
        for worker in workers:
            for variant in worker.variants(question):
                try:
                    found = worker.call("cases", question, variant, [work])[0]
                except (Crash, Failure) as error:
                    found = str(error)
                text = found.tolist() if hasattr(found, "tolist") else found
                print(f"    {worker.label(variant):20} {text}")


if __name__ == "__main__":
    main()
