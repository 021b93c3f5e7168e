// The functions of motion_clearance.h: check arguments and convert motions to double precision.
#include "adaptive_bvh/motion_clearance.h"

#include <array>
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

/// A body of a query.
struct QueryBody {
  QueryBody(const BodyMotion& motion, MovingBoxes& memory) {
    requireRigid(motion.start_tf);
    requireRigid(motion.end_tf);
    const fcl::Transform3d &from = motion.start_tf, &to = motion.end_tf;
    if (motion.mesh) {
      body.emplace(stateOf(*motion.mesh->mesh), motion.mesh->start, motion.mesh->end,
                   FrameMotion(from, to, motion.path));
    } else if (const auto* mesh = dynamic_cast<const DeformableMesh*>(motion.geometry)) {
      body.emplace(stateOf(*mesh), FrameMotion(from, to, motion.path));
    } else {
      shape.emplace(*motion.geometry);
      body.emplace(**shape, FrameMotion(rotated(from), rotated(to), motion.path));
    }
    boxed.emplace(*body, memory);
  }
  QueryBody(const QueryBody&) = delete;
  QueryBody& operator=(const QueryBody&) = delete;

  std::optional<ShapeSolid> shape;
  std::optional<MovingBody> body;
  std::optional<BoxedBody> boxed;
};

/// Returns run(query, is_swapped).
template <typename Run>
auto withBodies(const BodyMotion& first, const BodyMotion& second, double tolerance,
                const Run& run) {
  const Leased<std::array<MovingBoxes, 2>> memory;
  QueryBody a(first, (*memory)[0]), b(second, (*memory)[1]);
  const bool swaps = orderOf(*a.body) > orderOf(*b.body);
  const ClearanceQuery query = {swaps ? *b.boxed : *a.boxed, swaps ? *a.boxed : *b.boxed,
                                tolerance};
  requireTolerable(query);
  return run(query, swaps);
}

/// Returns run(query) for a mesh with itself.
template <typename Run>
auto withItself(const BodyMotion& motion, const Ignored& ignored, double tolerance,
                const Run& run) {
  const Leased<MovingBoxes> memory;
  QueryBody body(motion, *memory);
  if (!body.body->mesh())
    throw std::invalid_argument("adaptive_bvh: a shape has no distance to itself");
  if (ignored.neighbours != NeighbourFilter::SharedVertex)
    throw std::invalid_argument(
        "adaptive_bvh: triangles with a common vertex are at the distance 0; ignore the neighbours "
        "SharedVertex");
  requireSorted(ignored, true);
  const NeighbourRanges* surface = surfaceOf(ignored, *body.body->mesh());
  const auto by_vertices = surface ? nullptr : neighboursByVertices(*body.body->mesh());
  if (!surface) surface = by_vertices.get();
  ClearanceQuery query = {*body.boxed, *body.boxed, tolerance, surface, &ignored.triangles};
  if (!ignored.triangles.list && !ignored.triangles.test) query.ignored = nullptr;
  requireTolerable(query);
  return run(query);
}

}  // namespace

MotionClearance leastDistance(const BodyMotion& first, const BodyMotion& second, double tolerance,
                              double limit) {
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

void intervalsBelow(const BodyMotion& first, const BodyMotion& second, double clearance,
                    double tolerance, std::vector<MotionInterval>& intervals) {
  requireClearance(clearance);
  withBodies(first, second, tolerance, [&](const ClearanceQuery& query, bool) {
    findIntervalsBelow(query, clearance, intervals);
  });
}

MotionClearance selfLeastDistance(const BodyMotion& mesh, const Ignored& ignored,
                                  double tolerance) {
  return withItself(mesh, ignored, tolerance, [](const ClearanceQuery& query) {
    MotionClearance best;
    lowerClearance(query, best);
    if (best.triangles[0] > best.triangles[1]) swapBodies(best);
    return best;
  });
}

void selfIntervalsBelow(const BodyMotion& mesh, const Ignored& ignored, double clearance,
                        double tolerance, std::vector<MotionInterval>& intervals) {
  requireClearance(clearance);
  withItself(mesh, ignored, tolerance,
             [&](const ClearanceQuery& query) { findIntervalsBelow(query, clearance, intervals); });
}

}  // namespace adaptive_bvh
