"""What Python can do to the module besides calling it: old pickle protocols, subinterpreters."""

import copy
import pickle
import subprocess
import sys
import textwrap

import adaptive_bvh as ab
import numpy as np
import pytest


def things():
    """An object of every class that can be had without a file."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    mesh = ab.DeformableMesh(vertices, faces)
    other = ab.DeformableMesh(vertices + 0.25, faces)
    scene = ab.Scene()
    scene.add(mesh)
    return [
        mesh,
        mesh.last_update,
        scene,
        ab.Sphere(1),
        ab.Box(1, 2, 3),
        ab.distance(mesh, other),
        ab.collide(mesh, other),
        ab.pairs_within(mesh, other, distance=1),
        ab.contact_regions(mesh, other),
        ab.closest_points(mesh, vertices),
        ab.closest_point(mesh, [1, 2, 3]),
        ab.signed_distance(mesh, other, 0.01),
        ab.CoherentDistance(mesh, other),
        ab.CoherentProximity(mesh, other),
        ab.ContactTracker(),
        ab.Motion(mesh, vertices, vertices),
        ab.weld_vertices(vertices, faces),
    ]


@pytest.mark.parametrize("thing", things(), ids=lambda thing: type(thing).__name__)
def test_every_protocol_works_or_raises(thing):
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        if isinstance(thing, (ab.DeformableMesh, ab.Scene, ab.Shape)) or hasattr(thing, "_attributes"):
            other = pickle.loads(pickle.dumps(thing, protocol))
            assert repr(other) == repr(thing)
        else:
            with pytest.raises(TypeError, match="cannot pickle"):
                pickle.dumps(thing, protocol)


def test_a_pickled_result_has_its_attributes():
    """Also those that are results, and arrays that would share memory with the result."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    mesh = ab.DeformableMesh(vertices, [[0, 1, 2]])
    found = ab.feature_pairs_within(mesh, ab.DeformableMesh(vertices + 0.1, [[0, 1, 2]]), distance=1)
    details = ab.feature_pair_details(mesh, mesh, found)
    for other in (pickle.loads(pickle.dumps(details)), copy.deepcopy(details)):
        assert repr(other) == repr(details)
        np.testing.assert_array_equal(other.edge_edge.distances, details.edge_edge.distances)
        assert len(other.edge_edge) == len(details.edge_edge)


def test_a_pickle_of_an_old_protocol_holds_the_mesh():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = ab.DeformableMesh(vertices, [[0, 1, 2]])
    mesh.update_two_frames(vertices + 1)
    for protocol in (0, 1):
        other = pickle.loads(pickle.dumps(mesh, protocol))
        assert other.validate()
        assert np.array_equal(other.vertices, mesh.vertices)
        assert np.array_equal(other.previous_vertices, mesh.previous_vertices)
    assert np.array_equal(copy.copy(mesh).vertices, mesh.vertices)


def test_every_class_says_how_it_is_pickled():
    for name in ab.__all__:
        thing = getattr(ab, name)
        if isinstance(thing, type(ab.DeformableMesh)):  # one of pybind11's classes
            assert thing.__reduce_ex__ is not object.__reduce_ex__, name


@pytest.mark.parametrize("imported_before", [False, True])
def test_a_subinterpreter_is_refused(imported_before):
    """Both where it is the first to import the module, and where it gets a copy of it."""
    try:
        import _xxsubinterpreters  # noqa: F401
    except ImportError:
        pytest.skip("this Python has no such module")
    program = """
        import _xxsubinterpreters as interpreters
        {before}
        code = '''
        try:
            import adaptive_bvh
        except ImportError as error:
            print(error)
        '''
        import textwrap
        interpreters.run_string(interpreters.create(), textwrap.dedent(code))
    """.format(before="import adaptive_bvh" if imported_before else "")
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "adaptive_bvh does not work in a subinterpreter" in result.stdout, result.stderr
