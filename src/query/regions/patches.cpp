#include "query/regions/patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace adaptive_bvh {

void SurfacePatches::build(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                           const std::array<SurfaceWinding, 2>& windings) {
  bodies_ = &bodies;
  crossings_ = &crossings;
  windings_ = &windings;
  first_labels_ = windings[0].numLabels();
  num_labels_ = first_labels_ + windings[1].numLabels();
  parents_.resize(num_labels_ + crossings.nodes().size());
  std::iota(parents_.begin(), parents_.end(), 0u);
  pieces_.clear();
  cuts_.clear();
  parts_.clear();
  for (const CrossingSegment& s : crossings.segments())
    connect(nodeElement(s.start), nodeElement(s.end));
  cutTriangles(WhichBody::First);
  cutTriangles(WhichBody::Second);
  traceCurves();
  last_part_.assign(parents_.size(), 0);
  collectParts(WhichBody::First);
  collectParts(WhichBody::Second);
  connectHoles();
  connectCavities();
  numberRegions();
}

unsigned SurfacePatches::rootOf(unsigned element) const {
  while (parents_[element] != element) element = parents_[element] = parents_[parents_[element]];
  return element;
}

/// Connects two elements. The smaller root becomes the root of both.
void SurfacePatches::connect(unsigned a, unsigned b) {
  a = rootOf(a);
  b = rootOf(b);
  parents_[std::max(a, b)] = std::min(a, b);
}

unsigned SurfacePatches::regionOf(WhichBody body, unsigned vertex) const {
  const SurfaceWinding& winding = (*windings_)[indexOf(body)];
  const unsigned label = winding.label(vertex);
  if (label == SurfaceWinding::kNoLabel || winding.numberOf(label) == 0) return kNoRegion;
  return numbers_[rootOf(labelElement(body, label))];
}

/// Collects the pieces of all triangles of a body that cross the other body.
void SurfacePatches::cutTriangles(WhichBody body) {
  const auto& segments = crossings_->segments();
  const auto triangleOf = [&](unsigned i) {
    return body == WhichBody::First ? segments[i].first : segments[i].second;
  };
  order_.resize(segments.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (body == WhichBody::Second)
    std::sort(order_.begin(), order_.end(), [&](unsigned a, unsigned b) {
      return std::make_pair(triangleOf(a), a) < std::make_pair(triangleOf(b), b);
    });
  for (std::size_t i = 0; i < order_.size();) {
    const unsigned triangle = triangleOf(order_[i]);
    const std::size_t begin = pieces_.size();
    addEdges(body, triangle);
    for (; i < order_.size() && triangleOf(order_[i]) == triangle; ++i)
      pieces_.push_back(pieceOf(body, segments[order_[i]]));
    cuts_.push_back({body, triangle, begin, pieces_.size()});
  }
}

/// Adds the pieces of a triangle's edges inside the other body; connects their ends' elements.
void SurfacePatches::addEdges(WhichBody body, unsigned triangle) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  const SurfaceWinding& winding = (*windings_)[indexOf(body)];
  const VertexIndices v = surface.corners(triangle);
  for (std::size_t k = 0; k < 3; ++k) {
    const unsigned a = v[k], b = v[(k + 1) % 3];
    if (a == b) continue;
    const SurfaceCrossings::Range range = crossings_->nodesOfEdge(body, a, b);
    int number = winding.numberOf(winding.label(a));  // the other body's winding number at `from`
    unsigned element = labelElement(body, winding.label(a));
    fcl::Vector3d from = surface.points[a];
    const auto advance = [&](unsigned next, const fcl::Vector3d& to) {
      if (number != 0) {
        connect(element, next);
        pieces_.push_back({element, number, from, to});
      }
      element = next;
      from = to;
    };
    for (unsigned i = 0; i < range.end - range.begin; ++i) {
      const unsigned node = a < b ? range.begin + i : range.end - 1 - i;
      advance(nodeElement(node), crossings_->nodes()[node].position);
      number += a < b ? crossings_->nodes()[node].sign : -crossings_->nodes()[node].sign;
    }
    advance(labelElement(body, winding.label(b)), surface.points[b]);
  }
}

/// Returns a segment as a piece of one of its triangles. For the second body the inside is on the
/// other side, so the direction is reversed.
auto SurfacePatches::pieceOf(WhichBody body, const CrossingSegment& segment) const -> Piece {
  const fcl::Vector3d &start = crossings_->nodes()[segment.start].position,
                      &end = crossings_->nodes()[segment.end].position;
  const unsigned element = nodeElement(segment.start);
  if (body == WhichBody::First) return {element, 1, start, end};
  return {element, 1, end, start};
}

/// Traces the curves, ordered by their smallest segment. At each node as many segments start as
/// end, so each curve returns to its start.
void SurfacePatches::traceCurves() {
  const auto& segments = crossings_->segments();
  order_.resize(segments.size());
  std::iota(order_.begin(), order_.end(), 0u);
  std::sort(order_.begin(), order_.end(), [&](unsigned a, unsigned b) {
    return std::make_pair(segments[a].start, a) < std::make_pair(segments[b].start, b);
  });
  next_.assign(crossings_->nodes().size(), 0);
  for (std::size_t i = order_.size(); i-- > 0;)
    next_[segments[order_[i]].start] = static_cast<unsigned>(i);
  is_traced_.assign(segments.size(), 0);
  curves_.clear();
  curve_segments_.clear();
  for (unsigned first = 0; first < segments.size(); ++first) {
    if (is_traced_[first]) continue;
    const std::size_t begin = curve_segments_.size();
    for (unsigned current = first;;) {
      is_traced_[current] = 1;
      curve_segments_.push_back(current);
      const unsigned node = segments[current].end;
      if (node == segments[first].start) break;
      while (next_[node] < order_.size() && is_traced_[order_[next_[node]]]) ++next_[node];
      current = order_[next_[node]];
    }
    curves_.push_back({begin, curve_segments_.size(), nodeElement(segments[first].start)});
  }
}

/// Connects the curves around holes with their parts. Only a curve that lies in one triangle can go
/// around a hole of a part without a common point with the rest of the part's boundary. Larger
/// holes come first: see connectCavities.
void SurfacePatches::connectHoles() {
  const auto& segments = crossings_->segments();
  holes_.clear();
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    const CrossingCurve& curve = curves_[c];
    const CrossingSegment& s = segments[curve_segments_[curve.begin]];
    bool is_in_first = true, is_in_second = true;
    for (std::size_t i = curve.begin; i < curve.end; ++i) {
      is_in_first = is_in_first && segments[curve_segments_[i]].first == s.first;
      is_in_second = is_in_second && segments[curve_segments_[i]].second == s.second;
    }
    if (is_in_first) addIfHole(c, WhichBody::First, s.first);
    if (is_in_second) addIfHole(c, WhichBody::Second, s.second);
  }
  std::sort(holes_.begin(), holes_.end(), [](const Hole& a, const Hole& b) {
    return std::make_tuple(a.area, a.curve, a.body) < std::make_tuple(b.area, b.curve, b.body);
  });
  for (const Hole& hole : holes_) connectHole(hole);
}

/// Returns the area that a curve encloses in a body's triangle; positive if the part is inside the
/// curve, negative if the curve goes around a hole. `normal`: of the triangle.
double SurfacePatches::signedArea(const CrossingCurve& curve, WhichBody body,
                                  const fcl::Vector3d& normal) const {
  fcl::Vector3d sum = fcl::Vector3d::Zero();
  const auto positionOf = [&](std::size_t i) -> const fcl::Vector3d& {
    return crossings_->nodes()[crossings_->segments()[curve_segments_[i]].start].position;
  };
  const fcl::Vector3d& origin = positionOf(curve.begin);
  for (std::size_t i = curve.begin + 1; i + 1 < curve.end; ++i)
    sum += (positionOf(i) - origin).cross(positionOf(i + 1) - origin);
  return body == WhichBody::First ? sum.dot(normal) : -sum.dot(normal);
}

/// Returns the pieces of a triangle; null if the triangle crosses nothing.
auto SurfacePatches::cutTriangle(WhichBody body, unsigned triangle) const -> const CutTriangle* {
  const auto key = std::make_pair(body, triangle);
  const auto keyOf = [](const CutTriangle& cut) { return std::make_pair(cut.body, cut.triangle); };
  const auto cut =
      std::lower_bound(cuts_.begin(), cuts_.end(), key,
                       [&](const CutTriangle& c, const auto& k) { return keyOf(c) < k; });
  return cut != cuts_.end() && keyOf(*cut) == key ? &*cut : nullptr;
}

unsigned SurfacePatches::regionAt(WhichBody body, unsigned triangle, const fcl::Vector3d& x) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  const CutTriangle* const cut = cutTriangle(body, triangle);
  if (!cut) return regionOf(body, surface.corners(triangle)[0]);
  const TrianglePoints p = surface.triangle(triangle);
  around_.clear();
  addWindings(lineAcross(p, x), *cut);
  const unsigned root = rootAround(kNoRegion);
  return root == kNoRegion ? kNoRegion : numbers_[root];
}

/// Adds the parts of a body's triangles.
void SurfacePatches::collectParts(WhichBody body) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  auto cut = std::find_if(cuts_.begin(), cuts_.end(),
                          [&](const CutTriangle& c) { return c.body == body; });
  for (unsigned t = 0; t < surface.numTriangles(); ++t) {
    if (cut != cuts_.end() && cut->body == body && cut->triangle == t)
      addCut(*cut++);
    else
      addWhole(body, t);
  }
}

/// Adds a triangle without crossings, if it is inside.
void SurfacePatches::addWhole(WhichBody body, unsigned triangle) {
  const ClosedSurface& surface = (*bodies_)[indexOf(body)];
  const SurfaceWinding& winding = (*windings_)[indexOf(body)];
  const unsigned label = winding.label(surface.corners(triangle)[0]);
  const int number = winding.numberOf(label);
  if (number == 0) return;
  const TrianglePoints p = surface.triangle(triangle);
  const fcl::Vector3d u = p[1] - p[0], v = p[2] - p[0], cross = u.cross(v),
                      normal = cross.stableNormalized();
  const double area = 0.5 * number * cross.dot(normal);
  parts_.push_back({body, triangle, labelElement(body, label), false, area, std::fabs(area), normal,
                    p[0], fcl::Vector3d((u + v) * (area / 3))});
}

/// Adds the parts of a triangle with crossings. Each piece adds a triangle with the part's origin.
void SurfacePatches::addCut(const CutTriangle& cut) {
  const TrianglePoints p = (*bodies_)[indexOf(cut.body)].triangle(cut.triangle);
  const fcl::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).stableNormalized();
  const std::size_t first_part = parts_.size();
  for (std::size_t i = cut.begin; i < cut.end; ++i) {
    const Piece& piece = pieces_[i];
    SurfacePart& part = partOf(first_part, piece, cut, normal);
    const fcl::Vector3d u = piece.from - part.origin, v = piece.to - part.origin;
    const double area = 0.5 * piece.count * u.cross(v).dot(normal);
    part.area += area;
    part.size += std::fabs(area);
    part.moment += (u + v) * (area / 3);
  }
}

/// Returns the part to which a piece belongs, perhaps a new one. `first_part`: of its triangle.
SurfacePart& SurfacePatches::partOf(std::size_t first_part, const Piece& piece,
                                    const CutTriangle& cut, const fcl::Vector3d& normal) {
  const unsigned root = rootOf(piece.element);
  std::size_t& last = last_part_[root];
  if (last >= first_part && last < parts_.size() && parts_[last].region == root)
    return parts_[last];
  last = parts_.size();
  parts_.push_back(
      {cut.body, cut.triangle, root, true, 0, 0, normal, piece.from, fcl::Vector3d::Zero()});
  return parts_.back();
}

/// Merges the parts of each triangle that belong to one region. They were separate until holes and
/// cavities were connected.
void SurfacePatches::mergeParts() {
  std::size_t kept = 0, first = 0;  // `first`: the triangle's first part
  last_part_.assign(num_regions_, 0);
  for (const SurfacePart& part : parts_) {
    if (kept > 0 &&
        (parts_[kept - 1].body != part.body || parts_[kept - 1].triangle != part.triangle))
      first = kept;
    std::size_t& last = last_part_[part.region];
    if (last >= first && last < kept && parts_[last].region == part.region) {
      parts_[last].add(part);
    } else {
      last = kept;
      parts_[kept++] = part;
    }
  }
  parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(kept), parts_.end());
}

/// Numbers the regions in the order of their keys, which depend on the crossings only; replaces
/// elements by these numbers, and sorts the curves by region.
void SurfacePatches::numberRegions() {
  constexpr unsigned kNone = ~0u;
  keys_.clear();
  numbers_.assign(parents_.size(), kNoRegion);
  const auto keyOf = [&](unsigned element) -> RegionKey& {
    unsigned& number = numbers_[rootOf(element)];
    if (number == kNoRegion) {
      number = static_cast<unsigned>(keys_.size());
      keys_.push_back({kNone, kNone, kNone, rootOf(element)});
    }
    return keys_[number];
  };
  for (const SurfacePart& part : parts_) {
    RegionKey& key = keyOf(part.region);
    unsigned& smallest = part.body == WhichBody::First ? key.first : key.second;
    smallest = std::min(smallest, part.triangle);
  }
  for (std::size_t c = curves_.size(); c-- > 0;)
    keyOf(curves_[c].region).curve = static_cast<unsigned>(c);
  const auto sortKeyOf = [](const RegionKey& k) {
    return std::make_tuple(k.first, k.second, k.curve, k.root);
  };
  std::sort(keys_.begin(), keys_.end(),
            [&](const RegionKey& a, const RegionKey& b) { return sortKeyOf(a) < sortKeyOf(b); });
  num_regions_ = keys_.size();
  for (std::size_t i = 0; i < keys_.size(); ++i) numbers_[keys_[i].root] = static_cast<unsigned>(i);
  for (SurfacePart& part : parts_) part.region = numbers_[rootOf(part.region)];
  mergeParts();
  for (CrossingCurve& curve : curves_) curve.region = numbers_[rootOf(curve.region)];
  std::sort(curves_.begin(), curves_.end(), [](const CrossingCurve& a, const CrossingCurve& b) {
    return std::make_pair(a.region, a.begin) < std::make_pair(b.region, b.begin);
  });
}

}  // namespace adaptive_bvh
