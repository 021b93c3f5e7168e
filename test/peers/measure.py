"""Measures all peers on the same work, in turns, and compares their answers with this library's.

Writes one CSV row for each peer, question, scene, size and number of threads: the least mean
milliseconds of a step over all rounds, update of the structure included. The rows "empty call" have
two tetrahedra and one point: what a call costs in Python.
"""

from __future__ import annotations

import argparse
import csv
import os

from questions import DOUBLE, QUESTIONS, SINGLE, difference, scale
from worker import PEERS, Crash, Failure, Worker

COLUMNS = ["peer", "question", "scene", "size", "triangles", "threads", "ms a step", "times ours"]
COLUMNS += ["difference", "agrees", "update", "remark"]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small scenes, one thread, one round")
    parser.add_argument("--peers", nargs="*", default=PEERS, help="only these")
    parser.add_argument("--questions", nargs="*", default=list(QUESTIONS), help="only these")
    parser.add_argument("--sizes", nargs="*", type=int, help="1 and 16")
    parser.add_argument("--threads", nargs="*", type=int, help="1 and 2")
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--points", type=int, help="query points and rays")
    parser.add_argument("--csv", default="peers.csv")
    options = parser.parse_args()
    quick = {"sizes": [1], "threads": [1], "rounds": 1, "steps": 3, "points": 2000}
    full = {"sizes": [1, 16], "threads": [1, 2], "rounds": 5, "steps": 12, "points": 100000}
    for name, value in (quick if options.quick else full).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    return options


def start(peers: list[str], threads: int, spread: bool = False) -> list[Worker]:
    """Starts the peers that can be imported; this library comes first, and must be there.

    spread: over all processors, for peers that are asked at the same time.
    """
    names = ["ours"] + [p for p in peers if p != "ours"]
    workers = []
    for name in names:
        worker = Worker(name, threads, len(workers) if spread else 0)
        if worker.failed:
            print(f"skipped {name}: {worker.failed}", flush=True)
            if name == "ours":
                raise SystemExit("this library's module must be importable: set PYTHONPATH")
        else:
            workers.append(worker)
    return workers


def verdict(question, work_unit: float, precision: str, ours, theirs) -> tuple[float, str]:
    """Returns the difference and "yes", "no" or "-" where the question has no single answer."""
    apart = difference(question.kind, ours, theirs, work_unit)
    if question.kind == "count":
        return apart, "-"
    limit = {"lengths": SINGLE if precision == "single" else DOUBLE, "numbers": 5e-2, "times": 1e-3}
    return apart, "yes" if apart <= max(question.limit, limit.get(question.kind, 0.0)) else "no"


def measured(workers: list[Worker], question, scene: tuple, rounds: int) -> dict:
    """Returns, for each (worker, variant), the result of the best round, or its failure."""
    best, failed = {}, {}
    for _ in range(rounds):
        for worker in workers:
            for variant in worker.variants(question.name):
                key = worker, variant
                if key in failed:
                    continue
                try:
                    found = worker.call("measure", question.name, variant, scene)
                except (Crash, Failure) as error:
                    failed[key] = {"failed": str(error)}
                    continue
                if "missing" in found:
                    return {}
                spent = found["milliseconds"]
                # The first step builds, or is slow where memory is touched for the first time.
                found["mean"] = sum(spent[1:]) / (len(spent) - 1) if len(spent) > 1 else spent[0]
                if key not in best or found["mean"] < best[key]["mean"]:
                    best[key] = found
    return {**best, **failed}


def row_of(worker, variant, question, scene, found, reference, unit) -> dict:
    row = dict.fromkeys(COLUMNS, "")
    row.update(peer=worker.label(variant), question=question.name, threads=worker.threads)
    update = variant if variant in ("refit", "rebuild") else chosen(worker, "update", question.name)
    row.update(size=scene[1], update=update, scene=reference["scene"])
    if "failed" in found:
        row["remark"] = found["failed"]
        return row
    if found["digest"] != reference["digest"]:
        raise SystemExit(f"{worker.peer} got other inputs")
    name = question.name
    apart, agrees = verdict(
        question, unit, chosen(worker, "precision", name), reference["answer"], found["answer"]
    )
    row["triangles"] = found["triangles"]
    row["ms a step"] = f"{found['mean']:.4g}"
    row["times ours"] = f"{found['mean'] / reference['mean']:.3g}"
    row["difference"], row["agrees"] = f"{apart:.3g}", agrees
    if question.kind == "count":
        row["remark"] = "pairs: " + " + ".join(str(int(x)) for x in found["answer"])
    return row


def chosen(worker: Worker, what: str, question: str) -> str:
    """Returns what a peer says of "update" or "precision", in general or for a question."""
    said = worker.about[what]
    return said if isinstance(said, str) else said.get(question, said[""])


def unit_of(question, scene: tuple) -> float:
    if scene[0] < 0:
        return 1.0
    return scale(question.scenes[scene[0]](scene[1], 1, 10))


def table(rows: list[dict]) -> None:
    shown = ["question", "scene", "size", "threads", "peer", "ms a step", "times ours"]
    shown += ["difference", "agrees", "update", "remark"]
    text = [[str(row[c]) for c in shown] for row in [dict(zip(shown, shown))] + rows]
    width = [max(len(line[i]) for line in text) for i in range(len(shown) - 1)]
    for line in text:
        print("  ".join(x.ljust(w) for x, w in zip(line, width)) + "  " + line[-1])


def absences(workers: list[Worker], questions: list[str]) -> list[dict]:
    rows = []
    for worker in workers:
        for question in questions:
            if not worker.variants(question):
                absent = worker.about["absent"]
                why = absent.get(question, absent.get("", "no such call"))
                row = dict.fromkeys(COLUMNS, "")
                row.update(peer=worker.peer, question=question, remark=why, threads=worker.threads)
                rows.append(row)
    return rows


def main() -> None:
    options = arguments()
    rows = []
    for threads in options.threads:
        workers = start(options.peers, threads)
        for name in options.questions:
            question = QUESTIONS[name]
            works = [(-1, 0)] + [(n, s) for s in options.sizes for n in range(len(question.scenes))]
            for number, size in works:
                scene = (number, size, options.steps, options.points)
                found = measured(workers, question, scene, options.rounds)
                if not found:
                    print(f"skipped a scene of {name}: its data is not there", flush=True)
                    continue
                ours = (workers[0], workers[0].variants(name)[0])
                if "failed" in found[ours]:
                    raise SystemExit(f"{name}: ours failed: {found[ours]['failed']}")
                unit = unit_of(question, scene)
                for (worker, variant), result in found.items():
                    row = row_of(worker, variant, question, scene, result, found[ours], unit)
                    rows.append(row)
                    print(*[row[c] for c in COLUMNS], sep="; ", flush=True)
        rows += absences(workers, options.questions)
        for worker in workers:
            worker.stop()
    with open(options.csv, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    print()
    table(rows)
    print(f"\nwrote {os.path.abspath(options.csv)}")


if __name__ == "__main__":
    main()
