#pragma once

#include "adaptive_bvh/scene.h"

namespace adaptive_bvh {

// Rounds a scene's results to float, like query/single_precision.h. The objects of contacts are
// not set; Scene::collisions sets them.
void narrow(const SceneCollisions<double>& from, SceneCollisions<float>& to);
void narrow(const SceneTrianglePairs<double>& from, SceneTrianglePairs<float>& to);
void narrow(const SceneVertexContacts<double>& from, SceneVertexContacts<float>& to);
void narrow(const SceneDistance<double>& from, SceneDistance<float>& to);
void narrow(const ScenePoint<double>& from, ScenePoint<float>& to);
void narrow(const SceneRayHit<double>& from, SceneRayHit<float>& to);

/// The order of Scene::nearest: by distance, then by the other body's id.
template <typename S>
bool isNearerBody(const SceneDistance<S>& a, const SceneDistance<S>& b) {
  return a.distance != b.distance ? a.distance < b.distance : a.bodies.second < b.bodies.second;
}

}  // namespace adaptive_bvh
