#pragma once

#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

// libfcl holds these for double only. One file of the tests compiles them for float, a minute's
// work; the others link to it.
namespace fcl {
extern template float distance(const CollisionGeometry<float>*, const Transform3<float>&,
                               const CollisionGeometry<float>*, const Transform3<float>&,
                               const DistanceRequest<float>&, DistanceResult<float>&);
extern template std::size_t collide(const CollisionGeometry<float>*, const Transform3<float>&,
                                    const CollisionGeometry<float>*, const Transform3<float>&,
                                    const CollisionRequest<float>&, CollisionResult<float>&);
}  // namespace fcl
