#!/usr/bin/env python3
"""Measured times as CSV, and a comparison of two runs.

  figures_csv.py write RESULTS FILE   every time in the tables that figures.sh keeps in RESULTS
  figures_csv.py compare OLD NEW      names the rows that became slower by more than 15 %

Columns: commit, date, processor, part (of figures.sh), table, row, column, time. The unit is that
of the table. A comparison divides by the median change of the rows of other libraries, whose code
stayed the same, so that another machine or a busy one does not count.
Exit status of compare: 1 if it names a row.
"""
import csv
import json
import re
import statistics
import sys
from pathlib import Path

from figures import printed_tables

COLUMNS = ["commit", "date", "processor", "part", "table", "row", "column", "time"]
LIMIT = 1.15
UNIT = re.compile(r"(?:^|[\s,(])(?:ms|ns|µs|us)(?:$|[\s,)])")
TIMES = re.compile(r"^(?:update|query|sum|touching)$")
NO_TIMES = re.compile(
    r"times|faster|than|takes|ratio|triangles|contacts|pairs|frames|error|difference|tests|refits"
    r"|nodes|bytes|candidates|cell|overlap|inside|answer|±|edges|diagonals|largest|wrong|vertices"
)
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
OTHERS = re.compile(r"FCL|Embree|CGAL|trimesh|expert", re.IGNORECASE)


def time_of(cell):
    """The number of a cell such as "2.3", "2.3 (1.1)" or "0.1 + 2.3", or None."""
    parts = re.sub(r" \(.*\)$", "", cell.replace("*", "")).split(" + ")
    if not all(NUMBER.fullmatch(part) for part in parts):
        return None
    return sum(float(part) for part in parts)


def is_precise(cell, time):
    """Whether the last digit of a cell counts for at most a twentieth of its number."""
    decimals = re.match(r"\d+\.(\d+)", cell.replace("*", ""))
    return time >= 20 * 10.0 ** -len(decimals[1] if decimals else "")


def rows_of(part, text):
    """Yields (part, table, row, column, time) of the times in a printed text."""
    for heading, header, rows in printed_tables(text):
        # What a heading says before its first number names the table; counts may change.
        table = re.split(r"[;(]", heading)[0].strip()
        # Either some columns name their unit, or all columns with numbers are times.
        known = [
            bool(UNIT.search(name) or TIMES.match(name)) and time_of(cell) is not None
            for name, cell in zip(header[1:], rows[0][1:])
        ]
        is_time = [
            (is_known or not any(known)) and not NO_TIMES.search(name)
            for is_known, name in zip(known, header[1:])
        ]
        first = ""
        for cells in rows:
            first = cells[0] or first
            texts = [c for c in cells[1:] if c not in ("", "-") and not NUMBER.match(c)]
            name = " / ".join([first, *texts])
            if "times faster" in name:
                continue
            for column, is_wanted, cell in zip(header[1:], is_time, cells[1:]):
                time = time_of(cell) if is_wanted else None
                if time is not None and is_precise(cell, time):
                    yield part, table, name, column or "time", time


def micro_rows(path):
    """Yields (name, time, unit) of Google Benchmark's results."""
    if path.exists():
        for run in json.loads(path.read_text(encoding="utf-8"))["benchmarks"]:
            if run.get("run_type", "iteration") == "iteration":
                yield run["name"], run["cpu_time"], run["time_unit"]


def write(results, path):
    provenance = (results / "provenance").read_text(encoding="utf-8")
    commit = re.search(r"`([^`]*)`", provenance)[1]
    date = re.search(r"\d{4}-\d\d-\d\d", provenance)[0]
    processor = re.search(r", on (.*?);", provenance)[1]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        seen = set()
        for text in sorted(results.glob("*.txt")):
            for row in rows_of(text.stem, text.read_text(encoding="utf-8")):
                if row[:4] not in seen:
                    seen.add(row[:4])
                    writer.writerow([commit, date, processor, *row[:4], f"{row[4]:.4g}"])
        for name, time, unit in micro_rows(results / "micro.json"):
            writer.writerow([commit, date, processor, "micro", unit, name, "time", f"{time:.4g}"])


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {tuple(r[c] for c in COLUMNS[3:7]): float(r["time"]) for r in rows}, rows[0]


def compare(old_path, new_path):
    old, of_old = read(old_path)
    new, of_new = read(new_path)
    changes = {key: new[key] / old[key] for key in old if new.get(key, 0) > 0 and old[key] > 0}
    others = [x for key, x in changes.items() if OTHERS.search(" ".join(key[2:]))]
    machine = statistics.median(others) if others else 1.0
    print(f"{of_old['commit']} to {of_new['commit']}: {len(changes)} rows in both.")
    print(f"Other libraries' rows: {machine:.3f} times; rows below are relative to that.")
    slower = {key: x / machine for key, x in changes.items() if x / machine > LIMIT}
    slower = {key: x for key, x in slower.items() if not OTHERS.search(" ".join(key[2:]))}
    for key, x in sorted(slower.items(), key=lambda item: -item[1]):
        print(f"{x:6.2f}  {old[key]:g} -> {new[key]:g}  {'; '.join(key)}")
    print(f"{len(slower)} rows became slower by more than {100 * (LIMIT - 1):.0f} %.")
    return 1 if slower else 0


def main(arguments):
    if len(arguments) == 3 and arguments[0] == "write":
        write(Path(arguments[1]), arguments[2])
        return 0
    if len(arguments) == 3 and arguments[0] == "compare":
        return compare(arguments[1], arguments[2])
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
