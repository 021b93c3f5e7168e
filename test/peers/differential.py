"""Asks all peers the same small questions, and a third judge who is wrong where they differ.

Prints a table: peer, question, family, cases, differences, how often each side is wrong and by how
much at most. Writes inputs of differences, made smaller, as JSON.
"""

from __future__ import annotations

import argparse
import copy
import json
import math
import os
from collections import defaultdict
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
# Fast winding numbers are approximations; exact ones of single precision are worse near a surface.
WINDING = {"single": 5e-2, "double": 5e-2}
KEPT = 3


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


def limit_of(question: str, precision: str, unit: float) -> float:
    if question == "winding numbers":
        return WINDING[precision]
    return unit * (SINGLE if precision == "single" else DOUBLE)


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

    def __init__(self, peer: Worker, variant: str, question: str, verdicts: Verdicts):
        self.peer, self.variant, self.question = peer, variant, question
        self.verdicts = verdicts
        self.precision = chosen(peer, "precision", question)
        self.counts: dict[str, Count] = defaultdict(Count)

    def compare(self, family: str, number: int, work: Work, ours, theirs) -> None:
        count = self.counts[family]
        count.cases += 1
        if isinstance(theirs, str):
            count.failures += 1
            count.remark = theirs
            self._keep(count, number, work, {"failure": theirs})
        elif isinstance(ours, str):
            count.ours_wrong += 1
            count.remark = f"ours: {ours}"
            self._keep(count, number, work, {"ours": ours})
        elif KINDS[self.question] == "pairs":
            self._compare_pairs(count, number, work, ours, theirs)
        else:
            self._compare_numbers(count, number, work, ours, theirs)

    def _compare_pairs(self, count: Count, number: int, work: Work, ours, theirs) -> None:
        a, b = ({tuple(map(int, p)) for p in np.reshape(x, (-1, 2))} for x in (ours, theirs))
        if a == b:
            return
        count.differences += 1
        wrong = {"ours": [], "theirs": []}
        for pair in sorted(a ^ b):
            truth = self.verdicts.of((number, pair), lambda p=pair: judge.touch(work, p))
            wrong["theirs" if truth == (pair in a) else "ours"].append(pair)
        count.ours_wrong += bool(wrong["ours"])
        count.theirs_wrong += bool(wrong["theirs"])
        count.ours_worst = max(count.ours_worst, len(wrong["ours"]))
        count.theirs_worst = max(count.theirs_worst, len(wrong["theirs"]))
        i, j = (wrong["ours"] or wrong["theirs"])[0]
        small = part(work, [i], [j])
        says = {"touch": ((i, j) in a) != bool(wrong["ours"]), "ours": (i, j) in a}
        says["theirs"] = (i, j) in b
        self._keep(count, number, small, says, bool(wrong["ours"]))

    def _compare_numbers(self, count: Count, number: int, work: Work, ours, theirs) -> None:
        unit = scale(work)
        if np.shape(ours) != np.shape(theirs):
            count.failures += 1
            count.remark = f"shape {np.shape(theirs)}"
            return
        limit = limit_of(self.question, self.precision, unit)
        entries = np.flatnonzero(differing(KINDS[self.question], ours, theirs, limit))
        if not len(entries):
            return
        count.differences += 1
        errors = [self._errors(number, work, int(i), ours[i], theirs[i], limit) for i in entries]
        precise = limit_of(self.question, "double", unit)
        count.ours_wrong += any(e[0] > precise for e in errors)
        count.theirs_wrong += any(e[1] > limit for e in errors)
        count.ours_worst = max([count.ours_worst] + [e[0] / unit for e in errors])
        count.theirs_worst = max([count.theirs_worst] + [e[1] / unit for e in errors])
        worst = max(range(len(errors)), key=lambda k: (errors[k][0] > precise, errors[k][1]))
        i, (ours_error, _, truth) = int(entries[worst]), errors[worst]
        says = {"truth": truth, "ours": float(ours[i]), "theirs": float(theirs[i])}
        is_ours = ours_error > precise
        if not is_ours and not any(e[1] > limit for e in errors):
            return  # Both answers are right: at a corner, or on a surface.
        if is_ours or len(count.kept) < KEPT:
            work = part(work, entry=None if self.question == "distance" else i)
            if not is_ours:
                work, says = self._reduce(work, limit, says)
            self._keep(count, number, work, says, is_ours)

    def _errors(self, number: int, work: Work, entry: int, ours, theirs, limit: float):
        """Returns the errors of both, and the truth: nan where there is none."""
        key = number, entry, limit if self.question == "first hits" else 0
        truths = self.verdicts.of(key, lambda: truths_of(self.question, work, entry, limit))
        return _apart(ours, truths[0]), _outside(theirs, truths), truths[0]

    def _reduce(self, work: Work, limit: float, says: dict) -> tuple[Work, dict]:
        best = dict(says)

        def is_wrong(smaller: Work) -> bool:
            try:
                arguments = self.question, self.variant, [smaller]
                theirs = self.peer.call("cases", *arguments)[0]
            except (Crash, Failure):
                return False
            if isinstance(theirs, str) or not len(theirs):
                return False
            truths = truths_of(self.question, smaller, 0, limit)
            if _outside(theirs[0], truths) <= limit:
                return False
            best.update(truth=truths[0], theirs=float(theirs[0]))
            best.pop("ours", None)
            return True

        return reduced(is_wrong, work, self.question == "distance"), best

    def _keep(self, count: Count, number: int, work: Work, says: dict, is_ours: bool = False):
        if is_ours or len(count.kept) < KEPT:
            text = {"peer": self.peer.label(self.variant), "case": number, "ours is wrong": is_ours}
            count.kept.append({**text, **says, **as_json(self.question, work)})


def truths_of(question: str, work: Work, entry: int, limit: float) -> list[float]:
    """The true answer, and those of rays beside a ray. nan: on a surface, where numbers jump."""
    if question == "first hits":
        return judge.hits_near(work, entry, limit)
    if question == "winding numbers":
        nearest = judge.answer("closest points", work, entry)[0]
        if nearest <= 1e-5 * scale(work):
            return [math.nan]
    single = None if question == "distance" else entry
    return [float(judge.answer(question, work, single)[0])]


def _outside(answer: float, truths: list[float]) -> float:
    """How far an answer is from the interval of finite truths, and from an infinite one."""
    finite = [t for t in truths if math.isfinite(t)]
    if len(truths) == 1 or not finite or not math.isfinite(answer):
        return min(_apart(answer, t) for t in truths)
    return max(0.0, min(finite) - answer, answer - max(finite))


class Verdicts:
    """The judge's answers of the batch, since all peers need the same ones."""

    def __init__(self):
        self.known = {}

    def of(self, key, ask):
        if key not in self.known:
            if len(self.known) > 100_000:
                self.known.clear()
            self.known[key] = ask()
        return self.known[key]


def _apart(a: float, b: float) -> float:
    if a == b or math.isnan(b):
        return 0.0
    apart = abs(float(a) - float(b))
    return math.inf if math.isnan(apart) else apart


def answered(worker: Worker, question: str, variant: str, first: int, count: int) -> list:
    """Answers of cases; where a process dies, the case that kills it is found by halving."""
    try:
        return worker.call("generated", question, variant, first, count)
    except Failure as failure:
        return [str(failure)] * count
    except Crash as crash:
        if count == 1:
            return [f"crash: {crash}"]
        half = count // 2
        return answered(worker, question, variant, first, half) + answered(
            worker, question, variant, first + half, count - half
        )


def run(workers: list[Worker], question: str, total: int, first: int) -> list[Comparison]:
    ours, verdicts = workers[0], Verdicts()
    compared = [
        Comparison(w, v, question, verdicts)
        for w in workers
        for v in w.variants(question)
        if (w, v) != (ours, ours.variants(question)[0])
    ]
    batch = 90
    for begin in range(first, first + total, batch):
        count = min(batch, first + total - begin)
        made = [cases.make(question, begin + i) for i in range(count)]
        reference = answered(ours, question, ours.variants(question)[0], begin, count)
        for comparison in compared:
            arguments = comparison.peer, question, comparison.variant, begin, count
            for i, theirs in enumerate(answered(*arguments)):
                family, work = made[i]
                comparison.compare(family, begin + i, work, reference[i], theirs)
    return compared


def report(compared: list[Comparison]) -> list[dict]:
    kept = []
    form = "{:16} {:20} {:13} {:>7} {:>7} {:>6} {:>6} {:>9} {:>9} {:>5}  {}"
    head = ["question", "peer", "family", "cases", "differ", "ours", "theirs"]
    print(form.format(*head, "by", "by", "fails", "").rstrip())
    for comparison in compared:
        label = comparison.peer.label(comparison.variant)
        for family, c in comparison.counts.items():
            if c.differences or c.failures or c.ours_wrong:
                numbers = [c.cases, c.differences, c.ours_wrong, c.theirs_wrong]
                numbers += [f"{c.ours_worst:.2g}", f"{c.theirs_worst:.2g}", c.failures]
                print(form.format(comparison.question, label, family, *numbers, c.remark).rstrip())
            kept += [{"family": family, **each} for each in c.kept]
        if not any(c.differences or c.failures for c in comparison.counts.values()):
            total = sum(c.cases for c in comparison.counts.values())
            print(form.format(comparison.question, label, "all", total, 0, 0, 0, 0, 0, 0, ""))
    return kept


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200, help="cases of each question")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--peers", nargs="*", default=PEERS)
    parser.add_argument("--questions", nargs="*", default=list(KINDS))
    parser.add_argument("--json", default="differences.json")
    parser.add_argument("--replay", help="a JSON file of inputs: prints what each peer answers")
    options = parser.parse_args()
    workers = start(options.peers, 1)
    if options.replay:
        replay(workers, options.replay)
    else:
        kept = []
        for question in options.questions:
            kept += report(run(workers, question, options.cases, options.first))
            with open(options.json, "w") as file:
                json.dump(kept, file, indent=1)
        print(f"{len(kept)} inputs in {os.path.abspath(options.json)}")
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
