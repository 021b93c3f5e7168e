"""The Python module beside C++, on the same arrays in one process, one after the other.

    cmake --build build/release --target adaptive_bvh_python python_bench
    PYTHONPATH=build/release/python python3 test/benchmark/python_bench.py \\
        build/release/test/benchmark/libpython_bench.so

After each update comes a distance to a body below, which is not timed. Prints medians; and what a
build and a load of a saved mesh take, without comparison. Fails with
--check when an update takes over 5 % longer than in C++, a call of distance over 3 us longer, or
building a model of FCL's anew, python-fcl's way, less than 50 times an update.
"""
import argparse
import ctypes
import pickle
import statistics
import sys
import time

import numpy as np

import adaptive_bvh as ab

Pointer = ctypes.c_void_p


def load(path):
    bench = ctypes.CDLL(path)
    bench.make.argtypes = [Pointer, ctypes.c_int, Pointer, ctypes.c_int]
    bench.make.restype = Pointer
    bench.destroy.argtypes = [Pointer]
    bench.update.argtypes = [Pointer, Pointer]
    bench.distance.argtypes = [Pointer, Pointer, ctypes.c_double, ctypes.c_int]
    bench.rebuild.argtypes = [Pointer, ctypes.c_int, Pointer, ctypes.c_int]
    for name in ("update", "distance", "rebuild"):
        getattr(bench, name).restype = ctypes.c_double
    return bench


def sheet(n):
    """(n + 1)^2 vertices and 2 n^2 faces over [-1, 1]^2."""
    line = np.linspace(-1, 1, n + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    corner = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (m.ravel() for m in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int64)
    return np.stack([x, y, 0 * x], -1).reshape(-1, 3), np.ascontiguousarray(faces)


def frames_of(vertices, count):
    """A wave that goes on and back, so that no step is a jump."""
    x, y, _ = vertices.T
    frames = [np.stack([x, y, 0.1 * np.sin(3 * x + 0.2 * t) * np.cos(2 * y)], 1) for t in range(count)]
    return frames + frames[-2:0:-1]


def subject(bench, vertices, faces):
    return bench.make(vertices.ctypes.data, len(vertices), faces.ctypes.data, len(faces))


def seconds(call):
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def compare_updates(bench, n, rounds):
    """Milliseconds of an update in C++ and Python, the median of their ratios, and of a build."""
    vertices, faces = sheet(n)
    frames = frames_of(vertices, 20)
    theirs, ours = subject(bench, vertices, faces), ab.DeformableMesh(vertices, faces)
    corners, sides = sheet(1)
    their_floor, our_floor = subject(bench, corners, sides), ab.DeformableMesh(corners, sides)
    below = np.eye(4)
    below[2, 3] = -0.3
    cpp, python = [], []
    for step in range(rounds):
        frame = frames[step % len(frames)]
        first, second = (cpp, python) if step % 2 else (python, cpp)
        for times in (first, second):
            if times is cpp:
                times.append(bench.update(theirs, frame.ctypes.data))
                bench.distance(theirs, their_floor, -0.3, 1)
            else:
                times.append(seconds(lambda: ours.update(frame)))
                ab.distance(ours, our_floor, tf2=below)
    bench.destroy(theirs)
    bench.destroy(their_floor)
    ratios = [p / c for p, c in zip(python[2:], cpp[2:])]
    builds = [
        bench.rebuild(f.ctypes.data, len(f), faces.ctypes.data, len(faces)) for f in frames[:3]
    ]
    median = statistics.median
    return median(cpp[2:]), median(python[2:]), median(ratios), median(builds)


def compare_distances(bench, rounds, calls=200):
    """Microseconds of a call in C++ and Python, of two sheets that face each other."""
    vertices, faces = sheet(1)
    first, second = (subject(bench, vertices, faces) for _ in range(2))
    a, b = (ab.DeformableMesh(vertices, faces) for _ in range(2))
    tf = np.eye(4)
    tf[2, 3] = 1
    cpp, python = [], []

    def call():
        for _ in range(calls):
            ab.distance(a, b, tf2=tf)

    for _ in range(rounds):
        cpp.append(bench.distance(first, second, 1.0, calls) * 1e6)
        python.append(seconds(call) / calls * 1e6)
    bench.destroy(first)
    bench.destroy(second)
    return statistics.median(cpp), statistics.median(python)


def compare_loads(n, is_shuffled, repeats=5):
    """Milliseconds of a build and of a load from a pickle, of a sheet: the least of some."""
    vertices, faces = sheet(n)
    if is_shuffled:
        rng = np.random.default_rng(1)
        order = rng.permutation(len(vertices))
        numbers = np.argsort(order)
        vertices, faces = vertices[order], rng.permutation(numbers[faces])
    saved = pickle.dumps(ab.DeformableMesh(vertices, faces))
    build = min(seconds(lambda: ab.DeformableMesh(vertices, faces)) for _ in range(repeats))
    load = min(seconds(lambda: pickle.loads(saved)) for _ in range(repeats))
    return build * 1e3, load * 1e3


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("library")
    arguments.add_argument("--size", type=int, default=316, help="squares a side (100,489 vertices)")
    arguments.add_argument("--rounds", type=int, default=100)
    arguments.add_argument("--check", action="store_true")
    given = arguments.parse_args()
    bench = load(given.library)
    cpp, python, ratio, build = compare_updates(bench, given.size, given.rounds)
    print(
        f"update of {(given.size + 1) ** 2} vertices: C++ {cpp * 1e3:.2f} ms, Python "
        f"{python * 1e3:.2f} ms, median of ratios {ratio:.3f}; new FCL model {build * 1e3:.0f} ms, "
        f"{build / python:.0f} times the update"
    )
    one, other = compare_distances(bench, 10 * given.rounds)
    print(
        f"distance of 2 + 2 triangles: C++ {one:.2f} us, Python {other:.2f} us, "
        f"{other - one:.2f} us more"
    )
    for is_shuffled in (False, True):
        built, loaded = compare_loads(given.size, is_shuffled)
        print(
            f"{2 * given.size**2} triangles in {'random ' if is_shuffled else ''}order: build "
            f"{built:.0f} ms, load {loaded:.0f} ms, {loaded / built:.2f} of it"
        )
    failed = ratio > 1.05 or build / python < 50 or other - one > 3
    sys.exit(given.check and failed)


if __name__ == "__main__":
    main()
