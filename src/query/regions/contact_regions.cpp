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
#include "query/single_precision.h"

namespace adaptive_bvh {
namespace {

/// Collects the pairs of triangles that may cross.
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
  double volume = 0;
  fcl::Vector3d origin = fcl::Vector3d::Zero();  ///< a point of it, for volume and moments
  bool has_origin = false;
  std::array<double, 2> areas{}, sizes{};
  std::array<fcl::Vector3d, 2> moments{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<fcl::Vector3d, 2> points{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<std::size_t, 2> num_parts{};
  /// Half the sum of the first body's normals times their areas, minus that of the second's.
  fcl::Vector3d normal = fcl::Vector3d::Zero();
  /// The share of faces that touch, which is not in `normal`.
  fcl::Vector3d touching = fcl::Vector3d::Zero();
  bool is_turned = false;  ///< the triangles of one of the bodies face inward
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
    normal += (part.body == WhichBody::First ? 0.5 : -0.5) * part.area * part.normal;
  }
  /// Removes coinciding faces from the normal. Of two faces that are alike, the normal contains
  /// one: the second body's, if the first's is in front. Of two faces that touch, it contains both,
  /// or none.
  void leaveOut(const CoincidingFaces& faces) {
    const double first_sense = areas[1] < 0 ? -1 : 1, second_sense = areas[0] < 0 ? -1 : 1;
    const double side = faces.is_first_in_front ? 1 : -1;
    if (faces.are_alike == (first_sense == second_sense)) {
      normal += 0.5 * side * (faces.are_alike ? faces.area : -faces.area) * faces.normal;
    } else if (side == first_sense) {
      normal -= second_sense * faces.area * faces.normal;
      touching += second_sense * faces.area * faces.normal;
    }
  }
  /// Whether the volume or an area is negative, as for a body that faces inward.
  bool isNegative() const { return volume < 0 || areas[0] < 0 || areas[1] < 0; }
  /// Changes signs as if each body faced outward. `senses`: by body, -1 if it faces inward, else 1.
  void faceOutward(const std::array<double, 2>& senses) {
    is_turned = senses[0] * senses[1] < 0;
    if (is_turned) {
      volume = -volume;
      normal = -normal;
      touching = -touching;
    }
    for (std::size_t k = 0; k < 2; ++k) {
      areas[k] *= senses[1 - k];
      moments[k] *= senses[1 - k];
    }
  }
  /// Finishes the sums, after all parts. A region as thin as the rounding error consists of faces
  /// that touch.
  void finish(double rounding) {
    constexpr double kFlat = 1e-9;
    const double area = sizes[0] + sizes[1];
    if (!(std::fabs(volume) <= area * (kFlat * std::sqrt(area) + rounding))) return;
    volume = std::fabs(volume);
    normal += touching;
  }
  /// The centroid of a side's parts. The deepest point if there are none; a point of a part if they
  /// have no area.
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

/// Finds the deepest of points that lie on one surface, inside the other body.
class RegionDepth {
 public:
  /// `to_other`: maps points to the other mesh's frame. `scale`: factor by which the points are
  /// enlarged.
  RegionDepth(const MeshState& other, const RelativePlacement& to_other, double scale)
      : to_other_(to_other), scale_(scale), search_(other), winding_(other) {}

  /// `is_inside`: whether the point is known to be inside.
  void take(const fcl::Vector3d& point, bool is_inside, RegionSums& region) {
    // A distance changes by no more than the point moves.
    if (last_ >= 0 && last_distance_ + (point - last_point_).norm() <= region.depth) return;
    const fcl::Vector3d x = to_other_(fcl::Vector3d(point * (1 / scale_)));
    PointSearch::Nearest nearest;
    if (last_ >= 0) search_.tryTriangle(x, last_, nearest);
    // No point is farther from the surface than from one of its triangles.
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
  int last_ = -1;  ///< the nearest triangle of the last point
  double last_distance_ = 0;
  fcl::Vector3d last_point_ = fcl::Vector3d::Zero();
};

/// Finds the triangles of a mesh near a ray.
class MeshRays final : public RayCandidates {
 public:
  /// `to_first`: maps points of the mesh to the first body's frame. There they are enlarged by
  /// `scale`. `rounding`: error of these points before they are enlarged.
  MeshRays(const MeshState& mesh, const RelativePlacement& to_first, double scale, double rounding)
      : to_first_(to_first),
        back_(to_first.R.inverse()),
        scale_(scale),
        rounding_(rounding),
        rays_(mesh) {}

  void find(const fcl::Vector3d& origin, const fcl::Vector3d& direction,
            std::vector<unsigned>& triangles) override {
    rays_.forEachNear(back_ * (origin * (1 / scale_) - to_first_.T), back_ * direction, rounding_,
                      [&](int t) { triangles.push_back(static_cast<unsigned>(t)); });
  }

 private:
  const RelativePlacement to_first_;
  const fcl::Matrix3d back_;
  const double scale_, rounding_;
  RayWalk rays_;
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
  int exponent = 0;     ///< points in `bodies` are enlarged by 2^exponent
  double rounding = 0;  ///< error of these points by the rounding of positions

  double scale() const { return std::ldexp(1., exponent); }
};

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

/// The largest coordinate of a mesh.
double extentOf(const PlacedMesh& body) {
  const fcl::AABBd& box = body.bounds().aabb_local;
  return static_cast<double>(box.min_.cwiseAbs().cwiseMax(box.max_.cwiseAbs()).maxCoeff());
}

/// Returns the exponent of a power of two by which products of small coordinates do not underflow.
int enlargementOf(double extent) {
  constexpr double kSmall = 0x1p-100;
  constexpr int kMost = 1000;
  return extent > 0 && extent < kSmall ? std::min(-std::ilogb(extent), kMost) : 0;
}

void placeSurface(const MeshState& mesh, const RelativePlacement& to_first, double scale,
                  ClosedSurface& surface) {
  surface.topology = mesh.topology.get();
  surface.points.resize(mesh.vertices.size());
  const fcl::Vector3d by = scale * to_first.T;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    surface.points[v] = to_first.R * (scale * mesh.vertices[v]) + by;
}

/// Finds the crossings, the winding numbers and the parts of both surfaces. `epsilon`: of the
/// number type of the positions.
void findPatches(const PlacedMesh& first, const PlacedMesh& second,
                 const RelativePlacement& to_first, double epsilon, RegionMemory& m) {
  const bool has_none = first.mesh.numTriangles() == 0 || second.mesh.numTriangles() == 0;
  m.coinciding.clear();
  if (has_none || areBallsFarther(first, second, to_first, 0)) return m.patches.clear();
  const double shift = to_first.T.cwiseAbs().maxCoeff(),
               extent = std::max(extentOf(first), extentOf(second)) + shift,
               in_world = extent + double(first.tf.translation().cwiseAbs().maxCoeff());
  m.exponent = enlargementOf(extent);
  placeSurface(first.mesh, RelativePlacement(), m.scale(), m.bodies[0]);
  placeSurface(second.mesh, to_first, m.scale(), m.bodies[1]);
  constexpr double kUnits = 16;
  m.rounding = kUnits * epsilon * in_world * m.scale();
  MeshRays first_rays(first.mesh, RelativePlacement(), m.scale(), 0),
      second_rays(second.mesh, to_first, m.scale(), 0x1p-45 * extent);
  m.bodies[0].rays = &first_rays;
  m.bodies[1].rays = &second_rays;
  collectCandidates(first, second, m.pairs);
  m.crossings.build(m.bodies, m.pairs, m.rounding);
  for (const WhichBody body : {WhichBody::First, WhichBody::Second})
    m.windings[indexOf(body)].build(m.bodies, body, m.crossings);
  m.patches.build(m.bodies, m.crossings, m.windings);
  findCoincidingFaces(m.bodies, m.crossings, m.patches, m.coinciding);
}

/// Whether a point of a triangle's plane is in the triangle. A part's centroid may be outside if
/// the other body intersects itself.
bool isWithin(const TrianglePoints<double>& p, const fcl::Vector3d& normal,
              const fcl::Vector3d& x) {
  for (std::size_t k = 0; k < 3; ++k)
    if ((p[(k + 1) % 3] - p[k]).cross(x - p[k]).dot(normal) < 0) return false;
  return true;
}

/// Measures the depth of those points of one body that are inside the other.
void findDepths(WhichBody body, const MeshState& other, const RelativePlacement& to_other,
                RegionMemory& m) {
  RegionDepth search(other, to_other, m.scale());
  const ClosedSurface& surface = m.bodies[indexOf(body)];
  // A sample comes first: the deeper its deepest point, the fewer other points need a search.
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

/// Returns -1 for a surface that encloses a negative volume, else 1.
double senseOf(const ClosedSurface& surface) {
  const fcl::Vector3d& origin = surface.points[0];
  double volume = 0;
  for (unsigned t = 0; t < surface.numTriangles(); ++t) {
    const TrianglePoints<double> p = surface.triangle(t);
    volume += (p[0] - origin).dot((p[1] - origin).cross(p[2] - origin));
  }
  return volume < 0 ? -1 : 1;
}

void faceOutward(RegionMemory& m) {
  if (std::none_of(m.sums.begin(), m.sums.end(),
                   [](const RegionSums& sums) { return sums.isNegative(); }))
    return;
  const std::array<double, 2> senses = {senseOf(m.bodies[0]), senseOf(m.bodies[1])};
  for (RegionSums& sums : m.sums) sums.faceOutward(senses);
}

void sumRegions(const PlacedMesh& first, const PlacedMesh& second, RegionMemory& m) {
  m.sums.assign(m.patches.numRegions(), RegionSums());
  for (const SurfacePart& part : m.patches.parts()) m.sums[part.region].add(part);
  for (const CoincidingFaces& faces : m.coinciding) m.sums[faces.region].leaveOut(faces);
  faceOutward(m);
  for (RegionSums& sums : m.sums) sums.finish(m.rounding);
  if (m.sums.empty()) return;
  findDepths(WhichBody::First, second.mesh, RelativePlacement(second.tf, first.tf), m);
  findDepths(WhichBody::Second, first.mesh, RelativePlacement(), m);
  for (RegionSums& sums : m.sums) {
    if (sums.depth >= 0) continue;
    sums.depth = 0;
    sums.deepest = sums.origin;
  }
}

/// Transforms the regions found to the world, and writes them into a result.
class RegionWriter {
 public:
  RegionWriter(const RegionMemory& memory, const fcl::Transform3d& tf,
               ContactRegions<double>& result)
      : m_(memory),
        turn_(tf.linear()),
        shift_(tf.translation()),
        scale_(memory.scale()),
        result_(result) {}

  void write() {
    writeRegions();
    writePatches(WhichBody::First, result_.first);
    writePatches(WhichBody::Second, result_.second);
    writeCurves();
  }

 private:
  fcl::Vector3d placed(const fcl::Vector3d& x) const {
    return (turn_ * (x * (1 / scale_)) + shift_);
  }
  /// Scales a length, an area or a volume back.
  double reduced(double size, int dimension) const {
    return std::ldexp(size, -dimension * m_.exponent);
  }

  void writeRegions() {
    const std::size_t count = m_.sums.size();
    result_.volumes.resize(count);
    result_.depths.resize(count);
    result_.deepest_points.resize(count);
    result_.normals.resize(count);
    for (std::size_t r = 0; r < count; ++r) {
      const RegionSums& sums = m_.sums[r];
      result_.volumes[r] = reduced(sums.volume, 3);
      result_.depths[r] = reduced(sums.depth, 1);
      result_.deepest_points[r] = placed(sums.deepest);
      result_.normals[r] = (turn_ * sums.meanNormal(m_.rounding)).normalized();
    }
  }

  void writePatches(WhichBody body, ContactPatches<double>& patches) const {
    const std::size_t side = indexOf(body), count = m_.sums.size();
    patches.areas.resize(count);
    patches.centroids.resize(count);
    patches.begins.assign(count + 1, 0);
    for (std::size_t r = 0; r < count; ++r) {
      patches.areas[r] = reduced(m_.sums[r].areas[side], 2);
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
      const bool is_turned = m_.sums[curve.region].is_turned;
      for (std::size_t i = curve.begin; i < curve.end; ++i) {
        // A curve that is turned begins with the same segment.
        const std::size_t at = is_turned && i > curve.begin ? curve.begin + curve.end - i : i;
        const CrossingSegment& s = m_.crossings.segments()[m_.patches.curveSegments()[at]];
        const unsigned node = is_turned ? s.end : s.start;
        result_.curve_points.push_back(placed(m_.crossings.nodes()[node].position));
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
  const double scale_;
  ContactRegions<double>& result_;
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
  const PlacedMesh one(first, tf1), two(second, tf2);
  findPatches(one, two, RelativePlacement(one.tf, two.tf),
              double(std::numeric_limits<S>::epsilon()), memory);
  sumRegions(one, two, memory);
  answerInDouble(result, [&](ContactRegions<double>& regions) {
    RegionWriter(memory, one.tf, regions).write();
  });
  return result.size();
}

template std::size_t contactRegions(const DeformableMesh<float>&, const fcl::Transform3<float>&,
                                    const DeformableMesh<float>&, const fcl::Transform3<float>&,
                                    ContactRegions<float>&);
template std::size_t contactRegions(const DeformableMesh<double>&, const fcl::Transform3<double>&,
                                    const DeformableMesh<double>&, const fcl::Transform3<double>&,
                                    ContactRegions<double>&);

}  // namespace adaptive_bvh
