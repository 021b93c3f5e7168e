"""The __repr__ of results: "RayHits(rays=[0, 2], triangles=[7, 9], ...)"."""

import numpy as np

_SHOWN = 12  # numbers of an array; longer ones are abbreviated, and followed by their shape
_SIX_DIGITS = {"float_kind": "{:.6g}".format, "int_kind": "{}".format}


def _text_of_value(value):
    if not isinstance(value, np.ndarray):
        return repr(value)
    text = np.array2string(value, separator=", ", threshold=_SHOWN, edgeitems=2,
                           formatter=_SIX_DIGITS)
    line = " ".join(text.split())  # rows end with newlines
    return line if value.size <= _SHOWN else f"{line} of shape {value.shape}"


def text_of(result):
    """Shows the attributes by name."""
    values = (f"{name}={_text_of_value(getattr(result, name))}" for name in result._attributes)
    return f"{type(result).__name__}({', '.join(values)})"
