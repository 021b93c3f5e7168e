"""The command: one run, and what it says and writes."""

import argparse
import sys
from typing import Dict, List, Optional, Sequence as Many

from ._arguments import parser
from ._frames import Sequence, SequenceError
from ._inputs import InputError, Inputs
from ._lengths import LengthError
from ._messages import internal, say, written
from ._opening import Part
from ._progress import Progress, put
from ._run import INTERNAL, INTERRUPTED, WRONG_INPUT, Outcome, check, num_steps
from ._table import Numbering, checked_text, csv_text, headline, text_table, write_whole


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
    put("\n".join([headline(outcome), text_table(outcome, numberings),
                   *_checked(outcome, numberings)]), sys.stdout)
    files = _write(arguments, outcome, sequences, parts, numberings)
    return outcome.status or files


def _checked(outcome: Outcome, numberings: Dict[str, Numbering]) -> List[str]:
    return [f"{body.label}: only these frames were checked: "
            f"{checked_text(body, numberings[body.name]) or 'none'}"
            for body in outcome.bodies if not body.is_complete]


def _write(arguments: argparse.Namespace, outcome: Outcome, sequences: List[Sequence],
           parts: List[Part], numberings: Dict[str, Numbering]) -> int:
    """The files that are wanted. Returns a status: 2 when one cannot be written."""
    status = 0
    if arguments.csv:
        status = max(status, written(arguments.csv, lambda: write_whole(
            arguments.csv, csv_text(outcome, numberings))))
    if arguments.report:
        from ._report import write_report
        status = max(status, written(arguments.report, lambda: write_report(
            arguments.report, outcome, sequences, parts, numberings, up=arguments.up or "z")))
    return status


def main(arguments: Optional[Many[str]] = None) -> int:
    """Runs the command. Returns the exit status: 0 kept, 1 not kept, 2 wrong input, 3 interrupted,
    4 internal error."""
    try:
        given = parser().parse_args(arguments)
        if given.command is None:
            raise InputError("no command is given; how to check a clearance: "
                             "adaptive_bvh clearance --help")
        if given.study:
            from ._study import run_study
            return run_study(given)
        return run(given)
    except (InputError, SequenceError, LengthError) as error:
        for line in str(error).splitlines():
            say(f"error: {line}")
        return WRONG_INPUT
    except OSError as error:
        say(f"error: {error}")
        return WRONG_INPUT
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED
    except SystemExit:  # of argparse
        raise
    except BaseException as error:
        say(internal(error))
        return INTERNAL
