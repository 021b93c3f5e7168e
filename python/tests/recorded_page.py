"""A page of a Recording, read as a browser reads it."""

import base64
import json

import numpy as np


class Page:
    def __init__(self, text):
        self.text = text
        self.run = json.loads(self._element('<script id="run" type="application/json">'))
        self.data = base64.b64decode(self._element('<script id="data" type="text/plain">'))

    def _element(self, tag):
        begin = self.text.index(tag) + len(tag)
        return self.text[begin:self.text.index("</script>", begin)]

    def frame(self, number):
        return self.run["frames"][number]

    def body(self, frame, body, name):
        """What a body has in a frame; what is left out is as in the frame before."""
        for now in reversed(self.run["frames"][:frame + 1]):
            if len(now["bodies"]) > body and name in (now["bodies"][body] or {}):
                return now["bodies"][body][name]
        return None

    def numbers(self, at, count, dtype):
        return np.frombuffer(self.data, dtype, count, at)

    def points(self, block):
        """(N, 3), and by how much each coordinate may be off."""
        size, low = np.array(block["size"]), np.array(block["low"])
        steps = self.numbers(block["at"], 3 * block["count"], "<u2").reshape(-1, 3)
        return low + steps * size / 65535, 0.5 * size / 65535 + 1e-12 * (abs(low) + size)

    def positions(self, frame, body):
        return self.points(self.body(frame, body, "positions"))

    def pose(self, frame, body):
        """(4, 4)."""
        columns = np.array(self.body(frame, body, "pose")).reshape(4, 3)
        return np.vstack([columns.T, [0, 0, 0, 1]])

    def patches(self, frame, body):
        """Triangles, and the number of the patch of each."""
        block = self.frame(frame)["bodies"][body]["patches"]
        return self.numbers(block["at"], 2 * block["count"], "<u4").reshape(2, -1).tolist()


def check_points(found, expected):
    """Points and their tolerance, of Page.points, against the recorded ones."""
    points, tolerance = found
    expected = np.asarray(expected, float).reshape(-1, 3)
    assert points.shape == expected.shape
    assert (np.abs(points - expected) <= tolerance).all()
