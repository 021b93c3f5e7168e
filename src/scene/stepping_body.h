#pragma once

#include <optional>
#include <vector>

#include "base/leased.h"
#include "ccd/clearance_search.h"
#include "scene/body.h"

namespace adaptive_bvh {

/// The motion of a body in the step: a mesh, a shape, or the occupied cells of an octree.
class SteppingBody {
 public:
  SteppingBody(const Body& stepping, FramePath path);
  SteppingBody(const SteppingBody&) = delete;
  SteppingBody& operator=(const SteppingBody&) = delete;

  /// The mesh or shape; not of an octree.
  BoxedBody& whole() { return *boxed_; }
  /// A lower bound of the distance from what is in a box, while both move.
  double gapTo(const WorldBox& other);

  /// Calls visit(part, null) for the mesh or shape, or visit(part, &box) for the cells with
  /// bound(box) <= limit(), near ones first. `box` is around the motion of a cell, or of several.
  template <typename Bound, typename Limit, typename Visit>
  void visitParts(const Bound& bound, const Limit& limit, const Visit& visit);

  const Body& body;

 private:
  void findBoxes();
  double gapToPlane(const WorldBox& other) const;

  const FramePath path_;
  const Leased<MovingBoxes> memory_;  ///< of the boxes of one part at a time
  const QueryObject object_;
  const fcl::Transform3d from_, to_;
  std::optional<FrameBoxes> cells_;  ///< of an octree
  std::optional<MovingBody> moving_;
  std::optional<BoxedBody> boxed_;
  std::vector<WorldBox> boxes_;  ///< together around the motion; empty until they are needed
};

template <typename Bound, typename Limit, typename Visit>
void SteppingBody::visitParts(const Bound& bound, const Limit& limit, const Visit& visit) {
  if (boxed_) return visit(*boxed_, nullptr);
  object_.parts().visit(
      [&](const CellBall& ball) {
        return bound(cells_->around(ball.middle, fcl::Vector3d::Zero(), ball.radius));
      },
      limit,
      [&](const ConvexPart& part) {
        const auto& [solid, tf] = part.placed;
        const WorldBox box = cells_->around(tf.translation(), solid.core().high, 0);
        if (!(bound(box) <= limit())) return false;
        const MovingBody cell(solid, FrameMotion(from_ * tf, to_ * tf, path_), int(part.id));
        BoxedBody boxed(cell, *memory_);
        visit(boxed, &box);
        return false;
      });
}

/// Calls visit(query) for the pairs of parts of two bodies that may come within limit(), which
/// visits may lower.
template <typename Limit, typename Visit>
void visitParts(SteppingBody& first, SteppingBody& second, double tolerance, const Limit& limit,
                const Visit& visit) {
  const auto toSecond = [&](const WorldBox& box) { return second.gapTo(box); };
  first.visitParts(toSecond, limit, [&](BoxedBody& a, const WorldBox* cell) {
    const auto toFirst = [&](const WorldBox& box) {
      return cell ? gapOf(*cell, box) : first.gapTo(box);
    };
    second.visitParts(toFirst, limit,
                      [&](BoxedBody& b, const WorldBox*) { visit(queryOf(a, b, tolerance)); });
  });
}

/// Lowers `found` to the first impact of two bodies, if that is earlier than found.time, or `found`
/// is none. Of impacts at the same time, that of the smallest numbers counts.
void lowerToImpact(SteppingBody& first, SteppingBody& second, double separation,
                   MotionClearance& found);

}  // namespace adaptive_bvh
