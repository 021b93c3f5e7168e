#include "adaptive_bvh/contact_regions.h"

#include "base/leased.h"
#include "query/candidate_tests.h"
#include "query/closed_surface.h"
#include "query/contact_regions_patches.h"
#include "query/point_search.h"
#include "query/winding_number.h"

namespace adaptive_bvh {
namespace {

/// Takes the pairs of triangles that may cross.
struct PairCollector {
  std::vector<TrianglePair>& pairs;

  void add(int first, int second) const { test(first, second); }
  void test(int first, int second) const {
    pairs.push_back({static_cast<unsigned>(first), static_cast<unsigned>(second)});
  }
  static bool isDone() { return false; }
  static bool needsFew() { return false; }
};

/// What is added up of a region. Points are in the frame of the first mesh.
struct RegionSums {
  double volume = 0;
  fcl::Vector3d origin = fcl::Vector3d::Zero();  ///< a point of it, for volume and moments
  bool has_origin = false;
  std::array<double, 2> areas{}, sizes{};
  std::array<fcl::Vector3d, 2> moments{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<fcl::Vector3d, 2> points{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<std::size_t, 2> num_parts{};
  fcl::Vector3d normal = fcl::Vector3d::Zero();  ///< of the first, times its area
  double depth = -1;
  fcl::Vector3d deepest = fcl::Vector3d::Zero();

  void add(const SurfacePart& part) {
    const std::size_t side = indexOf(part.body);
    if (!has_origin) origin = part.origin;
    has_origin = true;
    if (num_parts[side]++ == 0) points[side] = part.origin;
    const fcl::Vector3d from = part.origin - origin;
    volume += from.dot(part.normal) * part.area / 3;
    areas[side] += part.area;
    sizes[side] += part.size;
    moments[side] += from * part.area + part.moment;
    if (part.body == Operand::First) normal += part.area * part.normal;
  }
  /// The deepest point where a side has no part; where a part has no area, a point of it.
  fcl::Vector3d centroid(std::size_t side) const {
    if (num_parts[side] == 0) return deepest;
    if (!(std::fabs(areas[side]) > 1e-9 * sizes[side])) return points[side];
    return origin + moments[side] / areas[side];
  }
  /// Zero where normals cancel each other, up to rounding.
  fcl::Vector3d meanNormal() const {
    if (!(normal.norm() > 1e-9 * sizes[0])) return fcl::Vector3d::Zero();
    return normal.stableNormalized();
  }
};

/// Finds the deepest of points that lie on one surface inside the other body.
template <typename S>
class RegionDepth {
 public:
  /// `to_other`: takes points to the other mesh's frame.
  RegionDepth(const MeshState<S>& other, const RelativePlacement& to_other)
      : to_other_(to_other), search_(other), winding_(other) {}

  /// `is_inside`: whether the point is known to be inside.
  void take(const fcl::Vector3d& point, bool is_inside, RegionSums& region) {
    const fcl::Vector3d x = to_other_(point);
    // A distance changes by no more than the point moves.
    if (last_.triangle >= 0 && last_.distance + (x - last_point_).norm() <= region.depth) return;
    typename PointSearch<S>::Nearest nearest;
    if (last_.triangle >= 0) search_.tryTriangle(x, last_.triangle, nearest);
    // No point is farther from the surface than from one of its triangles.
    search_.search(x, nearest, region.depth);
    last_ = nearest;
    last_point_ = x;
    if (!(nearest.distance > region.depth)) return;
    if (!is_inside && winding_.of(x) == 0) return;
    region.depth = nearest.distance;
    region.deepest = point;
  }

 private:
  const RelativePlacement to_other_;
  PointSearch<S> search_;
  WindingNumber<S> winding_;
  typename PointSearch<S>::Nearest last_;
  fcl::Vector3d last_point_ = fcl::Vector3d::Zero();
};

/// What a query keeps for the next one on its thread.
struct RegionMemory {
  ClosedSurfaces bodies;
  std::vector<TrianglePair> pairs;
  SurfaceCrossings crossings;
  std::array<SurfaceWinding, 2> windings;
  SurfacePatches patches;
  std::vector<RegionSums> sums;
};

template <typename S>
void collectCandidates(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                       std::vector<TrianglePair>& pairs) {
  pairs.clear();
  const PairCollector collector{pairs};
  TreePair<S> trees(first, second);
  alignIfNear(trees, 0);
  const PairInput<S> input(trees);
  searchInFrame(
      trees,
      [&](const auto& frame) {
        using Frame = std::decay_t<decltype(frame)>;
        CandidateSearch<S, Frame, const PairCollector>(input.trees(frame), collector, input, frame)
            .runFromRoots();
      },
      [&] { testAllCandidates(input, collector); });
}

template <typename S, typename Place>
void placeSurface(const MeshState<S>& mesh, const Place& place, ClosedSurface& surface) {
  surface.topology = mesh.topology.get();
  surface.points.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    surface.points[v] = place(mesh.vertices[v]);
}

/// Finds crossings, what is inside, and the parts of both surfaces.
template <typename S>
void findPatches(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                 const RelativePlacement& to_first, RegionMemory& m) {
  const bool has_none = first.mesh.numTriangles() == 0 || second.mesh.numTriangles() == 0;
  if (has_none || areBallsFarther(first, second, to_first, 0)) return m.patches.clear();
  placeSurface(
      first.mesh,
      [](const fcl::Vector3<S>& x) -> fcl::Vector3d { return x.template cast<double>(); },
      m.bodies[0]);
  placeSurface(second.mesh, to_first, m.bodies[1]);
  collectCandidates(first, second, m.pairs);
  m.crossings.build(m.bodies, m.pairs);
  for (const Operand body : {Operand::First, Operand::Second})
    m.windings[indexOf(body)].build(m.bodies, body, m.crossings);
  m.patches.build(m.bodies, m.crossings, m.windings);
}

/// Whether a point of a triangle's plane is in the triangle. The centroid of a part need not be,
/// where the other body crosses itself.
bool isWithin(const TrianglePoints<double>& p, const fcl::Vector3d& normal,
              const fcl::Vector3d& x) {
  for (std::size_t k = 0; k < 3; ++k)
    if ((p[(k + 1) % 3] - p[k]).cross(x - p[k]).dot(normal) < 0) return false;
  return true;
}

/// Tries the points of one body that are inside the other.
template <typename S>
void findDepths(Operand body, const MeshState<S>& other, const RelativePlacement& to_other,
                RegionMemory& m) {
  RegionDepth<S> search(other, to_other);
  const ClosedSurface& surface = m.bodies[indexOf(body)];
  // First a few: the deeper the deepest of them, the fewer of the others need a search.
  constexpr unsigned kStride = 13;
  const auto count = static_cast<unsigned>(surface.points.size());
  for (unsigned first = 0; first < kStride; ++first)
    for (unsigned v = first; v < count; v += kStride) {
      const unsigned region = m.patches.regionOf(body, v);
      if (region != SurfacePatches::kNoRegion) search.take(surface.points[v], true, m.sums[region]);
    }
  for (const SurfacePart& part : m.patches.parts()) {
    if (part.body != body) continue;
    const fcl::Vector3d centroid = part.centroid();
    const bool is_on_surface =
        !part.is_cut || isWithin(surface.triangle(part.triangle), part.normal, centroid);
    if (is_on_surface) search.take(centroid, !part.is_cut, m.sums[part.region]);
  }
}

template <typename S>
void sumRegions(const PlacedMesh<S>& first, const PlacedMesh<S>& second, RegionMemory& m) {
  m.sums.assign(m.patches.numRegions(), RegionSums());
  for (const SurfacePart& part : m.patches.parts()) m.sums[part.region].add(part);
  if (m.sums.empty()) return;
  findDepths<S>(Operand::First, second.mesh, RelativePlacement(second.tf, first.tf), m);
  findDepths<S>(Operand::Second, first.mesh, RelativePlacement(), m);
  for (RegionSums& sums : m.sums) {
    if (sums.depth >= 0) continue;
    sums.depth = 0;
    sums.deepest = sums.origin;
  }
}

/// Takes what was found to the world, and into a result.
template <typename S>
class RegionWriter {
 public:
  RegionWriter(const RegionMemory& memory, const fcl::Transform3<S>& tf, ContactRegions<S>& result)
      : m_(memory),
        turn_(tf.linear().template cast<double>()),
        shift_(tf.translation().template cast<double>()),
        result_(result) {}

  void write() {
    writeRegions();
    writePatches(Operand::First, result_.first);
    writePatches(Operand::Second, result_.second);
    writeCurves();
  }

 private:
  fcl::Vector3<S> placed(const fcl::Vector3d& x) const {
    return (turn_ * x + shift_).template cast<S>();
  }

  void writeRegions() {
    const std::size_t count = m_.sums.size();
    result_.volumes.resize(count);
    result_.depths.resize(count);
    result_.deepest_points.resize(count);
    result_.normals.resize(count);
    for (std::size_t r = 0; r < count; ++r) {
      const RegionSums& sums = m_.sums[r];
      result_.volumes[r] = static_cast<S>(sums.volume);
      result_.depths[r] = static_cast<S>(sums.depth);
      result_.deepest_points[r] = placed(sums.deepest);
      result_.normals[r] = (turn_ * sums.meanNormal()).template cast<S>().normalized();
    }
  }

  void writePatches(Operand body, ContactPatches<S>& patches) const {
    const std::size_t side = indexOf(body), count = m_.sums.size();
    patches.areas.resize(count);
    patches.centroids.resize(count);
    patches.begins.assign(count + 1, 0);
    for (std::size_t r = 0; r < count; ++r) {
      patches.areas[r] = static_cast<S>(m_.sums[r].areas[side]);
      patches.centroids[r] = placed(m_.sums[r].centroid(side));
      patches.begins[r + 1] = patches.begins[r] + m_.sums[r].num_parts[side];
    }
    patches.triangles.resize(patches.begins[count]);
    for (const SurfacePart& part : m_.patches.parts())
      if (part.body == body) patches.triangles[patches.begins[part.region]++] = part.triangle;
    for (std::size_t r = count; r > 0; --r) patches.begins[r] = patches.begins[r - 1];
    patches.begins[0] = 0;
  }

  void writeCurves() {
    const auto& curves = m_.patches.curves();
    result_.curve_points.clear();
    result_.curve_first.clear();
    result_.curve_second.clear();
    result_.curve_regions.clear();
    result_.curve_begins.assign(1, 0);
    for (const CrossingCurve& curve : curves) {
      for (std::size_t i = curve.begin; i < curve.end; ++i) {
        const CrossingSegment& s = m_.crossings.segments()[m_.patches.curveSegments()[i]];
        result_.curve_points.push_back(placed(m_.crossings.nodes()[s.start].position));
        result_.curve_first.push_back(s.first);
        result_.curve_second.push_back(s.second);
      }
      result_.curve_regions.push_back(curve.region);
      result_.curve_begins.push_back(result_.curve_points.size());
    }
  }

  const RegionMemory& m_;
  const fcl::Matrix3d turn_;
  const fcl::Vector3d shift_;
  ContactRegions<S>& result_;
};

}  // namespace

template <typename S>
std::size_t contactRegions(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                           const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                           ContactRegions<S>& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "contactRegions");
  requireClosed(stateOf(second), "contactRegions");
  const Leased<RegionMemory> leased;
  RegionMemory& memory = *leased;
  const PlacedMesh<S> one(first, tf1), two(second, tf2);
  findPatches(one, two, RelativePlacement(tf1, tf2), memory);
  sumRegions(one, two, memory);
  RegionWriter<S>(memory, tf1, result).write();
  return result.size();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                        \
  template std::size_t contactRegions(const DeformableMesh<S>&, const fcl::Transform3<S>&, \
                                      const DeformableMesh<S>&, const fcl::Transform3<S>&, \
                                      ContactRegions<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
