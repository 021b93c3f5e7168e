#include "thesis/adaptive_tree.h"

#include "base/leased.h"
#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

template <typename BV>
void Topology::assign(const fcl::BVHModel<BV>& model) {
  const auto nodes = static_cast<std::size_t>(model.getNumBVs());
  OrderedTree tree;  // FCL's tree, in the form that VertexSlots reads
  tree.nodes.reserve(nodes);
  links.resize(nodes);
  tree.primitives.resize((nodes + 1) / 2);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    const auto first = static_cast<unsigned>(node.first_primitive);
    tree.nodes.push_back({node.isLeaf() ? -1 : node.leftChild(),
                          node.isLeaf() ? -1 : node.rightChild(), first,
                          static_cast<unsigned>(node.num_primitives)});
    links[static_cast<std::size_t>(i)] = node.isLeaf() ? -1 - int(first) : node.leftChild();
    if (node.isLeaf()) tree.primitives[first] = static_cast<unsigned>(node.primitiveId());
  }
  MeshView<double> corners;  // without positions
  corners.triangles = viewOf(model).triangles;
  slots.assign(tree, corners, static_cast<std::size_t>(model.num_vertices));
  depth = 0;
  Scratch<int> depth_of(nodes, 0);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    depth = std::max(depth, depth_of[i]);
    if (node.isLeaf()) continue;
    for (int child : {node.leftChild(), node.rightChild()}) depth_of[child] = depth_of[i] + 1;
  }
}

DirtyNodes Topology::dirtyNodes(std::size_t num_vertices) const {
  const auto pairOf = [](int node) { return static_cast<unsigned>(node + 1) / 2; };
  const int nodes = static_cast<int>(links.size());
  std::vector<unsigned> parents(slots.leaves(), 0);
  for (int i = 0; i < nodes; ++i)
    if (!isLeaf(i)) parents[innerIndex(i) + 1] = pairOf(i);
  return {num_vertices, std::move(parents), [&](const auto& visit) {
            for (int i = 0; i < nodes; ++i)
              if (isLeaf(i))
                for (unsigned v : slots.verticesOf(static_cast<std::size_t>(leafIndex(i))))
                  visit(v, pairOf(i));
          }};
}

template <typename BV>
void AdaptiveTree<BV>::assign(const fcl::BVHModel<BV>& model) {
  ++resets;
  topology.assign(model);
  positions.assign(model.vertices, model.vertices + model.num_vertices);
  statistics.reset(model.getNumBVs());
  refits.reset(model.getNumBVs());
}

template <typename BV>
void AdaptiveTree<BV>::restartCoordinateSum(const fcl::BVHModel<BV>& model) {
  inflations.restart();
  for (int i = 0; i < model.getNumBVs(); ++i)
    inflations.include(Volume<BV>::cornerSum(model.getBV(i).bv));
}

template <typename BV>
BV UpdateTarget<BV>::fitted(int node) const {
  const fcl::BVNode<BV>& fcl_node = model.getBV(node);
  const Leased<std::vector<VertexIndices>> memory;
  std::vector<VertexIndices>& triangles = *memory;  // those below the node
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  triangles.resize(static_cast<std::size_t>(fcl_node.num_primitives));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    triangles[i] = tree.topology.slots.verticesOf(first + i);
  return Volume<BV>::fit(viewOf(model), triangles.data(), fcl_node.num_primitives);
}

namespace {

/// The primitive of each leaf, in leaf order (by BVNode::first_primitive); empty if the leaves do
/// not contain every primitive once.
template <typename BV>
std::vector<unsigned> leafOrder(const fcl::BVHModel<BV>& model, int primitives) {
  std::vector<unsigned> order(static_cast<std::size_t>(primitives));
  std::vector<bool> index_taken(order.size()), primitive_taken(order.size());
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (!node.isLeaf()) continue;
    const int index = node.first_primitive;
    const int primitive = node.primitiveId();
    if (index < 0 || index >= primitives || primitive >= primitives || index_taken[index] ||
        primitive_taken[primitive])
      return {};
    index_taken[index] = primitive_taken[primitive] = true;
    order[index] = static_cast<unsigned>(primitive);
  }
  return order;
}

/// Whether node i precedes its children, and its leaves are its left child's, then its right
/// child's.
template <typename BV>
bool linksHold(const fcl::BVHModel<BV>& model, int i) {
  const fcl::BVNode<BV>& node = model.getBV(i);
  if (node.isLeaf()) return node.num_primitives == 1;
  if (node.leftChild() <= i || node.rightChild() >= model.getNumBVs()) return false;
  const fcl::BVNode<BV>& left = model.getBV(node.leftChild());
  const fcl::BVNode<BV>& right = model.getBV(node.rightChild());
  return left.first_primitive == node.first_primitive &&
         right.first_primitive == left.first_primitive + left.num_primitives &&
         left.num_primitives + right.num_primitives == node.num_primitives;
}

}  // namespace

template <typename BV>
bool checkTree(const fcl::BVHModel<BV>& model, std::string* reason) {
  const auto fail = [reason](const std::string& what) {
    if (reason) *reason = what;
    return false;
  };
  const int nodes = model.getNumBVs();
  if (nodes == 0) return true;
  const int primitives = model.num_tris > 0 ? model.num_tris : model.num_vertices;
  if (nodes != 2 * primitives - 1)
    return fail(std::to_string(nodes) + " nodes for " + std::to_string(primitives) + " primitives");
  const std::vector<unsigned> order = leafOrder(model, primitives);
  if (order.empty()) return fail("the leaves do not hold every primitive once");

  const MeshView<typename BV::S> mesh = viewOf(model);
  for (int i = 0; i < nodes; ++i) {
    if (!linksHold(model, i)) return fail("node " + std::to_string(i) + " has wrong links");
    const fcl::BVNode<BV>& node = model.getBV(i);
    for (int k = 0; k < node.num_primitives; ++k) {
      const unsigned primitive = order[node.first_primitive + k];
      bool inside = true;
      mesh.forEachPosition(primitive,
                           [&](const auto& p) { inside &= Volume<BV>::contains(node.bv, p); });
      if (!inside)
        return fail("node " + std::to_string(i) + " does not contain primitive " +
                    std::to_string(primitive));
    }
  }
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                        \
  template void Topology::assign(const fcl::BVHModel<BV>&); \
  template struct AdaptiveTree<BV>;                         \
  template struct UpdateTarget<BV>;                         \
  template bool checkTree(const fcl::BVHModel<BV>&, std::string*);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
