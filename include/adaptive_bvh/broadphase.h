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
class IntervalTreeObjects : fcl::IntervalTreeCollisionManagerd {
  using Manager = fcl::IntervalTreeCollisionManagerd;

 public:
  static std::vector<fcl::CollisionObjectd*> of(const Manager& manager) {
    const auto& intervals = (manager.*(&IntervalTreeObjects::obj_interval_maps))[0];
    const auto& end_points = (manager.*(&IntervalTreeObjects::endpoints))[0];
    std::vector<fcl::CollisionObjectd*> objects;
    for (const auto& entry : intervals) objects.push_back(entry.first);
    if (manager.*(&IntervalTreeObjects::setup_)) return objects;
    for (std::size_t i = 2 * intervals.size(); i < end_points.size(); ++i)
      if (end_points[i].minmax == 0) objects.push_back(end_points[i].obj);
    return objects;
  }
};

/// Registers exactly these objects, with their present boxes.
inline void refill(fcl::BroadPhaseCollisionManagerd& manager,
                   const std::vector<fcl::CollisionObjectd*>& objects) {
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
inline void refresh(const std::vector<fcl::CollisionObjectd*>& objects,
                    fcl::BroadPhaseCollisionManagerd& manager) {
  for (fcl::CollisionObjectd* object : objects) {
    const auto* geometry = object->collisionGeometry().get();
    // The object was made from a pointer to a geometry that is not const.
    const_cast<fcl::CollisionGeometryd*>(geometry)->computeLocalAABB();
    object->computeAABB();
  }
  if (dynamic_cast<fcl::SaPCollisionManagerd*>(&manager)) {
    std::vector<fcl::CollisionObjectd*> registered;
    manager.getObjects(registered);
    detail::refill(manager, registered);
  } else if (const auto* tree = dynamic_cast<fcl::IntervalTreeCollisionManagerd*>(&manager)) {
    detail::refill(manager, detail::IntervalTreeObjects::of(*tree));
  } else {
    manager.update();
  }
}

/// Updates everything that FCL caches for one object.
inline void refresh(fcl::CollisionObjectd& object, fcl::BroadPhaseCollisionManagerd& manager) {
  refresh(std::vector<fcl::CollisionObjectd*>{&object}, manager);
}

/// Request and result of `collideCallback`: the `cdata` of the manager's call.
struct BroadphaseCollision {
  fcl::CollisionRequestd request;  ///< for all pairs together; FCL's default is one contact
  fcl::CollisionResultd result;    ///< of all pairs
};

/// Callback for the `collide` of FCL's managers: adds the contacts of two objects, found by
/// adaptive_bvh::collide, to a BroadphaseCollision. Returns whether the request is satisfied,
/// which ends the manager's search.
///
///     adaptive_bvh::BroadphaseCollision found;
///     manager.collide(&found, adaptive_bvh::collideCallback);
inline bool collideCallback(fcl::CollisionObjectd* o1, fcl::CollisionObjectd* o2, void* cdata) {
  auto& found = *static_cast<BroadphaseCollision*>(cdata);
  queries::collide(o1, o2, found.request, found.result);
  return found.request.isSatisfied(found.result);
}

/// Request and result of `distanceCallback`: the `cdata` of the manager's call.
struct BroadphaseDistance {
  fcl::DistanceRequestd request;  ///< of all pairs
  fcl::DistanceResultd result;    ///< of the nearest pair, whose distance bounds each search
  const fcl::CollisionObjectd* first = nullptr;   ///< first object of the manager's pair, or null
  const fcl::CollisionObjectd* second = nullptr;  ///< second object of that pair, or null
};

/// Callback for the `distance` of FCL's managers: computes the distance of two objects by
/// adaptive_bvh::distance, and keeps it in a BroadphaseDistance if it is less than that of the
/// previous pairs. Sets `distance` to the smallest distance so far, so that the manager skips pairs
/// that are farther apart.
inline bool distanceCallback(fcl::CollisionObjectd* o1, fcl::CollisionObjectd* o2, void* cdata,
                             double& distance) {
  auto& found = *static_cast<BroadphaseDistance*>(cdata);
  const double before = found.result.min_distance;
  queries::distance(o1, o2, found.request, found.result);
  if (found.result.min_distance < before) {
    found.first = o1;
    found.second = o2;
  }
  distance = found.result.min_distance;
  return distance <= 0;
}

/// Returns the object of a manager that is nearest to `object`, which need not be registered. An
/// object is not compared with itself.
inline BroadphaseDistance nearest(fcl::CollisionObjectd& object,
                                  const fcl::BroadPhaseCollisionManagerd& manager,
                                  const fcl::DistanceRequestd& request = fcl::DistanceRequestd()) {
  BroadphaseDistance found;
  found.request = request;
  manager.distance(&object, &found, distanceCallback);
  return found;
}

}  // namespace adaptive_bvh
