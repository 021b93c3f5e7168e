"""Bodies of a recording: shapes, scenes that are followed, and what the page holds of them."""

import gc
import threading
import weakref

import numpy as np
import pytest
from meshes import ball, place, sheet, wave
from recorded_page import Page, check_points

import adaptive_bvh as ab


@pytest.fixture
def recording():
    try:
        return ab.Recording()
    except RuntimeError as missing:
        pytest.skip(str(missing))


@pytest.mark.parametrize("shape, size", [
    (ab.Box(1, 2, 3), (1, 2, 3)), (ab.Sphere(2), (4, 4, 4)), (ab.Capsule(1, 3), (2, 2, 5)),
    (ab.Cylinder(1, 3), (2, 2, 3)), (ab.Cone(1, 3), (2, 2, 3)), (ab.Ellipsoid(1, 2, 3), (2, 4, 6)),
    (ab.Plane([0, 0, 1], 2), None), (ab.Halfspace([0, 0, 1], 2), None)])
def test_shapes_are_bodies(recording, shape, size):
    assert recording.add(shape, place(1, 2, 3), name="shape") == 0
    recording.frame()
    page = Page(recording.html())
    assert page.run["bodies"][0]["name"] == "shape"
    assert page.run["bodies"][0]["unbounded"] == (size is None)
    points = page.positions(0, 0)[0]
    if size is None:
        np.testing.assert_allclose(points[:, 2], 2)
    else:
        np.testing.assert_allclose(np.ptp(points, axis=0), size, rtol=1e-6)
    np.testing.assert_array_equal(page.pose(0, 0), place(1, 2, 3))


def test_bodies_appear_and_vanish(recording):
    mesh = ab.DeformableMesh(*ball())
    recording.add(ab.Sphere(1), name="early")
    recording.frame()
    assert recording.add(mesh, name="late") == 1
    recording.frame()
    recording.remove(0)
    for gone in (lambda: recording.remove(0), lambda: recording.place(0, None),
                 lambda: recording.remove(2),
                 lambda: recording.frame(patches={0: ([0], [0])})):
        with pytest.raises(ValueError):
            gone()
    recording.frame()
    page = Page(recording.html())
    assert [len(frame["bodies"]) for frame in page.run["frames"]] == [1, 2, 2]
    assert page.frame(2)["bodies"][0] is None
    check_points(page.positions(2, 1), mesh.vertices)
    assert recording.num_bodies == 2


def test_a_scene_is_followed(recording):
    vertices, faces = sheet()
    cloth = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    of_cloth, of_ball = scene.add(cloth), scene.add(ab.Sphere(0.5), place(0, 0, 3))
    recording.follow(scene, lambda body: f"number {body}")
    assert (recording.body_of(of_cloth), recording.body_of(of_ball)) == (0, 1)
    recording.frame()
    moved = wave(vertices, 1)
    cloth.update(moved)
    scene.set_transform(of_ball, place(-2, 0, 3))
    of_box = scene.add(ab.Box(1, 2, 3))
    assert recording.body_of(of_box) == 2  # before a frame has it
    recording.frame(vertex_distances={recording.body_of(of_cloth): np.arange(len(vertices))})
    scene.remove(of_ball)
    recording.frame()
    page = Page(recording.html())
    assert [body["name"] for body in page.run["bodies"]] == [
        f"number {body}" for body in (of_cloth, of_ball, of_box)]
    check_points(page.positions(0, 0), vertices)
    check_points(page.positions(2, 0), cloth.vertices)
    np.testing.assert_array_equal(page.pose(0, 1), place(0, 0, 3))
    np.testing.assert_array_equal(page.pose(1, 1), place(-2, 0, 3))
    assert page.frame(2)["bodies"][1] is None and page.frame(2)["bodies"][2] is not None
    assert page.frame(1)["bodies"][0]["vertexDistances"]["high"] == len(vertices) - 1


def test_errors_of_following(recording):
    scene = ab.Scene()
    body = scene.add(ab.Sphere(1))
    for wrong in (None, "scene", recording):
        with pytest.raises(TypeError):
            recording.follow(wrong)
    with pytest.raises(TypeError):
        recording.follow(scene, "name")
    with pytest.raises(ValueError):
        recording.body_of(body)  # nothing is followed yet

    def fails(body):
        raise KeyError(body)

    for error, name in ((KeyError, fails), (TypeError, lambda body: body),
                        (RuntimeError, lambda body: str(len(scene))),
                        (RuntimeError, lambda body: str(recording.num_bodies))):
        with pytest.raises(error):
            recording.follow(scene, name)
        assert recording.num_bodies == 0
    recording.follow(scene)
    with pytest.raises(RuntimeError, match="already"):
        recording.follow(ab.Scene())
    with pytest.raises(ValueError):
        recording.body_of(body + 1)
    with pytest.raises(ValueError, match="followed scene"):
        recording.remove(0)
    recording.frame()
    assert Page(recording.html()).run["bodies"][0]["name"] == f"body {body}"


def test_a_name_that_fails_later_leaves_the_recording_as_it_was(recording):
    scene, names = ab.Scene(), {}
    names[scene.add(ab.Sphere(1))] = "first"
    recording.follow(scene, lambda body: names[body])
    recording.frame()
    late = scene.add(ab.Box(1, 1, 1))
    for call in (recording.frame, lambda: recording.body_of(late)):
        with pytest.raises(KeyError):
            call()
    assert (recording.num_frames, recording.num_bodies) == (1, 1)
    names[late] = "late"
    recording.frame()
    assert [body["name"] for body in Page(recording.html()).run["bodies"]] == ["first", "late"]


def test_it_keeps_the_scene_and_is_collected_with_it(recording):
    scene = ab.Scene()
    scene.add(ab.DeformableMesh(*sheet()))
    recording.follow(scene)
    del scene
    gc.collect()
    recording.frame()
    assert Page(recording.html()).run["bodies"][0]["triangles"] == 32

    class Owner:
        """Refers to a recording that refers to it, twice."""

        def __init__(self):
            self.scene, self.recording = ab.Scene(), ab.Recording()
            self.scene.add(ab.Sphere(1))
            self.scene.set_filter(self.counts)
            self.recording.follow(self.scene, self.name)

        def name(self, body):
            return f"of {self.__class__.__name__}"

        def counts(self, first, second):
            return self.recording is not None

    owner = weakref.ref(Owner())
    gc.collect()
    assert owner() is None


def test_threads_take_turns(recording):
    vertices, faces = sheet(8)
    mesh = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    scene.add(mesh)
    scene.add(ab.Sphere(0.3), place(0, 0, 2))
    recording.follow(scene, lambda body: str(body))
    recording.add(mesh, place(5, 0, 0), name="once more")
    errors = []

    def run(work):
        try:
            for step in range(30):
                work(step)
        except Exception as error:  # noqa: BLE001
            errors.append(error)

    threads = [threading.Thread(target=run, args=(work,)) for work in (
        lambda step: recording.frame(note=str(step)), lambda step: recording.frame(),
        lambda step: mesh.update(wave(vertices, step)),
        lambda step: scene.add(ab.Box(1, 1, 1)), lambda step: recording.html())]
    recording.frame()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert recording.num_frames == 61 and len(Page(recording.html()).run["frames"]) == 61
