#pragma once

/// \file
/// Ends long queries before they are done, as on Ctrl-C.
namespace adaptive_bvh {

/// May throw to end the query that calls it.
using InterruptionCheck = void (*)();

/// Sets the function that searches for pairs of triangles call every few milliseconds, on each
/// thread that they run on: contacts, self-collisions, near pairs, candidates, contact regions, of
/// meshes and of scenes. Null: none, which is the default. A query that it ends by an exception
/// leaves what std::bad_alloc leaves, and the caller gets the exception. Thread-safe.
void setInterruptionCheck(InterruptionCheck check) noexcept;

}  // namespace adaptive_bvh
