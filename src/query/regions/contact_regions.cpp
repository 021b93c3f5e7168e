// Contact regions of two closed meshes: findPatches finds the parts of each surface inside the
// other body, sumRegions measures the regions, RegionWriter writes the result.
#include "adaptive_bvh/contact_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/leased.h"
#include "query/closed_surface.h"
#include "query/contacts/candidate_tests.h"
#include "query/points/point_search.h"
#include "query/points/winding_number.h"
#include "query/regions/coinciding.h"
#include "query/regions/patches.h"

namespace adaptive_bvh {
namespace {

/// A sink of CandidateTests that collects all pairs of triangles that may cross.
struct PairCollector {
  std::vector<TrianglePair>& pairs;

  void add(int first, int second) const { test(first, second); }
  void test(int first, int second) const {
    pairs.push_back({static_cast<unsigned>(first), static_cast<unsigned>(second)});
  }
  static bool isDone() { return false; }
  static bool needsFew() { return false; }
};

/// Sums over the parts of a region. Points are in the coordinates of ClosedSurface.
struct RegionSums {
  double volume = 0;                             ///< that the parts enclose, relative to `origin`
  fcl::Vector3d origin = fcl::Vector3d::Zero();  ///< a point of a part; see volume and moments
  bool has_origin = false;
  // By body: sums of SurfacePart::area, size and moment (relative to `origin`), a point of a part,
  // and the number of parts.
  std::array<double, 2> areas{}, sizes{};
  std::array<fcl::Vector3d, 2> moments{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<fcl::Vector3d, 2> points{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<std::size_t, 2> num_parts{};
  /// Half the sum of the first body's normals times their areas, minus half that of the second's.
  fcl::Vector3d normal = fcl::Vector3d::Zero();
  /// The contribution of touching faces to the normal, which leaveOut has removed.
  fcl::Vector3d touching = fcl::Vector3d::Zero();
  double depth = -1;  ///< -1: no point measured
  fcl::Vector3d deepest = fcl::Vector3d::Zero();

  void add(const SurfacePart& part) {
    const std::size_t side = indexOf(part.body);
    if (!has_origin) origin = part.origin;
    has_origin = true;
    if (num_parts[side]++ == 0) points[side] = part.origin;
    const fcl::Vector3d offset = part.origin - origin;
    volume += offset.dot(part.normal) * part.area / 3;
    areas[side] += part.area;
    sizes[side] += part.size;
    moments[side] += offset * part.area + part.moment;
    normal += (part.body == WhichBody::First ? 0.5 : -0.5) * part.area * part.normal;
  }
  /// Removes the contribution of coinciding faces from the normal, because rounding decides
  /// which of them are inside the other body. Of two alike faces, the one behind is (the second
  /// body's, if the first's is in front). Of two opposite faces, which touch, both are, or none.
  void leaveOut(const CoincidingFaces& faces) {
    const fcl::Vector3d common = faces.area * faces.normal;
    if (faces.are_alike) {
      normal += (faces.is_first_in_front ? 0.5 : -0.5) * common;
    } else if (faces.is_first_in_front) {
      normal -= common;
      touching += common;
    }
  }
  /// Finishes the sums, after all parts. A region as thin as the rounding error consists of
  /// touching faces, so these determine its normal. `rounding`: of positions.
  void finish(double rounding) {
    constexpr double kFlat = 1e-9;
    const double area = sizes[0] + sizes[1];
    if (!(std::fabs(volume) <= area * (kFlat * std::sqrt(area) + rounding))) return;
    volume = std::fabs(volume);
    normal += touching;
  }
  /// The centroid of a body's parts. Without parts: the deepest point. Without area: a part's
  /// point.
  fcl::Vector3d centroid(std::size_t side) const {
    if (num_parts[side] == 0) return deepest;
    if (!(std::fabs(areas[side]) > 1e-9 * sizes[side])) return points[side];
    return origin + moments[side] / areas[side];
  }
  /// The mean normal; zero if normals cancel each other. `rounding`: of positions.
  fcl::Vector3d meanNormal(double rounding) const {
    const double area = sizes[0] + sizes[1];
    if (!(normal.norm() > 1e-9 * area + rounding * std::sqrt(area))) return fcl::Vector3d::Zero();
    return normal.stableNormalized();
  }
};

/// Finds the deepest point of each region among points of one surface.
class RegionDepth {
 public:
  /// `to_other`: maps points to the other mesh's frame, once divided by `scale`.
  RegionDepth(const MeshState& other, const RelativePlacement& to_other, double scale)
      : to_other_(to_other), scale_(scale), search_(other), winding_(other) {}

  /// Sets the region's depth and deepest point if a point is inside the other body, and deeper.
  /// `is_inside`: whether it is known to be inside.
  void addPoint(const fcl::Vector3d& point, bool is_inside, RegionSums& region) {
    // From point to point, the distance changes by at most the distance of the points.
    if (last_ >= 0 && last_distance_ + (point - last_point_).norm() <= region.depth) return;
    const fcl::Vector3d x = to_other_(fcl::Vector3d(point * (1 / scale_)));
    PointSearch::Nearest nearest;
    if (last_ >= 0) search_.tryTriangle(x, last_, nearest);
    // Stop at a triangle nearer than the depth so far: then the point is not deeper.
    search_.search(x, nearest, region.depth / scale_);
    last_ = nearest.triangle;
    last_distance_ = nearest.distance * scale_;
    last_point_ = point;
    if (!(last_distance_ > region.depth)) return;
    if (!is_inside && winding_.of(x) == 0) return;
    region.depth = last_distance_;
    region.deepest = point;
  }

 private:
  const RelativePlacement to_other_;
  const double scale_;
  PointSearch search_;
  WindingNumber winding_;
  int last_ = -1;             ///< the nearest triangle of the last point
  double last_distance_ = 0;  ///< its distance, or an upper bound
  fcl::Vector3d last_point_ = fcl::Vector3d::Zero();
};

/// Memory of a query, kept for the next one on its thread.
struct RegionMemory {
  ClosedSurfaces bodies;
  std::vector<TrianglePair> pairs;
  SurfaceCrossings crossings;
  std::array<SurfaceWinding, 2> windings;
  SurfacePatches patches;
  std::vector<CoincidingFaces> coinciding;
  std::vector<RegionSums> sums;
  int exponent = 0;     ///< points in `bodies` are multiplied by 2^exponent
  double rounding = 0;  ///< error of these points by the rounding of positions

  double scale() const { return std::ldexp(1., exponent); }
};

/// Sets `pairs` to the triangles that may cross.
void collectCandidates(const PlacedMesh& first, const PlacedMesh& second,
                       std::vector<TrianglePair>& pairs) {
  pairs.clear();
  const PairCollector collector{pairs};
  TreePair trees(first, second);
  alignIfNear(trees, 0);
  const PairInput input(trees);
  searchInFrame(
      trees,
      [&](const auto& frame) {
        using Frame = std::decay_t<decltype(frame)>;
        CandidateSearch<Frame, const PairCollector>(input.trees(frame), collector, input, frame)
            .runFromRoots();
      },
      [&] { testAllCandidates(input, collector); });
}

/// The largest absolute coordinate of a mesh, in its frame.
double extentOf(const PlacedMesh& body) {
  const fcl::AABBd& box = body.bounds().aabb_local;
  return box.min_.cwiseAbs().cwiseMax(box.max_.cwiseAbs()).maxCoeff();
}

/// Whether a surface encloses a negative volume.
bool facesInward(const ClosedSurface& surface) {
  const fcl::Vector3d& origin = surface.points[0];
  double volume = 0;
  for (unsigned t = 0; t < surface.numTriangles(); ++t) {
    const TrianglePoints p = surface.triangle(t);
    volume += (p[0] - origin).dot((p[1] - origin).cross(p[2] - origin));
  }
  return volume < 0;
}

/// Sets a surface to the mesh in the first body's frame, multiplied by `scale`.
void placeSurface(const MeshState& mesh, const RelativePlacement& to_first, double scale,
                  ClosedSurface& surface) {
  surface.topology = mesh.topology.get();
  surface.points.resize(mesh.vertices.size());
  const fcl::Vector3d shift = scale * to_first.T;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    surface.points[v] = to_first.R * (scale * mesh.vertices[v]) + shift;
  surface.faces_inward = false;
}

/// Finds the crossings, the winding numbers and the parts of both surfaces, and sums the parts.
void buildPatches(RegionMemory& memory) {
  memory.crossings.build(memory.bodies, memory.pairs, memory.rounding);
  for (const WhichBody body : {WhichBody::First, WhichBody::Second})
    memory.windings[indexOf(body)].build(memory.bodies, body, memory.crossings);
  memory.patches.build(memory.bodies, memory.crossings, memory.windings);
  memory.sums.assign(memory.patches.numRegions(), RegionSums());
  for (const SurfacePart& part : memory.patches.parts()) memory.sums[part.region].add(part);
}

/// If a region has a negative volume or area, turns bodies that face inward. Returns whether any
/// do.
bool turnOutward(RegionMemory& memory) {
  const auto is_negative = [](const RegionSums& r) {
    return r.volume < 0 || r.areas[0] < 0 || r.areas[1] < 0;
  };
  if (std::none_of(memory.sums.begin(), memory.sums.end(), is_negative)) return false;
  for (ClosedSurface& surface : memory.bodies) surface.faces_inward = facesInward(surface);
  return memory.bodies[0].faces_inward || memory.bodies[1].faces_inward;
}

/// Finds the parts of both surfaces, with triangles that face outward.
void findPatches(const PlacedMesh& first, const PlacedMesh& second,
                 const RelativePlacement& to_first, RegionMemory& memory) {
  const bool has_none = first.mesh.numTriangles() == 0 || second.mesh.numTriangles() == 0;
  memory.coinciding.clear();
  memory.sums.clear();
  if (has_none || areBallsFarther(first, second, to_first, 0)) return memory.patches.clear();
  const double shift = to_first.T.cwiseAbs().maxCoeff(),
               extent = std::max(extentOf(first), extentOf(second)) + shift,
               in_world = extent + first.tf.translation().cwiseAbs().maxCoeff();
  memory.exponent = std::ilogb(rounding::enlargement(extent));
  placeSurface(first.mesh, RelativePlacement(), memory.scale(), memory.bodies[0]);
  placeSurface(second.mesh, to_first, memory.scale(), memory.bodies[1]);
  constexpr double kRounding = 16 * rounding::epsilon<double>();  // of a position
  memory.rounding = kRounding * in_world * memory.scale();
  MeshRays first_rays(first.mesh, RelativePlacement(), memory.scale(), 0),
      second_rays(second.mesh, to_first, memory.scale(), 0x1p-45 * extent);
  memory.bodies[0].rays = &first_rays;
  memory.bodies[1].rays = &second_rays;
  collectCandidates(first, second, memory.pairs);
  buildPatches(memory);
  if (turnOutward(memory)) buildPatches(memory);
  findCoincidingFaces(memory.bodies, memory.crossings, memory.patches, memory.coinciding);
}

/// Whether a point of a triangle's plane is in the triangle. A part's centroid may be outside if
/// the other body intersects itself.
bool isWithin(const TrianglePoints& p, const fcl::Vector3d& normal, const fcl::Vector3d& x) {
  for (std::size_t k = 0; k < 3; ++k)
    if ((p[(k + 1) % 3] - p[k]).cross(x - p[k]).dot(normal) < 0) return false;
  return true;
}

/// Measures the depths of regions by points of one body: vertices inside the other one, and
/// centroids of parts. `other`: that body; `to_other` maps the first body's frame to its frame.
void findDepths(WhichBody body, const MeshState& other, const RelativePlacement& to_other,
                RegionMemory& memory) {
  RegionDepth search(other, to_other, memory.scale());
  const ClosedSurface& surface = memory.bodies[indexOf(body)];
  // Every 13th vertex comes first: a sample soon finds a deep point, which excludes others.
  constexpr unsigned kStride = 13;
  const auto count = static_cast<unsigned>(surface.points.size());
  for (unsigned first = 0; first < kStride; ++first)
    for (unsigned v = first; v < count; v += kStride) {
      const unsigned region = memory.patches.regionOf(body, v);
      if (region != SurfacePatches::kNoRegion)
        search.addPoint(surface.points[v], true, memory.sums[region]);
    }
  for (const SurfacePart& part : memory.patches.parts()) {
    if (part.body != body) continue;
    const fcl::Vector3d centroid = part.centroid();
    const bool is_on_surface =
        !part.is_cut || isWithin(surface.triangle(part.triangle), part.normal, centroid);
    if (is_on_surface) search.addPoint(centroid, !part.is_cut, memory.sums[part.region]);
  }
}

/// Sets the sums of all regions from the patches, and the depths.
void sumRegions(const PlacedMesh& first, const PlacedMesh& second, RegionMemory& memory) {
  for (const CoincidingFaces& faces : memory.coinciding) memory.sums[faces.region].leaveOut(faces);
  for (RegionSums& sums : memory.sums) sums.finish(memory.rounding);
  if (memory.sums.empty()) return;
  findDepths(WhichBody::First, second.mesh, RelativePlacement(second.tf, first.tf), memory);
  findDepths(WhichBody::Second, first.mesh, RelativePlacement(), memory);
  for (RegionSums& sums : memory.sums) {
    if (sums.depth >= 0) continue;
    sums.depth = 0;  // no point was found inside
    sums.deepest = sums.origin;
  }
}

/// Writes the regions into a result, in world coordinates.
class RegionWriter {
 public:
  RegionWriter(const RegionMemory& memory, const fcl::Transform3d& tf, ContactRegions& result)
      : memory_(memory),
        rotation_(tf.linear()),
        translation_(tf.translation()),
        scale_(memory.scale()),
        result_(result) {}

  void write() {
    writeRegions();
    writePatches(WhichBody::First, result_.first);
    writePatches(WhichBody::Second, result_.second);
    writeCurves();
  }

 private:
  fcl::Vector3d toWorld(const fcl::Vector3d& x) const {
    return rotation_ * (x * (1 / scale_)) + translation_;
  }
  /// Divides a length, an area or a volume (`dimension` 1, 2, 3) by the scale.
  double unscaled(double size, int dimension) const {
    return std::ldexp(size, -dimension * memory_.exponent);
  }

  void writeRegions() {
    const std::size_t count = memory_.sums.size();
    result_.volumes.resize(count);
    result_.depths.resize(count);
    result_.deepest_points.resize(count);
    result_.normals.resize(count);
    for (std::size_t r = 0; r < count; ++r) {
      const RegionSums& sums = memory_.sums[r];
      result_.volumes[r] = unscaled(sums.volume, 3);
      result_.depths[r] = unscaled(sums.depth, 1);
      result_.deepest_points[r] = toWorld(sums.deepest);
      result_.normals[r] = (rotation_ * sums.meanNormal(memory_.rounding)).normalized();
    }
  }

  void writePatches(WhichBody body, ContactPatches& patches) const {
    const std::size_t side = indexOf(body), count = memory_.sums.size();
    patches.areas.resize(count);
    patches.centroids.resize(count);
    patches.begins.assign(count + 1, 0);
    for (std::size_t r = 0; r < count; ++r) {
      patches.areas[r] = unscaled(memory_.sums[r].areas[side], 2);
      patches.centroids[r] = toWorld(memory_.sums[r].centroid(side));
      patches.begins[r + 1] = patches.begins[r] + memory_.sums[r].num_parts[side];
    }
    patches.triangles.resize(patches.begins[count]);
    // Advance each begin to the next one while writing; then shift them back.
    for (const SurfacePart& part : memory_.patches.parts())
      if (part.body == body) patches.triangles[patches.begins[part.region]++] = part.triangle;
    for (std::size_t r = count; r > 0; --r) patches.begins[r] = patches.begins[r - 1];
    patches.begins[0] = 0;
  }

  void writeCurves() {
    const auto& curves = memory_.patches.curves();
    result_.curve_points.clear();
    result_.curve_first.clear();
    result_.curve_second.clear();
    result_.curve_regions.clear();
    result_.curve_begins.assign(1, 0);
    for (const CrossingCurve& curve : curves) {
      for (std::size_t i = curve.begin; i < curve.end; ++i) {
        const CrossingSegment& s = memory_.crossings.segments()[memory_.patches.curveSegments()[i]];
        result_.curve_points.push_back(toWorld(memory_.crossings.nodes()[s.start].position));
        result_.curve_first.push_back(s.first);
        result_.curve_second.push_back(s.second);
      }
      result_.curve_regions.push_back(curve.region);
      result_.curve_begins.push_back(result_.curve_points.size());
    }
  }

  const RegionMemory& memory_;
  const fcl::Matrix3d rotation_;
  const fcl::Vector3d translation_;
  const double scale_;
  ContactRegions& result_;
};

}  // namespace

std::size_t contactRegions(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           ContactRegions& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  requireClosed(stateOf(first), "contactRegions");
  requireClosed(stateOf(second), "contactRegions");
  const Leased<RegionMemory> leased;
  RegionMemory& memory = *leased;
  const PlacedMesh one(first, tf1), two(second, tf2);
  findPatches(one, two, RelativePlacement(one.tf, two.tf), memory);
  sumRegions(one, two, memory);
  RegionWriter(memory, one.tf, result).write();
  return result.size();
}

}  // namespace adaptive_bvh
