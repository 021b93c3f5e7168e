import bisect
import os
import signal
import sys
import threading
import time

import meshes
import numpy as np
import pytest

import adaptive_bvh as ab


def run_together(jobs, seconds=1.0):
    """Runs each job again and again on a thread of its own. Raises what one of them raises."""
    errors, end = [], time.monotonic() + seconds

    def loop(job):
        try:
            while time.monotonic() < end and not errors:
                job()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=loop, args=(job,)) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive(), "threads wait for each other"
    if errors:
        raise errors[0]


def test_queries_beside_updates_see_one_frame_or_the_other():
    (v1, f1), (v2, f2) = meshes.ball(2), meshes.sheet(8)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    frames1, frames2 = [v1, meshes.wave(v1, 1)], [v2, meshes.wave(v2, 2)]
    tf = (np.eye(3), [0, 0, 3])
    distances, counts = set(), set()
    for one in frames1:
        for other in frames2:
            a.update(one)
            b.update(other)
            distances.add(round(ab.distance(a, b, tf2=tf).distance, 5))
            counts.add(len(ab.pairs_within(b, a, 0.2)))
    assert len(distances) == 4
    pair = ab.CoherentDistance(b, a)
    rng = np.random.default_rng(9)

    def query():
        assert round(ab.distance(a, b, tf2=tf).distance, 5) in distances
        assert round(pair.distance(tf, None).distance, 5) in distances
        assert len(ab.pairs_within(b, a, 0.2)) in counts
        ab.self_collide(a), ab.collide(b, a), ab.closest_points(b, v1), a.vertices, a.last_update

    run_together(
        [
            query,
            query,
            lambda: a.update(frames1[rng.integers(2)]),
            lambda: b.update(frames2[rng.integers(2)]),
        ],
        0.6,
    )
    assert a.validate() and b.validate()


def test_a_snapshot_is_queried_beside_updates_of_the_original():
    (v1, f1), (v2, f2) = meshes.ball(2), meshes.sheet(8)
    mesh, other = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    snapshot, tf = mesh.copy(), (np.eye(3), [0, 0, 3])
    expected, before = ab.distance(snapshot, other, tf2=tf).distance, snapshot.vertices
    frames = [meshes.wave(v1, t) for t in range(4)]
    rng = np.random.default_rng(12)

    def query():
        assert ab.distance(snapshot, other, tf2=tf).distance == expected

    def renewed():
        assert ab.distance(mesh.copy(), other, tf2=tf).distance > 0

    run_together([query, query, renewed, lambda: mesh.update(frames[rng.integers(4)])], 0.6)
    np.testing.assert_array_equal(snapshot.vertices, before)
    assert mesh.validate() and snapshot.validate()


@pytest.mark.parametrize("what", ["update", "query"])
def test_others_run_meanwhile(what):
    vertices, faces = meshes.sheet(300)
    mesh = ab.DeformableMesh(vertices, faces)
    frames = [meshes.wave(vertices, t) for t in (0, 1)]
    points = np.random.default_rng(10).normal(size=(20000, 3)) * 3

    def call(i):
        if what == "query":
            ab.closest_points(mesh, points)
        else:
            mesh.update(frames[i % 2])

    calls, ticks, done = [], [], threading.Event()

    def work():
        for i in range(40):
            start = time.perf_counter()
            call(i)
            calls.append((start, time.perf_counter()))
        done.set()

    call(0)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(100)  # no thread gives the GIL away but by itself
    try:
        thread = threading.Thread(target=work)
        thread.start()
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0)
        thread.join()
    finally:
        sys.setswitchinterval(interval)

    def has_tick(start, end):
        quarter = (end - start) / 4
        at = bisect.bisect(ticks, start + quarter)
        return at < len(ticks) and ticks[at] < end - quarter

    # With the GIL held this thread would stand still in the middle of each call.
    assert sum(has_tick(*one) for one in calls) >= 5


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT")
def test_ctrl_c_ends_a_search_within_its_leaves():
    """A fan: 1.8 billion pairs share a vertex, and all are tested."""
    n = 60000
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.c_[np.cos(angle), np.sin(angle), 0.3 * np.sin(7 * angle)]
    fan = ab.DeformableMesh(np.vstack([[[0, 0, 0]], rim]),
                            np.c_[np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n])
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    begin = time.process_time()
    with pytest.raises(KeyboardInterrupt):
        ab.self_collide(fan)
    assert time.process_time() - begin < 3
    fan.update(fan.vertices + 1)  # no lock is left
    assert ab.distance(fan, fan, tf2=(np.eye(3), [0, 0, 9])).distance > 8
