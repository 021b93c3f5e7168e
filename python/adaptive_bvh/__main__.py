"""The command adaptive_bvh: `adaptive_bvh clearance ...`, also `python -m adaptive_bvh clearance`."""

import os
import signal
import sys

from ._clearance import main
from ._clearance._run import INTERRUPTED


def _leave(*_):
    os._exit(INTERRUPTED)


def run():
    """Runs the command, and ends the process with its status. Ctrl-C, the end of the terminal, and
    SIGTERM are KeyboardInterrupt while it runs."""
    signals = [number for name in ("SIGINT", "SIGTERM", "SIGHUP")
               for number in [getattr(signal, name, None)]
               if number is not None and signal.getsignal(number) is not signal.SIG_IGN]
    try:
        try:
            for number in signals:
                signal.signal(number, signal.default_int_handler)
            if sys.stdout is not None:
                sys.stdout.reconfigure(errors="backslashreplace")  # names of files may be any bytes
            status = main()
        finally:
            for number in signals:
                signal.signal(number, _leave)
    except KeyboardInterrupt:
        status = INTERRUPTED
    for number in signals:
        signal.signal(number, signal.SIG_IGN)  # Python's own end would restore what kills the process
    sys.exit(status)


if __name__ == "__main__":
    run()
