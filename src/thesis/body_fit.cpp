#include "thesis/body_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "thesis/volumes/swept_fit.h"

namespace adaptive_bvh {
namespace {

/// Returns {a, b, c, d} for two triangles abc and bad with the common edge ab, in any order; four
/// equal vertices if the triangles have no common edge, or all corners in common.
std::array<unsigned, 4> quadOf(const VertexIndices& s, const VertexIndices& t) {
  const auto has = [](const VertexIndices& triangle, unsigned v) {
    return (triangle[0] == v) + (triangle[1] == v) + (triangle[2] == v);
  };
  const int in_t[3] = {has(t, s[0]), has(t, s[1]), has(t, s[2])};
  const std::size_t i = !in_t[0] ? 0 : !in_t[1] ? 1 : 2;            // s[i] is not in t
  const std::size_t j = !has(s, t[0]) ? 0 : !has(s, t[1]) ? 1 : 2;  // t[j] is not in s
  const unsigned ends[2] = {s[(i + 1) % 3], s[(i + 2) % 3]};
  // A triangle may repeat a vertex.
  const bool is_quad = in_t[0] + in_t[1] + in_t[2] == 2 && ends[0] != ends[1] && !has(s, t[j]);
  if (!is_quad) return {s[0], s[0], s[0], s[0]};
  return {ends[0], ends[1], s[i], t[j]};
}

/// Work space for choosing axes.
struct AxisFitMemory : FitMemory<float> {
  PointArrays<float> points;
};

/// The size class of a node by its number of triangles: 3; 4; 5, 6; 7, 8; up to 12, 18, 32, and
/// more.
int sizeOf(int triangles) {
  constexpr std::uint8_t kSizes[33] = {0, 0, 0, 0, 1, 2, 2, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5,
                                       5, 5, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6};
  return triangles <= 32 ? kSizes[triangles] : 7;
}

/// The contiguous numbers of an FCL volume, in the order of VolumeWriter.
template <typename BV>
typename BV::S* numbersOf(BV& bv) {
  static_assert(sizeof(BV) == Volume<BV>::kNumbers * sizeof(typename BV::S), "nothing between");
  return reinterpret_cast<typename BV::S*>(&bv);
}

/// The transform from step to model coordinates, and its error. Let e be the largest coordinate of
/// the body in the step's coordinates (`extent`), u = 2^-24. The error of a point of the body is
/// below 4ue, and that of a volume's corner below 8ue: 2^-20 e = 16ue covers both.
template <typename S>
ModelCoordinates coordinatesOf(const ScaledFrame<S>& frame, float extent, double askew_axes) {
  const fcl::Vector3d origin = frame.origin().template cast<double>();
  const double unit = static_cast<double>(frame.unit()), size = extent * unit;
  const double error =
      size / (1 << 20) +
      16 * double(rounding::epsilon<S>()) * (origin.template lpNorm<1>() + 8 * size) +
      double(rounding::tiny<S>());
  return {{origin[0], origin[1], origin[2]}, unit, error, askew_axes};
}

/// ModelCoordinates::askew_axes for this type of volume.
template <typename BV>
double askewAxes() {
  if constexpr (Volume<BV>::kHasBox) return 2 * static_cast<double>(Volume<BV>::kAxes);
  return 0;
}

/// The rotation whose columns are the axes in lane 0.
PackedRotation packed(const Axes<Float4>& rotations) {
  const auto column = [](const Vectors<Float4>& v, float(&to)[3]) {
    to[0] = v.x[0];
    to[1] = v.y[0];
    to[2] = v.z[0];
  };
  float x[3], y[3], z[3];
  column(rotations.x, x);
  column(rotations.y, y);
  column(rotations.z, z);
  return {x, y, z};
}

/// The KeptAxes of a leaf. Their area 0 makes every fit in two frames search new axes.
const KeptAxes& noAxes() {
  static const KeptAxes none;
  return none;
}

}  // namespace

PackedRotation::PackedRotation(const float (&x)[3], const float (&y)[3], const float (&z)[3]) {
  Eigen::Matrix3f rotation;
  rotation << x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2];
  const Eigen::Vector4f q = Eigen::Quaternionf(rotation).normalized().coeffs();
  for (int k = 0; k < 4; ++k)
    numbers_[k] = static_cast<std::int16_t>(std::lround(q[k] * float(kOne)));
}

#ifdef ADAPTIVE_BVH_HAS_AVX2
/// Defined in fit_kernels_avx2.cpp.
const FitFunctions& fitFunctionsWithAvx2();
#endif

const FitFunctions& fitFunctions() {
#ifdef ADAPTIVE_BVH_HAS_AVX2
  if (packs::hasAvx2()) return fitFunctionsWithAvx2();
#endif
  return FitKernels<Float4>::kFunctions;
}

template <typename BV>
BodyFit<BV>::BodyFit(const UpdateTarget<BV>& target, const VertexStates<S>& vertices,
                     KeptAxes* kept, const RefitPolicy& policy, const FitFunctions& functions)
    : target_(target),
      topology_(target.tree.topology),
      kept_(kept),
      area_ratio_(1 + static_cast<float>(policy.axes_tolerance)),
      unit_(static_cast<double>(vertices.frame().unit())),
      fits_(functions),
      source_{vertices.data(),
              target.model.prev_vertices ? vertices.previous()[0].data() : nullptr,
              coordinatesOf(vertices.frame(), vertices.extent(), askewAxes<BV>()),
              {},
              kVolumeType<S, Volume<BV>::kHasBox>} {
  makeRoom(VertexSlots::kBlock);
}

template <typename BV>
void BodyFit<BV>::add(int node) {
  if (source_.previous) return addTo(others_, node, fits_.others);  // two frames
  if (topology_.isLeaf(node)) return addTo(triangles_, node, fits_.triangles);
  const KeptAxes& kept = kept_[topology_.innerIndex(node)];
  if (kept.isQuad()) return addTo(quads_, node, fits_.quads);
  if (kept.slots == 0) return addTo(others_, node, fits_.others);
  addTo(patches_[sizeOf(target_.model.getBV(node).num_primitives)], node, fits_.patches);
}

template <typename BV>
typename BV::S BodyFit<BV>::finish() {
  finish(triangles_, fits_.triangles);
  finish(quads_, fits_.quads);
  for (Group& patches : patches_) finish(patches, fits_.patches);
  finish(others_, fits_.others);
  return S(largest_corner_sum_) * (1 + 8 * rounding::epsilon<S>());
}

template <typename BV>
void BodyFit<BV>::addTo(Group& group, int node, FitFunction fit) {
  fcl::BVNode<BV>& fcl_node = target_.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  const LeafSlots* const leaves = topology_.slots.leafSlots() + first;
  const int i = group.count++;
  group.nodes[i] = node;
  group.leaves[i] = leaves;
  group.triangles[i] = fcl_node.num_primitives;
  group.to[i] = numbersOf(fcl_node.bv);
  group.kept[i] = topology_.isLeaf(node) ? &noAxes() : &kept_[topology_.innerIndex(node)];
  group.slots[i] = topology_.isLeaf(node) ? leaves->bits() : group.kept[i]->slots;
  if (group.slots[i] == 0) {  // a range of slots: `others` needs work space for its points
    const VertexSlots::Set set =
        topology_.slots.below(first, static_cast<std::size_t>(fcl_node.num_primitives), 0);
    group.end[i] = set.last;
    makeRoom(set.last - set.first);
  }
  if (group.count == fits_.lanes) finish(group, fit);
}

template <typename BV>
KeptAxes* BodyFit<BV>::keptAxes(int node) const {
  if (topology_.isLeaf(node)) return nullptr;
  KeptAxes& kept = kept_[topology_.innerIndex(node)];
  return kept.isQuad() ? nullptr : &kept;
}

/// Makes room in the work space for this number of points in two frames, and a pack for each.
template <typename BV>
void BodyFit<BV>::makeRoom(std::size_t points) {
  const std::size_t room = 2 * (points + kMostLanes);
  if (work_->size() < 3 * room) work_->resize(3 * room);
  for (std::size_t k = 0; k < 3; ++k) source_.work[k] = work_->data() + k * (work_->size() / 3);
}

/// Fits the nodes of a group and empties it. Unused lanes repeat the first node.
template <typename BV>
void BodyFit<BV>::finish(Group& group, FitFunction fit) {
  if (group.count == 0) return;
  for (int i = group.count; i < fits_.lanes; ++i) {
    group.leaves[i] = group.leaves[0];
    group.triangles[i] = group.triangles[0];
    group.kept[i] = group.kept[0];
    group.slots[i] = group.slots[0];
  }
  float areas[kMostLanes];
  largest_corner_sum_ = std::max(largest_corner_sum_, fit(source_, group, areas));
  if (&group != &triangles_ && &group != &quads_)
    for (int i = 0; i < group.count; ++i)
      if (!(areas[i] <= area_ratio_ * group.kept[i]->area)) renewAxes(group, i, areas[i]);
  group.count = 0;
}

/// Writes the volume along the new axes if it has the smaller area, and stores the better axes.
/// (Axes of a leaf or of a quad, which get here in two frames, are not stored.)
template <typename BV>
void BodyFit<BV>::renewAxes(const Group& group, int lane, float area) {
  using Kernels = FitKernels<Float4>;
  FitGroup alone;
  alone.count = 1;
  for (int i = 0; i < Kernels::kLanes; ++i) {
    alone.leaves[i] = group.leaves[lane];
    alone.triangles[i] = group.triangles[lane];
    alone.slots[i] = group.slots[lane];
    alone.end[i] = group.end[lane];
    alone.to[i] = group.to[lane];
  }
  const Axes<Float4> new_axes = bestAxesOf(alone);
  const BodyVolumes<Float4> volumes = Kernels::volumesAlong(new_axes, source_, alone);
  const float new_area = volumes.area()[0];
  KeptAxes* const kept = keptAxes(group.nodes[lane]);
  if (kept) kept->area = std::min(area, new_area);
  if (!(new_area < area)) return;
  largest_corner_sum_ = std::max(largest_corner_sum_, Kernels::write(volumes, source_, alone));
  if (kept) kept->rotation = packed(Kernels::nodeFrames(source_, alone).components(new_axes));
}

template <typename BV>
Axes<Float4> BodyFit<BV>::bestAxesOf(const FitGroup& node) const {
  const Leased<AxisFitMemory> memory;
  PointArrays<float>& points = memory->points;
  points.clear();
  const unsigned block = node.leaves[0]->block;
  const auto add = [&](unsigned slot) {
    points.makeRoomFor(2);
    points.add(Eigen::Map<const Eigen::Vector3f>(source_.states[slot].position));
    if (source_.previous)
      points.add(Eigen::Map<const Eigen::Vector3f>(source_.previous + 4 * std::size_t(slot)));
  };
  if (node.slots[0] == 0)
    for (unsigned slot = block; slot < node.end[0]; ++slot) add(slot);
  for (std::uint64_t bits = node.slots[0]; bits != 0; bits &= bits - 1)
    add(block + unsigned(__builtin_ctzll(bits)));
  points.fillUp();
  return bestAxes<float>(points, *memory);
}

template <typename BV>
void BodyFit<BV>::keepAxes(int node, const BV& bv) {
  const fcl::BVNode<BV>& fcl_node = target_.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  const auto count = static_cast<std::size_t>(fcl_node.num_primitives);
  KeptAxes& kept = kept_[topology_.innerIndex(node)];
  kept = KeptAxes();
  kept.slots = topology_.slots.below(first, count).bits;
  if (count == 2) {
    const auto quad = quadOf(topology_.slots.slotsOf(first), topology_.slots.slotsOf(first + 1));
    for (std::size_t k = 0; k < 4; ++k)
      kept.quad[k] = static_cast<std::uint8_t>(quad[k] - topology_.slots.blockStart(first));
    if (kept.isQuad()) return;
  }
  FitGroup alone;
  for (int i = 0; i < FitKernels<Float4>::kLanes; ++i) {
    alone.leaves[i] = topology_.slots.leafSlots() + first;
    alone.triangles[i] = fcl_node.num_primitives;
  }
  const fcl::Matrix3f axes = Volume<BV>::axes(bv).template cast<float>();
  const Axes<Float4> volume_axes{vectors::all(axes.col(0)), vectors::all(axes.col(1)),
                                 vectors::all(axes.col(2))};
  kept.rotation = packed(FitKernels<Float4>::nodeFrames(source_, alone).components(volume_axes));
  kept.area = static_cast<float>(Volume<BV>::surfaceArea(bv) / (unit_ * unit_));
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
