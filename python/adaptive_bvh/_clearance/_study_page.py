"""The page of a study: all motions, the tightest first, and clearance over each number that varies."""

import os
from html import escape
from typing import Any, Dict, List, Optional, Tuple

from ._lengths import digits

_STYLE = """
:root { --paper: #f6f7f9; --ink: #1d2733; --soft: #5b6876; --line: #d7dce2; --bar: #1f6feb;
  --bad: #c4232c; }
@media (prefers-color-scheme: dark) { :root { --paper: #12161c; --ink: #e3e8ee; --soft: #97a3b0;
  --line: #303945; --bar: #5aa2ff; --bad: #ff6b6b; } }
body { margin: 0 auto; padding: 12px 20px; max-width: 1200px; background: var(--paper);
  color: var(--ink); font: 15px/1.45 system-ui, sans-serif; }
h1 { font-size: 1.2rem; margin: 0 0 4px; } h2 { font-size: 1rem; margin: 18px 0 4px; }
p { margin: 0 0 8px; color: var(--soft); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 4px 14px 4px 0; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
th { color: var(--soft); }
.number { text-align: right; } .no { color: var(--bad); font-weight: 600; }
.bar { display: inline-block; height: 9px; border-radius: 3px; background: var(--bar); }
.bar.no { background: var(--bad); }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(260px, 1fr)); gap: 16px; }
svg { width: 100%; height: auto; overflow: visible; }
svg text { font-size: 11px; fill: var(--soft); }
"""


class _Row:
    """A motion and its nearest pair."""

    def __init__(self, motion: Any, result: Dict[str, Any]):
        self.name, self.about = motion.name, motion.about
        self.kept = {0: "yes", 1: "no"}.get(result["status"], "incomplete")
        self.headline = result["headline"]
        found = [row for row in result["rows"] if row[4] != ""]
        self.nearest: Optional[List[Any]] = found[0] if found else None
        self.least = float(found[0][4]) if found else float("inf")


def study_page(path: str, motions: List[Any], done: Dict[str, Dict[str, Any]]) -> str:
    """The page, which needs no other file."""
    rows = sorted((_Row(motion, done[motion.name]) for motion in motions if motion.name in done),
                  key=lambda row: row.least)
    limit = next((result["limit"] for result in done.values() if "limit" in result), 0.0)
    unit = next((result["unit"] for result in done.values() if "unit" in result), "")
    title = f"Study {os.path.splitext(os.path.basename(path))[0]}"
    kept = sum(row.kept == "yes" for row in rows)
    missing = len(motions) - len(rows)
    said = f"{kept} of {len(rows)} motions keep {digits(limit)} {unit}" + (
        f"; {missing} are not done yet: run the same command again" if missing else "")
    return "\n".join([
        "<!DOCTYPE html>", '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">', '<link rel="icon" href="data:,">',
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{escape(title)}</h1><p>{escape(said)}.</p>",
        _plots(rows, limit, unit), _table(rows, unit), "</body></html>", ""])


def _table(rows: List[_Row], unit: str) -> str:
    about = list(dict.fromkeys(key for row in rows for key in row.about))
    most = max((row.least for row in rows if row.nearest), default=0.0) or 1.0
    lines = ['<h2>Motions, the tightest first</h2><div class="wide"><table><thead><tr><th>motion',
             *(f"<th>{escape(key)}" for key in about),
             f"<th class=number>least, {escape(unit)}<th><th>kept<th>nearest<th class=number>frame"
             f"</tr></thead><tbody>"]
    for row in rows:
        kind = "no" if row.kept == "no" else "yes"
        cells = [escape(row.name), *(escape(row.about.get(key, "")) for key in about)]
        lines.append("<tr><td>" + "<td>".join(cells))
        if row.nearest is None:
            lines.append(f"<td><td><td>{row.kept}<td>{escape(row.headline)}<td></tr>")
            continue
        lines.append(f"<td class=number>{digits(row.least)}<td><span class=\"bar {kind}\" "
                     f"style=\"width: {120 * row.least / most:.0f}px\"></span>"
                     f"<td class={kind}>{row.kept}<td>{escape(row.nearest[0])} – "
                     f"{escape(row.nearest[1])}<td class=number>{row.nearest[5]}</tr>")
    return "\n".join(lines) + "</tbody></table></div>"


def _number(text: str) -> Optional[float]:
    try:
        return float(text)
    except ValueError:
        return None


def _plots(rows: List[_Row], limit: float, unit: str) -> str:
    """For each column of numbers that differ: the least clearance over it."""
    plots = []
    for key in dict.fromkeys(key for row in rows for key in row.about):
        points: List[Tuple[float, _Row]] = []
        for row in rows:
            x = _number(row.about.get(key, ""))
            if x is not None and row.nearest is not None:
                points.append((x, row))
        if len(points) == sum(row.nearest is not None for row in rows) and len(
                {x for x, _ in points}) > 1:
            plots.append(_plot(key, points, limit, unit))
    return f'<div class="plots">{"".join(plots)}</div>' if plots else ""


def _plot(key: str, points: List[Tuple[float, _Row]], limit: float, unit: str) -> str:
    low, high = min(x for x, _ in points), max(x for x, _ in points)
    top = max(max(row.least for _, row in points), limit) or 1.0

    def at(x: float, y: float) -> Tuple[float, float]:
        return 40 + 230 * (x - low) / (high - low), 130 - 115 * y / top

    marks = []
    for x, row in points:
        px, py = at(x, row.least)
        colour = "var(--bad)" if row.kept == "no" else "var(--bar)"
        marks.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="3" fill="{colour}"><title>'
                     f"{escape(row.name)}: {digits(row.least)}</title></circle>")
    _, line = at(low, limit)
    return (f'<figure style="margin: 0"><svg viewBox="0 0 290 165" role="img" '
            f'aria-label="Least clearance over {escape(key)}">'
            f'<path d="M40 15V130H270" fill="none" stroke="var(--line)"/>'
            f'<path d="M40 {line:.1f}H270" stroke="var(--bad)" stroke-dasharray="3 3"/>'
            f'{"".join(marks)}<text x="40" y="144">{low:g}</text>'
            f'<text x="270" y="144" text-anchor="end">{high:g}</text>'
            f'<text x="155" y="160" text-anchor="middle">{escape(key)}</text>'
            f'<text x="36" y="19" text-anchor="end">{digits(top)}</text>'
            f'<text x="46" y="{line - 4:.1f}">{digits(limit)} {escape(unit)}</text></svg></figure>')
