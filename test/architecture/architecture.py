#!/usr/bin/env python3
"""Compares docs/architecture.md with the files that a call runs.

    architecture.py BUILD [--print]

BUILD is a build folder of this program (architecture.sh makes it), compiled with --coverage. For
each flow that `flows` knows the document has a section "### A ...: N files". The files in it that
have a number, and no others, must be those of src/ and include/ of which the call runs a line; a
source, its header and its form for AVX2 are one. Public headers may hold declarations only. The
document names the files that do not count.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
NAME = r"`([\w/]+)\.(?:h|cpp)`"


def unit_of(name):
    """'query/tree_pair' of 'tree_pair' or 'query/tree_pair'; 'include/...' of a public header."""
    found = [path for path in [*ROOT.glob(f"src/**/{name}.*"), *ROOT.glob(f"include/**/{name}.*"),
                               *ROOT.glob(f"{name}.*")]
             if path.suffix in (".h", ".cpp")]
    units = {unit_of_path(path) for path in found}
    assert len(units) == 1, f"architecture.md: {name} is {sorted(units) or 'no file'}"
    return units.pop()


def unit_of_path(path):
    relative = path.relative_to(ROOT).with_suffix("")
    relative = relative.with_name(relative.name.replace("_avx2", ""))
    return str(relative.relative_to("src")) if relative.parts[0] == "src" else str(relative)


def uncounted(document):
    text = re.search(r"Not counted are(.*?)and FCL's", document, re.S).group(1)
    units, folder = set(), None
    for name in re.findall(NAME, text):
        folder = name.rpartition("/")[0] or folder
        units.add(unit_of(name if "/" in name else f"{folder}/{name}"))
    return units


def sections(document):
    """The counted units of each flow, in the order of their numbers."""
    for title, count, text in re.findall(r"### An? (.*?): (\d+) files\n(.*?)(?=\n##|\Z)", document,
                                         re.S):
        numbered = re.findall(NAME + r"(?:,| \()\s*(\d+)", text)
        numbers = [int(number) for _, number in numbered]
        assert numbers == list(range(1, int(count) + 1)), f"{title}: the numbers are {numbers}"
        yield title, [unit_of(name) for name, _ in numbered]


def executed(build, flow):
    """The units of which one call runs a line."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([build / "flows", flow], check=True,
                       env={"GCOV_PREFIX": folder, "GCOV_PREFIX_STRIP": "0"})
        units = set()
        for counts in pathlib.Path(folder).rglob("*.gcda"):
            notes = pathlib.Path("/") / counts.relative_to(folder).with_suffix(".gcno")
            (counts.parent / notes.name).symlink_to(notes)
            report = subprocess.run(["gcov", "--json-format", "--stdout", counts], check=True,
                                    capture_output=True, cwd=folder).stdout
            for line in report.splitlines():
                units |= units_in(json.loads(line))
        return units


def units_in(report):
    base = pathlib.Path(report["current_working_directory"])
    ran = {(base / file["file"]).resolve() for file in report["files"]
           if any(line["count"] for line in file["lines"])}
    return {unit_of_path(path) for path in ran
            if path.is_relative_to(ROOT / "src") or path.is_relative_to(ROOT / "include")}


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    document = (ROOT / "docs/architecture.md").read_text()
    ignored = uncounted(document)
    listed = dict(sections(document))
    flows = subprocess.run([build / "flows"], capture_output=True, text=True,
                           check=True).stdout.splitlines()
    wrong = 0
    for flow in flows:
        ran = executed(build, flow) - ignored
        if "--print" in sys.argv:
            print(f"{flow}: {len(ran)}\n    " + "\n    ".join(sorted(ran)))
        numbered = set(listed.get(flow, []))
        for unit in sorted(ran ^ numbered):
            if unit.startswith("include/") and unit in numbered:
                continue
            wrong += 1
            print(f"{flow}: {unit}.* {'runs, but has no number' if unit in ran else 'does not run'}")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
