"""The page of compare_with_fcl shows the times of meshes in a run without the recorder: no longer
than the times that the program measures for its table, beside FCL.

    times.py COMPARE_WITH_FCL FOLDER
"""
import csv
import json
import pathlib
import statistics
import subprocess
import sys

compare, folder = sys.argv[1], pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
page, table = folder / "times.html", folder / "times.csv"


def recorded_times():
    """What the page shows of every frame: update and query, milliseconds."""
    text, tag = page.read_text(), '<script id="run" type="application/json">'
    begin = text.index(tag) + len(tag)
    frames = json.loads(text[begin:text.index("</script>", begin)])["frames"]
    return [(frame["updateMs"], frame["queryMs"]) for frame in frames]


for attempt in range(3):  # a busy machine may be late
    subprocess.run([compare, "--frames", "100", "--page", page, "--csv", table], check=True,
                   stdout=subprocess.DEVNULL)
    with open(table) as file:
        rows = list(csv.DictReader(file))
    measured = [[float(row[f"coherent_{name}_ms"]) for row in rows] for name in ("update", "query")]
    shown = list(zip(*recorded_times()))
    assert [len(times) for times in shown] == [100, 100]
    ratios = [statistics.median(a) / statistics.median(b) for a, b in zip(shown, measured)]
    print("times of the page by those of the table: update %.2f, query %.2f" % tuple(ratios))
    if max(ratios) < 2:
        sys.exit(0)
sys.exit("the page shows longer times than the program's own")
