"""What the module's classes have of Python: their __repr__, and how they are pickled."""

import numpy as np

from . import _core

_SHOWN = 12  # numbers of an array; longer ones are abbreviated, and followed by their shape
_SIX_DIGITS = {"float_kind": "{:.6g}".format, "int_kind": "{}".format}


def _text_of_value(value):
    if not isinstance(value, np.ndarray):
        return repr(value)
    text = np.array2string(value, separator=", ", threshold=_SHOWN, edgeitems=2,
                           formatter=_SIX_DIGITS)
    line = " ".join(text.split())  # rows end with newlines
    return line if value.size <= _SHOWN else f"{line} of shape {value.shape}"


def _repr(result):
    """The attributes by name: "RayHits(rays=[0, 2], triangles=[7, 9], ...)"."""
    values = (f"{name}={_text_of_value(getattr(result, name))}" for name in result._attributes)
    return f"{type(result).__name__}({', '.join(values)})"


def _reduce_ex(self, protocol):
    """The protocols 0 and 1 make a pickled object of any class without its __new__, which pybind11
    answers by ending the process. So they get what protocol 2 gets: what a class says about itself,
    or a TypeError.
    """
    return object.__reduce_ex__(self, max(protocol, 2))


def complete():
    for thing in vars(_core).values():
        if isinstance(thing, type(_core.DeformableMesh)):  # a class of pybind11
            thing.__reduce_ex__ = _reduce_ex
            if "_attributes" in vars(thing):
                thing.__repr__ = _repr
