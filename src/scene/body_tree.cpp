#include "scene/body_tree.h"

#include <memory>

#include "base/task_pool.h"
#include "hierarchy/bottom_up.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

void BodyTree::clear() { corners_.clear(); }

void BodyTree::update(const std::vector<WorldBox>& boxes) {
  constexpr double kRebuildGrowth = 1.5;
  const bool is_new = boxes.size() != built_count_;
  corners_.clear();
  for (const WorldBox& box : boxes) {
    corners_.push_back(box.low);
    corners_.push_back(box.high);
  }
  if (!is_new) refit();
  if (is_new || cost() > kRebuildGrowth * built_cost_) build();
}

void BodyTree::build() {
  const auto count = static_cast<unsigned>(size());
  built_count_ = 0;  // stays 0 if the build throws
  std::vector<fcl::Triangle> triangles;
  for (std::size_t i = 0; i < count; ++i) triangles.emplace_back(2 * i, 2 * i + 1, 2 * i + 1);
  const MeshView<double> mesh{corners_.data(), nullptr, triangles.data()};
  const OrderedTree order(buildBottomUp(mesh, count));
  auto leaves = std::make_shared<LeafTriangles>();
  leaves->assign(order, mesh, count, corners_.size());
  tree_ = WideTree(order, std::move(leaves));
  refit();
  built_cost_ = cost();
  built_count_ = count;
}

/// Refits in the axes of the world, with the origin at the centre of all boxes.
void BodyTree::refit() {
  fcl::Vector3d low = corners_[0], high = corners_[1];
  for (std::size_t i = 0; i < corners_.size(); i += 2) {
    low = low.cwiseMin(corners_[i]);
    high = high.cwiseMax(corners_[i + 1]);
  }
  const BodyCoordinates coordinates =
      BodyCoordinates::about((low + high) / 2, fcl::Matrix3d::Identity(), 2 * (high - low).norm());
  tree_.refit(corners_.data(), coordinates, TaskPool(1));
}

/// Half the sum of the surface areas of the inner nodes' boxes, in the world's units.
double BodyTree::cost() const {
  double sum = 0;
  for (int n = 0; n < tree_.size(); ++n) {
    const WideNode& node = tree_.nodes()[n];
    for (int i = 0; !node.isLeaf() && i < int(node.count); ++i) {
      const Box box = node.boxes.box(i);
      const Float4 side = box.high - box.low;
      sum += double(side[0] * side[1] + side[1] * side[2] + side[2] * side[0]);
    }
  }
  return sum / (tree_.scale() * tree_.scale());
}

}  // namespace adaptive_bvh
