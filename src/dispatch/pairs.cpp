#include "dispatch/pairs.h"

#include "dispatch/octree_pair.h"
#include "dispatch/shape_pairs.h"
#include "dispatch/shape_search.h"
#include "query/contacts/contacts.h"
#include "query/nearest/close_triangles.h"
#include "query/nearest/nearest_search.h"

// The table of pairs: which search answers the queries of two kinds of objects.
namespace adaptive_bvh {
namespace {

using Reported = fcl::CollisionGeometryd;  ///< an object that contacts refer to

void distanceOfMeshes(const QueryObject& a, const QueryObject& b, const DistanceQuery& query) {
  NearestPair nearest(a.mesh(), b.mesh(), query);
  constexpr int kMinTriangles = 1024;  // for fewer triangles closeTriangles costs what it saves
  if (a.mesh().mesh.numTriangles() + b.mesh().mesh.numTriangles() > kMinTriangles) {
    const TrianglePair close = closeTriangles(PairOfMeshes(a.mesh(), b.mesh()));
    nearest.addWitness(int(close.first), int(close.second));
  }
  NearestSearch(a.mesh(), b.mesh(), nearest).run();
}
void collideMeshPair(const QueryObject& a, const QueryObject& b, const Reported& o1,
                     const Reported& o2, const CollisionQuery& query) {
  collideMeshes({o1, a.mesh()}, {o2, b.mesh()}, query);
}

MeshShapeSearch shapeSearch(const QueryObject& mesh, const QueryObject& shape) {
  return {mesh.mesh(), shape.solid(), shape.parts().shape().core()};
}
void distanceToShapeOf(const QueryObject& a, const QueryObject& b, const DistanceQuery& query) {
  distanceToShape(shapeSearch(a, b), query);
}
void collideWithShapeOf(const QueryObject& a, const QueryObject& b, const Reported& o1,
                        const Reported& o2, const CollisionQuery& query) {
  collideWithShape(shapeSearch(a, b), o1, o2, query);
}

void distanceOfPartsOf(const QueryObject& a, const QueryObject& b, const DistanceQuery& query) {
  distanceOfParts(a.parts(), b.parts(), query);
}
void collidePartsOf(const QueryObject& a, const QueryObject& b, const Reported& o1,
                    const Reported& o2, const CollisionQuery& query) {
  collideParts(a.parts(), b.parts(), o1, o2, query);
}

#if FCL_HAVE_OCTOMAP
void distanceToMesh(const QueryObject& octree, const QueryObject& mesh,
                    const DistanceQuery& query) {
  distanceToOctree(QueryTriangles(mesh.mesh()), WideNodes(mesh.mesh().tree()),
                   {octree.parts().cells(), octree.parts().tf()}, query);
}
void collideWithMesh(const QueryObject& octree, const QueryObject& mesh, const Reported& o1,
                     const Reported& o2, const CollisionQuery& query) {
  collideWithOctree(QueryTriangles(mesh.mesh()), WideNodes(mesh.mesh().tree()),
                    {octree.parts().cells(), octree.parts().tf()}, o1, o2, query);
}
#else  // without octrees
constexpr auto distanceToMesh = distanceOfPartsOf;
constexpr auto collideWithMesh = collidePartsOf;
#endif

constexpr PairSearch kParts{false, distanceOfPartsOf, collidePartsOf};

/// By kinds: a row for each first object, a column for each second.
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
