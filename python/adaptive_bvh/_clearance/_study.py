"""A study: many motions against the same parts, on the processes of Dask.

Each motion's result is written as soon as it is there, in a file of its own. A study that was
interrupted goes on with the motions whose files are missing, or were made of other inputs. The parts
are opened by one process and travel to the others as pickles of DeformableMesh; if the process that
has them dies, Dask opens them again. A motion whose process dies runs again in another one.
"""

import argparse
import csv
import hashlib
import json
import os
import re
import signal
import sys
import time
from multiprocessing import resource_tracker
from typing import Any, Dict, List, NamedTuple, Tuple

from .. import __version__
from ._frames import SequenceError, read_text
from ._inputs import InputError, Inputs
from ._messages import internal, say, written
from ._opening import Part, expanded
from ._progress import Progress, put
from ._run import INTERNAL, INTERRUPTED, KEPT, VIOLATED, WRONG_INPUT, check
from ._table import Numbering, csv_rows, headline, write_whole
from ._table import COLUMNS as _PAIR_COLUMNS


class Motion(NamedTuple):
    """A row of the study's file."""

    name: str
    moving: List[List[str]]  # the files of each body
    about: Dict[str, str]  # the other columns


def read_study(path: str) -> List[Motion]:
    """SequenceError when the file is no such table."""
    lines = read_text(path, "the table of the motions, a CSV file, after --study").splitlines()
    rows = csv.DictReader(lines, delimiter=";" if lines and ";" in lines[0] else ",")
    columns = rows.fieldnames or []
    if "name" not in columns or "moving" not in columns:
        raise SequenceError(f"{path} has no columns 'name' and 'moving' in its first line; write "
                            f"them there, and below a line for each motion")
    folder = os.path.dirname(os.path.abspath(path))
    motions: Dict[str, Motion] = {}
    for row in rows:
        name = (row["name"] or "").strip()
        bodies = [[os.path.join(folder, file.strip()) for file in body.split("+")]
                  for body in (row["moving"] or "").split("|") if body.strip()]
        if not name or not bodies or name in motions:
            raise SequenceError(f"line {rows.line_num} of {path} has no name, no files, or a name "
                                f"that another line has; give each motion a name and its files")
        about = {key: (value or "").strip() for key, value in row.items()
                 if key not in (None, "name", "moving") and isinstance(value, (str, type(None)))}
        motions[name] = Motion(name, bodies, about)
    if not motions:
        raise SequenceError(f"{path} names no motion; write a line for each")
    return list(motions.values())


# ---- in a process of Dask ------------------------------------------------------------------------


def open_parts(given: Dict[str, Any]) -> Tuple[List[Part], List[str]]:
    """The parts, and sentences about those that cannot be used."""
    inputs = Inputs(argparse.Namespace(**given), [])
    return inputs.open_parts(), inputs.outcome.problems


def run_motion(given: Dict[str, Any], motion: Motion,
               opened: Tuple[List[Part], List[str]]) -> Dict[str, Any]:
    """One motion. Returns its result as JSON has it."""
    begin = time.perf_counter()
    parts, problems = opened
    try:
        inputs = Inputs(argparse.Namespace(**given), motion.moving)
        sequences = inputs.open_moving()
    except (InputError, SequenceError) as error:
        return {"status": WRONG_INPUT, "headline": str(error), "rows": [], "problems": [str(error)],
                "seconds": time.perf_counter() - begin}
    outcome = inputs.outcome
    outcome.problems += problems
    check(sequences, parts, inputs.settings(parts), outcome, ignored=given["ignore"])
    numberings = {sequence.name: Numbering(sequence.numbers) for sequence in sequences}
    return {"status": outcome.status, "headline": headline(outcome), "unit": outcome.unit,
            "limit": outcome.limit, "rows": csv_rows(outcome, numberings),
            "problems": outcome.all_problems, "warnings": outcome.warnings,
            "frames": sum(len(sequence) for sequence in sequences),
            "seconds": time.perf_counter() - begin}


# ---- results in files ----------------------------------------------------------------------------


def _state_of(paths: List[str]) -> List[Tuple[str, int, int]]:
    states = []
    for path in paths:
        of = os.stat(path)
        states.append((os.path.abspath(path), of.st_size, of.st_mtime_ns))
    return states


def _fingerprint(given: Dict[str, Any], motion: Motion, parts: List[Tuple[str, int, int]]) -> str:
    """What the result depends on: options and files. Another one asks for a new result."""
    files: List[Any] = []
    for body in motion.moving:
        try:
            files.append(_state_of(expanded(body)))
        except (SequenceError, OSError) as error:
            files.append(str(error))
    options = [given[key] for key in ("clearance", "unit", "parts_unit", "up", "ignore",
                                      "tolerance", "rate")]
    text = json.dumps([__version__, options, parts, files])
    return hashlib.sha256(text.encode()).hexdigest()


def _file_of(folder: str, name: str) -> str:
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name)
    if plain != name:
        plain += "-" + hashlib.sha256(name.encode()).hexdigest()[:8]
    return os.path.join(folder, plain + ".json")


def _load(path: str, fingerprint: str) -> Dict[str, Any]:
    """An earlier result; empty when there is none of these inputs."""
    try:
        with open(path, encoding="utf-8") as file:
            found = json.load(file)
        return found["result"] if found["inputs"] == fingerprint else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


# ---- the study -----------------------------------------------------------------------------------


def _import_distributed():
    try:
        import distributed  # type: ignore[import]
    except ImportError:
        raise InputError("--study needs Dask's package distributed; install it: "
                         "pip install distributed") from None
    return distributed


def _client(arguments: argparse.Namespace):
    """Dask's client, and the cluster if it is one of local processes. Ctrl-C is blocked then."""
    distributed = _import_distributed()
    if arguments.scheduler:
        try:
            return distributed.Client(arguments.scheduler, timeout="20s"), None
        except (OSError, ValueError) as error:
            raise InputError(f"no scheduler answers at {arguments.scheduler} ({error}); start one "
                             f"with: dask scheduler") from None
    # A terminal sends Ctrl-C to all processes. Those of Dask inherit that it is blocked here.
    resource_tracker.ensure_running()  # unblocks it when it starts, so start it before
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    cluster = distributed.LocalCluster(n_workers=arguments.threads, threads_per_worker=1,
                                       processes=True, dashboard_address=None, silence_logs=50)
    return distributed.Client(cluster), cluster


def _compute(arguments: argparse.Namespace, given: Dict[str, Any], wanted: List[Motion],
             done: Dict[str, Dict[str, Any]], keep) -> bool:
    """Runs the motions, and keeps each result. Returns whether Ctrl-C ended this."""
    client, cluster = _client(arguments)
    from distributed import as_completed  # type: ignore[import]
    progress = Progress("motions", len(wanted))
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        parts = client.submit(open_parts, given, key=f"parts-{time.time_ns()}")
        futures = {client.submit(run_motion, given, motion, parts, pure=False): motion
                   for motion in wanted}
        for future in as_completed(futures):
            motion = futures[future]
            error = future.exception()
            if error is None:
                keep(motion, future.result())
            else:
                done[motion.name] = _failed(error)
            future.release()
            progress.advance(1)
        return False
    except KeyboardInterrupt:
        return True
    finally:
        progress.end()
        client.close()
        if cluster is not None:
            cluster.close()


def _failed(error: BaseException) -> Dict[str, Any]:
    """The result of a motion that could not be computed."""
    is_input = isinstance(error, (InputError, SequenceError))
    text = str(error) if is_input else internal(error)
    if type(error).__name__ == "KilledWorker":
        text = ("its process ended each time that it was tried; it may need more memory than there "
                "is; " + text)
    return {"status": WRONG_INPUT if is_input else INTERNAL, "headline": text, "rows": [],
            "problems": [text]}


def run_study(arguments: argparse.Namespace) -> int:
    """Runs what is missing of a study, and writes page and table. Returns the exit status."""
    from ._study_page import study_page
    if arguments.moving:
        raise InputError("--moving stands in the table of --study; leave it out")
    if not arguments.parts:
        raise InputError("no part is given; name the files of the parts after --parts")
    motions = read_study(arguments.study)
    _import_distributed()
    given = {key: value for key, value in vars(arguments).items() if key != "moving"}
    given["parts"] = [os.path.abspath(path) for path in expanded(arguments.parts)]
    given["unit"] = Inputs(argparse.Namespace(**given), [  # of all motions; checks the options
        body for motion in motions for body in motion.moving]).unit
    folder = arguments.results or os.path.splitext(arguments.study)[0]
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be a folder of results ({error.strerror}); name another "
                         f"one: --results FOLDER") from None
    parts = _state_of(given["parts"])
    prints = {motion.name: _fingerprint(given, motion, parts) for motion in motions}
    done: Dict[str, Dict[str, Any]] = {}
    for motion in motions:
        found = _load(_file_of(folder, motion.name), prints[motion.name])
        if found:
            done[motion.name] = found
    wanted = [motion for motion in motions if motion.name not in done]
    if done:
        say(f"{len(done)} of {len(motions)} motions were done before, in {folder}")

    def keep(motion: Motion, result: Dict[str, Any]) -> None:
        done[motion.name] = result
        write_whole(_file_of(folder, motion.name),
                    json.dumps({"inputs": prints[motion.name], "result": result}))

    begin = time.perf_counter()
    interrupted = _compute(arguments, given, wanted, done, keep) if wanted else False
    if wanted:
        say(f"{len(done)} of {len(motions)} motions are done, {time.perf_counter() - begin:.1f} s")
    for motion in motions:
        result = done.get(motion.name, {})
        for kind, texts in (("warning", "warnings"), ("error", "problems")):
            for text in result.get(texts, []):
                say(f"{kind}: {motion.name}: {text}")
    for motion in motions:
        if motion.name in done:
            put(f"{motion.name}: {done[motion.name]['headline']}", sys.stdout)
    statuses = {result["status"] for result in done.values()}
    if arguments.report:
        statuses.add(written(arguments.report, lambda: write_whole(
            arguments.report, study_page(arguments.study, motions, done))))
    if arguments.csv:
        statuses.add(written(arguments.csv, lambda: write_whole(
            arguments.csv, _study_csv(motions, done))))
    if interrupted:
        say("Ctrl-C: run the same command again to go on")
        return INTERRUPTED
    return next((s for s in (VIOLATED, INTERNAL, WRONG_INPUT, INTERRUPTED) if s in statuses), KEPT)


def _study_csv(motions: List[Motion], done: Dict[str, Dict[str, Any]]) -> str:
    import io
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    about = list(dict.fromkeys(key for motion in motions for key in motion.about))
    writer.writerow(["motion"] + about + _PAIR_COLUMNS)
    for motion in motions:
        for row in done.get(motion.name, {}).get("rows", []):
            writer.writerow([motion.name] + [motion.about.get(key, "") for key in about] + row)
    return out.getvalue()
