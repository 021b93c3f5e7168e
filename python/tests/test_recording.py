"""A run as a page: what is written, and what is refused. The page itself is tested in a browser."""

import gc
import os

import numpy as np
import pytest

import adaptive_bvh as ab
from meshes import ball, sheet


@pytest.fixture
def run():
    """A recording of a sheet above a ball, and the sheet's mesh and vertices."""
    try:
        recording = ab.Recording(title="sheet & ball", unit="mm")
    except RuntimeError as missing:
        pytest.skip(str(missing))
    vertices, faces = sheet()
    mesh = ab.DeformableMesh(vertices, faces)
    assert recording.add(mesh, None, name="sheet") == 0
    assert recording.add(ab.weld_vertices(*ball()), ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, -2]),
                         name="ball") == 1
    return recording, mesh, vertices


def test_a_run_is_written_whole(run, tmp_path):
    recording, mesh, vertices = run
    obstacle = ab.DeformableMesh(*ball())
    below = np.eye(4)
    below[2, 3] = -2
    for step in range(4):
        mesh.update(vertices - [0, 0, 0.3 * step])
        distance = ab.distance(mesh, obstacle, tf2=below)
        contacts = ab.collide(mesh, obstacle, tf2=below)
        recording.frame(distance, contacts, update_ms=0.5, query_ms=0.25,
                        vertex_distances={0: np.linspace(0, 1, len(vertices))}, note=f"step {step}")
    assert (recording.num_bodies, recording.num_frames) == (2, 4)
    assert recording.num_bytes > 4 * 6 * len(vertices)
    page = tmp_path / "run.html"
    recording.write(page)
    text = page.read_text()
    assert text.lstrip().startswith("<!DOCTYPE html>") and text.rstrip().endswith("</html>")
    assert "sheet &amp; ball" in text and "three.js" in text
    assert 'src="http' not in text and page.stat().st_size > recording.num_bytes


def test_it_keeps_its_meshes(run, tmp_path):
    recording, mesh, vertices = run
    del mesh
    gc.collect()
    recording.frame()
    recording.write(str(tmp_path / "run.html"))


def test_errors(run, tmp_path):
    recording, mesh, vertices = run
    with pytest.raises(RuntimeError):
        recording.write(tmp_path / "none.html")  # no frame yet
    with pytest.raises(ValueError):
        recording.place(7, None)
    with pytest.raises(TypeError):
        recording.add("sheet")
    with pytest.raises(ValueError):
        recording.frame(vertex_distances={0: [1.0, 2.0]})
    with pytest.raises(ValueError):
        recording.frame(vertex_distances={5: np.zeros(len(vertices))})
    with pytest.raises(ValueError):
        recording.frame(vertex_distances={0: np.zeros((2, 2))})
    with pytest.raises(TypeError):
        recording.frame(vertex_distances={"sheet": np.zeros(len(vertices))})
    assert recording.num_frames == 0
    recording.frame()
    assert recording.add(mesh, name="late") == 2  # from the next frame on
    with pytest.raises(RuntimeError):
        recording.write(tmp_path / "no" / "folder.html")
    strange = os.fsencode(tmp_path) + b"/no/caf\xe9.html"
    with pytest.raises(RuntimeError) as error:
        recording.write(strange)
    assert os.fsdecode(strange) in str(error.value)
    for wrong in ({"frames_per_second": 0}, {"up": (0, 0, 0)}):
        with pytest.raises(ValueError):
            ab.Recording(**wrong)
    with pytest.raises(TypeError):
        ab.Recording.__new__(ab.Recording).frame()
