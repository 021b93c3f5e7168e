"""The command: one run, and what it says and writes."""

import argparse
import os
import sys
import traceback
from typing import Callable, Dict, List, Optional, Sequence as Many

from .. import __version__
from ._arguments import parser
from ._frames import Sequence, SequenceError
from ._inputs import InputError, Inputs
from ._lengths import LengthError
from ._opening import Part
from ._progress import Progress, put
from ._run import INTERNAL, INTERRUPTED, WRONG_INPUT, Outcome, check, num_steps
from ._table import Numbering, checked_text, csv_text, headline, text_table, write_whole


def say(text: str) -> None:
    put(text, sys.stderr)


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


def written(path: str, write: Callable[[], None]) -> int:
    """Writes a file. Returns a status: 2 when it cannot be, 3 when Ctrl-C ended that."""
    try:
        write()
        return 0
    except (OSError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        say(f"error: {path} cannot be written ({reason}); name another file")
        return WRONG_INPUT
    except KeyboardInterrupt:
        say(f"\nCtrl-C: {path} is not written")
        return INTERRUPTED


def internal(error: BaseException) -> str:
    """The sentence about an error that nothing foresaw."""
    places = traceback.extract_tb(error.__traceback__)[-4:]
    at = ", ".join(f"{os.path.basename(place.filename)}:{place.lineno}" for place in places)
    return (f"internal error: {type(error).__name__}: {error} (adaptive_bvh {__version__}, {at}); "
            f"send this line, the command and its files to the maintainers of adaptive_bvh")


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
