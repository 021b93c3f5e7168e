#include "dispatch/pairs.h"

#include "dispatch/octree_pair.h"
#include "dispatch/shape_pairs.h"
#include "dispatch/shape_search.h"
#include "query/close_triangles.h"
#include "query/contacts.h"
#include "query/nearest_search.h"

namespace adaptive_bvh {
namespace {

using Object = QueryObject;
using Geometry = fcl::CollisionGeometryd;

void distanceOfMeshes(const Object& a, const Object& b, const DistanceQuery<double>& query) {
  NearestPair nearest(a.mesh(), b.mesh(), query);
  constexpr int kMany = 1024;  // else it takes as long as it gains
  if (a.mesh().mesh.numTriangles() + b.mesh().mesh.numTriangles() > kMany) {
    const TrianglePair close = closeTriangles(PairOfMeshes(a.mesh(), b.mesh()));
    nearest.addWitness(int(close.first), int(close.second));
  }
  NearestSearch(a.mesh(), b.mesh(), nearest).run();
}
void collideMeshPair(const Object& a, const Object& b, const Geometry& o1, const Geometry& o2,
                     const CollisionQuery<double>& query) {
  collideMeshes({o1, a.mesh()}, {o2, b.mesh()}, query);
}

MeshShapeSearch shapeSearch(const Object& mesh, const Object& shape) {
  return {mesh.mesh(), shape.solid(), shape.parts().shape().core()};
}
void distanceToShapeOf(const Object& a, const Object& b, const DistanceQuery<double>& query) {
  distanceToShape(shapeSearch(a, b), query);
}
void collideWithShapeOf(const Object& a, const Object& b, const Geometry& o1, const Geometry& o2,
                        const CollisionQuery<double>& query) {
  collideWithShape(shapeSearch(a, b), o1, o2, query);
}

void distanceOfPartsOf(const Object& a, const Object& b, const DistanceQuery<double>& query) {
  distanceOfParts(a.parts(), b.parts(), a.parallel(), query);
}
void collidePartsOf(const Object& a, const Object& b, const Geometry& o1, const Geometry& o2,
                    const CollisionQuery<double>& query) {
  collideParts(a.parts(), b.parts(), a.parallel(), o1, o2, query);
}

#if FCL_HAVE_OCTOMAP
void distanceToMesh(const Object& octree, const Object& mesh, const DistanceQuery<double>& query) {
  distanceToOctree(QueryTriangles(mesh.mesh()), WideNodes(mesh.mesh().tree()),
                   {octree.parts().cells(), octree.parts().tf()}, query);
}
void collideWithMesh(const Object& octree, const Object& mesh, const Geometry& o1,
                     const Geometry& o2, const CollisionQuery<double>& query) {
  collideWithOctree(QueryTriangles(mesh.mesh()), WideNodes(mesh.mesh().tree()),
                    {octree.parts().cells(), octree.parts().tf()}, o1, o2, query);
}
#else  // there are no octrees
constexpr auto distanceToMesh = distanceOfPartsOf;
constexpr auto collideWithMesh = collidePartsOf;
#endif

constexpr PairSearch kParts{false, distanceOfPartsOf, collidePartsOf};

constexpr PairSearch kPairs[3][3] = {
    {{false, distanceOfMeshes, collideMeshPair},
     {false, distanceToShapeOf, collideWithShapeOf},
     {true, distanceToMesh, collideWithMesh}},
    {{true, distanceToShapeOf, collideWithShapeOf}, kParts, kParts},
    {{false, distanceToMesh, collideWithMesh}, kParts, kParts}};

}  // namespace

const PairSearch& searchOf(ObjectKind first, ObjectKind second) {
  return kPairs[static_cast<int>(first)][static_cast<int>(second)];
}

}  // namespace adaptive_bvh
