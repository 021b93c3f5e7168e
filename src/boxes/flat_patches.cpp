#include "boxes/flat_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

using float4::all;
using float4::lower;
using float4::upper;

/// The gaps between the interval of a and b and the interval of c and d; negative if they overlap.
ADAPTIVE_BVH_INLINE Float4 gap(const Float4& a, const Float4& b, const Float4& c, const Float4& d) {
  return upper<Float4>(lower(c, d) - upper(a, b), lower(a, b) - upper(c, d));
}

}  // namespace

PlaneContour::PlaneContour(std::size_t corners)
    : corners_(corners),
      memory_(2 * (corners + 2 * kChain)),
      x_(memory_.data()),
      y_(memory_.data() + corners + 2 * kChain) {}

void PlaneContour::close() {
  for (std::size_t i = corners_; i < corners_ + 2 * kChain; ++i) {
    x_[i] = x_[0];
    y_[i] = y_[0];
  }
}

bool PlaneContour::keepsApart(float distance) {
  close();
  return isStar(distance) || (neighboursKeepApart(distance) && edgesKeepApart(distance));
}

PlaneContour::Ends PlaneContour::edge(std::size_t i) const {
  return {all(x_[i]), all(y_[i]), all(x_[i + 1]), all(y_[i + 1])};
}

PlaneContour::Ends PlaneContour::chain(std::size_t first) const {
  using float4::load;
  return {load(&x_[first]), load(&y_[first]), load(&x_[first + 1]), load(&y_[first + 1])};
}

/// A bit for each edge of the chain that begins at `first`; chains at the end have fewer edges.
unsigned PlaneContour::edgesOf(std::size_t first) const {
  return corners_ < first + kChain ? 15u >> (first + kChain - corners_) : 15u;
}

/// Whether the polygon is star-shaped around its centroid (every edge turns left around it, and all
/// edges together turn once) and large enough: seen from the centroid, there is an edge between a
/// corner and any edge that does not end at it. So the directions to a point of that edge and to
/// the corner differ by at least the least angle of an edge, and the point is at least as far from
/// the centroid as the nearest edge: their distance is at least the sine of the one times the
/// other.
bool PlaneContour::isStar(float distance) const {
  float sum_x = 0, sum_y = 0;
  for (std::size_t i = 0; i < corners_; ++i) {
    sum_x += x_[i];
    sum_y += y_[i];
  }
  const Float4 x = all(sum_x / float(corners_)), y = all(sum_y / float(corners_));
  Float4 least_sine = all(1), least_height = all(std::numeric_limits<float>::max());
  int turns = 0;
  for (std::size_t i = 0; i < corners_; i += kChain) {
    const Ends e = chain(i);
    const Float4 ax = e.ax - x, ay = e.ay - y, bx = e.bx - x, by = e.by - y;
    const Float4 edge_x = e.bx - e.ax, edge_y = e.by - e.ay;
    const Float4 area = ax * by - ay * bx;  // twice the area of the centroid and the edge
    const unsigned edges = edgesOf(i);
    if ((float4::bits(area > all(0)) & edges) != edges) return false;
    turns += packs::countOf16(float4::bits((ay < all(0)) & (by >= all(0))) & edges);
    const Float4 length = float4::squareRoot(edge_x * edge_x + edge_y * edge_y);
    const Float4 height = area / length;  // distance of the edge's line from the centroid
    const Float4 sides = (ax * ax + ay * ay) * (bx * bx + by * by);
    const Float4 sine = height * length / float4::squareRoot(sides);
    // Past the last edge both are NaN, and comparisons are false.
    least_sine = sine < least_sine ? sine : least_sine;
    least_height = height < least_height ? height : least_height;
  }
  return turns == 1 && packs::smallest(least_sine) * packs::smallest(least_height) >= distance;
}

/// Whether, for each two consecutive edges, the far end of each keeps its distance from the other
/// edge. If their angle is obtuse, the nearest point is the common end, an edge length away.
bool PlaneContour::neighboursKeepApart(float distance) const {
  for (std::size_t i = 0; i < corners_; ++i) {
    const std::size_t next = i + 1 < corners_ ? i + 2 : 1;
    const float ax = x_[i] - x_[i + 1], ay = y_[i] - y_[i + 1];
    const float bx = x_[next] - x_[i + 1], by = y_[next] - y_[i + 1];
    if (ax * bx + ay * by <= 0) continue;
    const float longer = std::sqrt(std::max(ax * ax + ay * ay, bx * bx + by * by));
    if (!(std::fabs(ax * by - ay * bx) >= distance * longer)) return false;
  }
  return true;
}

PlaneContour::ChainBox PlaneContour::boxOf(std::size_t first) const {
  const auto x = std::minmax_element(x_ + first, x_ + first + kChain + 1);
  const auto y = std::minmax_element(y_ + first, y_ + first + kChain + 1);
  return {*x.first, *y.first, *x.second, *y.second};
}

/// The gap between an edge and other edges, across the edge's line or along it, minus `distance`;
/// all multiplied by the edge's length.
ADAPTIVE_BVH_INLINE Float4 PlaneContour::gapBeside(const Ends& e, const Ends& other,
                                                   const Float4& distance) {
  const Float4 x = e.bx - e.ax, y = e.by - e.ay;
  const Float4 to_ax = other.ax - e.ax, to_ay = other.ay - e.ay;
  const Float4 to_bx = other.bx - e.ax, to_by = other.by - e.ay;
  const Float4 across_a = x * to_ay - y * to_ax, across_b = x * to_by - y * to_bx;
  const Float4 along_a = x * to_ax + y * to_ay, along_b = x * to_bx + y * to_by;
  const Float4 squared = x * x + y * y;
  const Float4 across = upper<Float4>(lower(across_a, across_b), -upper(across_a, across_b));
  const Float4 along = upper<Float4>(lower(along_a, along_b) - squared, -upper(along_a, along_b));
  return upper(across, along) - distance * float4::squareRoot(squared);
}

/// Whether edge i keeps its distance from the later edges of a chain that are not adjacent to it.
ADAPTIVE_BVH_INLINE bool PlaneContour::edgeKeepsApart(std::size_t i, std::size_t first,
                                                      float least) const {
  unsigned others = edgesOf(first);  // the edges of the chain that are still to test
  if (first < i + 2) others &= 15u << (i + 2 - first);
  if (i == 0 && first + kChain >= corners_) others &= ~(1u << (corners_ - 1 - first));
  if (others == 0) return true;
  const Ends a = edge(i), b = chain(first);
  const Float4 distance = all(least), zero = all(0);
  others &= ~float4::bits((gap(a.ax, a.bx, b.ax, b.bx) >= distance) |
                          (gap(a.ay, a.by, b.ay, b.by) >= distance));
  if (others == 0) return true;
  others &=
      ~float4::bits((gapBeside(a, b, distance) >= zero) | (gapBeside(b, a, distance) >= zero));
  return others == 0;
}

/// Whether all edges that are not adjacent keep their distance. Tests chains with near boxes.
bool PlaneContour::edgesKeepApart(float distance) const {
  Scratch<ChainBox> boxes;
  for (std::size_t i = 0; i < corners_; i += kChain) boxes.push_back(boxOf(i));
  for (std::size_t c = 0; c < boxes.size(); ++c) {
    const ChainBox near{boxes[c].low_x - distance, boxes[c].low_y - distance,
                        boxes[c].high_x + distance, boxes[c].high_y + distance};
    const std::size_t end = std::min((c + 1) * kChain, corners_);
    for (std::size_t other = c; other < boxes.size(); ++other) {
      const ChainBox& box = boxes[other];
      if (box.low_x > near.high_x || box.high_x < near.low_x || box.low_y > near.high_y ||
          box.high_y < near.low_y)
        continue;
      for (std::size_t i = c * kChain; i < end; ++i)
        if (!edgeKeepsApart(i, other * kChain, distance)) return false;
    }
  }
  return true;
}

bool FlatPatches::contains(int node) const {
  const Patch& patch = contours_.patch(node);
  if (patch.length == 0) return false;
  const View view = viewOf(patch);
  const Shape shape = shapeOf(patch, view);
  const float least = kShare * shape.edge + kLeast;
  return shape.height >= least + distance_ &&
         contourKeepsApart(patch, view, least + kContourFactor * distance_);
}

/// The view along the sum of the triangles' normals, which is the sum over the contour's edges. Any
/// directions are valid, as long as none exceeds length 1 by more than rounding.
auto FlatPatches::viewOf(const Patch& patch) const -> View {
  using float4::all;
  using float4::cross;
  using float4::dot;
  const unsigned* const slots = contours_.slots(patch);
  const Float4 *const positions = tree_.positions(), &origin = positions[slots[0]];
  Float4 normal = all(0), last = normal;
  for (std::uint32_t i = 1; i < patch.length; ++i) {
    const Float4 corner = positions[slots[i]] - origin;
    normal += cross(last, corner);
    last = corner;
  }
  const auto unit = [](const Float4& v) -> Float4 { return v * all(1 / std::sqrt(dot(v, v))); };
  normal = unit(normal);
  const bool along_z = std::fabs(normal[2]) > 0.5f;
  const Float4 right = unit(cross(normal, along_z ? Float4{1, 0, 0, 0} : Float4{0, 0, 1, 0}));
  const Float4 up = unit(cross(normal, right));
  return {vectors::all(right), vectors::all(up), vectors::all(cross(right, up))};
}

/// Processes four triangles at a time, one from each quarter of the patch, so that a bend is
/// detected early.
auto FlatPatches::shapeOf(const Patch& patch, const View& view) const -> Shape {
  using vectors::cross;
  using vectors::difference;
  using vectors::dot;
  const std::uint32_t quarter = (patch.count + 3) / 4, last = patch.first + patch.count - 1;
  Float4 longest = float4::all(0), lowest = float4::all(std::numeric_limits<float>::max());
  for (std::uint32_t i = patch.first; i < patch.first + quarter; ++i) {
    Vector4x3 corners[3];
    gatherCorners(tree_.slots(), tree_.positions(),
                  {i, std::min(i + quarter, last), std::min(i + 2 * quarter, last),
                   std::min(i + 3 * quarter, last)},
                  corners);
    const Vector4x3 a = difference(corners[1], corners[0]), b = difference(corners[2], corners[0]);
    const Vector4x3 c = difference(corners[2], corners[1]);
    const Float4 edge =
        float4::squareRoot(float4::upper(float4::upper(dot(a, a), dot(b, b)), dot(c, c)));
    longest = float4::upper(longest, edge);
    const Float4 area = dot(cross(a, b), view.ahead);  // twice the area
    const Float4 height = area / edge;
    if (float4::bits(height > float4::all(distance_)) != 15) return {0, -1};
    lowest = float4::lower<Float4>(lowest, height);
  }
  return {packs::largest(longest), packs::smallest(lowest)};
}

/// Whether the projected contour keeps a distance from itself.
bool FlatPatches::contourKeepsApart(const Patch& patch, const View& view, float distance) const {
  const unsigned* const slots = contours_.slots(patch);
  const Float4* const positions = tree_.positions();
  PlaneContour contour(patch.length);
  for (std::uint32_t i = 0; i < patch.length; i += 4) {
    const auto corner = [&](std::uint32_t k) -> const Float4& {
      return positions[slots[std::min(i + k, patch.length - 1)]];
    };
    const Vector4x3 corners = float4::columns(corner(0), corner(1), corner(2), corner(3));
    contour.setCorners(i, vectors::dot(corners, view.right), vectors::dot(corners, view.up));
  }
  return contour.keepsApart(distance);
}

}  // namespace adaptive_bvh
