#include "thesis/fcl_build.h"

#include <cstddef>
#include <vector>

#include <fcl/geometry/bvh/detail/BV_splitter.h>

#include "hierarchy/bottom_up.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {
namespace {

/// A finished tree in the form that FCL's recursive build needs. FCL visits the nodes in preorder,
/// left before right, and asks for each primitive of a node whether it belongs to the right child.
struct SplitList {
  static constexpr unsigned kLeaf = 0;

  std::vector<unsigned> rank;  ///< by primitive: its leaf index, from left to right
  /// By node in preorder: the smallest rank in its right child; kLeaf for a leaf.
  std::vector<unsigned> right_begin;

  void assign(const OrderedTree& tree) {
    rank.resize(tree.primitives.size());
    for (std::size_t i = 0; i < rank.size(); ++i)
      rank[tree.primitives[i]] = static_cast<unsigned>(i);
    right_begin.clear();
    right_begin.reserve(tree.nodes.size());
    for (const OrderedTree::Node& node : tree.nodes)
      right_begin.push_back(node.isLeaf() ? kLeaf
                                          : tree.nodes[static_cast<std::size_t>(node.right)].first);
  }

  /// Clears the list. Keeps the memory for the next build if the tree was small.
  void clear() {
    constexpr std::size_t kSmall = 1024;
    if (right_begin.capacity() > kSmall) *this = SplitList();
    right_begin.clear();
  }
};

/// The tree of buildBottomUp, which takes positions in double precision.
OrderedTree treeOf(const MeshView<double>& mesh, unsigned count) {
  return OrderedTree(buildBottomUp(mesh, count));
}
OrderedTree treeOf(const MeshView<float>& mesh, unsigned count) {
  std::vector<fcl::Vector3d> positions;  // by vertex, as far as a primitive has it
  for (unsigned p = 0; p < count; ++p)
    for (const unsigned v : mesh.verticesOf(p)) {
      if (v >= positions.size()) positions.resize(v + 1);
      positions[v] = mesh.vertices[v].cast<double>();
    }
  return OrderedTree(buildBottomUp({positions.data(), nullptr, mesh.triangles}, count));
}

/// Makes FCL's build reproduce the tree of buildBottomUp.
template <typename BV>
class BottomUpSplitter final : public fcl::detail::BVSplitterBase<BV> {
 public:
  using S = typename BV::S;

  void set(fcl::Vector3<S>* vertices, fcl::Triangle* triangles, fcl::BVHModelType type) override {
    Build& build = current();
    build.clear();
    build.mesh.vertices = vertices;
    build.mesh.triangles = type == fcl::BVH_MODEL_TRIANGLES ? triangles : nullptr;
  }

  /// Called for each node in preorder, with its primitives. Builds the whole tree at the root,
  /// whose primitives are all there are. A leaf needs no rule.
  void computeRule(const BV&, unsigned* primitives, int count) override {
    Build& build = current();
    if (build.nodes == 0 && count > 1)
      build.splits.assign(treeOf(build.mesh, static_cast<unsigned>(count)));
    const std::size_t node = build.nodes++;
    if (count == 1) return;
    build.right_begin = build.splits.right_begin[node];
    build.next = primitives;
  }

  /// Whether a primitive belongs to the right child. FCL passes only its centre, but it calls this
  /// in the order of the node's array of primitives, and swaps only elements before the current
  /// one, so `next` points to the primitive.
  bool apply(const fcl::Vector3<S>&) const override {
    Build& build = current();
    return build.splits.rank[*build.next++] >= build.right_begin;
  }

  void clear() override { current().clear(); }

 private:
  struct Build {
    MeshView<S> mesh;
    SplitList splits;
    std::size_t nodes = 0;           ///< number of nodes visited
    unsigned right_begin = 0;        ///< SplitList::right_begin of the current node
    const unsigned* next = nullptr;  ///< next primitive of the current node

    void clear() {
      splits.clear();
      nodes = 0;
    }
  };

  /// The build of the calling thread.
  static Build& current() {
    static thread_local Build build;
    return build;
  }
};

/// FCL's own splitter at the mean of the centres, one per thread.
template <typename BV>
class TopDownSplitter final : public fcl::detail::BVSplitterBase<BV> {
 public:
  using S = typename BV::S;

  void set(fcl::Vector3<S>* vertices, fcl::Triangle* triangles, fcl::BVHModelType type) override {
    rule().set(vertices, triangles, type);
  }
  void computeRule(const BV& bv, unsigned* primitives, int count) override {
    rule().computeRule(bv, primitives, count);
  }
  bool apply(const fcl::Vector3<S>& q) const override { return rule().apply(q); }
  void clear() override { rule().clear(); }

 private:
  using Rule = fcl::detail::BVSplitter<BV>;
  static Rule& rule() {
    static thread_local Rule mean_split(fcl::detail::SPLIT_METHOD_MEAN);
    return mean_split;
  }
};

/// Fits by Volume::fit; see sharedFitter.
template <typename BV>
class Fitter final : public fcl::detail::BVFitterBase<BV> {
 public:
  using S = typename BV::S;

  void set(fcl::Vector3<S>* vertices, fcl::Triangle* triangles, fcl::BVHModelType type) override {
    set(vertices, nullptr, triangles, type);
  }

  void set(fcl::Vector3<S>* vertices, fcl::Vector3<S>* previous, fcl::Triangle* triangles,
           fcl::BVHModelType type) override {
    mesh().vertices = vertices;
    mesh().previous = previous;
    mesh().triangles = type == fcl::BVH_MODEL_TRIANGLES ? triangles : nullptr;
  }

  BV fit(unsigned int* primitives, int count) override {
    return Volume<BV>::fit(mesh(), primitives, count);
  }

  void clear() override { mesh() = MeshView<S>(); }

 private:
  /// The mesh that the calling thread builds or refits.
  static MeshView<S>& mesh() {
    static thread_local MeshView<S> view;
    return view;
  }
};

}  // namespace

template <typename BV>
std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter(HierarchyStrategy strategy) {
  static const auto bottom_up = std::make_shared<BottomUpSplitter<BV>>();
  static const auto top_down = std::make_shared<TopDownSplitter<BV>>();
  if (strategy == HierarchyStrategy::BottomUp) return bottom_up;
  return top_down;
}

template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter() {
  static const auto fitter = std::make_shared<Fitter<BV>>();
  return fitter;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                           \
  template std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter(HierarchyStrategy); \
  template std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
