#pragma once

#include <cstddef>
#include <cstdint>

#include "hierarchy/leaf_slots.h"
#include "thesis/volumes/body_volumes.h"
#include "thesis/volumes/volume_writer.h"

// The arithmetic of BodyFit. Compiled once for every processor, four nodes at a time, and once for
// processors with AVX2, eight at a time. The AVX2 code must share no functions with other sources,
// because the linker could then use its version everywhere. Therefore this file includes nothing of
// the standard library, and everything is a template on the pack or always inlined.
namespace adaptive_bvh {

/// A vertex in a step: its position (ScaledFrame) and its motion beyond the common translation, in
/// body units. Loads of four numbers read one number beyond.
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
  int count = 0;
  const LeafSlots* leaves[kMostLanes];  ///< the first leaf of each node
  int triangles[kMostLanes];            ///< number of triangles
  std::uint64_t slots[kMostLanes];      ///< their vertices as VertexSlots::Set::bits
  unsigned end[kMostLanes];             ///< end of the slots, if no bit is set
  const KeptAxes* kept[kMostLanes];
  void* to[kMostLanes];  ///< the numbers of FCL's volume
};

/// The input of fits.
struct FitSource {
  const VertexState* states;  ///< indexed by slot
  const float* previous;      ///< four numbers for each slot, or null
  ModelCoordinates model;
  float* work[3];   ///< as PointExtents needs them
  int volume_type;  ///< kVolumeType

  ADAPTIVE_BVH_INLINE Float4 at(unsigned slot) const { return packs::load(states[slot].position); }
};

/// Fits a group. Returns the largest Volume::cornerSum; sets `areas`, in body units, if axes are
/// kept.
using FitFunction = double (*)(const FitSource&, const FitGroup&, float* areas);

/// Functions by kind of node: one triangle; two triangles with a common edge; kept axes, within one
/// block of slots; kept axes, many slots or two frames.
struct FitFunctions {
  int lanes;
  FitFunction triangles, quads, patches, others;
};

/// The fastest functions for this processor.
const FitFunctions& fitFunctions();

/// Points in an array: at some offsets, or all.
struct PointSet {
  const float* base;
  std::size_t stride;           ///< distance of two points, in numbers
  const std::uint8_t* offsets;  ///< null for all points
  std::size_t count;
};

/// The extents of one node's points along axes x, y and z, relative to one of them. For many
/// points: processes one per lane at a time.
template <typename P>
class PointExtents {
 public:
  /// Uses the axes of `lane`. `work` must have room for the coordinates of all points along the
  /// axes, plus one pack for each set.
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
    if (i < set.count)  // repeats the last point in unused lanes
      put(Lanes<P>::gather([&](std::size_t k) -> Float4 {
        return load(i + k < set.count ? i + k : set.count - 1);
      }));
  }

  ADAPTIVE_BVH_INLINE void finish() {
    const Float4 heights = Lanes<P>::largest(-range_.low.z, range_.high.z, P{}, P{});
    SlabRectangle<P> of(filled(-heights[0]), filled(heights[1]));
    const auto points = [this](std::size_t i) -> Vectors<P> { return at(i); };
    of.enclose(count_, points);
    of.encloseCorners(count_, points);
    rectangle = Float4{of.low[0][0], of.low[1][0], of.high[0][0], of.high[1][0]};
    sphere = Float4{of.middle[0], of.radius[0], 0, 0};
    const Float4 ends =
        Lanes<P>::largest(-range_.low.x, -range_.low.y, range_.high.x, range_.high.y);
    box = Float4{-ends[0], -ends[1], ends[2], ends[3]};
  }

  Float4 rectangle;  ///< sides of a SlabRectangle: low x, low y, high x, high y
  Float4 sphere;     ///< its plane and its radius
  Float4 box;        ///< bounding box of the points: low x, low y, high x, high y

 private:
  ADAPTIVE_BVH_INLINE static P filled(float x) { return packs::filled<P>(x); }
  ADAPTIVE_BVH_INLINE static Vectors<P> broadcast(const Vectors<P>& v, int lane) {
    return {filled(v.x[lane]), filled(v.y[lane]), filled(v.z[lane])};
  }
  ADAPTIVE_BVH_INLINE void put(const Vectors<P>& points) {
    const Vectors<P> along = axes_.components(vectors::difference(points, first_));
    range_.add(along);
    __builtin_memcpy(work_[0] + count_, &along.x, sizeof(P));
    __builtin_memcpy(work_[1] + count_, &along.y, sizeof(P));
    __builtin_memcpy(work_[2] + count_, &along.z, sizeof(P));
    count_ += Lanes<P>::kCount;
  }
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
  std::size_t count_ = 0;
  PointRange<P> range_{};  ///< range of the points, including `first`
};

/// Writes the offsets of the set bits; returns their number.
ADAPTIVE_BVH_INLINE int offsetsOf(std::uint64_t bits, std::uint8_t* offsets) {
  int count = 0;
  for (; bits != 0; bits &= bits - 1)
    offsets[count++] = static_cast<std::uint8_t>(__builtin_ctzll(bits));
  return count;
}

template <typename P>
struct FitKernels {
  static constexpr int kLanes = Lanes<P>::kCount;

  /// Frames that rotate with the nodes' vertices: each is spanned by three distant vertices of a
  /// node or, if these are nearly collinear, by two of them and a triangle.
  ADAPTIVE_BVH_INLINE static Axes<P> nodeFrames(const FitSource& source, const FitGroup& group) {
    using vectors::difference;
    using vectors::dot;
    const auto corners = [&](int corner, auto&& leaf) -> Vectors<P> {
      return Lanes<P>::gather([&](int i) -> Float4 {
        return source.at(group.leaves[i][leaf(group.triangles[i])].slot(corner));
      });
    };
    const auto first = [](int) { return 0; };
    const auto middle = [](int triangles) { return triangles / 2; };
    const auto last = [](int triangles) { return triangles - 1; };
    const Vectors<P> from = corners(0, first), by = corners(1, middle);
    const Vectors<P> along = difference(corners(2, last), from);
    Vectors<P> aside = difference(by, from);
    const Vectors<P> normal = vectors::cross(along, aside);
    const auto is_plane = dot(normal, normal) > 0.02f * dot(along, along) * dot(aside, aside);
    if (!packs::inEach(is_plane)) {
      const Vectors<P> other =
          vectors::cross(difference(corners(0, middle), by), difference(corners(2, middle), by));
      aside = vectors::select(is_plane, aside, other);
    }
    return axesAlong(along, aside);
  }

  ADAPTIVE_BVH_INLINE static Axes<P> keptAxes(const FitSource& source, const FitGroup& group) {
    P q[4];
    Lanes<P>::gather4([&](int i) -> Float4 { return group.kept[i]->rotation.quaternion(); }, q);
    return nodeFrames(source, group) * rotations<P>(q[0], q[1], q[2], q[3]);
  }

  /// Volumes along given axes, lane by lane.
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
    const auto gathered = [](const Float4(&rows)[kLanes], P(&to)[4]) {
      Lanes<P>::gather4([&](int i) -> Float4 { return rows[i]; }, to);
    };
    P rectangle[4], sphere[4], box[4];
    gathered(rectangles, rectangle);
    gathered(spheres, sphere);
    gathered(boxes, box);
    return {axes,
            Lanes<P>::gather([&](int i) -> Float4 { return first[i]; }),
            {rectangle[0], rectangle[1]},
            {rectangle[2], rectangle[3]},
            sphere[0],
            sphere[1],
            {box[0], box[1]},
            {box[2], box[3]}};
  }

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
    constexpr int kBlock = 64;
    std::uint8_t offsets[kLanes][kBlock];
    int counts[kLanes], most = 0;
    for (int i = 0; i < kLanes; ++i) {
      counts[i] = offsetsOf(group.slots[i], offsets[i]);
      most = counts[i] > most ? counts[i] : most;
    }
    for (int i = 0; i < kLanes; ++i)
      for (int k = counts[i]; k < most; ++k) offsets[i][k] = offsets[i][0];
    const auto points = [&](int k) -> Vectors<P> {
      return Lanes<P>::gather(
          [&](int i) -> Float4 { return source.at(group.leaves[i]->block + offsets[i][k]); });
    };
    const Axes<P> axes = keptAxes(source, group);
    const Vectors<P> first = points(0);
    Vectors<P> along[kBlock];
    along[0] = {P{}, P{}, P{}};
    for (int k = 1; k < most; ++k)
      along[k] = axes.components(vectors::difference(points(k), first));
    return finish(volumesAround(axes, first, along, most), source, group, areas);
  }

  static double others(const FitSource& source, const FitGroup& group, float* areas) {
    return finish(volumesAlong(keptAxes(source, group), source, group), source, group, areas);
  }

  /// Writes the volumes of a group to FCL's. Returns the largest Volume::cornerSum.
  ADAPTIVE_BVH_INLINE static double write(const BodyVolumes<P>& volumes, const FitSource& source,
                                          const FitGroup& group) {
    // In the order of kVolumeType.
    constexpr decltype(&writeAs<float, false>) kWriters[] = {
        writeAs<float, false>, writeAs<float, true>, writeAs<double, false>, writeAs<double, true>};
    return kWriters[source.volume_type](volumes, source, group);
  }

  static constexpr FitFunctions kFunctions = {kLanes, triangles, quads, patches, others};

 private:
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
