#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "adaptive_bvh/penetration.h"
#include "query/placed_mesh.h"
#include "query/point_search.h"
#include "query/vertex_search.h"

namespace adaptive_bvh {

/// What a vertex has as a contact, in the other body's frame.
struct VertexContact {
  double distance;  ///< signed
  fcl::Vector3d nearest, normal, barycentric;
  int triangle;  ///< -1: of a shape
};

/// Makes contacts of candidates, and writes them into a result by increasing vertex. The memory is
/// the thread's: one of it at a time.
template <typename S>
class ContactWriter {
 public:
  ContactWriter(const PlacedMesh<S>& mesh, const fcl::Transform3<S>& other_tf)
      : mesh_(mesh), other_tf_(other_tf) {
    candidates().clear();
  }

  /// To be filled.
  static std::vector<VertexCandidate>& candidates() { return memory().candidates; }
  /// Adds every vertex that a triangle has.
  void addAll() {
    const WideTree& tree = mesh_.tree();
    for (unsigned place = 0; place < unsigned(mesh_.mesh.numTriangles()); ++place)
      for (unsigned k = 0; k < 3; ++k)
        if (mesh_.mesh.topology->owners[place].ownsVertex(k))
          candidates().push_back({static_cast<unsigned>(tree.corners(place)[int(k)]), false});
  }

  /// makeTest() returns test(candidate, contact), which says whether it is one; each thread has its
  /// own.
  template <typename MakeTest>
  std::size_t write(int threads, const MakeTest& makeTest, VertexContacts<S>& result) const {
    Memory& m = memory();
    const std::size_t count = m.candidates.size();
    m.contacts.resize(count);
    m.is_contact.resize(count);
    forEachBatch(threads, count, [&](std::size_t begin, std::size_t end) {
      auto test = makeTest();
      for (std::size_t i = begin; i < end; ++i)
        m.is_contact[i] = test(m.candidates[i], m.contacts[i]);
    });
    m.order.clear();
    for (std::size_t i = 0; i < count; ++i)
      if (m.is_contact[i]) m.order.push_back(std::uint64_t(m.candidates[i].vertex) << 32 | i);
    std::sort(m.order.begin(), m.order.end());
    resize(result, m.order.size());
    for (std::size_t i = 0; i < m.order.size(); ++i) {
      const auto from = static_cast<std::uint32_t>(m.order[i]);
      set(result, i, m.candidates[from].vertex, m.contacts[from]);
    }
    return result.size();
  }

 private:
  struct Memory {
    std::vector<VertexCandidate> candidates;
    std::vector<VertexContact> contacts;
    std::vector<std::uint8_t> is_contact;
    std::vector<std::uint64_t> order;  ///< vertex, and number of the candidate
  };
  static Memory& memory() {
    static thread_local Memory memory;
    return memory;
  }

  static void resize(VertexContacts<S>& result, std::size_t count) {
    result.vertices.resize(count);
    result.distances.resize(count);
    result.positions.resize(count);
    result.nearest_points.resize(count);
    result.normals.resize(count);
    result.triangles.resize(count);
    result.barycentric.resize(count);
    result.areas.resize(count);
  }
  void set(VertexContacts<S>& result, std::size_t i, unsigned vertex,
           const VertexContact& contact) const {
    const auto turn = other_tf_.linear().template cast<double>();
    result.vertices[i] = vertex;
    result.distances[i] = static_cast<S>(contact.distance);
    result.positions[i] = mesh_.tf * mesh_.mesh.vertices[vertex];
    result.nearest_points[i] =
        (turn * contact.nearest + other_tf_.translation().template cast<double>())
            .template cast<S>();
    result.normals[i] = (turn * contact.normal).template cast<S>().normalized();
    result.triangles[i] = contact.triangle;
    result.barycentric[i] = contact.barycentric.template cast<S>();
    result.areas[i] = areaOf(vertex);
  }
  S areaOf(unsigned vertex) const {
    double sum = 0;
    for (const unsigned t : mesh_.mesh.topology->vertex_triangles[vertex]) {
      const TrianglePoints<double> p = mesh_.pointsOf(t);
      sum += (p[1] - p[0]).cross(p[2] - p[0]).norm();
    }
    return static_cast<S>(sum / 6);
  }

  const PlacedMesh<S>& mesh_;
  const fcl::Transform3<S>& other_tf_;
};

}  // namespace adaptive_bvh
