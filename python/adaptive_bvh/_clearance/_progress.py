"""What is printed; a line on a terminal that says how far a run is, and how long it still takes."""

import os
import sys
import threading
import time
from typing import Optional, TextIO

_BAR = 24


def put(text: str, stream: TextIO, end: str = "\n") -> None:
    """Prints as far as somebody reads it: `| head` may not."""
    try:
        print(text, end=end, file=stream, flush=True)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # for what is left to print
        if not isinstance(error, BrokenPipeError):
            raise


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(int(seconds + 0.5), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"


class Progress:
    """Counts steps, from any thread. Writes nothing unless the stream is a terminal."""

    def __init__(self, what: str, total: int, stream: Optional[TextIO] = None):
        self._stream = sys.stderr if stream is None else stream
        self._shown = self._stream.isatty() and total > 0
        self._what, self._total, self._done = what, total, 0
        self._begin = self._last = time.monotonic()
        self._lock = threading.Lock()

    def advance(self, steps: int) -> None:
        with self._lock:
            self._done += steps
            now = time.monotonic()
            if self._shown and (now - self._last >= 0.1 or self._done == self._total):
                self._last = now
                self._write(now - self._begin)

    def _write(self, passed: float) -> None:
        share = min(self._done / self._total, 1.0)
        bar = "#" * int(_BAR * share)
        left = _clock(passed * (1 - share) / share) if share > 0 else "?"
        self._stream.write(f"\r{self._what} [{bar:<{_BAR}}] {self._done} of {self._total}, "
                           f"{left} left   ")
        self._stream.flush()

    def end(self) -> None:
        """Removes the line."""
        if self._shown:
            self._stream.write("\r" + " " * 78 + "\r")
            self._stream.flush()
