#pragma once

// Docstrings of DeformableMesh. Lengths are in the unit of the mesh.
namespace adaptive_bvh::python::docs {

inline constexpr const char* kDeformableMesh =
    R"(A triangle mesh that deforms, ready to be queried in every step.

Thread-safe: threads share a lock for queries, and take it for themselves for updates.)";

inline constexpr const char* kDeformableMeshInit =
    R"(Builds the tree by the connectivity of the mesh.

vertices: (N, 3) positions in the mesh's own frame, at most 2^252 in magnitude, kept as float64; or
    an object with the attributes `vertices` and `faces`, such as a trimesh.Trimesh
    or what load_mesh returns.
faces: (M, 3) indices of vertices, of any type of integer. Counter-clockwise seen from outside.
    At least one. They never change: for others make another DeformableMesh.)";

inline constexpr const char* kUpdate =
    R"(A step: moves all vertices to `vertices`, (N, 3). Arrays of float64 or float32 in C or in Fortran
order are read without a copy.

Returns what it did: a MeshUpdate. On an error the mesh keeps its last positions.)";

inline constexpr const char* kUpdateSome =
    R"(A step in which some vertices move: vertex indices[i] to vertices[i].

indices: (K,) integers, 0 <= index < num_vertices; of one that is named twice the last counts.
vertices: (K, 3). The cost is in proportion to what moves.)";

inline constexpr const char* kUpdateTwoFrames =
    R"(A step that keeps the present positions as those of the frame before: as previous_vertices, where
a Motion starts. Queries answer for the new positions, `vertices`, (N, 3).

Returns what it did: a MeshUpdate. On an error the mesh keeps its last positions.)";

inline constexpr const char* kCopy =
    R"(A snapshot: another thread may query it while this mesh is updated. It shares the triangles, which
never change; positions and boxes are copied.)";

inline constexpr const char* kSave =
    R"(Writes the mesh with its tree to a file, so that another process can `load` it without a build:
about 16 bytes a triangle and 24 a vertex. A pickle holds the same.

path: a string, bytes or a path object. OSError when it cannot be written.)";

inline constexpr const char* kLoad =
    R"(Reads a mesh that `save` wrote. It answers as the saved mesh did: with the same bits where the
last update was one of all vertices, else up to rounding. Settings of threads are not saved.

path: a string, bytes or a path object. OSError when it cannot be read; ValueError when it holds no
mesh, or one that is damaged, cut off, of another version, or that a version before 0.3 saved in
single precision.)";

inline constexpr const char* kValidate =
    R"(Whether every box contains every triangle below it, as it must. Takes as long as many updates:
for tests.)";

inline constexpr const char* kSetThreads =
    R"(Lets an update, on meshes of 50,000 triangles or more, and a query, where there is much to
search, use so many threads, at least 1. Of two meshes the larger number counts. The results stay the
same. Distances take one thread.)";

}  // namespace adaptive_bvh::python::docs
