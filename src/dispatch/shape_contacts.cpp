// Contacts of a mesh's vertices with a shape: candidates by the tree, distances by Solid::surface.
#include <limits>

#include "adaptive_bvh/penetration.h"
#include "base/rigid.h"
#include "dispatch/shape_search.h"
#include "query/contacts/vertex_contacts.h"

namespace adaptive_bvh {
namespace {

/// Adds the vertices that may be at most `margin` from a shape: the leaves near it own them.
void findCandidates(const PlacedMesh& mesh, const ShapeInTree& shape, double margin,
                    std::vector<VertexCandidate>& candidates) {
  const WideTree& tree = mesh.tree();
  const FeatureLeaves& features = mesh.mesh.topology->features;
  const Float4 limit = float4::all(shape.squaredLimit(margin));
  TreeWalk(tree).visitLeaves(
      [&](const Boxes4& boxes) { return float4::bits(shape.squaredGaps(boxes) <= limit); },
      [&](const WideNode& node, unsigned) {
        const auto& leaf = features.leaves()[static_cast<std::size_t>(node.leaf)];
        for (unsigned i = 0; i < leaf.num_vertices; ++i)
          candidates.push_back({features.vertices()[4 * leaf.vertices + i].vertex, false});
        return false;
      });
}

}  // namespace

void findVertexContacts(const PlacedMesh& mesh, const ShapeSolid& shape,
                        const fcl::Transform3d& shape_tf, double margin, VertexContacts& result) {
  ContactWriter writer(mesh, shape_tf);
  const RelativePlacement to_shape(shape_tf, mesh.tf);
  const ShapeInTree in_tree(shape.core(), shape_tf, mesh.tree(), mesh.tf);
  if (in_tree.isPrecise())
    findCandidates(mesh, in_tree, margin, writer.candidates());
  else
    writer.addAll();
  const auto test = [&](const VertexCandidate& candidate, VertexContact& contact) {
    const ShapeSurface found = shape->surface(to_shape(mesh.mesh.vertices[candidate.vertex]));
    contact = {found.distance, found.nearest, -found.outward, fcl::Vector3d::Zero(), -1};
    return found.distance <= margin;
  };
  writer.write(
      mesh.mesh.threads, [&] { return test; }, result);
}

std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const fcl::CollisionGeometryd& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& result) {
  if (const auto* second_mesh = dynamic_cast<const DeformableMesh*>(&second))
    return vertexContacts(first, tf1, *second_mesh, tf2, distance, result);
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  const ShapeSolid shape(second);
  findVertexContacts({first, tf1}, shape, tf2, distance, result);
  return result.size();
}

}  // namespace adaptive_bvh
