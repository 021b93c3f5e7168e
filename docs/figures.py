#!/usr/bin/env python3
"""Writes the measured tables of the documents, and checks that the documents agree.

  figures.py write RESULTS FOLDER   all blocks of which RESULTS has the measurements, in FOLDER
  figures.py check FOLDER           exit status 1 if two documents disagree

figures.sh runs the programs, and calls this. FOLDER holds README.md and docs/. A block stands
between two comments and is replaced as a whole:

  <!-- figures: NAME -->
  ...
  <!-- /figures -->
"""
import csv
import functools
import json
import math
import re
import statistics
import sys
from pathlib import Path

median = statistics.median_low
BLOCK = re.compile(r"<!-- figures: ([a-z0-9-]+) -->\n(.*?)<!-- /figures -->", re.DOTALL)
BLOCKS = {}  # name: function of Results


def block(name):
    def register(function):
        BLOCKS[name] = function
        return function

    return register


class Missing(Exception):
    """A part of the measurements was not made."""


def printed_tables(text):
    """Yields (the line before it, header, rows of cells) of each markdown table of a text. A table
    without a header continues the one before it, under a heading of its own."""
    heading, header, rows = "", [], []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            cells = [cell.strip() for cell in line.strip()[1:-1].split("|")]
            if all(re.fullmatch("-+:?", cell) for cell in cells):
                header, rows = rows[-1], []
            else:
                rows.append(cells)
            continue
        if rows:
            yield heading, header, rows
            rows = []
        heading = line.strip() or heading


class Results:
    """What the programs wrote: NAME.json, and what they printed, NAME.txt."""

    def __init__(self, folder):
        self.folder = Path(folder)

    def text(self, name):
        path = self.folder / name
        if not path.exists():
            raise Missing(path.stem)
        return path.read_text(encoding="utf-8")

    @functools.lru_cache(maxsize=None)
    def json(self, name):
        return json.loads(self.text(name + ".json"))

    @functools.lru_cache(maxsize=None)
    def tables(self, name):
        """Of a printed text: (the line before it, rows of cells), without headers."""
        return [(heading, rows) for heading, _, rows in printed_tables(self.text(name + ".txt"))]

    def table(self, name, heading):
        return next(rows for line, rows in self.tables(name) if heading in line)


def number(value, digits=2):
    """Two significant digits: timings vary by more than a third one."""
    if value == 0:
        return "0"
    value = float(f"{value:.{digits - 1}e}")
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{decimals}f}"


def count(value):
    return f"{round(float(value)):,}"


def with_commas(text):
    return re.sub(r"\d{5,}", lambda digits: count(digits[0]), text)


def markdown(header, rows, names=1):
    """A table, whose columns after the first `names` hold numbers."""
    rule = ["---"] * names + ["---:"] * (len(header) - names)
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in [header, rule, *rows])


# Distances of two meshes: adaptive_bvh_bench

TITLES = {
    "coherent": "`CoherentDistance`",
    "mesh": "`adaptive_bvh::distance` of meshes",
    "recorded": "`adaptive_bvh::distance` of models",
    "drop-in": "drop-in, `fcl::distance`",
    "drop-in-all": "drop-in that refits all",
    "recorded-ab": "models, tests A and B",
    "drop-in-obbrss": "drop-in, OBBRSS",
    "recorded-obbrss": "`adaptive_bvh::distance` of models, OBBRSS",
    "expert-aabb": "FCL AABB, no copies, from the last pair",
}


class Series:
    """A run of adaptive_bvh_bench: some scenarios, every method, every repeat."""

    def __init__(self, entry):
        self.scenarios = entry["scenarios"]
        self.keys = [method["key"] for method in self.scenarios[0]["methods"]]

    def methods(self, key, scenario=None):
        chosen = [s for s in self.scenarios if scenario in (None, s["name"])]
        return [m for s in chosen for m in s["methods"] if m["key"] == key]

    def repeats(self, key, what="total", scenario=None):
        names = ["update_ms", "query_ms"] if what == "total" else [what + "_ms"]
        parts = [m[name] for m in self.methods(key, scenario) for name in names]
        return [sum(values) for values in zip(*parts)]

    def ms(self, key, what="total", scenario=None):
        return median(self.repeats(key, what, scenario))

    def times(self, slow, fast, what="total", scenario=None):
        pairs = zip(self.repeats(slow, what, scenario), self.repeats(fast, what, scenario))
        return median([a / b for a, b in pairs])

    def sum(self, key, name):
        return sum(m[name] for m in self.methods(key))

    def title(self, key):
        return TITLES.get(key, self.methods(key)[0]["title"])

    def bytes(self, key):
        """Of memory, a triangle."""
        triangles = [s["triangles"] for s in self.scenarios]
        sizes = [m["bytes_per_triangle"] for m in self.methods(key)]
        return sum(s * t for s, t in zip(sizes, triangles)) / sum(triangles)


def series(results, name, **wanted):
    """The run of that resolution, orientation and stride."""
    for entry in results.json(name):
        if all(entry[key] == value for key, value in wanted.items()):
            return Series(entry)
    raise Missing(name)


def smallest_and_largest(results, name):
    """x1 and x16, except in a quick trial."""
    runs = sorted(results.json(name), key=lambda entry: entry["resolution"])
    return [(runs[i]["resolution"] ** 2, Series(runs[i])) for i in (0, -1)]


def x1_and_x16(results, key):
    """In general orientation. At x16 some methods are measured once, in another run."""
    large = series(results, "large", aligned=False)
    if key not in large.keys:
        large = series(results, "thesis-large")
    return [series(results, "thesis", aligned=False), large]


def four_series(results):
    """General x1, x16, aligned x1, x16."""
    runs = []
    for aligned in (False, True):
        runs.append(series(results, "thesis", aligned=aligned))
        runs.append(series(results, "large", aligned=aligned))
    return runs


@block("headline")
def headline(results):
    def least_and_most(slow, fast):
        ratios = [run.times(slow, fast) for run in four_series(results)]
        return f"{number(min(ratios))} to {number(max(ratios))} times"

    return (
        f"Update and exact distance together are {least_and_most('fcl-rss', 'coherent')} as fast "
        f"as with FCL's RSS and its top-down refit, and "
        f"{least_and_most('expert-aabb', 'coherent')} as fast as with the best that FCL has."
    )


@block("times-faster")
def times_faster(results):
    rows = [
        ("`CoherentDistance` against FCL's RSS, top-down refit", "fcl-rss", "coherent"),
        ("`CoherentDistance` against the best that FCL has", "expert-aabb", "coherent"),
        ("`adaptive_bvh::distance` of meshes against FCL's RSS", "fcl-rss", "mesh"),
        ("drop-in, `fcl::distance`, against FCL's RSS", "fcl-rss", "drop-in"),
        ("drop-in against the best that FCL has", "expert-aabb", "drop-in"),
    ]
    runs = four_series(results)
    return markdown(
        ["", "general: ×1", "×16", "aligned: ×1", "×16"],
        [[t, *(f"**{number(run.times(a, b))}**" for run in runs)] for t, a, b in rows],
    )


@block("times-faster-by-scenario")
def times_faster_by_scenario(results):
    names = ["general, ×1", "general, ×16", "aligned, ×1", "aligned, ×16"]
    scenarios = [s["name"] for s in series(results, "thesis").scenarios]
    rows = []
    for key, title in (("coherent", "`CoherentDistance`"), ("drop-in", "drop-in")):
        for name, run in zip(names, four_series(results)):
            ratios = [run.times("expert-aabb", key, scenario=s) for s in scenarios]
            rows.append([f"{title}: {name}", *map(number, ratios)])
    return markdown(["against the best that FCL has", *scenarios], rows)


@block("obbrss")
def obbrss(results):
    rows = []
    for key in ("drop-in", "drop-in-obbrss", "fcl-rss", "fcl-obbrss"):
        runs = x1_and_x16(results, key)
        rows.append([runs[0].title(key), *(number(run.ms(key)) for run in runs)])
    return markdown(["ms, five scenarios", "×1", "×16"], rows)


@block("larger-steps")
def larger_steps(results):
    runs = [
        (f"{motion}, ×{size}", run)
        for motion, name in (("every fourth step", "stride"), ("transforms change, too", "moving"))
        for size, run in smallest_and_largest(results, name)
    ]
    rows = []
    for title, run in runs:
        ratios = [
            run.times(peer, ours) if ours in run.keys else None
            for peer in ("fcl-rss", "expert-aabb")
            for ours in ("coherent", "mesh", "drop-in")
        ]
        rows.append([title, *("–" if ratio is None else number(ratio) for ratio in ratios)])
    ours = ["`CoherentDistance`", "`adaptive_bvh::distance`", "drop-in"]
    header = ["", *(f"FCL's RSS: {o}" for o in ours), *(f"FCL's best: {o}" for o in ours)]
    return markdown(header, rows)


@block("further")
def further(results):
    run = series(results, "further")
    rows = [
        [s["name"]]
        + [
            number(run.times(peer, ours, scenario=s["name"]))
            for peer, ours in (
                ("fcl-rss", "coherent"),
                ("expert-aabb", "coherent"),
                ("fcl-rss", "drop-in"),
                ("expert-aabb", "drop-in"),
            )
        ]
        for s in run.scenarios[-4:]
    ]
    header = ["", "`CoherentDistance`: FCL's RSS", "FCL's best", "drop-in: FCL's RSS", "FCL's best"]
    return markdown(header, rows)


@block("refit-all")
def refit_all(results):
    run = series(results, "frames")
    rows = []
    for scenario in run.scenarios:
        name = scenario["name"]
        ms = {key: run.ms(key, "update", name) / scenario["frames"] for key in run.keys}
        row = [name.removesuffix(".ply"), count(scenario["triangles"]), number(ms["fcl-rss"])]
        for key in ("drop-in-all", "drop-in", "mesh"):
            row.append(f"{number(ms[key])} ({number(ms['fcl-rss'] / ms[key])})")
        rows.append([*row, number(run.times("fcl-rss", "drop-in", scenario=name))])
    header = ["update, ms a step", "triangles", "FCL, top-down refit", "`RefitAll`"]
    header += ["default policy", "`DeformableMesh`", "default policy, with its queries"]
    return markdown(header, rows)


@block("memory")
def memory(results):
    titles = {"mesh": "`DeformableMesh`", "drop-in": "`AdaptiveBVHModel`, RSS"}
    titles |= {"drop-in-obbrss": "`AdaptiveBVHModel`, OBBRSS", "fcl-rss": "FCL, RSS"}
    titles |= {"fcl-obbrss": "FCL, OBBRSS", "expert-aabb": "FCL, AABB"}
    rows = []
    for key, title in titles.items():
        rows.append([title, *(count(run.bytes(key)) for run in x1_and_x16(results, key))])
    return markdown(["bytes a triangle", "×1", "×16"], rows)


@block("growth")
def growth(results):
    runs = sorted(map(Series, results.json("growth")), key=lambda r: r.scenarios[0]["triangles"])
    sizes = [run.scenarios[0]["triangles"] for run in runs]
    rows = []
    for key in runs[0].keys:
        frames = [run.scenarios[0]["frames"] for run in runs]
        ms = {
            what: [run.ms(key, what) / f for run, f in zip(runs, frames)]
            for what in ("update", "query")
        }
        logs = [[math.log(x) for x in values] for values in (sizes, ms["update"])]
        power = statistics.linear_regression(*logs).slope
        cells = [f"{number(u)} / {number(q)}" for u, q in zip(ms["update"], ms["query"])]
        rows.append([runs[0].title(key), *cells, f"{power:.2f}"])
    header = ["update / query, ms a step", *(f"{s:,} triangles" for s in sizes)]
    return markdown([*header, "power of the update"], rows)


# The thesis's experiment: adaptive_bvh_bench, micro_bench


@block("scenarios")
def scenarios(results):
    rows = results.tables("describe")[0][1]
    header = ["scenario", "body", "vertices", "triangles", "steps"]
    header += ["motion in edges, mean", "largest", "in diagonals, mean", "largest"]
    return markdown(header, rows, names=2)


@block("thesis-table-2")
def thesis_table_2(results):
    of_thesis = [
        ("A", "thesis-a", 0.715),
        ("B", "thesis-b", 0.842),
        ("A∧B", "thesis-ab", 0.388),
        ("B∧C", "thesis-bc", 5.120),
        ("A∨(B∧C)", "thesis-a-or-bc", 0.531),
        ("A∧B∧C", "thesis-abc", 4.557),
        ("(A∧B)∨(B∧C)", "thesis-ab-or-bc", 0.332),
        ("Refit all", "thesis-all", 2.839),
        ("Refit none", "thesis-none", 12.485),
    ]
    run = series(results, "thesis", aligned=False)
    rows = [
        [title, f"{seconds:.3f}", f"{2.839 / seconds:.2f}", number(run.ms(key), 3)]
        + [f"{run.times(peer, key):.2f}" for peer in ("thesis-all", "fcl-rss")]
        for title, key, seconds in of_thesis
    ]
    header = ["criterion", "thesis, s", "times faster than refit all", "here, ms"]
    return markdown([*header, "than refit all", "than FCL's refit"], rows)


@block("thesis-rows")
def thesis_rows(results):
    run = series(results, "thesis", aligned=False)
    aligned = series(results, "thesis", aligned=True)
    rows = []
    for key in run.keys:
        row = [run.title(key)]
        for each in (run, aligned):
            row += [number(each.ms(key), 3), number(each.times("fcl-rss", key))]
        row += [number(run.ms(key, what), 3) for what in ("update", "query")]
        work = [run.sum(key, name) for name in ("bv_tests", "leaf_tests", "refitted")]
        row += [count(n) if any(work) else "–" for n in work]  # meshes do not count
        rows.append([*row, run.sum(key, "wrong_frames"), count(run.bytes(key))])
    header = ["method", "general: ms", "faster than FCL RSS", "aligned: ms", "faster than FCL RSS"]
    header += ["update", "query", "volume tests", "triangle tests", "refits", "wrong steps"]
    return markdown([*header, "bytes a triangle"], rows)


def rows_by_scenario(results, keys, aligned):
    run = series(results, "thesis", aligned=aligned)
    names = [s["name"] for s in run.scenarios]
    rows = [[run.title(key), *(number(run.ms(key, scenario=n), 3) for n in names)] for key in keys]
    return markdown(["ms", *names], rows)


@block("thesis-general")
def thesis_general(results):
    keys = ["coherent", "mesh", "drop-in", "thesis-ab", "thesis-ab-or-bc", "thesis-all", "larsson"]
    return rows_by_scenario(results, [*keys, "fcl-rss", "fcl-aabb", "expert-aabb"], False)


@block("thesis-aligned")
def thesis_aligned(results):
    keys = ["coherent", "mesh", "drop-in", "larsson", "fcl-rss", "fcl-aabb", "expert-aabb"]
    return rows_by_scenario(results, keys, True)


@block("thesis-growth")
def thesis_growth(results):
    keys = ["coherent", "mesh", "drop-in", "thesis-a", "thesis-ab", "thesis-ab-or-bc", "thesis-all"]
    rows = []
    for key in [*keys, "larsson", "fcl-rss", "expert-aabb"]:
        runs = x1_and_x16(results, key)
        ms = [run.ms(key) for run in runs]
        rows.append([runs[0].title(key), *(number(m) for m in ms), number(ms[1] / ms[0])])
    return markdown(["ms, five scenarios", "×1", "×16", "grows by"], rows)


@block("refit-cost")
def refit_cost(results):
    runs = [
        series(results, "thesis", aligned=False),
        series(results, "large", aligned=False),
        smallest_and_largest(results, "stride")[1][1],
    ]
    rows = []
    for key, title in (
        ("drop-in-all", "refit all"),
        ("drop-in", "A, p_max = 0.1, the default"),
        ("recorded-ab", "A and B, p_max = 0.1, queries recorded"),
        ("fcl-rss", "FCL RSS, top-down refit"),
    ):
        cells = []
        for run in runs:
            parts = [number(run.ms(key, what)) for what in ("update", "query", "total")]
            cells.append(f"{parts[0]} + {parts[1]} = **{parts[2]}**")
        rows.append([title, *cells])
    return markdown(["criterion", "×1", "×16", "×16, every fourth step"], rows)


@block("operations")
def operations(results):
    times = {}
    for entry in results.json("micro")["benchmarks"]:
        scale = {"ns": 1, "us": 1e3, "ms": 1e6}[entry["time_unit"]]
        items = entry.get("items_per_second")
        times[entry["name"].split("/manual")[0]] = (
            entry["real_time"] * scale,
            1e9 / items if items else None,
        )
    rows = [["a test of two volumes", number(times["volumeTest/8"][0])]]
    rows += [["a test of two triangles", number(times["triangleTest"][0])]]
    for n in (1, 4, 16, 256, 4096):
        plural = "s" if n > 1 else ""
        rows.append([f"a refit of {n:,} triangle{plural}", number(times[f"refit/{n}"][0])])
    for name, title in (
        ("displacement", "to read and measure a vertex"),
        ("propagation", "to inflate a node, in post-order"),
        ("refitAll", "to refit a node, if all are unfit"),
    ):
        for size, nodes in ((1, "1,400"), (16, "364,000")):
            if f"{name}/{size}/1" in times:  # not all in a quick trial
                rows.append([f"{title}, {nodes} nodes", number(times[f"{name}/{size}/1"][1])])
    return markdown(["", "ns"], rows)


# Contact: contact_bench


def contact_cases(results):
    """All cases but those of two frames, the dense ones last."""
    cases = results.json("contact") + results.json("contact-dense")
    return [case for case in cases if case["job"] != "continuous"]


def name_of(case):
    size = f", ×{case['resolution'] ** 2}" if case["resolution"] > 1 else ""
    return case["name"].removesuffix(".ply") + size


def method_of(case, key):
    return next((m for m in case.get("methods", []) if m["key"] == key), None)


def total_ms(method):
    return [u + q for u, q in zip(method["update_ms"], method["query_ms"])]


def ratio(slow, fast):
    return median([a / b for a, b in zip(total_ms(slow), total_ms(fast))])


def update_and_query(method):
    if method is None:
        return ""
    return " + ".join(number(median(method[name])) for name in ("update_ms", "query_ms"))


@block("contact")
def contact(results):
    keys = ["fcl-rss", "cgal", "embree", "embree-planes", "mesh", "coherent"]
    rows = []
    for case in contact_cases(results):
        contacts = "" if case["job"] == "distance" else count(case["contacts"] / case["frames"])
        cells = [update_and_query(method_of(case, key)) for key in keys]
        rows.append([f"{case['job']}: {name_of(case)}", count(case["triangles"]), contacts, *cells])
    header = ["update + query, ms a step", "triangles", "contacts a step", "FCL RSS", "CGAL"]
    header += ["Embree", "Embree, planes first", "adaptive_bvh", "`CoherentDistance`"]
    return markdown(header, rows)


@block("contact-times")
def contact_times(results):
    keys = ["fcl-rss", "cgal", "embree", "embree-planes"]
    rows = []
    for case in contact_cases(results):
        ours = method_of(case, "mesh")
        peers = [method_of(case, key) for key in keys]
        cells = [number(ratio(peer, ours)) if peer else "" for peer in peers]
        rows.append([f"{case['job']}: {name_of(case)}", *cells])
    header = ["times the time of adaptive_bvh", "FCL RSS", "CGAL", "Embree"]
    return markdown([*header, "Embree, planes first"], rows)


@block("contact-threads")
def contact_threads(results):
    rows = []
    for case in results.json("threads"):
        one, two = (
            method_of(case, "mesh") or method_of(case, "continuous"),
            method_of(case, "threads") or method_of(case, "continuous-threads"),
        )
        row = [f"{case['job']}: {name_of(case)}", count(case["triangles"])]
        rows.append([*row, *(number(median(total_ms(m))) for m in (one, two))])
        rows[-1].append(number(1 / ratio(one, two)))
    return markdown(["ms a step", "triangles", "one thread", "two", "share"], rows)


@block("continuous")
def continuous(results):
    rows = []
    for case in results.json("continuous"):
        ours, peer = method_of(case, "continuous"), method_of(case, "embree-continuous")
        row = [name_of(case), count(case["triangles"]), count(ours["candidates"] / case["frames"])]
        row += [number(median(total_ms(m))) for m in (peer, ours)]
        rows.append([*row, number(ratio(peer, ours))])
    header = ["ms a step", "triangles", "candidates a step", "Embree, swept boxes", "adaptive_bvh"]
    return markdown([*header, "Embree takes"], rows)


@block("truncated")
def truncated(results):
    rows = []
    for title, edges, *shares, one, displacements, planes, _ in results.table("steps", "truncated"):
        times = [number(float(time)) for time in (one, displacements, planes)]
        rows.append([title, number(float(edges)), *(f"{float(s):.3f}" for s in shares), *times])
    header = ["share of the motion that is kept", "largest step, edges", "one step for all"]
    header += ["`safeDisplacements`", "`truncateMotion`", "one step, ms"]
    return markdown([*header, "`safeDisplacements`, ms", "`truncateMotion`, ms"], rows)


@block("iterations")
def iterations(results):
    rows = []
    for _, edges, radius, pairs, searches, _, *times, _ in results.table("steps", "iterations"):
        begin, ten, steps = (number(float(time)) for time in times)
        rows.append([radius, number(float(edges)), count(pairs), searches, begin, ten, steps])
    header = ["radius, edges", "largest step, edges", "pairs", "searches", "first search, ms"]
    return markdown([*header, "ten iterations, ms", "ten of `largestSafeStep`, ms"], rows)


@block("contact-sets")
def contact_sets(results):
    rows = []
    for heading, cells in results.tables("sets"):
        rows.append([f"**{heading.split(',')[0]}**", "", "", "", "", ""])
        for name, pairs, changed, *_, query, update, ratio, _ in cells:
            times = (number(float(time)) for time in (query, update))
            rows.append([name, count(pairs), count(changed), *times, number(float(ratio))])
    header = ["", "pairs", "added and removed", "new query, ms", "update of the set, ms"]
    return markdown([*header, "update / query"], rows)


@block("update-or-build")
def update_or_build(results):
    rows = []
    for case in contact_cases(results):
        build, refit = method_of(case, "embree-build"), method_of(case, "embree")
        if not build:
            continue
        ours = method_of(case, "mesh")
        times = [median(method["update_ms"]) for method in (build, refit, ours)]
        row = [name_of(case), count(case["triangles"]), *map(number, times)]
        rows.append([*row, number(times[0] / times[2])])
    rows.sort(key=lambda row: int(row[1].replace(",", "")))
    header = ["ms a step", "triangles", "Embree, new tree", "Embree, refit", "this library, update"]
    return markdown([*header, "a new tree takes"], rows)


def proximity_rows(results):
    """Scenario, question, and method: update, query, times of ours, pairs."""
    cases = {}
    for name in ("proximity", "points"):
        for scenario, question, method, *values in results.tables(name)[0][1]:
            values = list(map(float, values))
            cases.setdefault((scenario.removesuffix(".ply"), question), {})[method] = values
    return cases


@block("proximity")
def proximity(results):
    rows = []
    for (scenario, question), methods in proximity_rows(results).items():
        found = re.match(r"within (.*) edges, (self|two)", question)
        if not found:
            continue
        of_what = "with itself" if found[2] == "self" else "two bodies"
        ours = methods["adaptive_bvh"]
        row = [f"{scenario}, {of_what}", found[1], count(ours[3] / 16)]
        peers = [methods.get("FCL RSS"), methods.get("Embree")]
        row += [f"{number(m[0])} + {number(m[1])}" if m else "" for m in (*peers, ours)]
        rows.append([*row, *(number(m[2]) if m else "" for m in peers)])
    header = ["update + query, ms a step", "d", "pairs a step", "FCL RSS", "Embree", "adaptive_bvh"]
    return markdown([*header, "FCL takes", "Embree takes"], rows)


@block("nearer")
def nearer(results):
    rows = []
    for (scenario, question), methods in proximity_rows(results).items():
        if question.startswith("nearer"):
            times = [methods[m] for m in ("adaptive_bvh", "CoherentDistance")]
            row = [f"{scenario}, {question}"]
            row += [f"{number(t[0])} + {number(t[1])}" for t in times]
            rows.append([*row, number(1 / times[1][2])])
    header = ["update + query, ms a step", "`CoherentProximity`", "`CoherentDistance`", "share"]
    return markdown(header, rows)


@block("points-and-rays")
def points_and_rays(results):
    titles = {"points": "closest point", "rays": "first hit", "any hit of rays": "any hit"}
    many = int(results.text("points.many"))
    rows = []
    for (scenario, question), methods in proximity_rows(results).items():
        if question in titles:
            times = [methods[m][1] * 1000 / many for m in methods]
            titled = dict(zip(methods, times))
            ours, peer = titled.pop("adaptive_bvh"), next(iter(titled.values()))
            row = [f"{scenario}: {titles[question]}", number(peer), number(ours)]
            rows.append([*row, number(ours / peer)])
    header = ["µs each", "Embree, single precision", "adaptive_bvh, double precision"]
    return markdown([*header, "adaptive_bvh takes"], rows)


# Other programs, from what they print


@block("cliff")
def cliff(results):
    rows = []
    for title, fcl, mesh, coherent, *_ in results.tables("cliff")[0][1]:
        times = list(map(float, (fcl, mesh, coherent)))
        rows.append([title, *map(number, times), number(times[0] / times[2])])
    header = ["ms a query", "FCL", "`adaptive_bvh::distance`", "`CoherentDistance`", "FCL takes"]
    return markdown(header, rows)


@block("scenes")
def scenes(results):
    rows = []
    for heading, cells in results.tables("scenes"):
        title = with_commas(re.split("; ms|, ms", heading)[0])
        rows.append([f"**{title}**", "", ""])
        first, base = cells[0][0], float(cells[0][1])
        for name, ms, *_ in cells:
            times = number(base / float(ms)) if name != first else ""
            rows.append([name, number(float(ms)), times])
    return markdown(["", "ms a step", "times faster than the first"], rows)


@block("shapes")
def shapes(results):
    rows = []
    for name in ("shapes-armadillo_rollers", "shapes-cloth_funnel"):
        methods = {}
        for shape, query, method, update, ask, answer in results.tables(name)[0][1]:
            times = (float(update), float(ask))
            methods.setdefault((shape, query), []).append((method, times, answer))
        for (shape, query), both in methods.items():
            if len(both) < 2 or (query == "distance" and "touching" in shape):
                continue
            (_, ours, answer), (_, fcl, _) = both
            contacts = int(answer.split()[0]) / 16 if query == "collide" else 0
            cells = [name.removeprefix("shapes-"), shape, f"`{query}`"]
            cells += [count(contacts) if contacts else ""]
            cells += [f"{number(t[0])} + {number(t[1])}" for t in (ours, fcl)]
            rows.append([*cells, number(sum(fcl) / sum(ours))])
    header = ["mesh", "shape", "query", "contacts a step", "ours: update + query", "FCL"]
    return markdown([*header, "times faster"], rows, names=3)


@block("contact-forces")
def contact_forces(results):
    beside = results.table("forces", "beside their poles")
    by_poles = results.table("forces", "by their poles")
    rows = []
    for row, other in zip(beside, by_poles):
        cells = [f"{float(row[0]):g}"]
        for overlap, contacts, inside, mesh, ball in (row, other):
            cells += [contacts, number(float(mesh)), number(float(ball))]
        rows.append(cells)
    header = ["overlap", "contacts, beside the poles", "ms", "with a sphere"]
    header += ["contacts, by the poles", "ms", "with a sphere"]
    return markdown(header, rows, names=0)


@block("winding-numbers")
def winding_numbers(results):
    rows, where = [], ""
    for line in results.text("forces.txt").splitlines():
        if found := re.match(r"\d+ points (.*), [\d]+ triangles", line):
            where = found[1]
        found = re.match(
            r"windingNumbers of (.*), boundary edges (.*): .*, "
            r"(.*) of closestPoints, worst error (.*)",
            line,
        )
        if found:
            what = found[1].replace("it without", "the mesh without")
            rows.append([f"{what}, points {where}", found[2], number(float(found[3])), found[4]])
    return markdown(["", "boundary edges", "of the time of `closestPoints`", "worst error"], rows)


@block("octree")
def octree(results):
    rows, cases = [], {}
    for mesh, triangles, cell, query, contacts, *_, times in results.tables("octree")[0][1]:
        case = cases.setdefault((mesh, int(triangles), float(cell)), {})
        case[query] = (int(contacts), float(times))
    for (mesh, triangles, cell), queries in cases.items():
        row = [mesh, count(triangles), f"{cell:g}", count(queries["contacts"][0])]
        for query in ("collide", "contacts", "first contact", "distance"):
            row.append(number(queries[query][1]) if query in queries else "")
        rows.append(row)
    header = ["pair", "triangles", "cells", "contacts", "pairs that touch", "all contacts"]
    return markdown([*header, "first contact", "distance"], rows)


@block("update")
def update(results):
    parts = [
        ("update of a model without refits", "model without refits, ns a node", "floor"),
        ("update of a mesh", "mesh, ns a triangle", "copy of the positions"),
        ("every volume", "model that refits all, ns a triangle", None),
    ]
    tables = [table for _, table in results.tables("update")]
    rows = []
    for (_, title, other), table in zip(parts, tables):
        rows.append([title, *(number(float(row[2])) for row in table)])
        if other:
            rows.append([other, *(number(float(row[3])) for row in table)])
    header = ["", *(row[0].replace(" ", "").replace("x", "×") for row in tables[0])]
    return markdown(header, rows)


@block("partial-update")
def partial_update(results):
    tables = [table for _, table in results.tables("update")][3:5]
    rows = []
    for table, title in zip(tables, ("model, ns a node", "mesh, ns a triangle")):
        for size, _, of_all, of_few, times in table:
            size = size.replace(" ", "").replace("x", "×")
            cells = (float(of_all), float(of_few), float(times))
            rows.append([f"{title}, {size}", *map(number, cells)])
    header = ["local poke", "update of all", "of the vertices that move", "times faster"]
    return markdown(header, rows)


@block("update-threads")
def update_threads(results):
    rows = []
    for table in [table for _, table in results.tables("update")][5:7]:
        for title, _, one, two, times in table:
            unit = "ns a node" if "," in title else "ns a triangle"
            kind = "model" if "," in title else "mesh"
            cells = (float(one), float(two), float(times))
            rows.append([f"{kind}, {with_commas(title)}, {unit}", *map(number, cells)])
    return markdown(["", "one thread", "two threads", "times faster"], rows)


@block("update-bytes")
def update_bytes(results):
    rows = []
    tables = [table for _, table in results.tables("update")]
    if len(tables) < 8:
        raise Missing("update")
    for title, triangles, ours, copied, times in tables[7]:
        read, written = re.fullmatch(r"(\d+) read \+ (\d+) written", title).groups()
        cells = (float(ours), float(copied), float(times))
        rows.append([count(triangles), read, written, *map(number, cells)])
    header = ["triangles", "bytes read a triangle", "written", "update, ns a triangle"]
    return markdown([*header, "copy of as many bytes", "times the copy"], rows, names=0)


def build_cells(text):
    """'12.5 (0.98)': the time, and the share of FCL's."""
    time, share = re.match(r"([\d.]+) \(([\d.]+)\)", text).groups()
    return float(time), float(share)


@block("build")
def build(results):
    rows = results.table("builds", "Small models")
    times = {(row[0], int(row[2])): build_cells(row[5])[1] for row in rows if row[1] == "double"}
    large = {(row[0], int(row[1])): build_cells(row[4])[1] for row in large_builds(results)}
    sizes = sorted({n for name, n in times if name == "connected"})
    cells = [[name] + [number(times[name, n]) for n in sizes] for name in ("connected", "soup")]
    for name, row in (("hills", cells[0]), ("hills, triangle soup", cells[1])):
        row += [number(large[name, n]) if (name, n) in large else "–" for n in (100352, 500000)]
    return markdown(["triangles", *map(count, sizes), "100,352", "500,000"], cells)


def large_builds(results):
    for _, rows in results.tables("builds"):
        if rows and rows[0][0].startswith("hills"):
            return rows
    raise Missing("builds")


@block("large-builds")
def large_builds_table(results):
    rows = []
    for mesh, triangles, fcl, top_down, bottom_up, *_ in large_builds(results):
        times = [build_cells(cell) for cell in (top_down, bottom_up)]
        row = [mesh, count(triangles), number(float(fcl))]
        row += [f"{number(t)} ({number(s)})" for t, s in times]
        rows.append([*row, number(1000 * times[1][0] / float(triangles))])
    header = ["mesh", "triangles", "FCL, ms", "top-down", "bottom-up", "µs a triangle"]
    return markdown(header, rows)


@block("small-builds")
def small_builds(results):
    rows = []
    for mesh, scalar, triangles, *cells in results.table("builds", "Small models"):
        if scalar == "double":
            row = [mesh, count(triangles)]
            for cell in cells:
                time = re.match(r"[\d.]+", cell)[0]
                row.append(cell.replace(time, number(float(time)), 1))
            rows.append(row)
    header = ["mesh", "triangles", "FCL: build, µs", "top-down", "bottom-up"]
    return markdown([*header, "FCL: again, µs", "top-down", "bottom-up"], rows)


@block("trees")
def trees(results):
    rows = []
    for heading, cells in results.tables("trees"):
        title = heading.split(";")[0].replace("triangles x ", "×")
        rows.append([f"**{title}**", "", "", "", ""])
        for name, volume_tests, triangle_tests, _, ms, times in cells:
            tests = [
                " / ".join(count(v) for v in cell.split("/"))
                for cell in (volume_tests, triangle_tests)
            ]
            both = " / ".join(number(float(v)) for v in ms.split("/"))
            rows.append([name.replace("all", "all five"), *tests, both, times])
    return markdown(["scenario", "volume tests", "triangle tests", "ms", "ratio"], rows)


@block("python")
def python(results):
    text = results.text("python.txt")
    rows = []
    update = r"update of (\d+) .*: C\+\+ ([\d.]+) ms, Python ([\d.]+) ms"
    for vertices, cpp, here in re.findall(update, text):
        rows.append([f"update of {count(vertices)} vertices, ms: in C++; in Python", cpp, here])
    call = r"distance of .*: C\+\+ ([\d.]+) us, Python ([\d.]+) us"
    for times in re.findall(call, text):
        rows.append(["a call of `distance`, µs: in C++; in Python", *times])
    load = r"(\d+) triangles in (random )?order: build (\d+) ms, load (\d+)"
    for triangles, order, *times in re.findall(load, text):
        title = f"{count(triangles)} triangles in {order}order, ms: build; load"
        rows.append([title, *times])
    return markdown(["", "first", "second"], rows)


# Newer libraries from PyPI: test/peers

PEERS = ["ipctk", "coal", "fcl", "trimesh", "warp", "mujoco", "meshlib", "igl", "open3d", "pcu"]
PEERS += ["vtk", "embreex", "fcpw", "drake"]


def peer_rows(results, peer, threads="1"):
    """The rows of one peer on that many threads at the largest size, each beside ours on the same
    work. Of a peer that has several ways, the fastest."""
    rows, ours = {}, {}
    for row in csv.DictReader(results.text("peers.csv").splitlines()):
        name, variant = re.fullmatch(r"(\w+)(?: \((.*)\))?", row["peer"]).groups()
        if row["threads"] != threads or not row["ms a step"] or row["scene"] == "empty call":
            continue
        row["variant"], work = variant, (row["question"], row["scene"])
        if name == "ours" and variant in (None, "one call", "beyond shared"):
            ours[work, row["size"]] = row
        if name == peer:
            rows.setdefault(work, []).append(row)
    for work, found in rows.items():
        row = min(found, key=lambda r: (-int(r["size"]), float(r["ms a step"])))
        yield row, ours[work, row["size"]]


def peer_table(peer, results):
    rows = []
    for row, ours in peer_rows(results, peer):
        name = f"{row['question']}, {row['scene']}"
        if row["variant"]:
            name += f" ({row['variant']})"
        agrees = {"yes": "equal", "no": "differ", "-": row["remark"]}[row["agrees"]]
        times = [float(r["ms a step"]) for r in (row, ours)]
        rows.append([name, count(row["triangles"]), *map(number, times)])
        rows[-1] += [number(times[0] / times[1]), agrees]
    if not rows:
        raise Missing("peers")
    header = ["", "triangles", f"{peer}, ms", "ours, ms", "takes times ours", "answers"]
    return markdown(header, rows)


@block("peers-threads")
def peers_threads(results):
    """Of peers that a second thread makes at least a tenth faster."""
    rows = []
    for peer in PEERS:
        one = {
            (row["question"], row["scene"], row["size"]): (row, ours)
            for row, ours in peer_rows(results, peer)
        }
        for row, ours in peer_rows(results, peer, "2"):
            work = row["question"], row["scene"], row["size"]
            if work not in one:
                continue
            both = [*one[work], row, ours]
            times = [float(r["ms a step"]) for r in both]
            if times[0] < 1.1 * times[2]:
                continue
            rows.append([peer, f"{work[0]}, {work[1]}", count(row["triangles"])])
            rows[-1] += map(number, [*times, times[2] / times[3]])
    if not rows:
        raise Missing("peers")
    header = ["", "", "triangles", "one thread, ms", "ours", "two threads, ms", "ours"]
    return markdown([*header, "takes times ours"], rows, names=2)


COUNTED = ["cases", "differ", "ours wrong", "theirs wrong", "fails"]


for peer_name in PEERS:
    BLOCKS[f"peers-{peer_name}"] = functools.partial(peer_table, peer_name)


@block("peer-differences")
def peer_differences(_):
    """What test/peers/differential.py --csv has counted: not measured here, so read from there."""
    path = Path(__file__).resolve().parents[1] / "test" / "peers" / "differences.csv"
    if not path.exists():
        raise Missing("differences")
    found = {}
    for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines()):
        found.setdefault((row["question"], row["peer"]), []).append(row)
    rows = []
    for (question, peer), families in found.items():
        total = {k: sum(int(f[k]) for f in families) for k in families[0] if k in COUNTED}
        wrong = [f for f in families if int(f["theirs wrong"])]
        shares = [(int(f["theirs wrong"]) / int(f["cases"]), f["family"]) for f in wrong]
        where = ", ".join(f"{name} {number(100 * x)}" for x, name in sorted(shares, reverse=True))
        worst = max((float(f["theirs by"]) for f in wrong), default=0)
        rows.append([question, peer, *(count(total[k]) for k in COUNTED)])
        rows[-1] += [number(worst) if math.isfinite(worst) else "hit or miss", where]
    header = ["", "library", *COUNTED, "theirs by at most", "wrong in %, by family"]
    return markdown(header, rows, names=2)


@block("plug-ins")
def plug_ins(_):
    """What test/peers/plug_ins.py --csv has measured, in a run of its own."""
    path = Path(__file__).resolve().parents[1] / "test" / "peers" / "plug_ins.csv"
    if not path.exists():
        raise Missing("plug-ins")
    rows = []
    for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines()):
        theirs, ours = (float(row[f"{who} ms"]) for who in ("theirs", "ours"))
        rows.append([row["task"], row["peer"], count(row["triangles"]), number(theirs)])
        rows[-1] += [number(ours), number(theirs / ours), row["answers"]]
    header = ["", "in place of", "triangles", "theirs, ms", "ours, ms", "takes times ours", "answers"]
    return markdown(header, rows, names=2)


@block("provenance")
def provenance(results):
    return results.text("provenance").strip()


# Documents


def documents(folder):
    return [folder / "README.md", *sorted((folder / "docs").glob("*.md"))]


def write(results, folder):
    kept = {}

    def replace(match):
        try:
            content = BLOCKS[match[1]](results)
        except Missing as part:
            kept[match[1]] = str(part)
            content = match[2].strip()
        return f"<!-- figures: {match[1]} -->\n{content}\n<!-- /figures -->"

    for path in documents(folder):
        text = path.read_text(encoding="utf-8")
        path.write_text(BLOCK.sub(replace, text), encoding="utf-8")
    for name, part in sorted(kept.items()):
        print(f"kept {name}: {part} was not measured")


def find_errors(folder):
    """Sentences on what does not agree."""
    errors, first, numbers = [], {}, set()
    performance = folder / "docs" / "performance.md"
    texts = {path: path.read_text(encoding="utf-8") for path in documents(folder)}
    for path, text in texts.items():
        for name, content in BLOCK.findall(text):
            if name not in BLOCKS:
                errors.append(f"{path}: figures.py does not know the block '{name}'")
            content = content.strip()
            if not content:
                errors.append(f"{path}: the block '{name}' is empty")
            other, expected = first.setdefault(name, (path, content))
            if content != expected:
                errors.append(f"{path}: '{name}' differs from that of {other}")
            if path == performance:
                numbers.update(re.findall(r"\d[\d,.]*\d|\d", content))
        if text.count("<!-- figures:") != len(BLOCK.findall(text)):
            errors.append(f"{path}: a block is not closed")
    errors += [f"no document has the block '{name}'" for name in BLOCKS if name not in first]

    readme = texts[folder / "README.md"]
    for name, _ in BLOCK.findall(readme):
        if f"figures: {name} " not in texts[performance]:
            errors.append(f"{performance} lacks README's block '{name}'")
    prose = re.sub(r"```.*?```", "", BLOCK.sub("", readme), flags=re.DOTALL)
    for value in re.findall(r"(\d[\d,.]*)\s+(?:times|ms|µs|ns|%)", prose):
        if value not in numbers:
            errors.append(f"README.md: {value} is not a figure of {performance}")

    shown = "".join(texts.values())
    for picture in sorted((folder / "docs" / "pictures").glob("*")):
        if f"pictures/{picture.name}" not in shown:
            errors.append(f"no document shows {picture}")
    return errors


def main(arguments):
    if len(arguments) == 3 and arguments[0] == "write":
        write(Results(arguments[1]), Path(arguments[2]))
        return 0
    if len(arguments) == 2 and arguments[0] == "check":
        errors = find_errors(Path(arguments[1]))
        print("\n".join(errors) or "the documents agree")
        return 1 if errors else 0
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
