#include "thesis/displacement_propagation.h"

#include <algorithm>

#include "thesis/post_order.h"

namespace adaptive_bvh {
namespace {

/// The rule of the traversal (post_order.h): thesis 4.3. The value of a node is its D_latest.
template <typename BV>
struct InflationRule {
  using S = typename BV::S;

  int nextPair() { return left -= 2; }
  bool isLeaf(int i) const { return model.getBV(i).isLeaf(); }
  void leaf(int i, S& d_latest) const { d_latest = latest[primitive(i)]; }
  static bool isTraversed(int) { return true; }
  static void skipped(int, S&) {}
  static void merge(S& a, S b) { a = std::max(a, b); }

  void apply(int left_node, S a, S b) {
    inflate(left_node, a);
    inflate(left_node + 1, b);
  }
  void applyRoot(S root) { inflate(0, root); }

  void inflate(int i, S d_latest) {
    BV& bv = model.getBV(i).bv;
    const S current = Volume<BV>::radius(bv);
    S inflated = rounding::sum(current, d_latest);
    if (isLeaf(i) && d_latest > 0) {
      inflated = rounding::sum(original_radius[i], overall[primitive(i)]);
      if (!leaf_radius_may_shrink) inflated = std::max(current, inflated);
    }
    if (inflated == current) return;
    Volume<BV>::setRadius(bv, inflated);
    ++changed;
  }

  int primitive(int leaf) const { return model.getBV(leaf).primitiveId(); }

  fcl::BVHModel<BV>& model;
  const S *original_radius, *latest, *overall;  ///< by node, by primitive, by primitive
  bool leaf_radius_may_shrink;
  int left;         ///< left sibling of the current pair; the number of nodes before the first one
  int changed = 0;  ///< number of volumes whose radius changed
};

}  // namespace

template <typename BV>
void DisplacementPropagation<BV>::reset(const UpdateTarget<BV>& target) {
  const auto nodes = static_cast<std::size_t>(target.nodes());
  const std::size_t primitives = target.tree.topology.slots.leaves();
  target.tree.inflations = Inflations<S>();
  original_radius_.resize(nodes);
  latest_.assign(primitives, S(0));
  overall_.resize(primitives);
  reference_.resize(primitives);
  stack_.resize(target.tree.topology.stackCapacity());
  vertex_motion_.assign(static_cast<std::size_t>(target.model.num_vertices), S(0));
}

template <typename BV>
void DisplacementPropagation<BV>::start(const UpdateTarget<BV>& target, const BV& root) {
  for (int i = 0; i < target.nodes(); ++i) refitted(target, i);
  BV recorded = root;
  Volume<BV>::raiseRadius(recorded);  // as the change detector will do with the root
  original_radius_[0] = Volume<BV>::radius(recorded);
}

template <typename BV>
VertexSummary<typename BV::S> DisplacementPropagation<BV>::read(const UpdateTarget<BV>& target,
                                                                const StepInput<S>& input,
                                                                int first, int last) {
  const Point* const present = target.tree.positions.data();
  VertexSummary<S> summary;
  for (int v = first; v < last; ++v) {
    const Point displacement = input.positions[v] - present[v];
    summary.add(input.positions[v], displacement);
    vertex_motion_[static_cast<std::size_t>(v)] = rounding::norm<S>(displacement);
  }
  return summary;
}

template <typename BV>
void DisplacementPropagation<BV>::measurePrimitives(const fcl::BVHModel<BV>& model) {
  const MeshView<S> mesh = viewOf(model);
  const int corners = mesh.verticesPerPrimitive();
  for (unsigned p = 0; p < latest_.size(); ++p) {
    S latest = 0;
    for (int k = 0; k < corners; ++k) latest = std::max(latest, vertex_motion_[mesh.vertex(p, k)]);
    latest_[p] = latest;
    if (latest == 0) continue;  // the primitive did not move: its overall_ is unchanged
    S overall = 0;
    for (int k = 0; k < corners; ++k)  // in a two-frame update, the positions of both frames
      mesh.forEachPositionOf(mesh.vertex(p, k), [&](const Point& position) {
        overall = std::max(overall, rounding::norm<S>(position - reference_[p][std::size_t(k)]));
      });
    overall_[p] = overall;
  }
}

template <typename BV>
PropagationCounts DisplacementPropagation<BV>::propagate(const UpdateTarget<BV>& target,
                                                         const RefitPolicy& policy, TaskPool&) {
  measurePrimitives(target.model);
  InflationRule<BV> rule{target.model,    original_radius_.data(),       latest_.data(),
                         overall_.data(), policy.leaf_radius_may_shrink, target.nodes()};
  traversePostOrder(stack_.data(), rule);
  return {0, rule.changed};
}

template <typename BV>
void DisplacementPropagation<BV>::refitted(const UpdateTarget<BV>& target, int node) {
  const fcl::BVNode<BV>& fcl_node = target.model.getBV(node);
  original_radius_[static_cast<std::size_t>(node)] = Volume<BV>::radius(fcl_node.bv);
  if (fcl_node.isLeaf())
    restartPrimitive(viewOf(target.model), static_cast<unsigned>(fcl_node.primitiveId()));
}

/// Resets a primitive whose leaf was just fitted to the current positions.
template <typename BV>
void DisplacementPropagation<BV>::restartPrimitive(const MeshView<S>& mesh, unsigned primitive) {
  overall_[primitive] = 0;
  for (int k = 0; k < mesh.verticesPerPrimitive(); ++k)
    reference_[primitive][static_cast<std::size_t>(k)] = mesh.vertices[mesh.vertex(primitive, k)];
}

template <typename BV>
std::size_t DisplacementPropagation<BV>::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return size(original_radius_) + size(latest_) + size(overall_) + size(reference_) +
         size(vertex_motion_) + size(stack_);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class DisplacementPropagation<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
