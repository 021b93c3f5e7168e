#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "adaptive_bvh/distance_derivatives.h"
#include "support/lattice_features.h"
#include "support/quad_geometry.h"
#include "support/test_mesh.h"

// Two meshes whose vertices move, and the distances of their features, in quadruple precision.
namespace adaptive_bvh_test {
namespace distance_derivatives {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::DistanceDerivatives;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::VertexGradients;
using quad::Point;
using quad::Real;
using Points = std::vector<Point>;

inline Points pointsOf(const std::vector<fcl::Vector3d>& vertices) {
  Points points;
  for (const fcl::Vector3d& x : vertices) points.push_back(quad::of(x));
  return points;
}

/// The motion from the second mesh's frame to the first's.
struct ToFirst {
  ToFirst(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2) {
    Point columns[3];
    for (int k = 0; k < 3; ++k) columns[k] = quad::of(tf1.linear().col(k));
    const Point apart = quad::of(tf2.translation()) - quad::of(tf1.translation());
    T = {quad::dot(columns[0], apart), quad::dot(columns[1], apart), quad::dot(columns[2], apart)};
    for (int k = 0; k < 3; ++k) {
      const Point axis = quad::of(tf2.linear().col(k));
      R[k] = {quad::dot(columns[0], axis), quad::dot(columns[1], axis),
              quad::dot(columns[2], axis)};
    }
  }
  Point turned(const Point& x) const { return x.x * R[0] + x.y * R[1] + x.z * R[2]; }
  Point operator()(const Point& x) const { return turned(x) + T; }

  Point R[3], T;  ///< R by columns
};

/// The positions of the vertices of two meshes, in the first's frame.
struct Positions {
  Points first, second;
};

/// Displacements of all vertices, each in the frame of its mesh.
struct Displacements {
  Points first, second;
};

inline Real largest(const Positions& positions) {
  Real size = 0;
  for (const Points* points : {&positions.first, &positions.second})
    for (const Point& x : *points) size = std::max(size, quad::size(x));
  return size;
}

inline Positions moved(const Positions& from, const Displacements& by, const ToFirst& to_first,
                       Real t) {
  Positions to = from;
  for (std::size_t i = 0; i < to.first.size(); ++i) to.first[i] = to.first[i] + t * by.first[i];
  for (std::size_t i = 0; i < to.second.size(); ++i)
    to.second[i] = to.second[i] + t * to_first.turned(by.second[i]);
  return to;
}

/// By how much the entries of a row change the distance.
inline Real changeOf(const VertexGradients& gradients, std::size_t row,
                     const Points& displacements) {
  Real sum = 0;
  const std::size_t count = gradients.per_distance;
  for (std::size_t i = row * count; i < (row + 1) * count; ++i)
    sum += quad::dot(quad::of(gradients.gradients[i]), displacements[gradients.vertices[i]]);
  return sum;
}

inline Real changeOf(const DistanceDerivatives& g, std::size_t row, const Displacements& by) {
  return changeOf(g.first, row, by.first) + changeOf(g.second, row, by.second);
}

/// The length of a face's height over its longest side.
inline Real heightOf(const quad::Triangle& t) {
  Real longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point side = t[(k + 1) % 3] - t[k];
    longest = std::max(longest, quad::dot(side, side));
  }
  const Point area = quad::cross(t[1] - t[0], t[2] - t[0]);
  return longest > 0 ? quad::root(quad::dot(area, area) / longest) : Real(0);
}

/// Two meshes in their places, or one with itself, and distances of their features.
class Bodies {
 public:
  Bodies(const DeformableMesh& a, const fcl::Transform3d& tf1, const DeformableMesh& b,
         const fcl::Transform3d& tf2)
      : first(a), second(b), to_first(tf1, tf2) {
    at.first = pointsOf(a.vertices());
    for (const Point& x : pointsOf(b.vertices())) at.second.push_back(to_first(x));
    size = std::max({largest(at), quad::size(to_first.T), Real(1e-300)});
    for (const Point& x : pointsOf(b.vertices())) size = std::max(size, quad::size(x));
    for (const Point& x : at.first) size = std::max(size, quad::size(x - to_first.T));
  }

  static quad::Triangle face(const DeformableMesh& mesh, const Points& at, unsigned t) {
    const fcl::Triangle& v = mesh.triangles()[t];
    return {at[v[0]], at[v[1]], at[v[2]]};
  }
  Real distance(FeatureKind kind, const FeaturePair& p, const Positions& at) const {
    if (kind == FeatureKind::VertexFace)
      return quad::distance(at.first[p.first], face(second, at.second, p.second));
    if (kind == FeatureKind::FaceVertex)
      return quad::distance(at.second[p.second], face(first, at.first, p.first));
    const auto e = adaptive_bvh::edgeVertices(first.triangles().data(), p.first),
               f = adaptive_bvh::edgeVertices(second.triangles().data(), p.second);
    return adaptive_bvh_test::distance(at.first[e[0]], at.first[e[1]], at.second[f[0]],
                                       at.second[f[1]]);
  }
  Real distance(const Positions& at) const {
    Real least = 1e300;
    for (unsigned i = 0; i < unsigned(numTriangles(first)); ++i)
      for (unsigned j = 0; j < unsigned(numTriangles(second)); ++j)
        least =
            std::min(least, quad::distance(face(first, at.first, i), face(second, at.second, j)));
    return least;
  }
  Real distanceOfVertex(unsigned v, const Positions& at) const {
    Real least = 1e300;
    for (unsigned j = 0; j < unsigned(numTriangles(second)); ++j)
      least = std::min(least, quad::distance(at.first[v], face(second, at.second, j)));
    return least;
  }

  const DeformableMesh &first, &second;
  const ToFirst to_first;
  Positions at;
  Real size;  ///< X of the bound
};

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
