#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace fcl {
template float distance(const CollisionGeometry<float>*, const Transform3<float>&,
                        const CollisionGeometry<float>*, const Transform3<float>&,
                        const DistanceRequest<float>&, DistanceResult<float>&);
template std::size_t collide(const CollisionGeometry<float>*, const Transform3<float>&,
                             const CollisionGeometry<float>*, const Transform3<float>&,
                             const CollisionRequest<float>&, CollisionResult<float>&);
}  // namespace fcl
