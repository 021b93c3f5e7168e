// Contacts of a mesh's vertices with a shape: candidates by the tree, distances by Solid::surface.
#include <limits>

#include "adaptive_bvh/penetration.h"
#include "base/rigid.h"
#include "dispatch/shape_search.h"
#include "query/contacts/vertex_contacts.h"
#include "query/single_precision.h"

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
                        const fcl::Transform3d& shape_tf, double margin,
                        VertexContacts<double>& result) {
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
      mesh.mesh.query_threads, [&] { return test; }, result);
}

template <typename S>
std::size_t vertexContacts(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                           const fcl::CollisionGeometry<S>& other,
                           const fcl::Transform3<S>& other_tf, NonDeduced<S> margin,
                           VertexContacts<S>& result) {
  if (const auto* other_mesh = dynamic_cast<const DeformableMesh<S>*>(&other))
    return vertexContacts(mesh, tf, *other_mesh, other_tf, margin, result);
  requireDistance(margin, "margin");
  requireRigid(tf);
  requireRigid(other_tf);
  const ShapeSolid shape(other);
  answerInDouble(result, [&](VertexContacts<double>& contacts) {
    findVertexContacts({mesh, tf}, shape, other_tf.template cast<double>(),
                       static_cast<double>(margin), contacts);
  });
  return result.size();
}

template std::size_t vertexContacts(const DeformableMesh<float>&, const fcl::Transform3<float>&,
                                    const fcl::CollisionGeometry<float>&,
                                    const fcl::Transform3<float>&, float, VertexContacts<float>&);
template std::size_t vertexContacts(const DeformableMesh<double>&, const fcl::Transform3<double>&,
                                    const fcl::CollisionGeometry<double>&,
                                    const fcl::Transform3<double>&, double,
                                    VertexContacts<double>&);

}  // namespace adaptive_bvh
