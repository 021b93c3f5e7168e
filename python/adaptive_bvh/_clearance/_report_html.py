"""What the page of a run says beside the player: the answer, the tightest moments, the table."""

from html import escape
from typing import Dict, List, NamedTuple, Optional, Sequence as Many

from ._lengths import digits, text_of
from ._results import PairResult
from ._run import KEPT, VIOLATED, Outcome
from ._table import Numbering, headline, verdict

_BUTTONS = 6


class Moment(NamedTuple):
    """A pair, and the frame of the page at which it is nearest."""

    pair: PairResult
    frame: Optional[int]


_STYLE = """<style>
#answer { padding: 0 20px 10px; display: grid; gap: 8px; }
#answer p, #answer ul { margin: 0; }
#answer .verdict { font-weight: 600; padding-left: 10px; border-left: 4px solid var(--accent); }
#answer .verdict.kept { border-color: #1a7f37; }
#answer .verdict.not-kept { border-color: var(--contact); }
#answer ul { padding-left: 18px; color: var(--soft); max-height: 6.2em; overflow: auto; }
#moments { display: flex; gap: 6px; overflow-x: auto; padding: 2px; }
#moments button { width: auto; height: auto; padding: 4px 12px; font: inherit; white-space: nowrap;
  text-align: left; line-height: 1.3; }
#moments button small { color: var(--soft); display: block; }
#table { padding: 14px 20px 6px; }
#table h2 { font-size: 1rem; margin: 0 0 6px; }
#table div { overflow-x: auto; }
#table table { border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100%; }
#table th { text-align: left; font-weight: 600; color: var(--soft); cursor: pointer; }
#table th[aria-sort=ascending]::after { content: " ▲"; }
#table th[aria-sort=descending]::after { content: " ▼"; }
#filter { font: inherit; padding: 4px 10px; width: 16em; max-width: 100%; margin-bottom: 6px; }
#table th, #table td { padding: 4px 14px 4px 0; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
#table td.wide { white-space: normal; min-width: 12em; }
#table .number { text-align: right; }
#table tr[tabindex] { cursor: pointer; }
#table tr[tabindex]:hover td, #table tr.shown td { color: var(--accent); }
#caption { display: none; }
#table .no { color: var(--contact); font-weight: 600; }
@media (min-width: 821px) and (min-height: 560px) {  /* the table begins below the player */
  body { height: auto; }
  main { flex: none; height: calc(100vh - 190px); min-height: 480px; }
}
@media (max-width: 820px) { #answer, #table { padding-left: 12px; padding-right: 12px; } }
</style>
"""

_SCRIPT = """<script>
(() => {
"use strict";
const page = window.adaptiveBvhPage;
const least = document.getElementById("value-clearance");  // of the motion: the same in all frames
if (least) least.hidden = least.previousElementSibling.hidden = true;
// Parts are transparent, so that moving bodies are seen between them.
page.bodies.forEach((body, i) => {
  if (i < MOVING) return;
  body.setOpacity(0.4);
  document.getElementById(`opacity-${i}`).value = 0.4;
});
const jump = (element) => {
  page.pause();
  page.show(Number(element.dataset.frame));
  for (const other of document.querySelectorAll("#table tr.shown")) other.classList.remove("shown");
  if (element.tagName === "TR") element.classList.add("shown");
  if (element.tagName === "TR") document.getElementById("stage").scrollIntoView({block: "nearest"});
};
for (const element of document.querySelectorAll("[data-frame]")) {
  element.addEventListener("click", () => jump(element));
  if (element.tagName === "TR")
    element.addEventListener("keydown", (event) => {
      if (event.key === "Enter") jump(element);
    });
}
// A head sorts the rows: its column ascending, then descending. The field shows those with a text.
const heads = [...document.querySelectorAll("#table th")];
const rows = [...document.querySelectorAll("#table tbody tr")];
const words = new Intl.Collator("en", {numeric: true});
const sort = (head) => {
  const column = heads.indexOf(head), isNumber = head.classList.contains("number");
  const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  const cell = (row) => row.cells[column].textContent;
  const order = (a, b) => (isNumber ? parseFloat(a) - parseFloat(b) : words.compare(a, b));
  const filled = rows.filter((row) => cell(row)), empty = rows.filter((row) => !cell(row));
  filled.sort((a, b) => sign * order(cell(a), cell(b)));
  document.querySelector("#table tbody").append(...filled, ...empty);
  for (const other of heads) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
};
for (const head of heads) {
  head.tabIndex = 0;
  head.title = "Sort by this column";
  head.addEventListener("click", () => sort(head));
  head.addEventListener("keydown", (event) => {
    if (event.key === "Enter") sort(head);
  });
}
document.getElementById("filter").addEventListener("input", ({target}) => {
  const wanted = target.value.toLowerCase();
  for (const row of rows) row.hidden = !row.textContent.toLowerCase().includes(wanted);
});
if (!new URLSearchParams(location.hash.slice(1)).has("frame")) {
  const first = document.querySelector("#moments [data-frame]");
  if (first) page.show(Number(first.dataset.frame));
}
})();
</script>
"""


def page_with_results(html: str, outcome: Outcome, rows: Many[Moment],
                      numberings: Dict[str, Numbering], moving: int) -> str:
    """The recorded page, whose first `moving` bodies move, with the answer above the scene, and the
    table below it."""
    styles, _, rest = html.partition("</head>")
    head, header, rest = rest.partition("</header>")
    main, end, tail = rest.partition("</main>")
    body, closing, after = tail.rpartition("</body>")
    return "".join([styles, _STYLE, "</head>", head, header, "\n",
                    _answer(outcome, rows, numberings), main, end, "\n",
                    _table(outcome, rows, numberings), body,
                    _SCRIPT.replace("MOVING", str(moving)), closing, after])


def _answer(outcome: Outcome, rows: Many[Moment], numberings: Dict[str, Numbering]) -> str:
    kind = {KEPT: "kept", VIOLATED: "not-kept"}.get(outcome.status, "incomplete")
    lines = [f'<section id="answer" aria-label="Answer"><p class="verdict {kind}">'
             f"{escape(headline(outcome))}</p>"]
    said = outcome.all_problems + outcome.warnings
    for body in outcome.bodies:
        if not body.is_complete:
            done = "; ".join(numberings[body.name].intervals(body.checked)) or "none"
            said.append(f"{body.label}: only these frames were checked: {done}")
    if said:
        lines.append("<ul>" + "".join(f"<li>{escape(text)}</li>" for text in said) + "</ul>")
    buttons = []
    for pair, frame in [row for row in rows if row.frame is not None][:_BUTTONS]:
        assert pair.nearest is not None
        number = numberings[pair.moving].text(pair.nearest.at)
        buttons.append(f'<button data-frame="{frame}" title="Show this moment">'
                       f"{escape(text_of(pair.upper, outcome.unit))}<small>"
                       f"{escape(pair.moving)} – {escape(pair.part)}, frame {number}"
                       f"</small></button>")
    if buttons:
        lines.append(f'<div id="moments" aria-label="Tightest moments">{"".join(buttons)}</div>')
    return "\n".join(lines) + "\n</section>\n"


def _table(outcome: Outcome, rows: Many[Moment], numberings: Dict[str, Numbering]) -> str:
    unit = escape(outcome.unit)
    limit = escape(text_of(outcome.limit, outcome.unit))
    below = f"below {limit}, frames" if outcome.limit > 0 else "touching, frames"
    lines = ['<section id="table" aria-label="Table"><h2>Least clearance over the motion</h2>',
             f"<p>Colours on the moving bodies: the least clearance of each vertex in the frames of "
             f"this page. A row shows its moment, a head sorts the rows. Bounds are proven for "
             f"all times between the frames.</p>"
             f'<input id="filter" type="search" placeholder="Show rows with ..."'
             f' aria-label="Show rows with"><div>'
             f"<table><thead><tr><th>moving<th>part<th class=number>least, {unit}"
             f"<th class=number>proven between<th class=number>frame<th>kept<th>{below}"
             f"</tr></thead><tbody>"]
    for pair, frame in rows:
        number = numberings[pair.moving]
        kept = verdict(pair, outcome.limit)
        jump = f' data-frame="{frame}" tabindex="0"' if frame is not None else ""
        cells: List[str] = [f"<td>{escape(pair.moving)}", f"<td>{escape(pair.part)}"]
        if pair.nearest is None:
            cells += ["<td><td><td>", f"<td>{kept}<td>"]
        else:
            times = ", ".join(number.intervals(pair.below))
            cells += [f"<td class=number>{digits(pair.upper)}",
                      f"<td class=number>{digits(pair.lower)} and {digits(pair.upper)}",
                      f"<td class=number>{number.text(pair.nearest.at)}",
                      f'<td class="{"no" if kept == "no" else "yes"}">{kept}',
                      f"<td class=wide>{times}"]
        lines.append(f"<tr{jump}>{''.join(cells)}</tr>")
    lines.append("</tbody></table></div></section>\n")
    return "\n".join(lines)
