#include "fcl/model_pairs.h"

#include <stdexcept>
#include <string>

// Which pairs of FCL's types have a distance and a collision query, so that others can be refused.
namespace adaptive_bvh {
namespace {

/// The name of a type with its article, for messages.
std::string nameOf(fcl::NODE_TYPE type) {
  if (isShape(type))
    return std::string(type == fcl::GEOM_ELLIPSOID ? "an " : "a ") + nameOfShape(type);
  switch (type) {
    case fcl::BV_AABB: return "a BVHModel of AABB";
    case fcl::BV_OBB: return "a BVHModel of OBB";
    case fcl::BV_RSS: return "a BVHModel of RSS";
    case fcl::BV_kIOS: return "a BVHModel of kIOS";
    case fcl::BV_OBBRSS: return "a BVHModel of OBBRSS";
    case fcl::BV_KDOP16: return "a BVHModel of KDOP 16";
    case fcl::BV_KDOP18: return "a BVHModel of KDOP 18";
    case fcl::BV_KDOP24: return "a BVHModel of KDOP 24";
    case fcl::GEOM_TRIANGLE: return "a TriangleP";
    case fcl::GEOM_OCTREE: return "an octree";
    default: return "a geometry of unknown type";
  }
}

bool isMesh(fcl::NODE_TYPE type) { return type >= fcl::BV_AABB && type <= fcl::BV_KDOP24; }
bool isBounded(fcl::NODE_TYPE type) { return type >= fcl::GEOM_BOX && type <= fcl::GEOM_CONVEX; }
bool isUnbounded(fcl::NODE_TYPE type) {
  return type == fcl::GEOM_PLANE || type == fcl::GEOM_HALFSPACE;
}
bool isOctree(fcl::NODE_TYPE type) { return type == fcl::GEOM_OCTREE; }

/// FCL has distances of meshes only for these volumes.
bool hasMeshDistance(fcl::NODE_TYPE type) {
  return type == fcl::BV_RSS || type == fcl::BV_kIOS || type == fcl::BV_OBBRSS;
}

/// Models whose queries with shapes the library answers itself.
bool isOurs(fcl::NODE_TYPE type) { return type == fcl::BV_RSS || type == fcl::BV_OBBRSS; }

/// Whether a distance query of the library or of FCL answers for the pair. Beyond hasMeshDistance,
/// FCL has distances of two meshes of AABB, and of octrees with any mesh.
bool hasDistance(fcl::NODE_TYPE a, fcl::NODE_TYPE b) {
  if ((isOurs(a) && isUnbounded(b)) || (isUnbounded(a) && isOurs(b))) return true;
  const auto isKnown = [](fcl::NODE_TYPE x) { return isMesh(x) || isBounded(x) || isOctree(x); };
  if (!isKnown(a) || !isKnown(b)) return false;
  if (isMesh(a) && isMesh(b)) return a == b && (hasMeshDistance(a) || a == fcl::BV_AABB);
  if (isMesh(a)) return hasMeshDistance(a) || isOctree(b);
  if (isMesh(b)) return hasMeshDistance(b) || isOctree(a);
  return true;
}

/// Whether a collision query of the library or of FCL answers for the pair. FCL's table has entries
/// that crash: planes and half-spaces with meshes of axis-aligned volumes, planes with convexes.
bool hasCollision(fcl::NODE_TYPE a, fcl::NODE_TYPE b) {
  const auto isKnown = [](fcl::NODE_TYPE x) {
    return isMesh(x) || isBounded(x) || isUnbounded(x) || isOctree(x);
  };
  const auto isAligned = [](fcl::NODE_TYPE x) {
    return isMesh(x) && (x == fcl::BV_AABB || x >= fcl::BV_KDOP16);
  };
  const auto crash = [&](fcl::NODE_TYPE x, fcl::NODE_TYPE y) {
    return (isUnbounded(x) && isAligned(y)) || (x == fcl::GEOM_PLANE && y == fcl::GEOM_CONVEX);
  };
  if (!isKnown(a) || !isKnown(b) || crash(a, b) || crash(b, a)) return false;
  return !isMesh(a) || !isMesh(b) || a == b;
}

/// Throws an exception that names the query and both types.
void refuse(const char* query, fcl::NODE_TYPE a, fcl::NODE_TYPE b) {
  std::string sentence = std::string("adaptive_bvh: FCL cannot compute ") + query + " between " +
                         nameOf(a) + " and " + nameOf(b);
  if (isMesh(a) && isMesh(b) && a != b) sentence += "; use the same volumes in both models";
  if (isUnbounded(a) || isUnbounded(b))
    sentence += "; a large box may stand for the plane or half-space";
  throw std::invalid_argument(sentence);
}

}  // namespace

void requireDistance(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
  if (!hasDistance(first, second)) refuse("the distance", first, second);
}

void requireCollision(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
  if (!hasCollision(first, second)) refuse("a collision", first, second);
}

}  // namespace adaptive_bvh
