"""Calls with arguments of all kinds: an answer or one of our errors, never a crash, and the mesh
stays on its last frame."""

import meshes
import numpy as np
import pytest
from brute_force import triangle_distances
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from long_mode import LONG, SEED

import adaptive_bvh as ab

pytestmark = pytest.mark.filterwarnings("ignore")  # of NumPy, about values that it casts
REFUSALS = (TypeError, ValueError, IndexError)
BALL, SHEET = meshes.ball(0), meshes.sheet(2)

numbers = st.one_of(
    st.floats(-2, 2),
    st.sampled_from([0.0, -0.0, 1e-300, 1e-20, 1e20, 1e70, 1e76, 1e308, np.nan, np.inf, -np.inf]),
)
dtypes = st.sampled_from(
    ["f2", "f4", "f8", ">f8", ">f4", "g", "i1", "i4", "i8", "u8", "?", "c16", "O", "U4", "M8[s]"]
)


@st.composite
def layouts(draw, array):
    """The same numbers, elsewhere in memory."""
    form = draw(st.integers(0, 7))
    if form == 1:
        array = np.asfortranarray(array)
    elif form == 2:
        array = np.repeat(array, 2, axis=0)[::2] if array.ndim else array
    elif form == 3:
        array = array[::-1].copy()[::-1] if array.ndim else array
    elif form == 4:  # not aligned
        raw = np.zeros(array.nbytes + 1, np.uint8)
        if not array.dtype.hasobject:
            raw[1:] = np.frombuffer(array.tobytes(), np.uint8)
            array = raw[1:].view(array.dtype).reshape(array.shape)
    elif form == 5:
        array = np.array(array)
        array.flags.writeable = False
    elif form == 6:
        return array.tolist()
    elif form == 7:
        array = np.ma.masked_array(array)
    return array


@st.composite
def arrays(draw, shape):
    """An array of that shape, of any type and layout."""
    values = draw(hnp.arrays(np.float64, shape, elements=numbers, fill=st.floats(-1, 1)))
    try:
        with np.errstate(all="ignore"):
            values = values.astype(draw(dtypes))
    except (ValueError, TypeError):
        pass
    return draw(layouts(values))


some_vertices = st.one_of(
    arrays((6, 3)), arrays((6, 3)), arrays(hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=7))
)
some_indices = hnp.arrays(
    st.sampled_from(["i1", "i8", "u8", ">i2", "f8"]),
    st.integers(0, 7),
    elements=st.integers(0, 8),
).flatmap(layouts)


def calls(count):
    """Tries a test on that many examples, or in the longer mode on ten times as many."""

    def decorate(test):
        if SEED:
            test = seed(int(SEED))(test)
        return settings(
            max_examples=count * (10 if LONG else 1),
            derandomize=not SEED,
            database=None,
            deadline=None,
            suppress_health_check=list(HealthCheck),
        )(test)

    return decorate


def is_usable(vertices):
    return np.abs(vertices).max() < 1e6


def check(mesh):
    """The mesh is sound and answers as brute force does."""
    assert mesh.validate()
    vertices = mesh.vertices
    if is_usable(vertices):
        other = ab.DeformableMesh(*SHEET)
        expected = triangle_distances(vertices, mesh.faces, *SHEET).min()
        scale = 1 + np.abs(vertices).max()
        distance = ab.distance(mesh, other).distance
        assert distance == pytest.approx(expected, abs=1e-6 * scale)


some_updates = st.one_of(some_vertices, st.tuples(some_indices, some_vertices))


@calls(50)
@given(st.lists(st.tuples(st.booleans(), some_updates), max_size=4))
def test_updates(updates):
    mesh = ab.DeformableMesh(*BALL)
    for two_frames, update in updates:
        before = mesh.vertices
        arguments = update if isinstance(update, tuple) else (update,)
        two_frames = two_frames and len(arguments) == 1
        try:
            (mesh.update_two_frames if two_frames else mesh.update)(*arguments)
        except REFUSALS:
            np.testing.assert_array_equal(mesh.vertices, before)
        else:
            given_now = np.asarray(arguments[-1], float)
            if len(arguments) == 1:
                np.testing.assert_array_equal(mesh.vertices, given_now)
            assert np.isfinite(mesh.vertices).all()
            expected = before if two_frames else before[:0]
            np.testing.assert_array_equal(mesh.previous_vertices, expected)
    check(mesh)


@calls(50)
@given(
    st.one_of(some_vertices, st.just(BALL[0])),
    st.one_of(
        hnp.arrays(
            st.sampled_from(["i1", "u1", "i8", "u8", ">i4"]),
            st.tuples(st.integers(0, 5), st.integers(2, 4)),
            elements=st.integers(0, 7),
        ).flatmap(layouts),
        hnp.arrays(np.int64, (4, 3), elements=st.integers(0, 5)).flatmap(layouts),
        st.none(),
    ),
)
def test_builds(vertices, faces):
    try:
        mesh = ab.DeformableMesh(vertices, faces)
    except REFUSALS:
        return
    np.testing.assert_array_equal(mesh.faces, np.asarray(faces).reshape(-1, 3))
    check(mesh)


@calls(50)
@given(st.one_of(arrays((4, 4)), st.tuples(arrays((3, 3)), arrays((3,))), some_vertices, st.text()))
def test_poses(tf):
    mesh = ab.DeformableMesh(*BALL)
    for query in (ab.distance, ab.collide, ab.vertex_distances):
        try:
            query(mesh, mesh, tf2=tf)
        except REFUSALS:
            pass


class Evil:
    """Says that it is an array."""

    @property
    def __array_interface__(self):
        return dict(shape=(6, 3), typestr="<f8", data=None, version=3)

    vertices = property(lambda self: 1 / 0)
    faces = 3


def pool():
    """What any argument may be."""
    bodies = [ab.DeformableMesh(*m) for m in (BALL, SHEET, BALL, SHEET)]
    bodies += [bodies[0].copy()]
    bodies[1].update_two_frames(SHEET[0] + 0.1)
    motions = [ab.Motion(m, m.vertices + 0.3) for m in bodies]
    shapes = [ab.Box(1, 1, 1), ab.Sphere(1e-8), ab.Sphere(1e8), ab.Capsule(1, 1), ab.Cone(1, 1e8)]
    shapes += [ab.Cylinder(1e-8, 1), ab.Ellipsoid(1, 1e-8, 1e8)]
    shapes += [ab.Plane([0, 0, 1]), ab.Halfspace([1, 0, 0], 1e8), ab.Halfspace([0, -1, 0], -0.5)]
    raw = [c.__new__(c) for c in (ab.DeformableMesh, ab.Motion, ab.Box, ab.FeaturePairs, ab.Plane)]
    raw += [c.__new__(c) for c in (ab.CoherentDistance, ab.DistanceResult, ab.Contacts)]
    raw += [c.__new__(c) for c in (ab.Mesh, ab.MeshUpdate)]
    plain = [None, True, 0, 1, -1, 2**70, 0.1, -0.5, np.nan, np.inf, "", "edge-edge", b"x"]
    plain += [Evil(), object(), ab.DeformableMesh, [], (), {}, "none", [[0, 1]], (0, 0)]
    plain += [np.eye(4), np.eye(3)]
    plain += [(np.eye(3), [0, 0, 1e70]), (np.eye(3), [5, 5, 5]), BALL[0], BALL[1], np.zeros((0, 3))]
    pairs = [ab.FeaturePairs(), ab.FeaturePairs(edge_edge=[[0, 23], [3, 5]])]
    return bodies * 4 + motions * 2 + shapes + raw + plain + pairs * 2


POOL = pool()
FUNCTIONS = sorted(set(ab.__all__) - {"MeshLoadError"})


@calls(800)
@given(st.data())
def test_every_function(data):
    function = getattr(ab, data.draw(st.sampled_from(FUNCTIONS)))
    numbers = data.draw(st.lists(st.integers(0, len(POOL) - 1), max_size=5))
    arguments = [POOL[i] for i in numbers]
    attributes = st.sampled_from(  # `save` would write files wherever the tests run
        [n for n in dir(ab.DeformableMesh) if not n.startswith("__") and n != "save"]
    )
    if data.draw(st.integers(0, 5)) == 0 and arguments:
        try:
            function = getattr(arguments[0], data.draw(attributes))
        except (AttributeError, ZeroDivisionError, *REFUSALS):
            return
        arguments = arguments[1:]
    try:
        result = function(*arguments) if callable(function) else function
        for name in dir(result):
            if not name.startswith("__"):
                getattr(result, name)
        repr(result)
    except (*REFUSALS, ZeroDivisionError, OSError):
        pass


@calls(200)
@given(st.data())
def test_every_method_of_a_scene(data):
    scene = ab.Scene()
    meshes_before = [mesh.vertices for mesh in POOL[:5]]
    names = [n for n in dir(ab.Scene) if not n.startswith("_") or n == "__contains__"]
    for _ in range(8):
        name = data.draw(st.sampled_from(["add", "add", "add", "update", *names]))
        pick = st.lists(st.integers(0, len(POOL) - 1), max_size=3)
        arguments = [POOL[i] for i in data.draw(pick)]
        if name == "add":
            arguments = [POOL[data.draw(st.integers(0, 40))], *arguments[:1]]
        elif data.draw(st.booleans()):  # a body, or a length
            arguments = [data.draw(st.integers(0, 3)), *arguments[:1]]
        method = getattr(scene, name)
        try:
            repr(method(*arguments) if callable(method) else method)
        except (*REFUSALS, ZeroDivisionError):
            pass
        except RuntimeError as error:
            assert "has changed since its last update" in str(error)
    scene.set_filter(None)
    scene.update()
    scene.collide()
    for mesh, before in zip(POOL[:5], meshes_before):
        np.testing.assert_array_equal(mesh.vertices, before)


def test_meshes_of_the_pool_are_sound():
    for mesh in POOL[:5]:
        assert mesh.validate()
