#include "query/nearest/nearest_pair.h"

#include "base/shortcut.h"
#include "query/nearest/farthest_point.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {
namespace {

/// Rounding of distances, with the second's coordinates transformed to the first's frame.
DistanceRounding roundingOf(const fcl::Vector3d& T, const PlacedMesh& first,
                            const PlacedMesh& second) {
  const auto size = [](const PlacedMesh& mesh) -> double {
    return mesh.bounds().aabb_center.lpNorm<1>() + 2 * mesh.bounds().aabb_radius;
  };
  return DistanceRounding(T.lpNorm<1>() + size(first) + size(second));
}

/// Vertices and number of triangle `i` of a leaf.
const Int4& cornersOf(const PlacedMesh& mesh, const WideNode& leaf, int i) {
  return mesh.tree().corners(static_cast<unsigned>(leaf.first + i));
}
VertexIndices verticesOf(const Int4& corners) {
  return {unsigned(corners[0]), unsigned(corners[1]), unsigned(corners[2])};
}
VertexIndices verticesOf(const PlacedMesh& mesh, const WideNode& leaf, int i) {
  return verticesOf(cornersOf(mesh, leaf, i));
}

}  // namespace

NearestPair::NearestPair(const PlacedMesh& first, const PlacedMesh& second,
                         const DistanceQuery<double>& query)
    : first_(first),
      second_(second),
      request_(query.request),
      result_(query.result),
      to_first_(first.tf, second.tf),
      boxes_(first, second, to_first_),
      triangles_(first.mesh.vertices.data(), second.mesh.vertices.data(), to_first_),
      rounding_(roundingOf(to_first_.T, first, second)) {
  setLimit();
}

/// FCL descends below a pair unless its bound c satisfies c >= min - abs_err and c (1 + rel_err) >=
/// min.
void NearestPair::setLimit() {
  const auto least = static_cast<double>(result_.min_distance);
  limit_ = std::max(least - static_cast<double>(request_.abs_err),
                    least / (1 + static_cast<double>(request_.rel_err)));
  least_enough_ = isClear() ? limitWithinRounding() : std::numeric_limits<double>::infinity();
}

/// Sets the line to that between the nearest points of two triangles.
void NearestPair::lookAlong(const TriangleGap& gap, const VertexIndices& a,
                            const VertexIndices& b) {
  triangles_.lookAlong(gap.points.first, gap.points.second);
  near1_ = a;
  near2_ = b;
  near_distance_ = gap.distance;
  is_refined_ = false;
}

void NearestPair::refineLine() {
  is_refined_ = true;
  if (triangles_.direction() == fcl::Vector3d::Zero()) return;
  triangles_.preferNormals(near1_, near2_, rounding_.below(near_distance_));
  raiseLeast();
}

void NearestPair::raiseLeast() {
  const auto& line = triangles_.line();
  raiseLeast(line.offset - boxes_.extent1(line.from, line.along1) -
             boxes_.extent2(line.to, -line.along2));
}

bool NearestPair::lookAlongHulls() {
  const auto farthestOf = [](const PlacedMesh& mesh) {
    return [&mesh](const fcl::Vector3d& along) -> fcl::Vector3d {
      return farthestPoint(mesh.tree(), mesh.mesh.vertices.data(), along);
    };
  };
  constexpr double kMost = 1 - 1. / 64;
  const fcl::Vector3d between =
      vectorBetween(to_first_, farthestOf(first_), farthestOf(second_), kMost * limit_);
  const double gap = between.stableNorm();
  if (!(gap > 0)) return false;
  triangles_.turnLine(between / gap);
  raiseLeast();
  return true;
}

void NearestPair::improve(const TriangleGap& gap, int triangle1, int triangle2) {
  result_.update(gap.distance, nullptr, nullptr, triangle1, triangle2);  // the caller sets o1, o2
  if (request_.enable_nearest_points) {
    const auto inWorld = [&](const fcl::Vector3d& x) -> fcl::Vector3d { return (first_.tf * x); };
    result_.nearest_points[0] = inWorld(gap.points.first);
    result_.nearest_points[1] = inWorld(gap.points.second);
  } else {
    unsetPoints(result_);
  }
  improved_ = true;
  setLimit();
}

void NearestPair::addWitness(int triangle1, int triangle2) {
  if (triangle1 < 0 || triangle1 >= first_.mesh.numTriangles() || triangle2 < 0 ||
      triangle2 >= second_.mesh.numTriangles())
    return;
  const VertexIndices a = first_.mesh.view().verticesOf(static_cast<unsigned>(triangle1)),
                      b = second_.mesh.view().verticesOf(static_cast<unsigned>(triangle2));
  const TriangleGap gap = triangles_.gap(a, b);
  if (gap.distance < result_.min_distance) improve(gap, triangle1, triangle2);
  lookAlong(gap, a, b);
}

void NearestPair::test(unsigned open, const TriangleBlock& block, double unit, double error,
                       const WideNode& leaf1, const WideNode& leaf2) {
  if (!isTaken(Shortcut::SinglePrecision)) {
    for (; open && !isDone(); open &= open - 1) testPair(__builtin_ctz(open), leaf1, leaf2);
    return;
  }
  const double off = rounding_.ofSeparations() + error,
               slack = double(block.slack()) * unit + 2 * off;
  const auto enough = static_cast<float>((limit_ + off) / unit * (1 + 1. / (1 << 20)));
  Float4 bounds[4];
  if (open & 0x000f) bounds[0] = block.bounds<0>(enough, open & 15);
  if (open & 0x00f0) bounds[1] = block.bounds<1>(enough, open >> 4 & 15);
  if (open & 0x0f00) bounds[2] = block.bounds<2>(enough, open >> 8 & 15);
  if (open & 0xf000) bounds[3] = block.bounds<3>(enough, open >> 12 & 15);
  unsigned tied = 0;
  const int tested = __builtin_popcount(open);
  for (; open && !isDone(); open &= open - 1) {
    const int bit = __builtin_ctz(open), i = bit & 3, j = bit >> 2;
    const double bound = double(bounds[j][i]) * unit - off;
    if (bound >= limit_) continue;  // false if it is out of range
    ++triangle_tests_;
    if (bound + slack >= limit_)
      tied |= 1u << bit;
    else
      testPair(bit, leaf1, leaf2);
  }
  if (tied && !isDone()) testTied(tied, tested, leaf1, leaf2);
}

/// Calls notApart(pair) for each pair of triangles of two leaves that no normal of the pairs
/// separates by the limit, until the search is over.
template <typename NotApart>
void NearestPair::separate(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2,
                           const NotApart& notApart) const {
  const TiedTriangles tied(
      triangles_, pairs, [&](int i) { return verticesOf(first_, leaf1, i); },
      [&](int j) { return verticesOf(second_, leaf2, j); });
  pairs &= ~tied.apartAlong(triangles_.direction(), limitWithinRounding(), pairs);
  while (pairs && !isDone()) {
    const int bit = __builtin_ctz(pairs);
    const unsigned apart = tied.apartNear(bit, limitWithinRounding(), pairs);
    if (!(apart >> bit & 1)) notApart(bit);
    pairs &= ~(apart | 1u << bit);
  }
}

/// Tests pairs whose bounds in double precision may reach the limit, though those in single
/// precision do not. Along the line between the nearest points pairs are tested one by one, which
/// often is enough; the first that it does not separate needs further directions. `tested`: of so
/// many pairs.
void NearestPair::testTied(unsigned pairs, int tested, const WideNode& leaf1,
                           const WideNode& leaf2) {
  const double limit = limitWithinRounding();
  for (; pairs; pairs &= pairs - 1) {
    const int bit = __builtin_ctz(pairs);
    if (!(triangles_.separation(verticesOf(first_, leaf1, bit & 3),
                                verticesOf(second_, leaf2, bit >> 2)) >= limit))
      break;
  }
  if (!pairs) return;
  mostly_tied_ = 2 * __builtin_popcount(pairs) > tested;
  separate(pairs, leaf1, leaf2, [&](int bit) { testPair(bit, leaf1, leaf2); });
}

unsigned NearestPair::withoutTied(unsigned open, const WideNode& leaf1, const WideNode& leaf2) {
  unsigned left = 0;
  triangle_tests_ += __builtin_popcount(open);
  separate(open, leaf1, leaf2, [&](int bit) { left |= 1u << bit; });
  mostly_tied_ = 2 * __builtin_popcount(left) < __builtin_popcount(open);
  return left;
}

void NearestPair::testPair(int bit, const WideNode& leaf1, const WideNode& leaf2) {
  const Int4 &first = cornersOf(first_, leaf1, bit & 3),
             &second = cornersOf(second_, leaf2, bit >> 2);
  const VertexIndices a = verticesOf(first), b = verticesOf(second);
  const TriangleGap gap = triangles_.gap(a, b);
  if (!(gap.distance < result_.min_distance)) return;
  improve(gap, first[3], second[3]);
  lookAlong(gap, a, b);
}

/// Stops at the first vertex that is too near. Tests a sample of both meshes first, which often has
/// one.
bool NearestPair::areSeparated() {
  if (!isClear()) return false;
  constexpr std::size_t kSampleStride = 32;  // of the vertices that are tested first
  const auto& line = triangles_.line();
  const double rest = line.offset - limitWithinRounding();
  const auto extent = [](const std::vector<fcl::Vector3d>& vertices, const fcl::Vector3d& from,
                         const fcl::Vector3d& along, double most, std::size_t stride) -> double {
    double extent = 0;
    for (std::size_t i = 0; i < vertices.size() && extent <= most; i += stride)
      extent = std::max(extent, along.dot(vertices[i] - from));
    return extent;
  };
  for (const std::size_t stride : {kSampleStride, std::size_t(1)}) {
    const double extent1 = extent(first_.mesh.vertices, line.from, line.along1, rest, stride);
    if (!(extent1 <= rest)) return false;
    const double rest2 = rest - extent1;
    if (!(extent(second_.mesh.vertices, line.to, -line.along2, rest2, stride) <= rest2))
      return false;
  }
  raiseLeast(limitWithinRounding());
  return true;
}

}  // namespace adaptive_bvh
