#include "body.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

std::vector<std::uint32_t> cornersOf(const fcl::Triangle* triangles, std::size_t count) {
  std::vector<std::uint32_t> corners;
  for (std::size_t t = 0; t < count; ++t)
    for (int k = 0; k < 3; ++k) corners.push_back(static_cast<std::uint32_t>(triangles[t][k]));
  return corners;
}

template <typename S>
void setPlace(VolumeRecord& record, const fcl::Vector3<S>& corner, const fcl::Matrix3<S>& axes,
              const fcl::Vector3d& low) {
  for (int k = 0; k < 3; ++k) {
    record.corner[k] = static_cast<float>(static_cast<double>(corner[k]) - low[k]);
    for (int side = 0; side < 2; ++side) record.axis[side][k] = static_cast<float>(axes(k, side));
  }
}

template <typename S>
void setShape(VolumeRecord& record, const fcl::RSS<S>& rss, const fcl::Vector3d& low) {
  setPlace<S>(record, rss.To, rss.axis, low);
  for (int side = 0; side < 2; ++side) record.side[side] = static_cast<float>(rss.l[side]);
  record.radius = static_cast<float>(rss.r);
}

template <typename S>
void setShape(VolumeRecord& record, const fcl::OBBRSS<S>& volume, const fcl::Vector3d& low) {
  const fcl::OBB<S>& box = volume.obb;
  const fcl::Vector3<S> corner =
      box.To - box.axis.col(0) * box.extent[0] - box.axis.col(1) * box.extent[1];
  setPlace<S>(record, corner, box.axis, low);
  for (int side = 0; side < 2; ++side) record.side[side] = static_cast<float>(2 * box.extent[side]);
  record.radius = static_cast<float>(box.extent[2]);
}

template <typename S>
const fcl::RSS<S>& sweptRectangle(const fcl::RSS<S>& rss) {
  return rss;
}
template <typename S>
const fcl::RSS<S>& sweptRectangle(const fcl::OBBRSS<S>& volume) {
  return volume.rss;
}

/// The inflation factor of thesis 4.4.1, against InflationReference::NodeSize.
template <typename S>
float inflationOf(const fcl::RSS<S>& rss, S original_radius) {
  const S inflation = rss.r - original_radius;
  if (!(inflation > 0)) return 0;
  const S half = original_radius + std::min(rss.l[0], rss.l[1]) / 2;
  const S size = half > 0 ? half : std::max(rss.l[0], rss.l[1]);
  return size > 0 ? static_cast<float>(inflation / size) : 1;
}

/// The volumes of one model in one frame.
template <typename BV>
class VolumeReader {
 public:
  VolumeReader(const AdaptiveBVHModel<BV>& model, const VolumeChoice& choice,
               const fcl::Vector3d& low, std::vector<VolumeRecord>& out)
      : model_(model), choice_(choice), low_(low), out_(out) {
    // Also brings nodes up to date that were changed through a fcl::BVHModel reference.
    model_.getNodeType();
    if (choice_.refits) refitted_ = model_.refittedNodes();
  }

  void read() {
    readBelow(0, 0);
    const std::size_t all = refitted_.size(),
                      count = std::min(all, static_cast<std::size_t>(choice_.deeper_refits));
    for (std::size_t i = 0; i < count; ++i)
      add(refitted_[i * all / count], choice_.depth + 1, true);
  }

 private:
  /// What is refitted among them is taken out of the list.
  void readBelow(int node, int depth) {
    const fcl::BVNodeBase& at = model_.getBV(node);
    const auto found = std::lower_bound(refitted_.begin(), refitted_.end(), node);
    const bool refitted = found != refitted_.end() && *found == node;
    if (refitted) refitted_.erase(found);
    add(node, depth, refitted);
    if (depth == choice_.depth || at.isLeaf()) return;
    readBelow(at.leftChild(), depth + 1);
    readBelow(at.rightChild(), depth + 1);
  }

  void add(int node, int depth, bool refitted) {
    const fcl::BVNode<BV>& at = model_.getBV(node);
    VolumeRecord record;
    setShape(record, at.bv, low_);
    record.inflation = inflationOf(sweptRectangle(at.bv), model_.originalRadius(node));
    record.depth = static_cast<float>(depth);
    record.leaf = at.isLeaf();
    record.refitted = refitted;
    out_.push_back(record);
  }

  const AdaptiveBVHModel<BV>& model_;
  const VolumeChoice& choice_;
  const fcl::Vector3d& low_;
  std::vector<VolumeRecord>& out_;
  std::vector<int> refitted_;
};

template <typename BV>
class ModelSource : public BodySource {
 public:
  explicit ModelSource(const AdaptiveBVHModel<BV>& model) : model_(model) {}

  int vertices() const override { return model_.num_vertices; }
  int triangleCount() const override { return model_.num_tris; }
  std::vector<std::uint32_t> triangles() const override {
    return cornersOf(model_.tri_indices, static_cast<std::size_t>(model_.num_tris));
  }
  VolumeKind volumeKind() const override {
    const bool swept = std::is_same<BV, fcl::RSS<typename BV::S>>::value;
    return swept ? VolumeKind::SweptRectangle : VolumeKind::Box;
  }
  PointBlock appendPositions(Blob& blob) const override {
    return appendPoints(model_.vertices, static_cast<std::size_t>(model_.num_vertices), blob);
  }
  void readVolumes(const VolumeChoice& choice, const fcl::Vector3d& low,
                   std::vector<VolumeRecord>& out) const override {
    if (model_.getNumBVs() > 0) VolumeReader<BV>(model_, choice, low, out).read();
  }
  UpdateReport lastUpdate() const override { return model_.lastUpdate(); }

 private:
  const AdaptiveBVHModel<BV>& model_;
};

/// A body without volumes.
class BareSource : public BodySource {
 public:
  VolumeKind volumeKind() const override { return VolumeKind::None; }
  void readVolumes(const VolumeChoice&, const fcl::Vector3d&,
                   std::vector<VolumeRecord>&) const override {}
};

template <typename S>
class DeformableSource : public BareSource {
 public:
  explicit DeformableSource(const DeformableMesh<S>& mesh) : mesh_(mesh) {}

  int vertices() const override { return static_cast<int>(mesh_.vertices().size()); }
  int triangleCount() const override { return static_cast<int>(mesh_.triangles().size()); }
  std::vector<std::uint32_t> triangles() const override {
    return cornersOf(mesh_.triangles().data(), mesh_.triangles().size());
  }
  PointBlock appendPositions(Blob& blob) const override {
    return appendPoints(mesh_.vertices().data(), mesh_.vertices().size(), blob);
  }
  UpdateReport lastUpdate() const override {
    UpdateReport report;
    report.largest_displacement = mesh_.lastUpdate().largest_displacement;
    report.displacement_seconds = mesh_.lastUpdate().seconds;
    return report;
  }

 private:
  const DeformableMesh<S>& mesh_;
};

class StillSource : public BareSource {
 public:
  explicit StillSource(const TriangleMesh<double>& mesh) : mesh_(mesh) {}

  int vertices() const override { return static_cast<int>(mesh_.vertices.size()); }
  int triangleCount() const override { return static_cast<int>(mesh_.triangles.size()); }
  std::vector<std::uint32_t> triangles() const override {
    return cornersOf(mesh_.triangles.data(), mesh_.triangles.size());
  }
  PointBlock appendPositions(Blob& blob) const override {
    return appendPoints(mesh_.vertices.data(), mesh_.vertices.size(), blob);
  }
  UpdateReport lastUpdate() const override { return UpdateReport(); }

 private:
  const TriangleMesh<double> mesh_;
};

}  // namespace

template <typename BV>
std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<BV>& model) {
  return std::make_unique<ModelSource<BV>>(model);
}

template <typename S>
std::unique_ptr<BodySource> sourceOf(const DeformableMesh<S>& mesh) {
  return std::make_unique<DeformableSource<S>>(mesh);
}

std::unique_ptr<BodySource> sourceOf(const TriangleMesh<double>& mesh) {
  return std::make_unique<StillSource>(mesh);
}

template std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<fcl::RSS<float>>&);
template std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<fcl::RSS<double>>&);
template std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<fcl::OBBRSS<float>>&);
template std::unique_ptr<BodySource> sourceOf(const AdaptiveBVHModel<fcl::OBBRSS<double>>&);
template std::unique_ptr<BodySource> sourceOf(const DeformableMesh<float>&);
template std::unique_ptr<BodySource> sourceOf(const DeformableMesh<double>&);

}  // namespace adaptive_bvh
