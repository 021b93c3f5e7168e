#pragma once

#include <atomic>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include <fcl/math/bv/AABB.h>

#include "adaptive_bvh/self_collision.h"
#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_contact.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh {

/// The triangles of one object of a contact query, and its pose.
struct PlacedTriangles {
  const fcl::CollisionGeometryd* geometry;
  MeshView<double> view;
  const fcl::Transform3d& tf;

  /// The corners of a triangle, in the object's frame.
  TrianglePoints operator[](int triangle) const {
    const VertexIndices t = view.verticesOf(static_cast<unsigned>(triangle));
    return {view.vertices[t[0]], view.vertices[t[1]], view.vertices[t[2]]};
  }
};

/// Adds the contacts of two triangles, and their cost source if requested. By the library's own
/// test triangles touch if their distance is 0, and every such pair has a contact, with all fields
/// if requested. (FCL decides by the signs of rounded numbers, and reads an uninitialized plane for
/// a triangle that is a segment or a point.) `touching`: the triangles are known to touch, and
/// neither is thin. `most`: largest number of contacts of this pair. `to_first`: maps the second
/// object's frame to the first's.
inline void addContactsOf(const PlacedTriangles& first, const PlacedTriangles& second,
                          const RelativePlacement& to_first, int id1, int id2, bool touching,
                          unsigned most, const fcl::CollisionRequestd& request,
                          fcl::CollisionResultd& result) {
  const bool occupied = first.geometry->isOccupied() && second.geometry->isOccupied();
  // As in FCL, uncertain objects, neither occupied nor free, have costs but no contacts.
  const bool has_cost =
      request.enable_cost && !first.geometry->isFree() && !second.geometry->isFree();
  if (!occupied && !has_cost) return;
  const auto hasRoom = [&] { return result.numContacts() < request.num_max_contacts; };
  const auto addPair = [&] {  // a contact of indices only
    if (hasRoom())
      result.addContact(fcl::Contactd(first.geometry, second.geometry, id1, id2, unsetPoint(),
                                      unsetPoint(), std::numeric_limits<double>::quiet_NaN()));
  };
  if (touching && occupied && !request.enable_contact && !request.enable_cost) return addPair();
  const TrianglePoints p = first[id1], q = second[id2];
  const TrianglePoints in_first = {to_first(q[0]), to_first(q[1]), to_first(q[2])};
  if (!touching && !touch(p, in_first)) return;
  if (occupied && request.enable_contact) {
    const TriangleContact contact = contactOf(p, in_first);
    for (unsigned i = 0; i < contact.count && i < most && hasRoom(); ++i)
      result.addContact(fcl::Contactd(first.geometry, second.geometry, id1, id2,
                                      first.tf * fcl::Vector3d(contact.points[i]),
                                      first.tf.linear() * contact.normal, contact.depth));
  } else if (occupied) {
    addPair();
  }
  if (!request.enable_cost) return;
  const auto boxOf = [](const fcl::Transform3d& tf, const TrianglePoints& t) {
    return fcl::AABBd(tf * t[0], tf * t[1], tf * t[2]);
  };
  fcl::AABBd common;
  boxOf(first.tf, p).overlap(boxOf(second.tf, q), common);
  const double density = first.geometry->cost_density * second.geometry->cost_density;
  result.addCostSource(fcl::CostSourced(common, density), request.num_max_cost_sources);
}

/// Decides which tasks of a contact query can be skipped, because tasks before them have all
/// contacts wanted: one task alone, or the first tasks together. As long as a worker's contacts are
/// too few to matter, it takes no lock.
class ContactLimit {
 public:
  /// `most`: number of contacts wanted.
  ContactLimit(std::size_t most, std::size_t tasks, int workers)
      : most_(most),
        per_worker_(most / static_cast<std::size_t>(workers)),
        counts_(tasks),
        last_needed_(tasks) {
    for (auto& count : counts_) count.store(kUnfinished, std::memory_order_relaxed);
  }

  bool needs(std::size_t task) const {
    return task <= last_needed_.load(std::memory_order_relaxed);
  }
  /// Records a finished task. `contacts`: number that it found; `of_worker`: of its worker, so far.
  void finish(std::size_t task, std::size_t contacts, std::size_t of_worker) {
    counts_[task].store(contacts, std::memory_order_relaxed);
    if (of_worker < per_worker_) return;  // if all workers return here, the sum is below most_
    const std::lock_guard<std::mutex> lock(counting_);
    if (contacts >= most_) endAt(task);
    for (std::size_t count; next_ < counts_.size() && sum_ < most_; ++next_) {
      if ((count = counts_[next_].load(std::memory_order_relaxed)) == kUnfinished) return;
      sum_ += count;
      if (sum_ >= most_) endAt(next_);
    }
  }

 private:
  static constexpr std::size_t kUnfinished = ~std::size_t(0);

  void endAt(std::size_t task) {
    if (task < last_needed_.load(std::memory_order_relaxed))
      last_needed_.store(task, std::memory_order_relaxed);
  }

  const std::size_t most_, per_worker_;           ///< contacts wanted, in all and per worker
  std::vector<std::atomic<std::size_t>> counts_;  ///< contacts by task, or kUnfinished
  std::mutex counting_;
  std::size_t next_ = 0, sum_ = 0;  ///< the first task not yet added to the sum; contacts before it
  std::atomic<std::size_t> last_needed_;  ///< tasks after this one are skipped
};

/// A mesh of a contact query, and the geometry to which its contacts point.
struct ContactMesh {
  const fcl::CollisionGeometryd& geometry;
  const PlacedMesh& placed;

  PlacedTriangles triangles() const { return {&geometry, placed.mesh.view(), placed.tf}; }
};

/// Adds the contacts of two meshes to the result.
void collideMeshes(const ContactMesh& first, const ContactMesh& second,
                   const CollisionQuery& query);
/// Adds the contacts of a mesh with itself. The lists of `ignored` are sorted.
void collideWithItself(const ContactMesh& mesh, const Ignored& ignored,
                       const CollisionQuery& query);

}  // namespace adaptive_bvh
