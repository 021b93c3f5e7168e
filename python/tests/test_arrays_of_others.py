"""Arrays that are not NumPy's: read in place by DLPack, NumPy's interface or the buffer protocol."""

import tracemalloc

import numpy as np
import pytest
from meshes import ball, wave

import adaptive_bvh as ab


class Tensor:
    """Has DLPack only, as a tensor of another library."""

    def __init__(self, array, device=(1, 0)):
        self.array, self.device, self.calls = array, device, 0

    def __dlpack__(self, stream=None):
        self.calls += 1
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.device


class Interface:
    """Has NumPy's interface, and DLPack that must not be needed, as an array of Warp."""

    def __init__(self, array):
        self.array = array

    @property
    def __array_interface__(self):
        return self.array.__array_interface__

    def __dlpack_device__(self):
        return (1, 0)

    def __dlpack__(self, stream=None):
        raise AssertionError("NumPy's interface was there")


def test_all_arguments_may_be_tensors(number):
    vertices, faces = ball(1)
    vertices = vertices.astype(number)
    moved = wave(vertices, 1).astype(number)
    mesh = ab.DeformableMesh(Tensor(vertices), Tensor(faces))
    np.testing.assert_array_equal(mesh.faces, faces)
    tensor = Tensor(moved)
    mesh.update(tensor)
    np.testing.assert_array_equal(mesh.vertices, moved)
    assert tensor.calls == 1
    mesh.update(Tensor(np.asfortranarray(vertices)))
    np.testing.assert_array_equal(mesh.vertices, vertices)
    mesh.update(Tensor(np.array([1, 2])), Tensor(moved[[1, 2]]))
    np.testing.assert_array_equal(mesh.vertices[[1, 2]], moved[[1, 2]])
    mesh.update_two_frames(Interface(moved))
    np.testing.assert_array_equal(mesh.vertices, moved)
    mesh.update(memoryview(vertices))
    np.testing.assert_array_equal(mesh.vertices, vertices)
    tf = np.eye(4)
    tf[2, 3] = 5
    expected = ab.distance(mesh, mesh, tf2=tf).distance
    assert ab.distance(mesh, mesh, tf2=Tensor(tf)).distance == expected
    pair = (Tensor(tf[:3, :3].copy()), Tensor(tf[:3, 3].copy()))
    assert ab.distance(mesh, mesh, tf2=pair).distance == expected
    points = np.random.default_rng(1).normal(size=(9, 3))
    np.testing.assert_array_equal(
        ab.closest_points(mesh, Tensor(points)).points, ab.closest_points(mesh, points).points
    )
    np.testing.assert_array_equal(
        ab.first_hit(mesh, Tensor(points), Tensor(-points)).t, ab.first_hit(mesh, points, -points).t
    )


@pytest.mark.parametrize("wrap", [Tensor, Interface, memoryview])
def test_nothing_is_copied(number, wrap):
    vertices, faces = ball(5)  # 4,098 vertices
    mesh = ab.DeformableMesh(vertices, faces)
    moved = wave(vertices, 1).astype(number)
    array = wrap(moved)
    mesh.update(array)
    tracemalloc.start()
    mesh.update(array)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < moved.nbytes / 10  # NumPy's arrays are traced
    moved += 1
    mesh.update(array)
    np.testing.assert_array_equal(mesh.vertices, moved)


@pytest.mark.parametrize("device, name", [(2, "CUDA"), (10, "ROCm"), (8, "Metal"), (77, "unknown")])
def test_arrays_on_a_device_are_refused(device, name):
    vertices, faces = ball(1)
    mesh = ab.DeformableMesh(vertices, faces)
    tensor = Tensor(vertices + 1, (device, 0))
    for call in (
        lambda: mesh.update(tensor),
        lambda: mesh.update([0] * len(vertices), tensor),
        lambda: ab.DeformableMesh(tensor, faces),
        lambda: ab.closest_points(mesh, tensor),
        lambda: ab.distance(mesh, mesh, tf1=tensor),
    ):
        with pytest.raises(TypeError, match=f"lies on a device .{name}, number {device} of DLPack"):
            call()
    assert tensor.calls == 0
    np.testing.assert_array_equal(mesh.vertices, vertices)


def test_tensors_that_numpy_cannot_read():
    class Broken(Tensor):
        def __dlpack__(self, stream=None):
            raise BufferError("it is sparse")

    mesh = ab.DeformableMesh(*ball(1))
    with pytest.raises(TypeError, match="vertices cannot be read by DLPack.*it is sparse"):
        mesh.update(Broken(mesh.vertices))
    with pytest.raises(ValueError, match="has the shape"):
        mesh.update(Tensor(np.zeros((3, 3))))
    with pytest.raises(TypeError, match="real numbers"):
        mesh.update(Tensor(np.zeros((mesh.num_vertices, 3), complex)))


def test_real_tensors():
    torch = pytest.importorskip("torch")
    vertices, faces = ball(2)
    mesh = ab.DeformableMesh(torch.tensor(vertices), torch.tensor(faces))
    mesh.update(torch.tensor(wave(vertices, 1)))
    np.testing.assert_array_equal(mesh.vertices, wave(vertices, 1))
