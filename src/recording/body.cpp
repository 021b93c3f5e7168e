#include "body.h"

#include <algorithm>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "adaptive_bvh/shape_mesh.h"

// BodySource for each type of body, and the functions Recording::add that make them.
namespace adaptive_bvh {
namespace {

/// A record with a rectangle alone. `low` is subtracted from its first corner.
VolumeRecord rectangle(const fcl::Vector3d& corner, const fcl::Matrix3d& axes, double width,
                       double height, const fcl::Vector3d& low) {
  VolumeRecord record{};
  for (int k = 0; k < 3; ++k) {
    record.corner[k] = static_cast<float>(static_cast<double>(corner[k]) - low[k]);
    for (int side = 0; side < 2; ++side) record.axis[side][k] = static_cast<float>(axes(k, side));
  }
  record.side[0] = static_cast<float>(width);
  record.side[1] = static_cast<float>(height);
  return record;
}

/// The inflation factor of thesis 4.4.1, against InflationReference::NodeSize.
float inflationOf(const fcl::RSSd& rss, double original_radius) {
  const double inflation = rss.r - original_radius;
  if (!(inflation > 0)) return 0;
  const double half_width = original_radius + std::min(rss.l[0], rss.l[1]) / 2;
  const double size = half_width > 0 ? half_width : std::max(rss.l[0], rss.l[1]);
  return size > 0 ? static_cast<float>(inflation / size) : 1;
}

/// The record of a volume, whose radius at the last refit was `original_radius`. Its position in
/// the tree is not set. Of an OBBRSS, the box is recorded.
VolumeRecord recordOf(const fcl::RSSd& rss, double original_radius, const fcl::Vector3d& low) {
  VolumeRecord record = rectangle(rss.To, rss.axis, rss.l[0], rss.l[1], low);
  record.radius = static_cast<float>(rss.r);
  record.inflation = inflationOf(rss, original_radius);
  return record;
}

VolumeRecord recordOf(const fcl::OBBRSSd& volume, double original_radius,
                      const fcl::Vector3d& low) {
  const fcl::OBBd& box = volume.obb;
  const fcl::Vector3d corner =
      box.To - box.axis.col(0) * box.extent[0] - box.axis.col(1) * box.extent[1];
  VolumeRecord record = rectangle(corner, box.axis, 2 * box.extent[0], 2 * box.extent[1], low);
  record.radius = static_cast<float>(box.extent[2]);
  record.inflation = inflationOf(volume.rss, original_radius);
  return record;
}

/// Reads the chosen volumes of one model for one frame.
template <typename BV>
class VolumeReader {
 public:
  VolumeReader(const AdaptiveBVHModel<BV>& model, const VolumeChoice& choice,
               const fcl::Vector3d& low)
      : model_(model), choice_(choice), low_(low) {
    // This call also repairs nodes that were changed through a fcl::BVHModel reference.
    model_.getNodeType();
    if (choice_.refits) deeper_refits_ = model_.refittedNodes();
  }

  std::vector<VolumeRecord> read() {
    readBelow(0, 0);
    // Deeper refits, evenly spread if there are too many.
    const std::size_t all = deeper_refits_.size(),
                      count = std::min(all, static_cast<std::size_t>(choice_.deeper_refits));
    for (std::size_t i = 0; i < count; ++i)
      add(deeper_refits_[i * all / count], choice_.depth + 1, true);
    return std::move(records_);
  }

 private:
  /// Adds the volumes from `node_index` down to the chosen depth; removes them from deeper_refits_.
  void readBelow(int node_index, int depth) {
    const fcl::BVNodeBase& node = model_.getBV(node_index);
    const auto refit = std::lower_bound(deeper_refits_.begin(), deeper_refits_.end(), node_index);
    const bool refitted = refit != deeper_refits_.end() && *refit == node_index;
    if (refitted) deeper_refits_.erase(refit);
    add(node_index, depth, refitted);
    if (depth == choice_.depth || node.isLeaf()) return;
    readBelow(node.leftChild(), depth + 1);
    readBelow(node.rightChild(), depth + 1);
  }

  void add(int node_index, int depth, bool refitted) {
    const fcl::BVNode<BV>& node = model_.getBV(node_index);
    VolumeRecord record = recordOf(node.bv, model_.originalRadius(node_index), low_);
    record.depth = static_cast<float>(depth);
    record.leaf = node.isLeaf();
    record.refitted = refitted;
    records_.push_back(record);
  }

  const AdaptiveBVHModel<BV>& model_;
  const VolumeChoice& choice_;
  const fcl::Vector3d& low_;
  std::vector<int> deeper_refits_;  ///< sorted; at first all refitted nodes
  std::vector<VolumeRecord> records_;
};

// What BodySource returns, for each type of body: a model, or a mesh without volumes of this kind.

template <typename BV>
std::vector<VolumeRecord> volumesOf(const AdaptiveBVHModel<BV>& model, const VolumeChoice& choice,
                                    const fcl::Vector3d& low) {
  if (model.getNumBVs() == 0) return {};
  return VolumeReader<BV>(model, choice, low).read();
}
template <typename Mesh>
std::vector<VolumeRecord> volumesOf(const Mesh&, const VolumeChoice&, const fcl::Vector3d&) {
  return {};
}

const char* kindOfVolumes(const AdaptiveBVHModel<fcl::RSSd>&) { return "swept rectangle"; }
const char* kindOfVolumes(const AdaptiveBVHModel<fcl::OBBRSSd>&) { return "box"; }
template <typename Mesh>
const char* kindOfVolumes(const Mesh&) {
  return "none";
}

template <typename BV>
UpdateReport updateOf(const AdaptiveBVHModel<BV>& model) {
  return model.lastUpdate();
}

UpdateReport updateOf(const DeformableMesh& mesh) {
  UpdateReport report;
  report.largest_displacement = mesh.lastUpdate().largest_displacement;
  report.displacement_seconds = mesh.lastUpdate().seconds;
  return report;
}

UpdateReport updateOf(const TriangleMesh&) { return UpdateReport(); }

/// The vertices and triangles of a body.
struct Surface {
  const fcl::Vector3d* vertices;
  std::size_t vertex_count;
  const fcl::Triangle* triangles;
  std::size_t triangle_count;
};

template <typename BV>
Surface surfaceOf(const AdaptiveBVHModel<BV>& model) {
  return {model.vertices, static_cast<std::size_t>(model.num_vertices), model.tri_indices,
          static_cast<std::size_t>(model.num_tris)};
}

Surface surfaceOf(const DeformableMesh& mesh) {
  return {mesh.vertices().data(), mesh.vertices().size(), mesh.triangles().data(),
          mesh.triangles().size()};
}

Surface surfaceOf(const TriangleMesh& mesh) {
  return {mesh.vertices.data(), mesh.vertices.size(), mesh.triangles.data(), mesh.triangles.size()};
}

/// The source for a mesh or model. `Kept` is its type, of which the source keeps a copy that never
/// changes, or a reference to its type.
template <typename Kept>
class SourceOf : public BodySource {
 public:
  explicit SourceOf(const Kept& source, bool unbounded = false)
      : source_(source), unbounded_(unbounded) {}

  int vertexCount() const override { return static_cast<int>(surfaceOf(source_).vertex_count); }
  int triangleCount() const override { return static_cast<int>(surfaceOf(source_).triangle_count); }
  std::vector<std::uint32_t> corners() const override {
    const auto surface = surfaceOf(source_);
    std::vector<std::uint32_t> corners;
    for (std::size_t t = 0; t < surface.triangle_count; ++t)
      for (int k = 0; k < 3; ++k)
        corners.push_back(static_cast<std::uint32_t>(surface.triangles[t][k]));
    return corners;
  }
  PointBlock appendPositions(Blob& blob) const override {
    const auto surface = surfaceOf(source_);
    return appendPoints(surface.vertices, surface.vertex_count, blob);
  }
  const char* volumeKind() const override { return kindOfVolumes(source_); }
  std::vector<VolumeRecord> volumes(const VolumeChoice& choice,
                                    const fcl::Vector3d& low) const override {
    return volumesOf(source_, choice, low);
  }
  UpdateReport lastUpdate() const override { return updateOf(source_); }
  bool isUnbounded() const override { return unbounded_; }
  bool isFixed() const override { return !std::is_reference_v<Kept>; }

 private:
  Kept source_;
  bool unbounded_;
};

}  // namespace

std::unique_ptr<BodySource> sourceOf(const fcl::CollisionGeometryd& geometry) {
  if (const auto* mesh = dynamic_cast<const DeformableMesh*>(&geometry))
    return std::make_unique<SourceOf<const DeformableMesh&>>(*mesh);
  return std::make_unique<SourceOf<TriangleMesh>>(shapeMesh(geometry), isUnbounded(geometry));
}

int Recording::add(const fcl::CollisionGeometryd& geometry, const fcl::Transform3d& tf,
                   const std::string& name) {
  return add(sourceOf(geometry), tf, name);
}

template <typename BV>
int Recording::add(const AdaptiveBVHModel<BV>& model, const fcl::Transform3d& tf,
                   const std::string& name) {
  if (model.getNumBVs() == 0)
    throw std::invalid_argument("Recording::add: '" + name + "' has no triangles or is not built");
  using Kept = const AdaptiveBVHModel<BV>&;
  return add(std::make_unique<SourceOf<Kept>>(model), tf, name);
}

int Recording::add(const TriangleMesh& mesh, const fcl::Transform3d& tf, const std::string& name) {
  for (const fcl::Vector3d& point : mesh.vertices)
    if (!point.allFinite())
      throw std::invalid_argument("Recording::add: a vertex of '" + name + "' is not finite");
  return add(std::make_unique<SourceOf<TriangleMesh>>(mesh), tf, name);
}

template int Recording::add(const AdaptiveBVHModel<fcl::RSSd>&, const fcl::Transform3d&,
                            const std::string&);
template int Recording::add(const AdaptiveBVHModel<fcl::OBBRSSd>&, const fcl::Transform3d&,
                            const std::string&);

}  // namespace adaptive_bvh
