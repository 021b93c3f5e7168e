"""The command line of `adaptive_bvh clearance`."""

import argparse
import difflib
import os
import re
import sys
from typing import List

from .. import __version__
from ._lengths import METRES
from ._progress import put

_EPILOG = """\
A moving body is a sequence: numbered files of any format that load_mesh reads (hose_0001.ply, ...),
an .npz with arrays 'vertices' (frames, vertices, 3) and 'faces', a .pc2 and the mesh beside it, a
glTF file with an animation, or a mesh and its poses. Between two frames every vertex moves on a
straight line, and a body with poses on a screw; the answer holds for all times in between, not for
the frames alone.

exit status: 0 the clearance is kept, 1 it is not, 2 wrong or incomplete input, 3 interrupted,
4 a mistake of the tool itself

example:
  adaptive_bvh clearance --moving 'hose_*.ply' --parts bay/*.stl --clearance 5mm \\
      --report report.html --csv clearance.csv
"""


class _Parser(argparse.ArgumentParser):
    """Wrong options are answered by one sentence, without the list of all options."""

    known: List[str] = []  # the options of the commands

    def __init__(self, **given):
        super().__init__(allow_abbrev=False, **given)

    def parse_args(self, args=None, namespace=None):
        given, unknown = self.parse_known_args(args, namespace)
        options = [word.partition("=")[0] for word in unknown if word.startswith("-")]
        if options:
            near = difflib.get_close_matches(options[0], self.known, 1)
            self.error(f"there is no option {options[0]}" +
                       (f"; did you mean {near[0]}?" if near else ""))
        if unknown:
            self.error(f"{unknown[0]} belongs to no option; name files after --moving or --parts")
        return given

    def _print_message(self, message, file=None):
        put(message or "", file or sys.stderr, end="")

    def error(self, message):
        self.exit(2, f"error: {message} (all options: adaptive_bvh clearance --help)\n")


class _Length(argparse.Action):
    """A length, also with a space before its unit."""

    def __call__(self, parser, namespace, values, option_string=None):
        setattr(namespace, self.dest, " ".join(values))


class _Poses(argparse.Action):
    """A table of poses: one more file of the last body."""

    def __call__(self, parser, namespace, values, option_string=None):
        if not namespace.moving or not values.lower().endswith(".csv"):
            parser.error(f"--poses {values} stands alone, or is no .csv file; write it after the "
                         f"mesh that it moves: --moving hose.stl --poses hose.csv")
        namespace.moving[-1].append(values)


def parser() -> argparse.ArgumentParser:
    top = _Parser(prog="adaptive_bvh", description="Exact distances of moving triangle meshes.",
                  epilog="all options: adaptive_bvh clearance --help")
    top.add_argument("--version", action="version", version=f"adaptive_bvh {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")
    tool = commands.add_parser(
        "clearance", help="the least clearance of moving bodies over their motion",
        description="Does a hose or a cable keep its clearance to the parts around it while it "
                    "moves? Writes the least clearance over the whole motion of each moving body "
                    "and each part, with proven bounds, when and where.",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = tool.add_argument
    add("--moving", nargs="+", action="append", metavar="FILE", default=[],
        help="the frames of a moving body, in the order of their numbers; once for each body")
    add("--poses", metavar="FILE", action=_Poses, dest="moving", default=argparse.SUPPRESS,
        help="the poses of the body named before, which is one mesh then: a CSV file whose first "
             "line names the columns t,x,y,z,qw,qx,qy,qz in their order; x, y, z in the unit of "
             "the mesh, in the axes of --up. Between two poses the body goes on a screw")
    add("--parts", nargs="+", action="extend", metavar="FILE", default=[],
        help="the parts around, which stand still; one part a file")
    add("--clearance", metavar="LENGTH", nargs="+", action=_Length, default="0",
        help="the clearance to be kept, such as 5mm or 0.2in; a number without a unit is in the "
             "unit of the files; 0, or none: whether they touch")
    add("--report", metavar="FILE", help="writes a page (HTML) that plays the motion")
    add("--csv", metavar="FILE", help="writes the table, one row a pair")
    add("--unit", metavar="UNIT",
        help=f"unit of files that declare none, such as STL and PLY: {', '.join(METRES)}; "
             f"default: mm. Results are in this unit")
    add("--parts-unit", metavar="UNIT", help="unit of the parts' files, where it is another one")
    add("--up", choices=["x", "y", "z"],
        help="the axis that points up: turns glTF and Collada, which declare theirs, and the page")
    add("--ignore", nargs="+", action="extend", metavar="PAIR", default=[],
        help="leaves pairs out: PART or MOVING:PART, with * and ?, such as 'hose:clip_*'")
    add("--tolerance", metavar="LENGTH", nargs="+", action=_Length,
        help="between the bounds of each least clearance; default: a thousandth of the clearance")
    add("--rate", type=float, default=30.0, metavar="N",
        help="frames a second in which animations of glTF are sampled; default: 30")
    add("--threads", type=int, default=min(2, os.cpu_count() or 1), metavar="N",
        help="default: 2")
    add("--study", metavar="FILE",
        help="checks many motions: a CSV file with the columns name and moving, one row each, and "
             "any more columns, which are shown (needs distributed)")
    add("--results", metavar="FOLDER",
        help="where a study keeps the result of each motion; default: FILE without .csv")
    add("--scheduler", metavar="ADDRESS",
        help="Dask's scheduler for a study, such as tcp://host:8786; default: local processes")
    tool._negative_number_matcher = re.compile(r"-\.?\d")  # -5mm is a length, no option
    top.known = re.findall(r"--[\w-]+", tool.format_usage())
    return top
