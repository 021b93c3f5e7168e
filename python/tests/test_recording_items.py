"""What a frame shows beside its bodies: the page holds what Python passed, and refuses the rest."""

import numpy as np
import pytest
from meshes import ball, place, sheet
from recorded_page import Page, check_points
from test_arrays_of_others import Tensor

import adaptive_bvh as ab


@pytest.fixture
def recording():
    try:
        return ab.Recording(title="items", unit="m")
    except RuntimeError as missing:
        pytest.skip(str(missing))


@pytest.fixture
def balls(recording):
    """Two welded balls that overlap, as bodies 0 and 1, and the second's pose."""
    first, second = (ab.DeformableMesh(*ball(3)) for _ in range(2))
    aside = place(1.5, 0.1, 0.2)
    assert recording.add(first, name="first") == 0
    assert recording.add(second, aside, name="second") == 1
    return recording, first, second, aside


def contact_forces(contacts, distance, stiffness=7.0):
    size = stiffness * (distance - contacts.distances) * contacts.areas
    return -size[:, None] * contacts.normals


def test_arrows_are_those_of_the_contacts(balls):
    recording, first, second, aside = balls
    contacts = ab.vertex_contacts(first, second, 0.05, tf2=aside)
    forces = contact_forces(contacts, 0.05)
    assert len(contacts) > 10
    recording.frame(arrows={"contact force, N": (contacts.positions, forces),
                            "normal": (contacts.positions, contacts.normals, 0.25)})
    recording.frame()
    page = Page(recording.html())
    force, normal = page.frame(0)["arrows"]
    assert (force["label"], force["scale"]) == ("contact force, N", 0)
    assert (normal["label"], normal["scale"]) == ("normal", 0.25)
    for arrows, vectors in ((force, forces), (normal, contacts.normals)):
        check_points(page.points(arrows["blocks"][0]), contacts.positions)
        check_points(page.points(arrows["blocks"][1]), vectors)
    assert "arrows" not in page.frame(1)


def test_segments_join_nearest_points_of_features(balls):
    recording, first, second, aside = balls
    apart = place(2.05, 0, 0)
    pairs = ab.feature_pairs_within(first, second, 0.2, tf2=apart)
    found = ab.feature_pair_details(first, second, pairs, tf2=apart).vertex_face
    assert len(found) > 3
    other = np.array([[[0, 1, 2], [3, 4, 5]]])  # integers are numbers
    recording.frame(segments={"pair": found.nearest_points, "other": other},
                    nearest_points=found.nearest_points[:2])
    page = Page(recording.html())
    assert [segments["label"] for segments in page.frame(0)["segments"]] == ["pair", "other"]
    for segments, expected in zip(page.frame(0)["segments"], (found.nearest_points, other)):
        for end in range(2):
            check_points(page.points(segments["blocks"][end]), expected[:, end])
    np.testing.assert_array_equal(page.frame(0)["nearest"],
                                  found.nearest_points[:2].reshape(2, 6))


def test_patches_are_those_of_the_regions(balls):
    recording, first, second, aside = balls
    regions, tracker = ab.contact_regions(first, second, tf2=aside), ab.ContactTracker()
    tracker.track(regions)
    assert len(regions) == 1
    recording.frame(patches={0: regions.first, 1: (regions.second, tracker.ids + 40)})
    recording.frame(patches={1: ([5, 2, 5], np.array([7, 8, 9], np.uint16))})
    recording.frame(patches={0: ab.contact_regions(first, second, tf2=place(9, 0, 0)).first})
    page = Page(recording.html())
    triangles = regions.first.triangles.tolist()
    assert page.patches(0, 0) == [triangles, [0] * len(triangles)]
    triangles = regions.second.triangles.tolist()
    assert page.patches(0, 1) == [triangles, [41] * len(triangles)]
    assert page.patches(1, 1) == [[5, 2, 5], [7, 8, 9]]
    assert "patches" not in page.frame(1)["bodies"][0]
    assert page.patches(2, 0) == [[], []]


def test_results_of_several_pairs_and_of_scenes(recording):
    vertices, faces = sheet()
    mesh = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    body, touching = scene.add(mesh), scene.add(ab.Sphere(0.5), place(0, 0, 0.3))
    far = scene.add(ab.Sphere(0.5), place(0, 0, 2))
    scene.update()
    recording.follow(scene)
    near = ab.distance(mesh, ab.Sphere(0.5), tf2=place(0, 0, 2))
    gap = scene.nearest(far)
    touches = scene.collide()
    more = ab.collide(mesh, ab.Sphere(0.5), tf2=place(0.5, 0, 0.2))
    assert len(touches) == 1 and len(more) > 0
    recording.frame([near, gap, 7.0], [touches, more, [[1, 2, 3.0]]], note="all & <more>",
                    update_ms=1e3 * mesh.last_update.seconds, query_ms=0)
    recording.frame(0.125, np.zeros((2, 3)))
    alone = ab.Scene()
    alone.add(mesh)
    alone.update()
    recording.frame(alone.distance(), ab.collide(mesh, ab.Sphere(0.5), enable_contact=False))
    page = Page(recording.html())
    first = page.frame(0)
    assert first["distance"] == min(near.distance, gap.distance)
    np.testing.assert_array_equal(first["nearest"], np.reshape([near.points, gap.points], (2, 6)))
    points = np.concatenate([touches.contacts.points, more.points, [[1, 2, 3]]])
    assert first["contactCount"] == len(points)
    check_points(page.points(first["contacts"]), points)
    assert first["note"] == "all & <more>"
    assert (first["updateMs"], first["queryMs"]) == (1e3 * mesh.last_update.seconds, 0)
    assert (page.frame(1)["distance"], page.frame(1)["contactCount"]) == (0.125, 2)
    last = page.frame(2)  # no pair; contacts without points
    assert "distance" not in last and "nearest" not in last and "contacts" not in last
    assert last["contactCount"] > 0
    assert recording.body_of(touching) == 1 and recording.body_of(body) == 0


def test_arrays_of_other_libraries(balls):
    recording = balls[0]
    rows = np.arange(6.0).reshape(2, 3)
    recording.frame(contacts=Tensor(rows), arrows={"a": (Tensor(rows), Tensor(-rows))},
                    segments={"s": Tensor(rows.reshape(1, 2, 3))},
                    patches={1: (Tensor(np.array([3, 4])), Tensor(np.array([0, 1])))},
                    vertex_distances={np.int64(0): Tensor(np.arange(float(balls[1].num_vertices)))})
    page = Page(recording.html())
    check_points(page.points(page.frame(0)["arrows"][0]["blocks"][1]), -rows)
    assert page.patches(0, 1) == [[3, 4], [0, 1]]
    assert page.frame(0)["bodies"][0]["vertexDistances"]["high"] == balls[1].num_vertices - 1
    with pytest.raises(TypeError, match="CUDA"):
        recording.frame(contacts=Tensor(rows, device=(2, 0)))
    assert recording.num_frames == 1


REFUSED = [
    (ValueError, dict(arrows={"f": (np.full((1, 3), np.nan), np.zeros((1, 3)))})),
    (ValueError, dict(arrows={"f": (np.zeros((1, 3)), np.full((1, 3), np.inf))})),
    (ValueError, dict(arrows={"f": (np.zeros((2, 3)), np.zeros((1, 3)))})),
    (ValueError, dict(arrows={"f": (np.zeros((2, 2)), np.zeros((2, 2)))})),
    (ValueError, dict(arrows={"f": (np.zeros((1, 3)), np.zeros((1, 3)), -1)})),
    (ValueError, dict(arrows={"f": (np.zeros((1, 3)), np.zeros((1, 3)), np.nan)})),
    (ValueError, dict(arrows={"f": (np.zeros((1, 3)),)})),
    (TypeError, dict(arrows={"f": np.zeros((1, 3))})),
    (TypeError, dict(arrows={3: (np.zeros((1, 3)), np.zeros((1, 3)))})),
    (TypeError, dict(arrows=[("f", (np.zeros((1, 3)), np.zeros((1, 3))))])),
    (TypeError, dict(arrows={"f": ([["x", "y", "z"]], np.zeros((1, 3)))})),
    (ValueError, dict(segments={"s": np.full((1, 2, 3), np.nan)})),
    (ValueError, dict(segments={"s": np.zeros((2, 3))})),
    (ValueError, dict(nearest_points=np.full((1, 2, 3), np.nan))),
    (ValueError, dict(nearest_points=np.zeros((1, 3, 2)))),
    (ValueError, dict(contacts=np.full((1, 3), np.nan))),
    (ValueError, dict(contacts=np.zeros((1, 4)))),
    (TypeError, dict(contacts="many")),
    (ValueError, dict(distance=np.nan)),
    (TypeError, dict(distance="far")),
    (TypeError, dict(distance=[1.0, None])),
    (ValueError, dict(update_ms=np.nan)),
    (ValueError, dict(query_ms=np.inf)),
    (ValueError, dict(vertex_distances={0: np.full(258, np.nan)})),
    (ValueError, dict(vertex_distances={0: np.zeros(257)})),
    (IndexError, dict(vertex_distances={-1: np.zeros(258)})),
    (ValueError, dict(patches={0: ([512], [0])})),
    (IndexError, dict(patches={0: ([-1], [0])})),
    (IndexError, dict(patches={0: ([1], [-1])})),
    (ValueError, dict(patches={0: ([1, 2], [0])})),
    (ValueError, dict(patches={7: ([1], [0])})),
    (IndexError, dict(patches={2**40: ([1], [0])})),
    (TypeError, dict(patches={"first": ([1], [0])})),
    (TypeError, dict(patches={0: ([1.5], [0])})),
    (TypeError, dict(patches={0: np.zeros(3, int)})),
    (ValueError, dict(patches={0: ([[1]], [0])})),
    (TypeError, dict(note=7)),
]


@pytest.mark.parametrize("error, wrong", REFUSED)
def test_what_is_refused_changes_nothing(balls, error, wrong):
    recording = balls[0]
    assert (balls[1].num_vertices, balls[1].num_faces) == (258, 512)
    good = dict(arrows={"good": (np.zeros((1, 3)), np.ones((1, 3)))}, note="good")
    recording.frame(**good)
    before = recording.html()
    with pytest.raises(error):
        recording.frame(**{**good, **wrong})
    assert recording.num_frames == 1 and recording.html() == before
    recording.frame(**good)  # nothing is left over
    assert [frame["note"] for frame in Page(recording.html()).run["frames"]] == ["good", "good"]


def test_results_that_were_written_to_are_refused(balls):
    recording, first, second, aside = balls
    regions = ab.contact_regions(first, second, tf2=aside)
    with pytest.raises(ValueError, match="2 ids for 1 regions"):
        recording.frame(patches={0: (regions.first, [1, 2])})
    for begins in ([0, 10**9], [5, 1], [-1, 3]):
        regions.first.begins[:] = begins
        with pytest.raises(ValueError, match="begins"):
            recording.frame(patches={0: regions.first})
    with pytest.raises(TypeError):
        recording.frame(patches={0: ab.ContactPatches.__new__(ab.ContactPatches)})
    with pytest.raises(TypeError):
        recording.frame(ab.SceneDistance.__new__(ab.SceneDistance))
    assert recording.num_frames == 0


def test_series_times_and_the_range_of_colours(balls):
    recording = ab.Recording(unit="m", time_unit="ms", vertex_distance_range=(0, 0.25))
    recording.add(balls[1], name="ball")
    recording.frame(series={"energy, J": 2.5, "contacts": 3}, time=0.125)
    recording.frame(time=0.25)
    page = Page(recording.html())
    assert page.run["timeUnit"] == "ms" and page.run["vertexDistanceRange"] == [0, 0.25]
    assert page.frame(0)["series"] == {"energy, J": 2.5, "contacts": 3}
    assert [page.frame(f)["time"] for f in (0, 1)] == [0.125, 0.25]
    assert "series" not in page.frame(1)
    with pytest.raises(ValueError, match="energy"):
        recording.frame(series={"energy": np.nan})
    with pytest.raises(TypeError):
        recording.frame(series={"energy": "2"})
    with pytest.raises(TypeError):
        recording.frame(series={3: 2.0})
    with pytest.raises(ValueError, match="vertex_distance_range"):
        ab.Recording(vertex_distance_range=(0, 1, 2))
    assert recording.num_frames == 2
