#pragma once

#include <cstddef>
#include <cstdint>

#include "hierarchy/leaf_slots.h"
#include "thesis/volumes/body_volumes.h"
#include "thesis/volumes/volume_writer.h"

// The arithmetic of BodyFit: fits the volumes of a group of nodes, one node per lane of a pack.
// Compiled once for every processor, with four lanes, and once for processors with AVX2, with
// eight. The AVX2 code must share no functions with other sources, because the linker could then
// use its version everywhere. Therefore this file includes nothing of the standard library that has
// code, and everything is a template on the pack or always inlined.
namespace adaptive_bvh {

/// A vertex in a step: its position in the step's coordinates (ScaledFrame) and its motion beyond
/// the common translation, in body units. Four numbers are loaded from `position` and from
/// `motion`: the last load reads one number beyond the state.
struct VertexState {
  float position[3];
  float motion[3];
};

/// The largest number of nodes in a group.
constexpr int kMostLanes = 8;

/// The type of FCL's volumes: RSS, or an OBB with an RSS, in either number type.
template <typename S, bool kWithBox>
constexpr int kVolumeType = 2 * (sizeof(S) == sizeof(double)) + kWithBox;

/// Nodes of one kind, whose volumes are computed together. Lanes beyond `count` repeat the first.
struct FitGroup {
  int count = 0;                        ///< number of nodes
  const LeafSlots* leaves[kMostLanes];  ///< the node's first leaf; the others follow in the array
  int triangles[kMostLanes];            ///< number of triangles
  std::uint64_t slots[kMostLanes];      ///< their vertices as VertexSlots::Set::bits
  unsigned end[kMostLanes];             ///< end of the slots, if no bit is set
  const KeptAxes* kept[kMostLanes];
  void* to[kMostLanes];  ///< where to write the numbers of FCL's volume
};

/// The input of fits that all groups share.
struct FitSource {
  const VertexState* states;  ///< indexed by slot
  const float* previous;      ///< previous positions, four numbers per slot; null for one frame
  ModelCoordinates model;
  float* work[3];   ///< work space of PointExtents
  int volume_type;  ///< kVolumeType

  /// The position of a slot's vertex; the fourth number is arbitrary.
  ADAPTIVE_BVH_INLINE Float4 at(unsigned slot) const { return packs::load(states[slot].position); }
};

/// Fits a group: writes FCL's volumes. Returns the largest Volume::cornerSum. Fits along kept axes
/// set `areas` to the surface areas of the volumes, in body units.
using FitFunction = double (*)(const FitSource&, const FitGroup&, float* areas);

/// Functions by kind of node:
/// - triangles: one triangle, in one frame;
/// - quads: two triangles with a common edge, in one frame;
/// - patches: nodes within one block of slots, in one frame, along kept axes;
/// - others: all other nodes, along kept axes.
struct FitFunctions {
  int lanes;  ///< number of nodes in a group
  FitFunction triangles, quads, patches, others;
};

/// The fastest functions for this processor.
const FitFunctions& fitFunctions();

/// Points in an array: `count` points at some offsets, or the first `count`.
struct PointSet {
  const float* base;
  std::size_t stride;           ///< distance of two points in the array, in numbers
  const std::uint8_t* offsets;  ///< indices of the points; null for the first ones
  std::size_t count;
};

/// The rectangle, sphere and box along given axes around many points of one node. Unlike the rest
/// of this file, processes several points of one node at a time, one per lane. Usage: `add` sets of
/// points, `finish`, read the public members. Results are components along the axes, relative to
/// `first`.
template <typename P>
class PointExtents {
 public:
  /// Uses the axes in lane `lane`. The arrays `work` receive the x, y and z of all points along the
  /// axes; they must have room for all points, plus one pack for each set.
  ADAPTIVE_BVH_INLINE PointExtents(const Axes<P>& axes, int lane, const Float4& first,
                                   float* const (&work)[3])
      : axes_{broadcast(axes.x, lane), broadcast(axes.y, lane), broadcast(axes.z, lane)},
        first_{filled(first[0]), filled(first[1]), filled(first[2])},
        work_{work[0], work[1], work[2]} {}

  ADAPTIVE_BVH_INLINE void add(const PointSet& set) {
    const auto load = [&](std::size_t i) -> Float4 {
      return packs::load(set.base + set.stride * (set.offsets ? set.offsets[i] : i));
    };
    std::size_t i = 0;
    for (; i + Lanes<P>::kCount <= set.count; i += Lanes<P>::kCount)
      put(Lanes<P>::gather([&](std::size_t k) -> Float4 { return load(i + k); }));
    if (i < set.count)  // the remaining points; unused lanes repeat the last one
      put(Lanes<P>::gather([&](std::size_t k) -> Float4 {
        return load(i + k < set.count ? i + k : set.count - 1);
      }));
  }

  ADAPTIVE_BVH_INLINE void finish() {
    const Float4 heights = Lanes<P>::largest(-range_.low.z, range_.high.z, P{}, P{});
    SlabRectangle<P> slab(filled(-heights[0]), filled(heights[1]));
    const auto pointsAt = [this](std::size_t i) -> Vectors<P> { return at(i); };
    slab.enclose(count_, pointsAt);
    slab.encloseCorners(count_, pointsAt);
    rectangle = Float4{slab.low[0][0], slab.low[1][0], slab.high[0][0], slab.high[1][0]};
    sphere = Float4{slab.middle[0], slab.radius[0], 0, 0};
    const Float4 ends =
        Lanes<P>::largest(-range_.low.x, -range_.low.y, range_.high.x, range_.high.y);
    box = Float4{-ends[0], -ends[1], ends[2], ends[3]};
  }

  Float4 rectangle;  ///< sides of a SlabRectangle: low x, low y, high x, high y
  Float4 sphere;     ///< z of the rectangle's plane, radius
  Float4 box;        ///< bounding box of the points: low x, low y, high x, high y

 private:
  ADAPTIVE_BVH_INLINE static P filled(float x) { return packs::filled<P>(x); }
  ADAPTIVE_BVH_INLINE static Vectors<P> broadcast(const Vectors<P>& v, int lane) {
    return {filled(v.x[lane]), filled(v.y[lane]), filled(v.z[lane])};
  }
  /// Appends one point per lane to the work space, as components along the axes.
  ADAPTIVE_BVH_INLINE void put(const Vectors<P>& points) {
    const Vectors<P> components = axes_.components(vectors::difference(points, first_));
    range_.add(components);
    __builtin_memcpy(work_[0] + count_, &components.x, sizeof(P));
    __builtin_memcpy(work_[1] + count_, &components.y, sizeof(P));
    __builtin_memcpy(work_[2] + count_, &components.z, sizeof(P));
    count_ += Lanes<P>::kCount;
  }
  /// The pack of points from number i on in the work space.
  ADAPTIVE_BVH_INLINE Vectors<P> at(std::size_t i) const {
    Vectors<P> point;
    __builtin_memcpy(&point.x, work_[0] + i, sizeof(P));
    __builtin_memcpy(&point.y, work_[1] + i, sizeof(P));
    __builtin_memcpy(&point.z, work_[2] + i, sizeof(P));
    return point;
  }

  const Axes<P> axes_;
  const Vectors<P> first_;
  float* const work_[3];
  std::size_t count_ = 0;  ///< number of points in the work space, including repeated ones
  PointRange<P> range_{};  ///< range of the points, including `first` (0)
};

/// Writes the numbers of the set bits to `offsets`, in ascending order. Returns how many there are.
ADAPTIVE_BVH_INLINE int offsetsOf(std::uint64_t bits, std::uint8_t* offsets) {
  int count = 0;
  for (; bits != 0; bits &= bits - 1)
    offsets[count++] = static_cast<std::uint8_t>(__builtin_ctzll(bits));
  return count;
}

/// Fits of a group of nodes, one per lane.
template <typename P>
struct FitKernels {
  static constexpr int kLanes = Lanes<P>::kCount;

  /// Frames that rotate with the nodes' vertices: each is spanned by three distant vertices of a
  /// node or, if these are nearly collinear, by two of them and the normal of a triangle.
  ADAPTIVE_BVH_INLINE static Axes<P> nodeFrames(const FitSource& source, const FitGroup& group) {
    using vectors::difference;
    using vectors::dot;
    // The corners with this number of one leaf below each node; `leaf` selects it.
    const auto corners = [&](int corner, auto&& leaf) -> Vectors<P> {
      return Lanes<P>::gather([&](int i) -> Float4 {
        return source.at(group.leaves[i][leaf(group.triangles[i])].slot(corner));
      });
    };
    const auto first = [](int) { return 0; };
    const auto middle = [](int triangles) { return triangles / 2; };
    const auto last = [](int triangles) { return triangles - 1; };
    const Vectors<P> start = corners(0, first), side = corners(1, middle);
    const Vectors<P> along = difference(corners(2, last), start);
    Vectors<P> across = difference(side, start);
    const Vectors<P> normal = vectors::cross(along, across);
    const auto is_plane = dot(normal, normal) > 0.02f * dot(along, along) * dot(across, across);
    if (!packs::inEach(is_plane)) {
      const Vectors<P> triangle_normal = vectors::cross(difference(corners(0, middle), side),
                                                        difference(corners(2, middle), side));
      across = vectors::select(is_plane, across, triangle_normal);
    }
    return axesAlong(along, across);
  }

  /// The axes in FitGroup::kept, rotated with the nodes to their current positions.
  ADAPTIVE_BVH_INLINE static Axes<P> keptAxes(const FitSource& source, const FitGroup& group) {
    P q[4];
    Lanes<P>::gather4([&](int i) -> Float4 { return group.kept[i]->rotation.quaternion(); }, q);
    return nodeFrames(source, group) * rotations<P>(q[0], q[1], q[2], q[3]);
  }

  /// Volumes along given axes, computed for one node after the other.
  ADAPTIVE_BVH_INLINE static BodyVolumes<P> volumesAlong(const Axes<P>& axes,
                                                         const FitSource& source,
                                                         const FitGroup& group) {
    Float4 first[kLanes], rectangles[kLanes], spheres[kLanes], boxes[kLanes];
    for (int i = 0; i < kLanes; ++i) {
      if (i >= group.count) {
        first[i] = first[0], rectangles[i] = rectangles[0];
        spheres[i] = spheres[0], boxes[i] = boxes[0];
        continue;
      }
      const unsigned block = group.leaves[i]->block;
      std::uint8_t offsets[64];
      PointSet set{source.states[block].position, sizeof(VertexState) / sizeof(float), nullptr, 0};
      const std::uint64_t bits = group.slots[i];
      if (bits != 0) {
        set.offsets = offsets;
        set.count = static_cast<std::size_t>(offsetsOf(bits, offsets));
      } else {
        set.count = group.end[i] - block;
      }
      first[i] = source.at(block + (bits != 0 ? offsets[0] : 0));
      PointExtents<P> extents(axes, i, first[i], source.work);
      extents.add(set);
      if (source.previous)
        extents.add({source.previous + 4 * std::size_t(block), 4, set.offsets, set.count});
      extents.finish();
      rectangles[i] = extents.rectangle;
      spheres[i] = extents.sphere;
      boxes[i] = extents.box;
    }
    const auto transpose = [](const Float4(&rows)[kLanes], P(&columns)[4]) {
      Lanes<P>::gather4([&](int i) -> Float4 { return rows[i]; }, columns);
    };
    P rectangle[4], sphere[4], box[4];
    transpose(rectangles, rectangle);
    transpose(spheres, sphere);
    transpose(boxes, box);
    return {axes,
            Lanes<P>::gather([&](int i) -> Float4 { return first[i]; }),
            {rectangle[0], rectangle[1]},
            {rectangle[2], rectangle[3]},
            sphere[0],
            sphere[1],
            {box[0], box[1]},
            {box[2], box[3]}};
  }

  // The functions of FitFunctions.

  static double triangles(const FitSource& source, const FitGroup& group, float*) {
    const auto corners = [&](int k) -> Vectors<P> {
      return Lanes<P>::gather([&](int i) -> Float4 { return source.at(group.leaves[i]->slot(k)); });
    };
    return write(triangleVolumes(corners(0), corners(1), corners(2)), source, group);
  }

  static double quads(const FitSource& source, const FitGroup& group, float*) {
    const auto corners = [&](int k) -> Vectors<P> {
      return Lanes<P>::gather([&](int i) -> Float4 {
        return source.at(group.leaves[i]->block + group.kept[i]->quad[k]);
      });
    };
    return write(quadVolumes(corners(0), corners(1), corners(2), corners(3)), source, group);
  }

  static double patches(const FitSource& source, const FitGroup& group, float* areas) {
    constexpr int kBlock = 64;  // VertexSlots::kBlock
    std::uint8_t offsets[kLanes][kBlock];
    int counts[kLanes], most = 0;  // numbers of vertices, and the largest
    for (int i = 0; i < kLanes; ++i) {
      counts[i] = offsetsOf(group.slots[i], offsets[i]);
      most = counts[i] > most ? counts[i] : most;
    }
    for (int i = 0; i < kLanes; ++i)  // smaller nodes repeat their first vertex
      for (int k = counts[i]; k < most; ++k) offsets[i][k] = offsets[i][0];
    const auto points = [&](int k) -> Vectors<P> {
      return Lanes<P>::gather(
          [&](int i) -> Float4 { return source.at(group.leaves[i]->block + offsets[i][k]); });
    };
    const Axes<P> axes = keptAxes(source, group);
    const Vectors<P> first = points(0);
    Vectors<P> components[kBlock];
    components[0] = {P{}, P{}, P{}};
    for (int k = 1; k < most; ++k)
      components[k] = axes.components(vectors::difference(points(k), first));
    return finish(volumesAround(axes, first, components, most), source, group, areas);
  }

  static double others(const FitSource& source, const FitGroup& group, float* areas) {
    return finish(volumesAlong(keptAxes(source, group), source, group), source, group, areas);
  }

  /// Writes the volumes of a group to FitGroup::to. Returns the largest Volume::cornerSum.
  ADAPTIVE_BVH_INLINE static double write(const BodyVolumes<P>& volumes, const FitSource& source,
                                          const FitGroup& group) {
    // In the order of kVolumeType.
    constexpr decltype(&writeAs<float, false>) kWriters[] = {
        writeAs<float, false>, writeAs<float, true>, writeAs<double, false>, writeAs<double, true>};
    return kWriters[source.volume_type](volumes, source, group);
  }

  static constexpr FitFunctions kFunctions = {kLanes, triangles, quads, patches, others};

 private:
  /// Sets `areas` and writes the volumes.
  ADAPTIVE_BVH_INLINE static double finish(const BodyVolumes<P>& volumes, const FitSource& source,
                                           const FitGroup& group, float* areas) {
    const P area = volumes.area();
    __builtin_memcpy(areas, &area, sizeof(P));
    return write(volumes, source, group);
  }

  template <typename S, bool kWithBox>
  static double writeAs(const BodyVolumes<P>& volumes, const FitSource& source,
                        const FitGroup& group) {
    S* to[kMostLanes];
    for (int i = 0; i < group.count; ++i) to[i] = static_cast<S*>(group.to[i]);
    return writeVolumes<kWithBox>(volumes, source.model, to, group.count);
  }
};

}  // namespace adaptive_bvh
