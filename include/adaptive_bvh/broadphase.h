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

/// Finds the objects of an interval tree manager. Its getObjects is wrong after unregisterObject,
/// which drops end points of other objects and may keep those of the object itself. Its map from
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

/// Registers exactly these objects, with their present boxes.
template <typename S>
void refill(fcl::BroadPhaseCollisionManager<S>& manager,
            const std::vector<fcl::CollisionObject<S>*>& objects) {
  manager.clear();
  manager.registerObjects(objects);
  manager.setup();
}

}  // namespace detail

/// Updates everything that FCL caches for deformed objects: the geometry's local box, the object's
/// box in the world, and the manager. Call it after the updates of the models and before the next
/// query of the manager. Each of FCL's own calls does one of the three; if one is left out,
/// managers miss collisions. The objects must be registered, and all objects that share a geometry
/// must be passed. Objects that only moved may be passed, too.
///
/// fcl::SaPCollisionManager loses pairs when boxes grow and shrink, and
/// fcl::IntervalTreeCollisionManager after unregisterObject, even if they are updated; these two
/// are rebuilt. All other managers of FCL are updated. After unregisterObject of an interval tree
/// manager call refresh before its setup or update; `objects` may be empty.
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

/// Updates everything that FCL caches for one object.
template <typename S>
void refresh(fcl::CollisionObject<S>& object, fcl::BroadPhaseCollisionManager<S>& manager) {
  refresh(std::vector<fcl::CollisionObject<S>*>{&object}, manager);
}

/// Request and result of `collideCallback`: the `cdata` of the manager's call.
template <typename S>
struct BroadphaseCollision {
  fcl::CollisionRequest<S> request;  ///< for all pairs together; FCL's default is one contact
  fcl::CollisionResult<S> result;    ///< of all pairs
};

/// Callback for the `collide` of FCL's managers: adds the contacts of two objects, found by
/// adaptive_bvh::collide, to a BroadphaseCollision<S>. Returns whether the request is satisfied,
/// which ends the manager's search.
///
///     adaptive_bvh::BroadphaseCollision<double> found;
///     manager.collide(&found, adaptive_bvh::collideCallback<double>);
template <typename S>
bool collideCallback(fcl::CollisionObject<S>* o1, fcl::CollisionObject<S>* o2, void* cdata) {
  auto& found = *static_cast<BroadphaseCollision<S>*>(cdata);
  queries::collide<S>(o1, o2, found.request, found.result);
  return found.request.isSatisfied(found.result);
}

/// Request and result of `distanceCallback`: the `cdata` of the manager's call.
template <typename S>
struct BroadphaseDistance {
  fcl::DistanceRequest<S> request;  ///< of all pairs
  fcl::DistanceResult<S> result;    ///< of the nearest pair, whose distance bounds each search
  const fcl::CollisionObject<S>* first = nullptr;   ///< first object of the manager's pair, or null
  const fcl::CollisionObject<S>* second = nullptr;  ///< second object of that pair, or null
};

/// Callback for the `distance` of FCL's managers: computes the distance of two objects by
/// adaptive_bvh::distance, and keeps it in a BroadphaseDistance<S> if it is less than that of the
/// previous pairs. Sets `distance` to the smallest distance so far, so that the manager skips pairs
/// that are farther apart.
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

/// Returns the object of a manager that is nearest to `object`, which need not be registered. An
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
