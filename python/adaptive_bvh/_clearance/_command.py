"""The command: one run, and what it says and writes."""

import argparse
import os
import sys
from typing import Dict, List, Optional, Sequence as Many

from ._arguments import parser
from ._frames import Sequence, SequenceError
from ._inputs import InputError, Inputs
from ._lengths import LengthError
from ._opening import Part
from ._progress import Progress
from ._run import INTERRUPTED, WRONG_INPUT, Outcome, check, num_steps
from ._table import Numbering, checked_text, csv_text, headline, text_table, write_whole


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def run(arguments: argparse.Namespace) -> int:
    """One run. Returns the exit status."""
    inputs = Inputs(arguments, arguments.moving)
    parts = inputs.open_parts()
    sequences = inputs.open_moving()
    outcome = inputs.outcome
    progress = Progress("checking", num_steps(sequences, arguments.ignore))
    check(sequences, parts, inputs.settings(parts), outcome, ignored=arguments.ignore,
          threads=arguments.threads, advance=progress.advance,
          on_stop=lambda: say("\nCtrl-C: ends here, and reports what was done"))
    progress.end()
    numberings = {sequence.name: Numbering(sequence.numbers) for sequence in sequences}
    for warning in outcome.warnings:
        say(f"warning: {warning}")
    for problem in outcome.all_problems:
        say(f"error: {problem}")
    status = max(outcome.status, _write(arguments, outcome, sequences, parts, numberings))
    _print([headline(outcome), text_table(outcome, numberings), *_checked(outcome, numberings)])
    return status


def _checked(outcome: Outcome, numberings: Dict[str, Numbering]) -> List[str]:
    return [f"{body.label}: only these frames were checked: "
            f"{checked_text(body, numberings[body.name]) or 'none'}"
            for body in outcome.bodies if not body.is_complete]


def _print(lines: List[str]) -> None:
    """Prints lines as far as somebody reads them: `| head` may not."""
    try:
        print("\n".join(lines), flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _write(arguments: argparse.Namespace, outcome: Outcome, sequences: List[Sequence],
           parts: List[Part], numberings: Dict[str, Numbering]) -> int:
    """The files that are wanted. Returns a status: 2 when one cannot be written."""
    status = 0
    if arguments.csv:
        try:
            write_whole(arguments.csv, csv_text(outcome, numberings))
        except OSError as error:
            say(f"error: {arguments.csv} cannot be written ({error.strerror}); name another file")
            status = WRONG_INPUT
    if arguments.report:
        from ._report import write_report
        try:
            write_report(arguments.report, outcome, sequences, parts, numberings,
                         up=arguments.up or "z")
        except (OSError, RuntimeError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            say(f"error: {arguments.report} cannot be written ({reason}); name another file")
            status = WRONG_INPUT
    return status


def main(arguments: Optional[Many[str]] = None) -> int:
    """Runs the command. Returns the exit status: 0 kept, 1 not kept, 2 wrong input, 130 Ctrl-C."""
    given = parser().parse_args(arguments)
    try:
        if given.study:
            from ._study import run_study
            return run_study(given)
        return run(given)
    except (InputError, SequenceError, LengthError) as error:
        for line in str(error).splitlines():
            say(f"error: {line}")
        return WRONG_INPUT
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED
