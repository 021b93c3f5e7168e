"""repr: every result shows its values."""

import numpy as np
import pytest
from meshes import ball, place, sheet

import adaptive_bvh as ab


def everything():
    """An object of every class that is not built by its name and arguments."""
    vertices, faces = ball(1)
    a, b = ab.DeformableMesh(vertices, faces), ab.DeformableMesh(vertices, faces)
    tf = place(0, 0.1, 1.9)
    scene = ab.Scene()
    first, second = scene.add(a), scene.add(b, tf)
    scene.begin_step()
    scene.update()
    features = ab.feature_pairs_within(a, b, 0.1, tf2=tf)
    details = ab.feature_pair_details(a, b, features, tf2=tf)
    derivatives = ab.distance_derivatives(a, b, features, details, tf2=tf)
    regions = ab.contact_regions(a, b, tf2=tf)
    near = ab.ContactSet(a, b, 0.1)
    near.update(None, tf)
    motion = [ab.Motion(m, m.vertices, m.vertices + s) for m, s in ((a, 0), (b, 5))]
    region = ab.TrustRegion(a, 1.0)
    region.begin(vertices)
    yield from (
        a.update(vertices),
        ab.weld_vertices(vertices, faces),
        ab.distance(a, b, tf2=tf),
        ab.collide(a, b, tf2=tf),
        ab.pairs_within(a, b, 0.1, tf2=tf),
        features,
        details,
        details.vertex_face,
        derivatives,
        derivatives.vertex_face,
        derivatives.vertex_face.first,
        ab.closest_point(a, [0, 0, 3]),
        ab.closest_points(a, [[0, 0, 3]]),
        ab.closest_features(a, [[0, 0, 3]]),
        ab.first_hit(a, [0, 0, 3], [0, 0.1, -1]),
        ab.vertex_contacts(a, b, 0.1, tf2=tf),
        ab.signed_distance(a, b, 0.01, tf2=tf),
        regions,
        regions.first,
        ab.earliest_impact(*motion),
        ab.times_of_impact(*motion, features),
        region.truncate(vertices)[1],
        near.triangles,
        near.compact(),
        ab.least_distance(*motion, 0.01),
        scene.least_distance(first, 0.01),
        scene.collide(),
        scene.pairs_within(0.1),
        scene.feature_pairs_within(0.1),
        scene.vertex_contacts(0.1),
        scene.nearest(first),
        scene.nearest_point([0, 0, 3]),
        scene.first_hit([0, 0, 3], [0, 0.1, -1]),
        scene.earliest_impact(),
        scene.options(second),
    )


def test_every_result_shows_its_values():
    seen = set()
    for result in everything():
        name = type(result).__name__
        text = repr(result)
        seen.add(name)
        assert text.startswith(name + "(") and text.endswith(")") and "\n" not in text, text
        assert len(text) < 4000
        for member, value in vars(type(result)).items():
            if isinstance(value, property) and member not in ("exists", "meets"):
                assert member + "=" in text, (name, member)
    others = {"Box", "Sphere", "Ellipsoid", "Capsule", "Cylinder", "Cone", "Plane", "Halfspace",
              "Convex",
              "Shape", "DeformableMesh", "Scene", "Motion", "Recording", "MeshLoadError",
              "CoherentDistance", "CoherentProximity", "ContactSet", "ContactTracker", "TrustRegion",
              "SurfaceNeighbourhood", "Ignored"}
    classes = {n for n in ab.__all__ if isinstance(getattr(ab, n), type)}
    assert seen == classes - others


def test_numbers_are_those_of_the_result():
    mesh = ab.DeformableMesh(*sheet(1))
    hits = ab.first_hit(mesh, [[0.5, 0.25, 2], [9, 9, 9]], [[0, 0, -1], [0, 0, -1]])
    assert repr(hits) == (
        "RayHits(rays=[0, 1], triangles=[0, -1], t=[2, inf], u=[0.125, 0], v=[0.625, 0])"
    )
    assert repr(ab.closest_point(mesh, [0.5, 0.25, 2])) == (
        "ClosestPoint(point=[0.5, 0.25, 0], distance=2.0, triangle=0)"
    )


def test_long_arrays_are_abbreviated():
    mesh = ab.DeformableMesh(*sheet(8))
    near = ab.self_pairs_within(mesh, 0.5)
    text = repr(near)
    first, last = near.triangles[[0, -1]]
    assert text.startswith("TrianglePairs(triangles=[[") and f"{first[1]}], [" in text
    assert "..., [" in text and f"{last[1]}]] of shape ({len(near)}, 2)" in text
    assert "distances=[]" in text and len(text) < 200
    points = ab.closest_points(mesh, np.zeros((4, 3)))
    assert " of shape" not in repr(points)  # 12 numbers are shown


def test_shapes_and_meshes():
    assert repr(ab.Box(1, 2, 3)) == "Box(1.0, 2.0, 3.0)"
    assert repr(ab.Plane([0, 0, 1], 2)) == "Plane((0.0, 0.0, 1.0), 2.0)"
    assert "25 vertices, 32 faces" in repr(ab.DeformableMesh(*sheet(4)))
    with pytest.raises(TypeError):
        repr(ab.RayHits.__new__(ab.RayHits))
