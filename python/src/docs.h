#pragma once

// Docstrings that are longer than a line or two. Lengths are in the unit of the meshes.
namespace adaptive_bvh::python::docs {

inline constexpr const char* kModule =
    R"(Exact distance and collision queries on deforming triangle meshes.

A Model is built once of a mesh and follows it: update(vertices) in every step, then query it. Its
tree of bounding volumes is not built anew, and every answer is exact in every step.

Arrays of vertices are (N, 3). float64 in C order (NumPy's default) is read in place; float32 is,
too, by a Model of float32; anything else is converted once. Lengths are in the unit of the mesh.
Results are float64 and own their memory; numbers of triangles and vertices are int32.

A pose places a model or a shape in the world: None (the identity), a (4, 4) array, or a pair
(R, t) of shapes (3, 3) and (3,). R must be a rotation to 1e-6.

Errors: TypeError, ValueError and IndexError. A refused update leaves the model as it was.

Threads: updates and queries release the GIL. Every Model has a lock: any number of threads may
query it at once; an update waits until they are done, and queries wait for it. Do not write into an
array while a call reads it.)";

inline constexpr const char* kModel =
    R"(A triangle mesh that deforms, ready to be queried in every step.

Thread-safe: threads share a lock for queries, and take it for themselves for updates.)";

inline constexpr const char* kModelInit =
    R"(Builds the model.

vertices: (N, 3) positions in the mesh's own frame, at most 2^252 (float64) or 2^28 (float32) in
    magnitude; or an object with the attributes `vertices` and `faces`, such as a trimesh.Trimesh
    or what load_mesh returns.
faces: (M, 3) indices of vertices, of any type of integer. Counter-clockwise seen from outside.
    Without any, (0, 3), the model can be updated, but not queried.
volume: 'rss' or 'obbrss', FCL's bounding volumes. Answers are the same; 'rss' needs less memory.
dtype: float64 or float32, the type of the model's numbers. Two models of a query have the same
    volume and dtype.
policy: a RefitPolicy, None for the default.
hierarchy: 'bottom-up' (by the connectivity of the mesh) or 'top-down' (as FCL builds).)";

inline constexpr const char* kUpdate =
    R"(A step: moves all vertices to `vertices`, (N, 3). float64 in C order is read in place.

Returns what it did: an UpdateReport. On an error the model keeps its last positions.)";

inline constexpr const char* kUpdateSome =
    R"(A step in which some vertices move: vertex indices[i] to vertices[i].

indices: (K,) integers, 0 <= index < num_vertices; of one that is named twice the last counts.
vertices: (K, 3). The cost is in proportion to what moves.)";

inline constexpr const char* kValidate =
    R"(Whether every bounding volume contains every triangle below it, as it must. Takes as long as
many updates: for tests.)";

inline constexpr const char* kUpdateThreads =
    R"(Lets updates use so many threads, at least 1, on models of 50,000 triangles or more.)";

inline constexpr const char* kQueryThreads =
    R"(Lets one query use so many threads, at least 1, where there is much to search. The answer stays
the same. Distances take one thread.)";

}  // namespace adaptive_bvh::python::docs
