"""Files and pickles of a built mesh; worker processes."""

import copy
import multiprocessing
import os
import pathlib
import pickle
import signal

import numpy as np
import pytest
from brute_force import surface_distances, triangle_distances
from meshes import ball, sheet, wave

import adaptive_bvh as ab


@pytest.fixture
def moved():
    vertices, faces = sheet(8)
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.update_two_frames(wave(vertices, 1))
    return mesh


def expect_same(mesh, other):
    assert other.validate()
    for name in ("vertices", "previous_vertices", "faces"):
        np.testing.assert_array_equal(getattr(other, name), getattr(mesh, name))
    points = np.random.default_rng(1).normal(size=(50, 3))
    a, b = ab.closest_points(mesh, points), ab.closest_points(other, points)
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.triangles, b.triangles)
    np.testing.assert_array_equal(
        ab.self_pairs_within(mesh, 0.3).triangles, ab.self_pairs_within(other, 0.3).triangles
    )


@pytest.mark.parametrize("make_path", [str, os.fsencode, pathlib.Path])
def test_a_file_holds_the_mesh(moved, tmp_path, make_path):
    path = make_path(str(tmp_path / "mesh.bin"))
    moved.save(path)
    other = ab.DeformableMesh.load(path)
    expect_same(moved, other)
    next_step = wave(moved.vertices, 0.2)
    for mesh in (moved, other):
        mesh.update(next_step)
    expect_same(moved, other)


@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_a_pickle_holds_the_mesh(moved, protocol):
    other = pickle.loads(pickle.dumps(moved, protocol))
    expect_same(moved, other)
    before = moved.vertices
    other.update(other.vertices + 1)
    np.testing.assert_array_equal(moved.vertices, before)
    twice = pickle.loads(pickle.dumps([moved, moved], protocol))
    assert twice[0] is twice[1]
    expect_same(moved, copy.deepcopy({"mesh": moved})["mesh"])


@pytest.mark.parametrize("begin", [b"ABVHMSHf", b"float32\nABVHMSHd"])
def test_meshes_in_single_precision_are_refused(moved, tmp_path, begin):
    """Of versions before 0.3: numbers of float32, or a mark before numbers of float64."""
    path = tmp_path / "mesh.bin"
    moved.save(path)
    data = path.read_bytes()
    assert data.startswith(b"ABVHMSHd")
    for saved in (begin + data[8:], begin):
        path.write_bytes(saved)
        for load in (
            lambda: ab.DeformableMesh.load(path),
            lambda: ab.DeformableMesh.__new__(ab.DeformableMesh).__setstate__(saved),
        ):
            with pytest.raises(ValueError, match="saved in single precision.*0.3.*save it anew"):
                load()


def distance_in_worker(mesh, z):
    mesh.update(wave(mesh.vertices, z))
    return ab.distance(mesh, ab.Sphere(0.5), tf2=(np.eye(3), [0, 0, z])).distance


def test_worker_processes_need_no_build():
    vertices, faces = ball(2)
    mesh = ab.DeformableMesh(vertices, faces)
    heights = [2.0, 3.0, 4.0]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.starmap(distance_in_worker, [(mesh, z) for z in heights])
    for z, distance in zip(heights, found):
        gaps = surface_distances(np.array([[0, 0, z]]), wave(vertices, z), faces)
        assert distance == pytest.approx(gaps.min() - 0.5, abs=1e-9)


def test_a_loaded_mesh_answers_as_brute_force(moved, tolerance, tmp_path):
    moved.save(tmp_path / "mesh.bin")
    mesh = ab.DeformableMesh.load(tmp_path / "mesh.bin")
    tool, tool_faces = ball(1, 0.4)
    for step in range(3):
        mesh.update(wave(mesh.vertices, step))
        other = ab.DeformableMesh(tool + [0, 0, 0.6], tool_faces)
        gaps = triangle_distances(mesh.vertices, mesh.faces, tool + [0, 0, 0.6], tool_faces)
        assert max(ab.distance(mesh, other).distance, 0) == pytest.approx(
            gaps.min(), abs=10 * tolerance
        )


def test_damaged_files_are_refused(moved, tmp_path):
    path = tmp_path / "mesh.bin"
    moved.save(path)
    data = path.read_bytes()
    rng = np.random.default_rng(2)
    for _ in range(300):
        changed = bytearray(data)
        changed[rng.integers(len(data))] ^= 1 << rng.integers(8)
        path.write_bytes(changed)
        with pytest.raises(ValueError, match="DeformableMesh::load"):
            ab.DeformableMesh.load(path)
    for size in [0, 3, 8, 100, *rng.integers(len(data), size=20)]:
        path.write_bytes(data[:size])
        with pytest.raises(ValueError, match="end too early"):
            ab.DeformableMesh.load(path)
    path.write_bytes(b"solid of an STL file, which is no saved mesh")
    with pytest.raises(ValueError, match="not those of a saved mesh"):
        ab.DeformableMesh.load(path)
    for state in (b"", data[:-1], b"x" * len(data)):
        with pytest.raises(ValueError, match="DeformableMesh::load"):
            ab.DeformableMesh.__new__(ab.DeformableMesh).__setstate__(state)


def test_files_that_cannot_be_used(moved, tmp_path):
    with pytest.raises(FileNotFoundError, match="missing"):
        ab.DeformableMesh.load(tmp_path / "missing")
    with pytest.raises(FileNotFoundError, match="missing"):
        moved.save(tmp_path / "missing" / "mesh.bin")
    with pytest.raises(ValueError, match="end too early"):
        ab.DeformableMesh.load(tmp_path)  # a folder
    with pytest.raises(TypeError):
        moved.save(3)
    if os.path.exists("/dev/full"):
        with pytest.raises(OSError):
            moved.save("/dev/full")


def test_a_full_disk_leaves_the_old_file(moved, tmp_path):
    resource = pytest.importorskip("resource")
    path = tmp_path / "mesh.bin"
    path.write_bytes(b"the mesh before")
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))  # writing fails as on a full disk
    try:
        for name in ("mesh.bin", "new.bin"):
            with pytest.raises(OSError, match=name):
                moved.save(tmp_path / name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_bytes() == b"the mesh before" and os.listdir(tmp_path) == ["mesh.bin"]
    name = os.fsencode(tmp_path) + b"/\xe9.bin"
    moved.save(name)
    assert ab.DeformableMesh.load(name).num_faces == moved.num_faces
