#include "dispatch/shape_pairs.h"

#include <limits>

#include "solids/solid_pair.h"

namespace adaptive_bvh {
namespace {

/// The bounding box of an octree's occupied cells, in the world.
class BoxAroundCells {
 public:
  explicit BoxAroundCells(const ConvexParts& octree) {
    const auto anyOrder = [](const CellBall&) { return 0.; };
    octree.visit(
        anyOrder, [] { return 0.; },
        [&](const ConvexPart& cell) {
          for (int k = 0; k < 3; ++k) {
            const auto& [solid, tf] = cell.placed;
            const fcl::Vector3d axis = tf.linear().transpose() * fcl::Vector3d::Unit(k);
            low_[k] = std::min(low_[k], (tf * solid.support(-axis))[k]);
            high_[k] = std::max(high_[k], (tf * solid.support(axis))[k]);
          }
          return false;
        });
  }
  /// A lower bound of the distance from a ball; infinite if there are no cells.
  double bound(const CellBall& ball) const {
    const BoxSolid box((high_ - low_) / 2);
    const fcl::Transform3d tf(Eigen::Translation3d((low_ + high_) / 2));
    return (low_.array() <= high_.array()).all() ? boundOf(PlacedSolid{box, tf}, ball) : kInfinity;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  fcl::Vector3d low_ = fcl::Vector3d::Constant(kInfinity),
                high_ = fcl::Vector3d::Constant(-kInfinity);
};

/// Calls test(a, b) for the parts a of the first and b of the second that may be at most limit()
/// apart, until it returns true. If the first is an octree, the second must be one, too.
template <typename Limit, typename Test>
void visitPairsInOrder(const ConvexParts& first, const ConvexParts& second, const Limit& limit,
                       const Test& test) {
  const auto visitSecond = [&](const ConvexPart& a) {
    return second.visit([&](const CellBall& ball) { return boundOf(a.placed, ball); }, limit,
                        [&](const ConvexPart& b) { return test(a, b); });
  };
  if (!first.isOctree()) {
    first.visit([](const CellBall&) { return 0.; }, limit, visitSecond);
    return;
  }
  const BoxAroundCells around(second);
  first.visit([&](const CellBall& ball) { return around.bound(ball); }, limit, visitSecond);
}

/// As visitPairsInOrder, for any two bodies.
template <typename Limit, typename Test>
void visitPairs(const ConvexParts& first, const ConvexParts& second, const Limit& limit,
                const Test& test) {
  if (!first.isOctree() || second.isOctree()) return visitPairsInOrder(first, second, limit, test);
  visitPairsInOrder(second, first, limit,
                    [&](const ConvexPart& b, const ConvexPart& a) { return test(a, b); });
}

}  // namespace

void distanceOfParts(const ConvexParts& first, const ConvexParts& second,
                     const DistanceQuery& query) {
  fcl::DistanceResultd& result = query.result;
  visitPairs(
      first, second, [&] { return result.min_distance; },
      [&](const ConvexPart& a, const ConvexPart& b) {
        const TriangleGap gap = gapOf(a.placed, b.placed);
        result.update(gap.distance, nullptr, nullptr, int(a.id), int(b.id), gap.points.first,
                      gap.points.second);
        return query.isSatisfied();
      });
}

void collideParts(const ConvexParts& first, const ConvexParts& second,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query) {
  if (query.isSatisfied() || !o1.isOccupied() || !o2.isOccupied()) return;
  visitPairs(
      first, second, [] { return 0.; },
      [&](const ConvexPart& a, const ConvexPart& b) {
        fcl::Contactd contact(&o1, &o2, int(a.id), int(b.id), unsetPoint(), unsetPoint(),
                              std::numeric_limits<double>::quiet_NaN());
        if (query.request.enable_contact) {
          ShapeContact found;
          if (!touch(a.placed, b.placed, found)) return false;
          contact.pos = found.position;
          contact.normal = found.normal;
          contact.penetration_depth = found.depth;
        } else if (gapOf(a.placed, b.placed).distance > 0) {
          return false;
        }
        query.result.addContact(contact);
        return query.isSatisfied();
      });
}

}  // namespace adaptive_bvh
