"""adaptive_bvh.ipctk.BroadPhase in ipc-toolkit, beside its own broad phases."""

import numpy as np
import pytest

ipctk = pytest.importorskip("ipctk")
trimesh = pytest.importorskip("trimesh")

from adaptive_bvh.ipctk import BroadPhase  # noqa: E402

THEIRS = ["LBVH", "HashGrid", "SweepAndPrune"]
MESHES = ["cube", "two-cubes-close", "two-cubes-intersecting", "bunny", "thick-cloth/t0"]


def cloth(seed, bend):
    """A rolled sheet, vertices moved at random: many layers are near each other."""
    n = 24
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    at = (np.arange(n)[:, None] * (n + 1) + np.arange(n)[None, :]).reshape(-1)
    faces = np.concatenate(
        [np.stack([at, at + n + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + 1], 1)]
    )
    turn, radius = bend * u, 0.1 + 0.03 * u
    vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.5 * v], -1).reshape(-1, 3)
    return vertices + np.random.default_rng(seed).normal(0, 5e-4, vertices.shape), faces


def made(vertices, faces, can_collide=None):
    v, f = np.asfortranarray(vertices), np.asfortranarray(faces, dtype=np.int32)
    mesh = ipctk.CollisionMesh(v, ipctk.edges(f), f)
    if can_collide is not None:
        mesh.can_collide = can_collide
    return mesh, v


def collisions(mesh, vertices, dhat, broad_phase):
    """The pairs that the narrow phase keeps, as texts."""
    found = ipctk.NormalCollisions()
    found.build(mesh, vertices, dhat, 0.0, broad_phase)
    kinds = (found.vv_collisions, found.ev_collisions, found.ee_collisions, found.fv_collisions)
    return sorted(
        str(sorted(c.vertex_ids(mesh.edges, mesh.faces))) for kind in kinds for c in kind
    )


def all_agree(mesh, vertices, dhat):
    """Twice by the same object: it refits the second time."""
    broad_phase = BroadPhase()
    for moved in (vertices, vertices + 0.1 * dhat):
        expected = collisions(mesh, moved, dhat, ipctk.LBVH())
        assert collisions(mesh, moved, dhat, broad_phase) == expected
    for name in THEIRS:
        assert collisions(mesh, vertices, dhat, getattr(ipctk, name)()) == collisions(
            mesh, vertices, dhat, BroadPhase()
        )
    return expected


def near(mesh, vertices, rows, dhat):
    """Of candidates those that are at most dhat apart."""
    kept = set()
    for candidate in rows:
        ids = candidate.vertex_ids(mesh.edges, mesh.faces)
        if candidate.compute_distance(np.concatenate([vertices[i] for i in ids])) <= dhat**2:
            kept.add(str(candidate))
    return kept


@pytest.mark.parametrize("seed", range(3))
def test_candidates_include_all_near_pairs_of_theirs(seed):
    vertices, faces = cloth(seed, 18.0)
    mesh, vertices = made(vertices, faces)
    dhat = 0.004
    ours, theirs = ipctk.Candidates(), ipctk.Candidates()
    ours.build(mesh, vertices, dhat / 2, BroadPhase())
    theirs.build(mesh, vertices, dhat / 2, ipctk.LBVH())
    for kind in ("ee_candidates", "fv_candidates"):
        expected = near(mesh, vertices, getattr(theirs, kind), dhat)
        assert len(expected) > 100
        found = {str(c) for c in getattr(ours, kind)}
        swapped = {f"[{b}, {a}]" for a, b in (c.strip("[]").split(", ") for c in found)}
        assert expected <= (found | swapped if kind == "ee_candidates" else found)
        assert len(getattr(ours, kind)) <= len(getattr(theirs, kind))
    assert len(all_agree(mesh, vertices, dhat)) > 100


@pytest.mark.parametrize("name", MESHES)
def test_their_own_meshes(ipctk_data, name):
    loaded = trimesh.load(ipctk_data / f"{name}.ply", process=False)
    mesh, vertices = made(loaded.vertices, loaded.faces)
    scale = np.ptp(vertices, axis=0).max()
    for share in (1e-3, 1e-2):
        all_agree(mesh, vertices, share * scale)
    assert ipctk.has_intersections(mesh, vertices, BroadPhase()) == ipctk.has_intersections(
        mesh, vertices, ipctk.LBVH()
    )


@pytest.mark.parametrize("names", [("two-cubes-far", "two-cubes-intersecting"),
                                   ("two-cubes-far", "two-cubes-close"),
                                   ("thick-cloth/t0", "thick-cloth/t1"),
                                   ("cloth_ball92", "cloth_ball93")])
def test_steps_of_their_own_meshes(ipctk_data, names):
    begin, end = (trimesh.load(ipctk_data / f"{name}.ply", process=False) for name in names)
    mesh, v0 = made(begin.vertices, begin.faces)
    v1 = np.asfortranarray(end.vertices)
    assert_same_step(mesh, v0, v1)


def assert_same_step(mesh, v0, v1):
    arguments = (mesh, v0, v1, 0.0)
    expected = ipctk.compute_collision_free_stepsize(*arguments, ipctk.LBVH())
    found = ipctk.compute_collision_free_stepsize(*arguments, BroadPhase())
    assert found == pytest.approx(expected, abs=1e-5)
    return found


def test_a_step_of_a_cloth():
    vertices, faces = cloth(0, 18.0)
    mesh, v0 = made(vertices, faces)
    v1 = np.asfortranarray(cloth(1, 20.0)[0])
    assert 0 < assert_same_step(mesh, v0, v1) < 1


def test_intersections():
    vertices, faces = cloth(0, 18.0)
    mesh, apart = made(vertices, faces)
    assert not ipctk.has_intersections(mesh, apart, BroadPhase())
    crossed = apart.copy(order="F")
    crossed[:60] *= 1.4
    assert ipctk.has_intersections(mesh, crossed, BroadPhase())


def test_pairs_that_may_not_collide():
    vertices, faces = cloth(0, 18.0)
    patches = (np.arange(len(vertices)) % 25 // 12).astype(np.int32)  # strips around the roll
    mesh, vertices = made(vertices, faces, ipctk.make_vertex_patches_filter(patches))
    everything = collisions(made(vertices, faces)[0], vertices, 0.004, ipctk.LBVH())
    assert 0 < len(all_agree(mesh, vertices, 0.004)) < len(everything)


def test_what_is_no_surface_goes_to_lbvh():
    vertices, faces = cloth(0, 18.0)
    loose = np.concatenate([vertices, vertices[:5] + 1e-3])  # five vertices without a face
    f = np.asfortranarray(faces, dtype=np.int32)
    v = np.asfortranarray(loose)
    mesh = ipctk.CollisionMesh(v, ipctk.edges(f), f)
    assert len(all_agree(mesh, v, 0.004)) > 0
    # Two dimensions: a zigzag of edges.
    flat = np.asfortranarray([[i, 0.01 * (i % 2)] for i in range(10)], dtype=float)
    edges = np.asfortranarray([[i, i + 1] for i in range(9)], dtype=np.int32)
    mesh = ipctk.CollisionMesh(flat, edges)
    all_agree(mesh, flat, 0.02)
