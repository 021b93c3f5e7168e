"""Lengths with a unit: '5mm', '0.2in', '3'."""

import math
import re
from typing import Tuple

METRES = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "in": 0.0254, "ft": 0.3048}
_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµ\"]*)\s*$")
_OTHER_NAMES = {'"': "in", "inch": "in", "µm": "um", "micron": "um"}


class LengthError(ValueError):
    """A text is no length. Says what to write."""


def unit_from(text: str) -> str:
    name = _OTHER_NAMES.get(text, text)
    if name not in METRES:
        raise LengthError(f"'{text}' is no unit of length; write one of {', '.join(METRES)}")
    return name


def length_from(text: str, unit: str) -> float:
    """The length in `unit`. A number without a unit is in `unit` already."""
    match = _LENGTH.match(text)
    if match is None:
        raise LengthError(f"'{text}' is no length; write a number and a unit, such as 5.5mm")
    number, name = float(match.group(1)), match.group(2)
    if not math.isfinite(number) or number < 0:
        raise LengthError(f"'{text}' is no length; write a number that is not negative")
    return number * factor(unit_from(name), unit) if name else number


def factor(of: str, unit: str) -> float:
    """By which lengths in the unit `of` are multiplied, to be in `unit`."""
    return METRES[of] / METRES[unit] if of != unit else 1.0


def text_of(length: float, unit: str) -> str:
    """Four digits, as many decimals as that takes: '12.34 mm'."""
    return f"{digits(length)} {unit}".rstrip()


def digits(length: float) -> str:
    if length == 0 or not math.isfinite(length):
        return f"{length:g}"
    decimals = max(3 - math.floor(math.log10(abs(length))), 0)
    return f"{length:.{decimals}f}" if decimals <= 9 else f"{length:.3e}"


def span(begin: float, end: float, decimals: int) -> Tuple[str, str]:
    """Both numbers of an interval, outward to so many decimals."""
    scale = 10**decimals
    return (plain(math.floor(scale * begin + 1e-6) / scale, decimals),
            plain(math.ceil(scale * end - 1e-6) / scale, decimals))


def plain(number: float, decimals: int) -> str:
    """Rounded to so many decimals, without zeros at its end."""
    return f"{number:.{decimals}f}".rstrip("0").rstrip(".")
