#pragma once

#include <vector>

#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl/narrowphase/collision_object.h>

namespace adaptive_bvh {

/// Brings everything that FCL caches of deformed objects up to date, after the updates of their
/// models and before the next query of the manager: the geometry's local box, the object's box in
/// the world, and the manager. Each of FCL's own calls does one of the three; when one is left out,
/// managers miss collisions. The objects must be registered; of those that share a geometry, all
/// must be named. Objects that only moved may be named, too.
///
/// fcl::SaPCollisionManager loses pairs when boxes grow and shrink, also when it is updated; it is
/// filled anew. All other managers of FCL are updated.
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
    manager.clear();
    manager.registerObjects(registered);
    manager.setup();
  } else {
    manager.update();
  }
}

/// For one object.
template <typename S>
void refresh(fcl::CollisionObject<S>& object, fcl::BroadPhaseCollisionManager<S>& manager) {
  refresh(std::vector<fcl::CollisionObject<S>*>{&object}, manager);
}

}  // namespace adaptive_bvh
