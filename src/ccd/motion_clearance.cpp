// The functions of motion_clearance.h: check arguments.
#include "adaptive_bvh/motion_clearance.h"

#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "base/leased.h"
#include "base/rigid.h"
#include "ccd/clearance_search.h"
#include "query/pair_filter.h"
#include "solids/shape_solid.h"

namespace adaptive_bvh {
namespace {

/// A body of a query.
struct QueryBody {
  QueryBody(const Motion& motion, MovingBoxes& memory) {
    requireRigid(motion.start_tf);
    requireRigid(motion.end_tf);
    const FrameMotion frame(motion.start_tf, motion.end_tf, motion.path);
    if (!motion.mesh)
      body.emplace(*shape.emplace(*motion.geometry),
                   FrameMotion(rotated(motion.start_tf), rotated(motion.end_tf), motion.path));
    else if (motion.start)
      body.emplace(stateOf(*motion.mesh), motion.start, motion.end, frame);
    else
      body.emplace(stateOf(*motion.mesh), frame);
    boxed.emplace(*body, memory);
  }
  QueryBody(const QueryBody&) = delete;
  QueryBody& operator=(const QueryBody&) = delete;

  std::optional<ShapeSolid> shape;
  std::optional<MovingBody> body;
  std::optional<BoxedBody> boxed;
};

/// Returns run(query).
template <typename Run>
auto withBodies(const Motion& first, const Motion& second, double tolerance, const Run& run) {
  const Leased<std::array<MovingBoxes, 2>> memory;
  QueryBody a(first, (*memory)[0]), b(second, (*memory)[1]);
  const ClearanceQuery query = queryOf(*a.boxed, *b.boxed, tolerance);
  requireTolerable(query);
  return run(query);
}

/// Returns run(query) for a mesh with itself.
template <typename Run>
auto withItself(const Motion& motion, const Ignored& ignored, double tolerance, const Run& run) {
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

MotionClearance leastDistance(const Motion& first, const Motion& second, double tolerance,
                              double limit) {
  if (!(limit >= 0)) throw std::invalid_argument("adaptive_bvh: a limit is negative or NaN");
  return withBodies(first, second, tolerance, [&](const ClearanceQuery& query) {
    MotionClearance best;
    best.upper = limit + tolerance;
    if (best.upper - tolerance < limit)
      best.upper = std::nextafter(best.upper, std::numeric_limits<double>::infinity());
    if (!lowerClearance(query, best)) best.upper = std::numeric_limits<double>::infinity();
    return best;
  });
}

void intervalsBelow(const Motion& first, const Motion& second, double distance, double tolerance,
                    std::vector<MotionInterval>& intervals) {
  requireSeparation(distance);
  withBodies(first, second, tolerance,
             [&](const ClearanceQuery& query) { findIntervalsBelow(query, distance, intervals); });
}

MotionClearance selfLeastDistance(const Motion& mesh, const Ignored& ignored, double tolerance) {
  return withItself(mesh, ignored, tolerance, [](const ClearanceQuery& query) {
    MotionClearance best;
    lowerClearance(query, best);
    if (best.elements[0] > best.elements[1]) swapBodies(best);
    return best;
  });
}

void selfIntervalsBelow(const Motion& mesh, const Ignored& ignored, double distance,
                        double tolerance, std::vector<MotionInterval>& intervals) {
  requireSeparation(distance);
  withItself(mesh, ignored, tolerance,
             [&](const ClearanceQuery& query) { findIntervalsBelow(query, distance, intervals); });
}

}  // namespace adaptive_bvh
