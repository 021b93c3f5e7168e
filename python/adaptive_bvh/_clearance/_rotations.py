"""Rotations: poses of a rigid body, the screw between two of them, how far a body turns."""

import math
from typing import NamedTuple, Tuple

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
QUARTER = math.pi / 2
_MANY = 1000


class Pose(NamedTuple):
    """Places a body in the world."""

    position: _Floats  # (3,)
    quaternion: _Floats  # (4,): w x y z, of length 1

    def place(self, points: _Floats) -> _Floats:
        return points @ _matrix(self.quaternion).T + self.position


class Screw:
    """The motion from one pose to the next: turning about an axis by at most half a turn, and going
    along it, both evenly. As least_distance has it."""

    def __init__(self, before: Pose, after: Pose):
        product = _multiplied(before.quaternion, after.quaternion * [1, -1, -1, -1])
        w, vector = abs(product[0]), math.copysign(1, product[0]) * product[1:]
        sine = float(np.linalg.norm(vector))
        half = math.atan2(sine, w)
        self.angle = 2 * half
        # By which a path is at most longer than the straight line between its ends.
        self.stretch = half / sine * (1 + 1e-12) if sine > 0 else 1.0
        self._turn = vector * (2 * half / sine if sine > 0 else 2.0)  # back, from the end
        rotation = _matrix(product)
        # The pose that leads from the end to the start.
        self.back = rotation, before.position - rotation @ after.position
        self._rate = np.linalg.solve(_average(self._turn), self.back[1])

    def at(self, share: float, after: _Floats) -> _Floats:
        """Points, given at the end, at a time from 0 to 1."""
        turn = (1 - share) * self._turn
        half = np.linalg.norm(turn) / 2
        quaternion = np.array([math.cos(half), *(np.sinc(half / math.pi) / 2 * turn)])
        return after @ _matrix(quaternion).T + (1 - share) * (_average(turn) @ self._rate)


def _matrix(quaternion: _Floats) -> _Floats:
    w, (x, y, z) = quaternion[0], quaternion[1:]
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def _multiplied(p: _Floats, q: _Floats) -> _Floats:
    return np.array([p[0] * q[0] - p[1:] @ q[1:],
                     *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def _average(turn: _Floats) -> _Floats:
    """The mean of the rotations from 0 to a rotation vector."""
    x, y, z = turn
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = float(np.linalg.norm(turn))
    if angle < 1e-4:
        return np.eye(3) + across / 2 + across @ across / 6
    return (np.eye(3) + (1 - math.cos(angle)) / angle**2 * across
            + (angle - math.sin(angle)) / angle**3 * (across @ across))


def best_fit_angle(before: _Floats, after: _Floats) -> float:
    """By how far the rotation turns that fits two sets of positions best (Kabsch): 0 to pi. Where
    several fit as well, as of points on a line, the smallest counts. Of many points, a share."""
    share = slice(None, None, max(len(before) // _MANY, 1))
    before, after = before[share], after[share]
    sides: Tuple[_Floats, ...] = tuple(of - of.mean(axis=0) for of in (after, before))
    scales = [float(abs(side).max(initial=0)) for side in sides]
    if not min(scales) > 0:
        return 0.0
    products = (sides[0] / scales[0]).T @ (sides[1] / scales[1])
    u, _, v = np.linalg.svd(products + 1e-12 * np.linalg.norm(products) * np.eye(3))
    trace = np.trace(u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v)
    return math.acos(min(max((trace - 1) / 2, -1), 1))
