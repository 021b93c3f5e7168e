"""What a run has found, as text on the terminal and as a CSV file."""

import csv
import io
import math
from typing import Dict, List

from .. import _core
from ._lengths import digits, plain, span, text_of
from ._results import BodyResult, Interval, PairResult
from ._run import Outcome

_MOST_ROWS = 20
COLUMNS = ["moving", "part", "unit", "lower", "upper", "frame", "kept", "limit", "below_limit",
           "x_moving", "y_moving", "z_moving", "x_part", "y_part", "z_part",
           "triangle_moving", "triangle_part", "frames_checked"]


class Numbering:
    """Frame numbers as the user counts them: those of the files, times, or 0, 1, ..."""

    def __init__(self, numbers: List[float]):
        self._numbers = numbers
        least = min((b - a for a, b in zip(numbers, numbers[1:])), default=1.0)
        # Hundredths of a step.
        self.decimals = min(max(2 - math.floor(math.log10(least)), 2), 9) if least > 0 else 2

    def __call__(self, at: float) -> float:
        before = min(int(at), len(self._numbers) - 1)
        after = min(before + 1, len(self._numbers) - 1)
        share = at - before
        return self._numbers[before] * (1 - share) + self._numbers[after] * share

    def text(self, at: float) -> str:
        return f"{self(at):.{self.decimals}f}"

    def intervals(self, intervals: List[Interval]) -> List[str]:
        texts = []
        for begin, end in intervals:
            first, last = span(self(begin), self(end), self.decimals)
            texts.append(first if first == last else f"{first}-{last}")
        return texts


def verdict(pair: PairResult, limit: float) -> str:
    if pair.nearest is None:
        return "not checked"
    if pair.is_violated(limit):
        return "no"
    return "yes" if pair.is_kept(limit) else "not proven"


def headline(outcome: Outcome) -> str:
    """One sentence: the answer."""
    limit = text_of(outcome.limit, outcome.unit)
    violated = [pair for pair in outcome.pairs if pair.is_violated(outcome.limit)]
    unproven = [pair for pair in outcome.pairs if not pair.is_violated(outcome.limit)
                and not pair.is_kept(outcome.limit)]
    if violated:
        what = f"{len(violated)} of {len(outcome.pairs)} pairs"
        least = violated[0]
        below = f"come below {limit}" if outcome.limit > 0 else "touch"
        return (f"NOT KEPT: {what} {below}; the least is {text_of(least.upper, outcome.unit)}, of "
                f"{least.moving} to {least.part}.")
    if not any(pair.nearest is not None for pair in outcome.pairs):
        return "NOT CHECKED: nothing could be checked."
    if outcome.all_problems or outcome.interrupted:
        return f"NOT COMPLETE: {limit} is kept where the motion could be checked."
    if unproven:
        return f"NOT PROVEN: {limit} is kept to rounding only."
    if outcome.limit == 0:
        return "KEPT: nothing touches."
    return f"KEPT: nothing comes below {limit}."


def text_table(outcome: Outcome, numberings: Dict[str, Numbering]) -> str:
    """The pairs, the nearest first; those far away are counted only."""
    limit, unit = outcome.limit, outcome.unit
    rows = [["moving", "part", f"least, {unit}".rstrip(", "), "between", "frame",
             f"below {text_of(limit, unit)}" if limit > 0 else "touching"]]
    pairs = [pair for pair in outcome.pairs if pair.nearest is not None]
    for pair in pairs[:_MOST_ROWS]:
        number = numberings[pair.moving]
        below = number.intervals(pair.below)
        text = ", ".join(below[:2]) + (f", and {len(below) - 2} more" if len(below) > 2 else "")
        assert pair.nearest is not None
        rows.append([pair.moving, pair.part, digits(pair.upper),
                     f"{digits(pair.lower)} and {digits(pair.upper)}",
                     number.text(pair.nearest.at), text or "-"])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip()
             for row in rows]
    if len(pairs) > _MOST_ROWS:
        lines.append(f"and {len(pairs) - _MOST_ROWS} more pairs, which are farther apart")
    return "\n".join(lines)


def checked_text(body: BodyResult, number: Numbering) -> str:
    return "; ".join(number.intervals(body.checked))


def csv_rows(outcome: Outcome, numberings: Dict[str, Numbering]) -> List[List[object]]:
    """A row for each pair, of the cells in COLUMNS."""
    rows: List[List[object]] = []
    checked = {id(pair): checked_text(body, numberings[body.name])
               for body in outcome.bodies for pair in body.pairs}
    for pair in outcome.pairs:
        number, nearest = numberings[pair.moving], pair.nearest
        row: List[object] = [pair.moving, pair.part, outcome.unit]
        if nearest is None:
            row += ["", "", "", verdict(pair, outcome.limit), repr(outcome.limit), ""] + [""] * 8
        else:
            row += [repr(float(pair.lower)), repr(float(pair.upper)),
                    plain(number(nearest.at), number.decimals + 4),
                    verdict(pair, outcome.limit), repr(outcome.limit),
                    "; ".join(number.intervals(pair.below))]
            row += [repr(float(x)) for x in nearest.points.ravel()]
            row += [int(triangle) for triangle in nearest.triangles]
        rows.append(row + [checked[id(pair)]])
    return rows


def csv_text(outcome: Outcome, numberings: Dict[str, Numbering]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([COLUMNS, *csv_rows(outcome, numberings)])
    return out.getvalue()


def write_whole(path: str, text: str) -> None:
    """Writes a file as a whole, or leaves what was there; what is no regular file, directly.
    OSError as open."""
    _core._write_file(path, text.encode("utf-8", "surrogateescape"))
