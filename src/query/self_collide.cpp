#include "adaptive_bvh/self_collision.h"

#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "model_state.h"
#include "query/mesh_collision_node.h"
#include "query/queried_mesh.h"
#include "query/recording_node.h"
#include "query/unset_fields.h"
#include "query/volume_separation.h"
#include "volume/rss.h"

namespace adaptive_bvh {
namespace {

/// Volumes and triangles of one mesh against each other, all in its own frame.
template <typename S>
class SelfCollisionNode : public MeshCollisionNode<S> {
 public:
  SelfCollisionNode() { this->contacts_per_pair = 1; }

  NeighbourFilter filter = NeighbourFilter::SharedVertex;

  /// FCL's own test takes the distance of their rectangles, which may be too large where these are
  /// nearly parallel, as neighbours are.
  bool BVTesting(int b1, int b2) const override {
    const fcl::RSS<S>&a = this->model1->getBV(b1).bv, &b = this->model1->getBV(b2).bv;
    const auto reach = [](const fcl::RSS<S>& bv) -> S {
      return Volume<fcl::RSS<S>>::reach(bv) + bv.l[0] + bv.l[1];
    };
    const VolumeSeparation<S> separation(this->R, this->T, reach(a), reach(b));
    return separation(a, b, fcl::Vector3<S>::Zero(), S(0)) > 0;
  }

  void leafTesting(int b1, int b2) const override {
    if (!areNeighbours(b1, b2)) MeshCollisionNode<S>::leafTesting(b1, b2);
  }

 protected:
  bool areNeighbours(int leaf1, int leaf2) const {
    if (filter == NeighbourFilter::None) return false;
    const fcl::Triangle &a = this->tri_indices1[this->model1->getBV(leaf1).primitiveId()],
                        &b = this->tri_indices1[this->model1->getBV(leaf2).primitiveId()];
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) shared += a[i] == b[j];
    return shared >= (filter == NeighbourFilter::SharedEdge ? 2 : 1);
  }
};

/// The same by the boxes, which also know the tree: FCL's nodes are not touched above the leaves.
/// Their volumes are not asked for, so it does not matter here how tight they are: visits are no
/// evidence for test D.
template <typename S>
class BoxedSelfCollisionNode : public SelfCollisionNode<S> {
 public:
  explicit BoxedSelfCollisionNode(const Recorder& recorder) : recorder_(recorder) {}
  ~BoxedSelfCollisionNode() override { recorder_.addQuery(work_); }

  void setBoxes(const Boxes<S>& boxes) {
    boxes_ = &boxes;
    // What the two boxes may be off, and what their difference rounds: docs/bounds.md, 4.
    slack_ = lanes::all(3 * BodyFrame<S>::kError * boxes[0].box().reach());
  }

  bool isFirstNodeLeaf(int b) const override { return (*boxes_)[b].isLeaf(); }
  bool isSecondNodeLeaf(int b) const override { return (*boxes_)[b].isLeaf(); }
  int getFirstLeftChild(int b) const override { return (*boxes_)[b].left(); }
  int getFirstRightChild(int b) const override { return (*boxes_)[b].left() + 1; }
  int getSecondLeftChild(int b) const override { return (*boxes_)[b].left(); }
  int getSecondRightChild(int b) const override { return (*boxes_)[b].left() + 1; }

  /// The larger one is split.
  bool firstOverSecond(int b1, int b2) const override {
    const NodeBox &a = (*boxes_)[b1], &b = (*boxes_)[b2];
    return b.isLeaf() || (!a.isLeaf() && squaredDiagonal(a) > squaredDiagonal(b));
  }

  bool BVTesting(int b1, int b2) const override {
    ++work_.box_tests;
    const Box a = (*boxes_)[b1].box(), b = (*boxes_)[b2].box();
    const bool disjoint = lanes::largest(lanes::upper(a.low - b.high, b.low - a.high) - slack_) > 0;
    if (!disjoint) recorder_.addVisit(b1, b2);
    return disjoint;
  }

  void leafTesting(int b1, int b2) const override {
    if (this->areNeighbours(b1, b2)) return;
    ++work_.leaf_tests;
    MeshCollisionNode<S>::leafTesting(b1, b2);
  }

 private:
  static float squaredDiagonal(const NodeBox& node) {
    const Box box = node.box();
    return lanes::sum((box.high - box.low) * (box.high - box.low));
  }

  Recorder recorder_;
  const Boxes<S>* boxes_ = nullptr;
  Lanes slack_;
  mutable QueryWork work_;
};

template <typename Node, typename S, typename SetUp>
void run(const fcl::BVHModel<fcl::RSS<S>>& model, const fcl::Transform3<S>& tf,
         const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
         const Recorder& recorder, SetUp&& set_up) {
  Node node(recorder);
  using Base = fcl::detail::MeshCollisionTraversalNodeRSS<S>;
  fcl::detail::initialize(static_cast<Base&>(node), model, tf, model, tf, request, result);
  node.R.setIdentity();  // tf to tf, exactly
  node.T.setZero();
  set_up(node);
  fcl::detail::selfCollide(static_cast<fcl::detail::CollisionTraversalNodeBase<S>*>(&node));
}

}  // namespace

template <typename BV>
std::size_t selfCollide(const AdaptiveBVHModel<BV>& model,
                        const fcl::Transform3<typename BV::S>& tf,
                        const fcl::CollisionRequest<typename BV::S>& request,
                        fcl::CollisionResult<typename BV::S>& result, NeighbourFilter filter) {
  using S = typename BV::S;
  model.getNodeType();  // repairs a tree changed behind our back
  const fcl::BVHModel<BV>& mesh = withTriangles<S>(&model);
  if (request.num_max_contacts == 0 || request.isSatisfied(result)) return result.numContacts();
  const std::size_t before = result.numContacts();
  const AdaptiveTree<BV>& tree = detail::ModelAccess<BV>::tree(model);
  Recorder recorder;
  recorder.side[0] = recorder.side[1] = &tree.evidence;
  if (tree.boxes)
    run<BoxedSelfCollisionNode<S>>(mesh, tf, request, result, recorder, [&](auto& node) {
      node.filter = filter;
      node.setBoxes(*tree.boxes);
    });
  else
    run<RecordingCollisionNode<SelfCollisionNode<S>, S>>(mesh, tf, request, result, recorder,
                                                         [&](auto& node) { node.filter = filter; });
  if (!request.enable_contact) unsetFields(result, before);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                            \
  template std::size_t selfCollide(const AdaptiveBVHModel<fcl::RSS<S>>&,                       \
                                   const fcl::Transform3<S>&, const fcl::CollisionRequest<S>&, \
                                   fcl::CollisionResult<S>&, NeighbourFilter);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
