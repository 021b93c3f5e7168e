#include "fcl/shape_pairs.h"

#include "fcl/convex_parts.h"

namespace adaptive_bvh {
namespace {

template <typename S>
bool isOctree(const PlacedGeometry<S>& body) {
  return body.geometry->getNodeType() == fcl::GEOM_OCTREE;
}

/// The box around all cells of an octree, in the world, as a shape.
template <typename S>
class BoxAroundCells {
 public:
  explicit BoxAroundCells(const PlacedGeometry<S>& octree) {
    const auto all = [](const CellBall&) { return 0.; };
    visitParts(
        octree, all, [] { return 0.; },
        [&](const ConvexPart& cell) {
          for (int k = 0; k < 3; ++k) {
            const auto& [shape, tf] = cell.placed;
            const fcl::Vector3d along = tf.linear().transpose() * fcl::Vector3d::Unit(k);
            low_[k] = std::min(low_[k], (tf * shape.support(-along))[k]);
            high_[k] = std::max(high_[k], (tf * shape.support(along))[k]);
          }
          return false;
        });
  }
  double bound(const CellBall& ball) const {
    const BoxShape box((high_ - low_) / 2);
    const fcl::Transform3d tf(Eigen::Translation3d((low_ + high_) / 2));
    return (low_.array() <= high_.array()).all() ? boundOf(PlacedShape{box, tf}, ball) : kInfinity;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  fcl::Vector3d low_ = fcl::Vector3d::Constant(kInfinity),
                high_ = fcl::Vector3d::Constant(-kInfinity);
};

/// Calls test(part of the first, part of the second) for those that may be at most limit() apart,
/// until it returns true. The second is an octree if the first is one.
template <typename S, typename Limit, typename Test>
void visitPairsInOrder(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second,
                       const Limit& limit, const Test& test) {
  const auto visitSecond = [&](const ConvexPart& a) {
    return visitParts(
        second, [&](const CellBall& ball) { return boundOf(a.placed, ball); }, limit,
        [&](const ConvexPart& b) { return test(a, b); });
  };
  if (!isOctree(first)) {
    visitParts(
        first, [](const CellBall&) { return 0.; }, limit, visitSecond);
    return;
  }
  const BoxAroundCells<S> around(second);
  visitParts(
      first, [&](const CellBall& ball) { return around.bound(ball); }, limit, visitSecond);
}

template <typename S, typename Limit, typename Test>
void visitPairs(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second, const Limit& limit,
                const Test& test) {
  if (!isOctree(first) || isOctree(second)) return visitPairsInOrder(first, second, limit, test);
  visitPairsInOrder(second, first, limit,
                    [&](const ConvexPart& b, const ConvexPart& a) { return test(a, b); });
}

}  // namespace

template <typename S>
S shapePairDistance(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second,
                    const DistanceQuery<S>& query) {
  fcl::DistanceResult<S>& result = query.result;
  visitPairs(
      first, second, [&] { return double(result.min_distance); },
      [&](const ConvexPart& a, const ConvexPart& b) {
        const TriangleGap gap = gapOf<S>(a.placed, b.placed);
        if (gap.distance < double(result.min_distance))
          result.update(distanceAs<S>(gap.distance), first.geometry, second.geometry, int(a.id),
                        int(b.id), gap.points.first.template cast<S>(),
                        gap.points.second.template cast<S>());
        return query.isSatisfied();
      });
  return result.min_distance;
}

template <typename S>
std::size_t shapePairCollide(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second,
                             const CollisionQuery<S>& query) {
  fcl::CollisionResult<S>& result = query.result;
  if (query.isSatisfied() || !first.geometry->isOccupied() || !second.geometry->isOccupied())
    return result.numContacts();
  visitPairs(
      first, second, [] { return 0.; },
      [&](const ConvexPart& a, const ConvexPart& b) {
        fcl::Contact<S> contact(first.geometry, second.geometry, int(a.id), int(b.id),
                                unsetPoint<S>(), unsetPoint<S>(),
                                std::numeric_limits<S>::quiet_NaN());
        if (query.request.enable_contact) {
          ShapeContact found;
          if (!touch<S>(a.placed, b.placed, found)) return false;
          contact.pos = found.position.template cast<S>();
          contact.normal = found.normal.template cast<S>();
          contact.penetration_depth = static_cast<S>(found.depth);
        } else if (gapOf<S>(a.placed, b.placed).distance > 0) {
          return false;
        }
        result.addContact(contact);
        return query.isSatisfied();
      });
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                         \
  template S shapePairDistance(const PlacedGeometry<S>&, const PlacedGeometry<S>&,          \
                               const DistanceQuery<S>&);                                    \
  template std::size_t shapePairCollide(const PlacedGeometry<S>&, const PlacedGeometry<S>&, \
                                        const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
