"""Recording. What `frame` is given becomes plain numbers here, and a page in the module."""

# mypy: ignore-errors
# __init__.pyi has the types.

import math
import operator

import numpy as np

from . import _core
from ._core import (
    ContactPatches,
    Contacts,
    DeformableMesh,
    DistanceResult,
    Scene,
    SceneCollisions,
    SceneDistance,
    Shape,
)


def _wrong_type(name, given, needed):
    return TypeError(f"{name} is a {type(given).__name__}; {needed} is needed")


def _each(given):
    """The objects of a list; one object or none is a list, too."""
    if given is None:
        return ()
    return given if isinstance(given, (list, tuple)) else (given,)


def _entries(mapping):
    """Keys and values of a dict or another mapping, as it is now."""
    if mapping is None:
        return ()
    if not hasattr(mapping, "keys"):
        raise TypeError(f"a {type(mapping).__name__} was passed where a dict is needed")
    return dict(mapping).items()


def _finite(number, name, needed="a number"):
    try:
        is_finite = math.isfinite(number)
    except TypeError:
        raise _wrong_type(name, number, needed) from None
    if not is_finite:
        raise ValueError(f"{name} has a number that is not finite")
    return number


def _array(given, name, *row):
    """Finite numbers, N rows of this shape."""
    array = _core._numbers(given, name)
    if array.ndim == 0 or array.shape[1:] != row:
        needed = str(("N", *row)).replace("'", "")
        raise ValueError(f"{name} has the shape {array.shape}; {needed} is needed")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has a number that is not finite")
    return array


def _body(key, name):
    try:
        number = operator.index(key)
    except TypeError:
        raise TypeError(f"{name}: a key is not the number of a body") from None
    if not 0 <= number < 2**31:
        raise IndexError(f"{name}[{key!r}]: no body has this number")
    return number


def _label(key, name):
    if not isinstance(key, str):
        raise TypeError(f"{name}: a key is not a string")
    return key


def _parts(given, name, counts, needed):
    if not isinstance(given, (tuple, list)):
        raise _wrong_type(name, given, needed)
    if len(given) not in counts:
        raise ValueError(f"{name} has {len(given)} parts; {needed} is needed")
    return given


def _add_distance(results, found):
    if isinstance(found, (DistanceResult, SceneDistance)):
        results.add_nearest_points(found.points[np.newaxis])
        distance = found.distance
    else:
        needed = "a DistanceResult, a SceneDistance, a number or a list of these"
        distance = _finite(found, "distance", needed)
    results.distance = min(distance, math.inf if results.distance is None else results.distance)


def _add_contacts(results, found):
    if isinstance(found, Contacts):
        points = found.points
    elif isinstance(found, SceneCollisions):
        points = found.contacts.points
    else:
        points = _array(found, "contacts", 3)
    results.add_contacts(points)


def _add_arrows(results, label, given):
    name = f"arrows[{label!r}]"
    needed = "(origins, vectors) or (origins, vectors, scale)"
    origins, vectors, scale = (*_parts(given, name, (2, 3), needed), 0.0)[:3]
    origins = _array(origins, f"{name}[0]", 3)
    vectors = _array(vectors, f"{name}[1]", 3)
    results.add_arrows(_label(label, "arrows"), origins, vectors, scale)


def _add_patches(results, body, given):
    name = f"patches[{body!r}]"
    number = _body(body, "patches")
    if isinstance(given, ContactPatches):
        results.add_regions(number, given, None, name)
        return
    needed = "ContactPatches, (ContactPatches, ids) or (triangles, patches)"
    patches, numbers = _parts(given, name, (2,), needed)
    of_regions = isinstance(patches, ContactPatches)
    add = results.add_regions if of_regions else results.add_patches
    add(number, patches, numbers, name)


class _Missing:
    def __init__(self, *arguments):
        raise RuntimeError("adaptive_bvh was built without the component recording (libjs-three)")


class Recording(getattr(_core, "_Recording", _Missing)):
    """Records a run and writes it as one HTML page that plays it, in any browser, without a
    network.

    Add the bodies or follow a scene, call frame() after every step, then write(). A body's
    positions are kept in 16 bits of the box around it, about 6 bytes a vertex and frame. The
    recording keeps meshes and the scene alive. It reads them as a query does, and changes nothing
    in them.

    The page shows the times that frame() is given; nothing is measured here. frame() itself
    replaces what the processor's caches hold, so the next update may take longer. For times without
    that, let the run pass once without a recording, keep the times of its steps, and hand them over
    in a second run.

    Thread-safe: threads take turns.
    """

    __module__ = "adaptive_bvh"
    __slots__ = ()

    def __init__(self, *, title="A run", unit="", frames_per_second=25.0, up=(0, 0, 1),
                 time_unit="s", vertex_distance_range=None):
        """title: of the page. unit: of lengths, shown after them, such as 'mm'.
        frames_per_second: at which the page plays. up: (3,), which way is up in the world.
        time_unit: of frame(time=...). vertex_distance_range: the numbers of vertex_distances with
            the first and with the last colour, (2,), which the page can change; None: the least and
            the largest of the run.
        """
        ends = vertex_distance_range
        if ends is not None:
            ends = _array(ends, "vertex_distance_range")
            if ends.shape != (2,):
                shape = f"vertex_distance_range has the shape {ends.shape}"
                raise ValueError(f"{shape}; (2,) is needed")
        super().__init__(title, unit, frames_per_second, up, time_unit, ends)

    def add(self, body, tf=None, *, name=""):
        """Adds a body, placed by a pose, from the next frame on. Returns its number: 0, 1, ...

        body: a DeformableMesh; a Shape; or an object with `vertices` and `faces` that does not
            deform, such as a Mesh, which is copied. Planes and half-spaces are drawn as a square.
        name: of the body on the page.
        """
        if isinstance(body, (DeformableMesh, Shape)):
            return super().add(body, tf, name)
        if not hasattr(body, "vertices") or not hasattr(body, "faces"):
            needed = "a DeformableMesh, a Shape, or an object with vertices and faces"
            raise _wrong_type("body", body, needed)
        return super().add(body.vertices, body.faces, tf, name)

    def remove(self, body):
        """Takes a body out from the next frame on. Its number is never given again. ValueError when
        there is no such body, and for one of a followed scene: that leaves the recording when it
        leaves the scene.
        """
        super().remove(body)

    def place(self, body, tf):
        """The pose of the body with this number from the next frame on."""
        super().place(body, tf)

    def follow(self, scene, name=None):
        """Records the bodies of a Scene with their poses: frame() adds bodies that are new in the
        scene and removes bodies that have left it. RuntimeError when a scene is followed already.

        name: a function that returns a body's name on the page, name(body) for its number in the
            scene; None names them 'body 7'. It must not call the scene, the recording or a mesh:
            RuntimeError. What it raises, follow(), frame() and body_of() raise, and record nothing.
        """
        if not isinstance(scene, Scene):
            raise _wrong_type("scene", scene, "a Scene")
        if name is not None and not callable(name):
            raise TypeError("name must be a function, or None")
        super().follow(scene, "body {}".format if name is None else name)

    def body_of(self, body):
        """The number in this recording of a body of the followed scene, for `vertex_distances` and
        `patches` of frame(). ValueError when no scene with such a body is followed.
        """
        return super().body_of(body)

    def frame(self, distance=None, contacts=None, *, update_ms=None, query_ms=None,
              nearest_points=None, vertex_distances=None, arrows=None, segments=None,
              patches=None, series=None, time=None, note=""):
        """Records the bodies as they are now, with what was computed. All arguments may be left
        out. Points and vectors are in the world, lengths in the bodies' unit.

        distance: a DistanceResult, a SceneDistance or a number, shown as the frame's distance; the
            nearest points are joined by a segment. A list of these shows the smallest distance and
            all segments.
        contacts: Contacts, SceneCollisions or an array of (K, 3) points; or a list of these.
        update_ms, query_ms: what updates and queries of this frame took, milliseconds. The page
            shows these numbers, such as 1e3 * mesh.last_update.seconds.
        nearest_points: (K, 2, 3), more pairs of points that segments join.
        vertex_distances: a dict from a body's number to (N,) numbers, one a vertex, to be painted
            on it: those of vertex_distances or signed_vertex_distances, or others.
        arrows: a dict from a label, such as 'contact force, N', to (origins, vectors) or (origins,
            vectors, scale), (K, 3) each. `scale` is the drawn length of a vector of length 1; 0, or
            none, draws the label's longest vector of the run as long as an eighth of the scene.
        segments: a dict from a label to (K, 2, 3), both ends of each, such as
            FeatureDetails.nearest_points.
        patches: a dict from a body's number to the triangles of it that are coloured:
            ContactPatches, which is `first` or `second` of ContactRegions, each region in a colour
            of its own; (ContactPatches, ids) with ContactTracker.ids, by which a region keeps its
            colour; or (triangles, numbers), (K,) indices and the number of a patch for each. Equal
            numbers get equal colours.
        series: a dict from a label, such as 'energy, J', to a number. The page charts the numbers
            of each label.
        time: of the frame, in time_unit. If all frames have one, and it increases, it is the axis
            of the charts.
        note: shown with the frame.

        TypeError, ValueError or IndexError on other objects, wrong shapes, numbers that are not
        finite, and bodies or triangles that are not there: nothing is recorded then. Points of
        results that were not computed (NaN) are left out.
        """
        results = _core._FrameResults()
        results.note = note
        for found in _each(distance):
            _add_distance(results, found)
        for found in _each(contacts):
            _add_contacts(results, found)
        if update_ms is not None:
            results.update_ms = _finite(update_ms, "update_ms")
        if query_ms is not None:
            results.query_ms = _finite(query_ms, "query_ms")
        if time is not None:
            results.time = _finite(time, "time")
        for label, number in _entries(series):
            results.add_to_series(_label(label, "series"), _finite(number, f"series[{label!r}]"))
        if nearest_points is not None:
            results.add_nearest_points(_array(nearest_points, "nearest_points", 2, 3))
        for body, values in _entries(vertex_distances):
            name = f"vertex_distances[{body!r}]"
            results.add_vertex_distances(_body(body, "vertex_distances"), _array(values, name))
        for label, given in _entries(arrows):
            _add_arrows(results, label, given)
        for label, pairs in _entries(segments):
            array = _array(pairs, f"segments[{label!r}]", 2, 3)
            results.add_segments(_label(label, "segments"), array)
        for body, given in _entries(patches):
            _add_patches(results, body, given)
        super().frame(results)

    def write(self, path):
        """Writes the page: one file of about 0.9 megabytes and 4/3 of num_bytes.

        path: a string, bytes or a path object. RuntimeError, which says why, when it cannot be
            written, and when no frame was recorded.
        """
        super().write(path)

    def html(self):
        """The page as a string, as write() writes it: for a notebook or a server. RuntimeError when
        no frame was recorded.
        """
        return super().html()

    @property
    def num_bodies(self):
        """How many bodies were added, including removed ones."""
        return super().num_bodies

    @property
    def num_frames(self):
        """How many frames were recorded."""
        return super().num_frames

    @property
    def num_bytes(self):
        """What they take in memory, about, bytes."""
        return super().num_bytes
