#pragma once

#include <cstddef>
#include <vector>

#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/narrowphase/collision_object.h>

#include "adaptive_bvh/build_flags.h"
#include "adaptive_bvh/query.h"

namespace adaptive_bvh {

namespace detail {

/// Reads which objects an interval tree manager holds. Its unregisterObject drops end points of
/// other objects and may leave those of the object itself; getObjects reads them. Its map from
/// objects to intervals is right. Objects registered since the last setup have end points only,
/// behind those of the others.
template <typename S>
class IntervalTreeObjects : fcl::IntervalTreeCollisionManager<S> {
  using Manager = fcl::IntervalTreeCollisionManager<S>;

 public:
  static std::vector<fcl::CollisionObject<S>*> of(const Manager& manager) {
    const auto& intervals = (manager.*(&IntervalTreeObjects::obj_interval_maps))[0];
    const auto& end_points = (manager.*(&IntervalTreeObjects::endpoints))[0];
    std::vector<fcl::CollisionObject<S>*> objects;
    for (const auto& entry : intervals) objects.push_back(entry.first);
    if (manager.*(&IntervalTreeObjects::setup_)) return objects;
    for (std::size_t i = 2 * intervals.size(); i < end_points.size(); ++i)
      if (end_points[i].minmax == 0) objects.push_back(end_points[i].obj);
    return objects;
  }
};

/// Leaves these objects alone registered, with the boxes that they have now.
template <typename S>
void refill(fcl::BroadPhaseCollisionManager<S>& manager,
            const std::vector<fcl::CollisionObject<S>*>& objects) {
  manager.clear();
  manager.registerObjects(objects);
  manager.setup();
}

}  // namespace detail

/// Brings everything that FCL caches of deformed objects up to date, after the updates of their
/// models and before the next query of the manager: the geometry's local box, the object's box in
/// the world, and the manager. Each of FCL's own calls does one of the three; when one is left out,
/// managers miss collisions. The objects must be registered; of those that share a geometry, all
/// must be named. Objects that only moved may be named, too.
///
/// fcl::SaPCollisionManager loses pairs when boxes grow and shrink, and
/// fcl::IntervalTreeCollisionManager after unregisterObject, also when they are updated; these two
/// are filled anew. All other managers of FCL are updated. After unregisterObject of an interval
/// tree manager call refresh before its setup or update; `objects` may be empty.
///
/// S is float or double.
template <typename S>
void refresh(const std::vector<fcl::CollisionObject<S>*>& objects,
             fcl::BroadPhaseCollisionManager<S>& manager) {
  for (fcl::CollisionObject<S>* object : objects) {
    const auto* geometry = object->collisionGeometry().get();
    // The object was made from a pointer to a geometry that is not const.
    const_cast<fcl::CollisionGeometry<S>*>(geometry)->computeLocalAABB();
    object->computeAABB();
  }
  if (dynamic_cast<fcl::SaPCollisionManager<S>*>(&manager)) {
    std::vector<fcl::CollisionObject<S>*> registered;
    manager.getObjects(registered);
    detail::refill(manager, registered);
  } else if (const auto* tree = dynamic_cast<fcl::IntervalTreeCollisionManager<S>*>(&manager)) {
    detail::refill(manager, detail::IntervalTreeObjects<S>::of(*tree));
  } else {
    manager.update();
  }
}

/// For one object.
template <typename S>
void refresh(fcl::CollisionObject<S>& object, fcl::BroadPhaseCollisionManager<S>& manager) {
  refresh(std::vector<fcl::CollisionObject<S>*>{&object}, manager);
}

/// What `collideCallback` is given as a manager's `cdata`, and fills.
template <typename S>
struct BroadphaseCollision {
  fcl::CollisionRequest<S> request;  ///< of all pairs together; FCL's default wants one contact
  fcl::CollisionResult<S> result;    ///< of all pairs
};

/// For the `collide` of FCL's managers: adds the contacts of two objects, by adaptive_bvh::collide,
/// to a BroadphaseCollision<S>. Ends the manager's search when all that is wanted is found.
///
///     adaptive_bvh::BroadphaseCollision<double> found;
///     manager.collide(&found, adaptive_bvh::collideCallback<double>);
template <typename S>
bool collideCallback(fcl::CollisionObject<S>* o1, fcl::CollisionObject<S>* o2, void* cdata) {
  auto& found = *static_cast<BroadphaseCollision<S>*>(cdata);
  queries::collide<S>(o1, o2, found.request, found.result);
  return found.request.isSatisfied(found.result);
}

/// What `distanceCallback` is given as a manager's `cdata`, and fills.
template <typename S>
struct BroadphaseDistance {
  fcl::DistanceRequest<S> request;  ///< of all pairs
  fcl::DistanceResult<S> result;    ///< of the nearest pair: each search ends at its distance
  const fcl::CollisionObject<S>* first = nullptr;   ///< the nearest pair, as the manager passes it
  const fcl::CollisionObject<S>* second = nullptr;  ///< null where there is none
};

/// For the `distance` of FCL's managers: the distance of two objects, by adaptive_bvh::distance, if
/// it is less than that of the pairs before. Gives the manager the distance from which on pairs do
/// not matter.
template <typename S>
bool distanceCallback(fcl::CollisionObject<S>* o1, fcl::CollisionObject<S>* o2, void* cdata,
                      S& distance) {
  auto& found = *static_cast<BroadphaseDistance<S>*>(cdata);
  const S before = found.result.min_distance;
  queries::distance<S>(o1, o2, found.request, found.result);
  if (found.result.min_distance < before) {
    found.first = o1;
    found.second = o2;
  }
  distance = found.result.min_distance;
  return distance <= 0;
}

/// The object of a manager that is nearest to another object, which the manager need not hold. An
/// object is not compared with itself.
template <typename S>
BroadphaseDistance<S> nearest(fcl::CollisionObject<S>& object,
                              const fcl::BroadPhaseCollisionManager<S>& manager,
                              const fcl::DistanceRequest<S>& request = fcl::DistanceRequest<S>()) {
  BroadphaseDistance<S> found;
  found.request = request;
  manager.distance(&object, &found, distanceCallback<S>);
  return found;
}

}  // namespace adaptive_bvh
