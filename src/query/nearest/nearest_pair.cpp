// The tests of pairs of triangles in a distance search, first along the line of the nearest points.
#include "query/nearest/nearest_pair.h"

#include "base/shortcut.h"
#include "query/nearest/farthest_point.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {
namespace {

/// Returns the rounding errors of distances in the first's frame. `T`: translation of the second.
DistanceRounding roundingOf(const fcl::Vector3d& T, const PlacedMesh& first,
                            const PlacedMesh& second) {
  const auto size = [](const PlacedMesh& mesh) -> double {
    return mesh.bounds().aabb_center.lpNorm<1>() + 2 * mesh.bounds().aabb_radius;
  };
  return DistanceRounding(T.lpNorm<1>() + size(first) + size(second));
}

/// Returns the three vertices and the index of triangle `i` of a leaf.
const Int4& cornersOf(const PlacedMesh& mesh, const WideNode& leaf, int i) {
  return mesh.tree().corners(static_cast<unsigned>(leaf.first + i));
}
VertexIndices verticesOf(const Int4& corners) {
  return {unsigned(corners[0]), unsigned(corners[1]), unsigned(corners[2])};
}
VertexIndices verticesOf(const PlacedMesh& mesh, const WideNode& leaf, int i) {
  return verticesOf(cornersOf(mesh, leaf, i));
}

/// Sets the corners of a leaf's triangles, in the mesh's frame.
void setCorners(const PlacedMesh& mesh, const WideNode& leaf, TiedCorners& to) {
  for (int k = 0; k < int(leaf.count); ++k) {
    const TrianglePoints points = mesh.pointsAt(static_cast<unsigned>(leaf.first + k));
    for (std::size_t c = 0; c < 3; ++c) to.set(c, k, points[c]);
  }
}

}  // namespace

NearestPair::NearestPair(const PlacedMesh& first, const PlacedMesh& second,
                         const DistanceQuery& query)
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

/// Sets the limit to the distance so far, less tolerances: FCL descends below a pair of nodes
/// unless its bound c satisfies c >= min_distance - abs_err and c (1 + rel_err) >= min_distance.
void NearestPair::setLimit() {
  const double distance = result_.min_distance;
  limit_ = std::max(distance - static_cast<double>(request_.abs_err),
                    distance / (1 + static_cast<double>(request_.rel_err)));
  final_bound_ = isClear() ? limitWithinRounding() : std::numeric_limits<double>::infinity();
}

/// Sets the line to that between the nearest points of two triangles with the vertices a and b.
void NearestPair::lookAlong(const TriangleGap& gap, const VertexIndices& a,
                            const VertexIndices& b) {
  triangles_.lookAlong(gap.points.first, gap.points.second);
  line_vertices1_ = a;
  line_vertices2_ = b;
  line_distance_ = gap.distance;
  is_refined_ = false;
}

void NearestPair::refineLine() {
  is_refined_ = true;
  if (triangles_.direction() == fcl::Vector3d::Zero()) return;
  triangles_.preferNormals(line_vertices1_, line_vertices2_, rounding_.below(line_distance_));
  raiseByBoxes();
}

/// Raises the lower bound to the gap of the local boxes along the line.
void NearestPair::raiseByBoxes() {
  const auto& line = triangles_.line();
  raiseLowerBound(line.offset - boxes_.extent1(line.from, line.along1) -
                  boxes_.extent2(line.to, -line.along2));
}

bool NearestPair::lookAlongHulls() {
  const auto supportOf = [](const PlacedMesh& mesh) {
    return [&mesh](const fcl::Vector3d& along) -> fcl::Vector3d {
      return farthestPoint(mesh.tree(), mesh.mesh.vertices.data(), along);
    };
  };
  constexpr double kNearly = 1 - 1. / 64;
  const fcl::Vector3d between =
      vectorBetween(to_first_, supportOf(first_), supportOf(second_), kNearly * limit_);
  const double gap = between.stableNorm();
  if (!(gap > 0)) return false;
  triangles_.turnLine(between / gap);
  raiseByBoxes();
  return true;
}

/// Writes a nearer pair of triangles into the result.
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

/// Skips pairs whose lower bound in single precision reaches the limit. Pairs whose bound would
/// reach it but for the errors of single precision are tied, and are tested in double precision.
void NearestPair::test(unsigned pairs, const TriangleBlock& block, double unit, double error,
                       const WideNode& leaf1, const WideNode& leaf2) {
  if (!isTaken(Shortcut::SinglePrecision)) {
    for (; pairs && !isDone(); pairs &= pairs - 1) testPair(__builtin_ctz(pairs), leaf1, leaf2);
    return;
  }
  const double bound_error = rounding_.ofSeparations() + error,
               slack = double(block.slack()) * unit + 2 * bound_error;
  const auto enough = static_cast<float>((limit_ + bound_error) / unit * (1 + 1. / (1 << 20)));
  Float4 bounds[4];
  if (pairs & 0x000f) bounds[0] = block.bounds<0>(enough, pairs & 15);
  if (pairs & 0x00f0) bounds[1] = block.bounds<1>(enough, pairs >> 4 & 15);
  if (pairs & 0x0f00) bounds[2] = block.bounds<2>(enough, pairs >> 8 & 15);
  if (pairs & 0xf000) bounds[3] = block.bounds<3>(enough, pairs >> 12 & 15);
  unsigned tied = 0;
  const int tested = __builtin_popcount(pairs);
  for (; pairs && !isDone(); pairs &= pairs - 1) {
    const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
    const double bound = double(bounds[j][i]) * unit - bound_error;
    if (bound >= limit_) continue;  // NaN, from numbers out of range, does not skip the pair
    ++triangle_tests_;
    if (bound + slack >= limit_)
      tied |= 1u << bit;
    else
      testPair(bit, leaf1, leaf2);
  }
  if (tied && !isDone()) testTied(tied, tested, leaf1, leaf2);
}

/// Calls notApart(bit) for each pair of two leaves that is not separated by the limit along a
/// direction of TiedTriangles::Along, until the search is over.
template <typename NotApart>
void NearestPair::separate(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2,
                           const NotApart& notApart) {
  if (!tied_leaves_) {
    tied_leaves_.emplace();
    for (TiedLeaves& leaves : **tied_leaves_) leaves.clear();
  }
  const TiedTriangles tied(
      (**tied_leaves_)[0].of(leaf1, [&](TiedCorners& to) { setCorners(first_, leaf1, to); }),
      (**tied_leaves_)[1].of(leaf2, [&](TiedCorners& to) {
        setCorners(second_, leaf2, to);
        to.place(to_first_);
      }));
  while (pairs && !isDone()) {
    const int bit = __builtin_ctz(pairs);
    const unsigned apart = tied.apartNear(bit, limitWithinRounding(), pairs, triangles_.direction(),
                                          preferred_direction_);
    if (!(apart >> bit & 1)) notApart(bit);
    pairs &= ~(apart | 1u << bit);
  }
}

/// Tests tied pairs in double precision: one by one along the line, which often separates all; from
/// the first pair that it does not separate, along further directions. `tested`: the number of
/// pairs of the two leaves, tied or not.
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

unsigned NearestPair::withoutTied(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2) {
  unsigned left = 0;
  triangle_tests_ += __builtin_popcount(pairs);
  separate(pairs, leaf1, leaf2, [&](int bit) { left |= 1u << bit; });
  mostly_tied_ = 2 * __builtin_popcount(left) < __builtin_popcount(pairs);
  return left;
}

/// Computes the distance of the pair `bit`, and keeps the pair if it is nearer than the result.
void NearestPair::testPair(int bit, const WideNode& leaf1, const WideNode& leaf2) {
  const Int4 &first = cornersOf(first_, leaf1, bit & 3),
             &second = cornersOf(second_, leaf2, bit >> 2);
  const VertexIndices a = verticesOf(first), b = verticesOf(second);
  const TriangleGap gap = triangles_.gap(a, b);
  if (!(gap.distance < result_.min_distance)) return;
  improve(gap, first[3], second[3]);
  lookAlong(gap, a, b);
}

/// Stops at the first vertex that extends too far. Tests a sample first, which often has one.
bool NearestPair::areSeparated() {
  if (!isClear()) return false;
  constexpr std::size_t kSampleStride = 32;  // of the vertices that are tested first
  const auto& line = triangles_.line();
  // The meshes are separated if their extents toward each other sum up to at most this.
  const double room = line.offset - limitWithinRounding();
  // The largest extent from `from` along a direction; a value above `most` ends the loop.
  const auto extent = [](const std::vector<fcl::Vector3d>& vertices, const fcl::Vector3d& from,
                         const fcl::Vector3d& along, double most, std::size_t stride) -> double {
    double extent = 0;
    for (std::size_t i = 0; i < vertices.size() && extent <= most; i += stride)
      extent = std::max(extent, along.dot(vertices[i] - from));
    return extent;
  };
  for (const std::size_t stride : {kSampleStride, std::size_t(1)}) {
    const double extent1 = extent(first_.mesh.vertices, line.from, line.along1, room, stride);
    if (!(extent1 <= room)) return false;
    const double room2 = room - extent1;
    if (!(extent(second_.mesh.vertices, line.to, -line.along2, room2, stride) <= room2))
      return false;
  }
  raiseLowerBound(limitWithinRounding());
  return true;
}

}  // namespace adaptive_bvh
