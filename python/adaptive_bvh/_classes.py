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


def _text(name, result):
    """The attributes by name: "RayHits(rays=[0, 2], triangles=[7, 9], ...)"."""
    values = (f"{each}={_text_of_value(getattr(result, each))}" for each in result._attributes)
    return f"{name}({', '.join(values)})"


def _repr(result):
    return _text(type(result).__name__, result)


class SavedResult:
    """What pickle and copy make of a result: its attributes, by the same names, and its text."""

    def __init__(self, name, values):
        self.__dict__.update(values)
        self._name, self._attributes = name, list(values)

    def __repr__(self):
        return _text(self._name, self)


class SavedRows(SavedResult):
    """Of a result that len() counts the rows of."""

    def __init__(self, name, values, count):
        super().__init__(name, values)
        self._count = count

    def __len__(self):
        return self._count


def _reduce_result(self, protocol):
    values = {name: getattr(self, name) for name in self._attributes}
    named = type(self).__name__, values
    return (SavedRows, (*named, len(self))) if hasattr(self, "__len__") else (SavedResult, named)


def _reduce_ex(self, protocol):
    """For pickle and copy. The protocols 0 and 1 make a pickled object of any class without its
    __new__, which pybind11 answers by ending the process. So they get what protocol 2 gets: what a
    class says about itself, or a TypeError.
    """
    try:
        return object.__reduce_ex__(self, max(protocol, 2))
    except TypeError:
        name = type(self).__name__
        raise TypeError(f"cannot pickle or copy a {name}, which keeps what it has found so far; "
                        f"make another by {name}(...)") from None


def complete():
    for thing in vars(_core).values():
        if isinstance(thing, type(_core.DeformableMesh)):  # a class of pybind11
            thing.__reduce_ex__ = _reduce_ex
            if "_attributes" in vars(thing):
                thing.__repr__ = _repr
                thing.__reduce_ex__ = _reduce_result
