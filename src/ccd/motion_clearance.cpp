// The functions of motion_clearance.h: check arguments and convert motions to double precision.
#include "adaptive_bvh/motion_clearance.h"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "base/leased.h"
#include "base/rigid.h"
#include "ccd/clearance_search.h"
#include "query/pair_filter.h"
#include "solids/shape_solid.h"

namespace adaptive_bvh {
namespace {

/// Positions in double precision: the array itself, or a copy in `converted`.
const fcl::Vector3d* positionsOf(const MeshState&, const DeformableMesh<double>&,
                                 const fcl::Vector3d* positions, std::vector<fcl::Vector3d>&) {
  return positions;
}
/// The mesh's own positions are there in double precision.
const fcl::Vector3d* positionsOf(const MeshState& state, const DeformableMesh<float>& mesh,
                                 const fcl::Vector3f* positions,
                                 std::vector<fcl::Vector3d>& converted) {
  if (positions == mesh.vertices().data()) return state.vertices.data();
  if (positions == mesh.previousVertices().data()) return state.previous.data();
  converted.resize(state.vertices.size());
  for (std::size_t i = 0; i < converted.size(); ++i) converted[i] = positions[i].cast<double>();
  return converted.data();
}

/// A body of a query, in double precision.
struct QueryBody {
  struct Memory {
    std::vector<fcl::Vector3d> start, end;
    MovingBoxes boxes;
  };

  template <typename S>
  QueryBody(const BodyMotion<S>& motion, Memory& memory) {
    requireRigid(motion.start_tf);
    requireRigid(motion.end_tf);
    const fcl::Transform3d from(motion.start_tf.template cast<double>()),
        to(motion.end_tf.template cast<double>());
    if (motion.mesh) {
      const MeshState& state = stateOf(*motion.mesh->mesh);
      body.emplace(state, positionsOf(state, *motion.mesh->mesh, motion.mesh->start, memory.start),
                   positionsOf(state, *motion.mesh->mesh, motion.mesh->end, memory.end),
                   FrameMotion(from, to, motion.path));
    } else if (const auto* mesh = dynamic_cast<const DeformableMesh<S>*>(motion.geometry)) {
      body.emplace(stateOf(*mesh), FrameMotion(from, to, motion.path));
    } else {
      shape.emplace(*motion.geometry);
      body.emplace(**shape, FrameMotion(rotated(from), rotated(to), motion.path));
    }
    boxed.emplace(*body, memory.boxes);
  }
  QueryBody(const QueryBody&) = delete;
  QueryBody& operator=(const QueryBody&) = delete;

  std::optional<ShapeSolid> shape;
  std::optional<MovingBody> body;
  std::optional<BoxedBody> boxed;
};

/// Returns run(query, is_swapped).
template <typename S, typename Run>
auto withBodies(const BodyMotion<S>& first, const BodyMotion<S>& second, double tolerance,
                const Run& run) {
  const Leased<std::pair<QueryBody::Memory, QueryBody::Memory>> memory;
  QueryBody a(first, memory->first), b(second, memory->second);
  const bool swaps = orderOf(*a.body) > orderOf(*b.body);
  const ClearanceQuery query = {swaps ? *b.boxed : *a.boxed, swaps ? *a.boxed : *b.boxed,
                                tolerance};
  requireTolerable(query);
  return run(query, swaps);
}

/// Returns run(query) for a mesh with itself.
template <typename S, typename Run>
auto withItself(const BodyMotion<S>& motion, const SurfaceNeighbourhood& left_out, double tolerance,
                const IgnoredPairs& ignored, const Run& run) {
  const Leased<QueryBody::Memory> memory;
  QueryBody body(motion, *memory);
  if (!body.body->mesh())
    throw std::invalid_argument("adaptive_bvh: a shape has no distance to itself");
  if (left_out.ranges().topology != body.body->mesh()->topology)
    throw std::invalid_argument(
        "adaptive_bvh: a SurfaceNeighbourhood of another mesh; make it of this mesh, or of the "
        "mesh "
        "that this is a copy of");
  requireSortedOfSelf(ignored);
  ClearanceQuery query = {*body.boxed, *body.boxed, tolerance, &left_out.ranges(), &ignored};
  if (!ignored.list && !ignored.test) query.ignored = nullptr;
  requireTolerable(query);
  return run(query);
}

}  // namespace

template <typename S>
MotionClearance leastDistance(const BodyMotion<S>& first, const BodyMotion<S>& second,
                              double tolerance, double limit) {
  if (!(limit >= 0)) throw std::invalid_argument("adaptive_bvh: a limit is negative or NaN");
  return withBodies(first, second, tolerance, [&](const ClearanceQuery& query, bool is_swapped) {
    MotionClearance best;
    best.upper = limit + tolerance;
    if (best.upper - tolerance < limit)
      best.upper = std::nextafter(best.upper, std::numeric_limits<double>::infinity());
    if (!lowerClearance(query, best)) best.upper = std::numeric_limits<double>::infinity();
    if (is_swapped) swapBodies(best);
    return best;
  });
}

template <typename S>
void intervalsBelow(const BodyMotion<S>& first, const BodyMotion<S>& second, double clearance,
                    double tolerance, std::vector<MotionInterval>& intervals) {
  requireClearance(clearance);
  withBodies(first, second, tolerance, [&](const ClearanceQuery& query, bool) {
    findIntervalsBelow(query, clearance, intervals);
  });
}

template <typename S>
MotionClearance leastSelfDistance(const BodyMotion<S>& mesh, const SurfaceNeighbourhood& left_out,
                                  double tolerance, const IgnoredPairs& ignored) {
  return withItself(mesh, left_out, tolerance, ignored, [](const ClearanceQuery& query) {
    MotionClearance best;
    lowerClearance(query, best);
    if (best.triangles[0] > best.triangles[1]) swapBodies(best);
    return best;
  });
}

template <typename S>
void selfIntervalsBelow(const BodyMotion<S>& mesh, const SurfaceNeighbourhood& left_out,
                        double clearance, double tolerance, std::vector<MotionInterval>& intervals,
                        const IgnoredPairs& ignored) {
  requireClearance(clearance);
  withItself(mesh, left_out, tolerance, ignored,
             [&](const ClearanceQuery& query) { findIntervalsBelow(query, clearance, intervals); });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                             \
  template MotionClearance leastDistance(const BodyMotion<S>&, const BodyMotion<S>&, double,    \
                                         double);                                               \
  template void intervalsBelow(const BodyMotion<S>&, const BodyMotion<S>&, double, double,      \
                               std::vector<MotionInterval>&);                                   \
  template MotionClearance leastSelfDistance(const BodyMotion<S>&, const SurfaceNeighbourhood&, \
                                             double, const IgnoredPairs&);                      \
  template void selfIntervalsBelow(const BodyMotion<S>&, const SurfaceNeighbourhood&, double,   \
                                   double, std::vector<MotionInterval>&, const IgnoredPairs&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
