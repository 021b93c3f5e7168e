"""What functions and methods say of arguments of wrong types: each, in each place."""

import copy
import pathlib
import pickle
import re

import numpy as np
import pytest
from meshes import ball

import adaptive_bvh as ab

VERTICES, FACES = ball(0)
MESH = ab.DeformableMesh(VERTICES, FACES)
OTHER = ab.DeformableMesh(VERTICES + [1.5, 0, 0], FACES)
SCENE = ab.Scene()
SCENE.add(MESH)
SCENE.update()

WRONG = {
    "str": "hose.stl", "path": pathlib.Path("hose.stl"), "bytes": b"hose.stl",
    "array": np.zeros((2, 3)), "shape": ab.Sphere(1.0), "None": None, "list": [1, 2], "int": 5,
    "float": 1.5, "mesh": MESH, "Mesh": ab.shape_mesh(ab.Sphere(1.0)), "Scene": SCENE, "dict": {},
    "class": ab.Sphere, "complex": 1j, "objects": [ab.Sphere(1.0), None], "function": len,
    "bools": np.zeros(3, bool), "texts": np.array(["a", "b"])}
# Arguments that are right, by type and by name.
OF_TYPE = {"DeformableMesh": MESH, "Shape": ab.Sphere(1.0), "Scene": SCENE, "float": 0.5, "int": 1,
           "Motion": ab.Motion(MESH, VERTICES, VERTICES + 0.1), "bool": True,
           "FeaturePairs": ab.feature_pairs_within(MESH, OTHER, 0.5)}
NAMED = {"vertices": VERTICES, "faces": FACES, "points": VERTICES, "point": [0, 0, 0],
         "origins": VERTICES, "directions": VERTICES, "start": VERTICES, "end": VERTICES,
         "positions": VERTICES, "proposed": VERTICES, "o1": MESH, "o2": OTHER, "body": MESH,
         "kind": "edge-edge", "pair": [0, 0], "ignored": None,
         "label_rule": "between", "elements": "triangles", "indices": [0], "normal": [0, 0, 1],
         "path": "/nonexistent/hose.stl"}


def parameters(text):
    """(name, type, whether it is needed) of each, of a signature in a docstring."""
    found = re.findall(r"(\w+): (?:adaptive_bvh\.)?(\w+)(?:\[[^\]]*\])?( = [^,]*)?", text)
    return [(name, kind, not default) for name, kind, default in found if name != "self"]


def calls(owner, name, function, bound):
    """(name, function, what is right, parameters) for each overload."""
    for line in (function.__doc__ or "").splitlines():
        form = re.match(rf"(?:\d+\. )?{name}\((.*)\)(?: ->.*)?$", line.strip())
        if form and "*args" not in form.group(1):
            of = parameters(form.group(1))
            right = {each: OF_TYPE.get(kind, NAMED.get(each))
                     for each, kind, needed in of if needed}
            yield f"{owner}{name}", bound, right, of


def all_calls():
    for name in ab.__all__:
        thing = getattr(ab, name)
        if isinstance(thing, type):
            if "__init__" in vars(thing) and hasattr(thing, "__reduce_ex__"):
                yield from calls(f"{name}.", "__init__", thing.__init__, thing)
        else:
            yield from calls("", name, thing, thing)
    things = [MESH.copy(), SCENE.snapshot(), ab.ContactSet(MESH, 0.5),
              ab.CoherentDistance(MESH, OTHER), ab.CoherentProximity(MESH, OTHER),
              ab.TrustRegion(MESH, 0.1), ab.ContactTracker()]
    for thing in things:
        for name in dir(type(thing)):
            if not name.startswith("__") and callable(getattr(type(thing), name)):
                owner = type(thing).__name__ + "."
                yield from calls(owner, name, getattr(type(thing), name), getattr(thing, name))


def messages():
    """(place, parameter's type, what is wrong, error) of all calls that raise."""
    for name, function, right, of in all_calls():
        for parameter, kind, _ in of:
            for wrong, value in WRONG.items():
                try:
                    function(**{**right, parameter: value})
                except Exception as error:  # noqa: BLE001
                    yield f"{name}({parameter}={wrong})", kind, wrong, error


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """`save` writes files of wrong names."""
    monkeypatch.chdir(tmp_path)


def test_every_message_is_a_sentence_for_python(elsewhere):
    count = 0
    for place, _, _, error in messages():
        count += 1
        text = str(error).split("Invoked with:")[0]
        if any(words in text for words in (
                "has changed since its last update", "body 1 in the scene",  # of what is right
                "expected str, bytes or os.PathLike object")):  # Python's own
            continue
        assert isinstance(error, (TypeError, ValueError, IndexError, OSError)), (place, error)
        for word in ("pybind11", "C++", "holds object;", "<U", "|S", "std::", "Unable to cast",
                     "as attributes", "NoneType object"):
            assert word not in text, (place, text)
    assert count > 3000


def test_what_is_no_mesh_yet_says_how_it_becomes_one(elsewhere):
    told = set()
    hints = {"str": "load_mesh(path)", "path": "load_mesh(path)", "bytes": "load_mesh(path)",
             "array": "DeformableMesh(vertices, faces)", "list": "DeformableMesh(vertices, faces)",
             "Mesh": "DeformableMesh(object)"}
    for place, kind, wrong, error in messages():
        if kind == "DeformableMesh" and wrong in hints:
            told.add(place)
            assert isinstance(error, TypeError) and hints[wrong] in str(error), (place, error)
    assert len(told) > 200


@pytest.mark.parametrize("make", [
    ab.DeformableMesh, ab.SurfaceNeighbourhood, lambda body: ab.Scene().add(body),
    lambda body: ab.distance(MESH, body), lambda body: ab.collide(body, MESH), ab.Motion.rigid,
    lambda body: ab.closest_point(body, [0, 0, 0]), lambda body: ab.ContactSet(body, 0.1)])
def test_the_hint_names_what_works(make, tmp_path):
    path = tmp_path / "ball.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in VERTICES] + [f"f {a} {b} {c}" for a, b, c in FACES + 1]
    path.write_text("\n".join(rows))
    for given in (str(path), path):
        with pytest.raises(TypeError, match=re.escape("DeformableMesh(load_mesh(path))")):
            make(given)
    with pytest.raises(TypeError, match=re.escape("DeformableMesh(vertices, faces)")):
        make(VERTICES)
    try:
        mesh = ab.DeformableMesh(ab.load_mesh(path))
    except RuntimeError:
        pytest.skip("built without assimp")
    make(mesh)
    make(ab.DeformableMesh(VERTICES, FACES))


def test_a_shape_is_no_mesh():
    shape = ab.Sphere(1)
    with pytest.raises(TypeError, match=re.escape("DeformableMesh(shape_mesh(shape))")):
        ab.DeformableMesh(shape)
    assert ab.DeformableMesh(ab.shape_mesh(shape)).num_faces > 0
    for other in (shape, OTHER):
        with pytest.raises(TypeError, match=r"for two objects, call collide\(first, second\)"):
            ab.self_collide(MESH, other)


def test_arrays_of_one_number_are_numbers():
    """Also where another overload has a mesh."""
    for distance in (np.array(0.5), np.float32(0.5), 1):
        assert ab.self_pairs_within(MESH, distance) is not None
        assert ab.ContactSet(MESH, distance) is not None
        assert ab.is_nearer(MESH, ab.Sphere(0.5), distance) in (True, False)



@pytest.mark.parametrize("kind", ["vertex_face", "face_vertex", "edge_edge"])
def test_a_contact_set_refuses_what_it_does_not_keep(kind):
    near = ab.ContactSet(MESH, OTHER, 2.0)
    of_features = ab.ContactSet(MESH, OTHER, 2.0, elements="features")
    assert near.update() > 0 and of_features.update() > 0
    for call in (lambda: getattr(near, kind), lambda: near.details(kind=kind)):
        with pytest.raises(ValueError, match="of triangles has no pairs of features"):
            call()
    for call in (lambda: of_features.triangles, of_features.details, of_features.contacts):
        with pytest.raises(ValueError, match="of features has no pairs of triangles"):
            call()
    assert len(near.triangles) == len(near) and len(near.details().distances) == len(near)
    assert len(getattr(of_features, kind)) == len(of_features.details(kind=kind).distances)


@pytest.mark.parametrize("thing", [
    ab.ContactSet(MESH, 0.1), ab.CoherentDistance(MESH, OTHER), ab.CoherentProximity(MESH, OTHER),
    ab.TrustRegion(MESH, 0.1), OF_TYPE["Motion"], ab.ContactTracker(),
    ab.SurfaceNeighbourhood(MESH)], ids=lambda thing: type(thing).__name__)
@pytest.mark.parametrize("make", [copy.copy, copy.deepcopy, pickle.dumps])
def test_what_cannot_be_copied_says_what_to_do(thing, make):
    name = type(thing).__name__
    with pytest.raises(TypeError) as error:
        make(thing)
    assert str(error.value) == (f"cannot pickle or copy a {name}, which keeps what it has found so "
                                f"far; make another by {name}(...)")


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy,
                                    lambda scene: pickle.loads(pickle.dumps(scene))])
def test_a_copied_scene_answers_the_same(copied):
    scene = ab.Scene()
    scene.add(MESH)
    scene.add(OTHER, np.array([[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    scene.update()
    other = copied(scene)
    assert other.distance().distance == scene.distance().distance
    np.testing.assert_array_equal(other.transform(1), scene.transform(1))
