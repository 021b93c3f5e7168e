#include "scene/scene_results.h"

#include "query/single_precision.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

void narrow(const SceneCollisions<double>& from, SceneCollisions<float>& to) {
  to.pairs = from.pairs;
  to.offsets = from.offsets;
  to.contacts.clear();
  for (const fcl::Contactd& contact : from.contacts) to.contacts.push_back(narrowed(contact));
}

void narrow(const SceneTrianglePairs<double>& from, SceneTrianglePairs<float>& to) {
  to.pairs = from.pairs;
  to.offsets = from.offsets;
  narrow(from.found, to.found);
}

void narrow(const SceneVertexContacts<double>& from, SceneVertexContacts<float>& to) {
  to.pairs = from.pairs;
  to.offsets = from.offsets;
  narrow(from.found, to.found);
}

void narrow(const SceneDistance<double>& from, SceneDistance<float>& to) {
  to.bodies = from.bodies;
  to.distance = distanceAs<float>(from.distance);
  to.points = {from.points[0].cast<float>(), from.points[1].cast<float>()};
  to.elements = from.elements;
}

void narrow(const ScenePoint<double>& from, ScenePoint<float>& to) {
  to = {from.body, distanceAs<float>(from.distance), from.point.cast<float>(), from.triangle};
}

void narrow(const SceneRayHit<double>& from, SceneRayHit<float>& to) {
  const RayHit<double>& hit = from.hit;
  to = {from.body,
        {static_cast<float>(hit.t), hit.triangle, static_cast<float>(hit.u),
         static_cast<float>(hit.v)}};
}

}  // namespace adaptive_bvh
