"""What the command says on stderr, and how a file or an error ends it."""

import os
import sys
import traceback
from typing import Callable

from .. import __version__
from ._progress import put
from ._run import INTERRUPTED, WRONG_INPUT


def say(text: str) -> None:
    put(text, sys.stderr)


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
