"""The third judge as a peer: this library's answers beside exact ones, in every case."""

from __future__ import annotations

import judge

precision = "exact"
update = "rebuild"
absent = {"": "too slow but for small meshes"}


def _asked(question: str):
    return lambda work: lambda frame: judge.answer(question, work)


answers = {
    question: _asked(question)
    for question in ("closest points", "distance", "contacts", "winding numbers", "first hits")
}
