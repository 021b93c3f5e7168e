#pragma once

#include <cstdint>
#include <vector>

#include "query/contact_regions_crossings.h"

namespace adaptive_bvh {

/// How often one body winds around each vertex of the other. Vertices that edges without crossings
/// connect have the same label, and number; along an edge that crosses, the number changes by its
/// nodes.
class SurfaceWinding {
 public:
  static constexpr unsigned kNoLabel = ~0u;  ///< of vertices that no triangle has

  /// Computes the winding numbers of the vertices of bodies[body].
  void build(const ClosedSurfaces& bodies, Operand body, const SurfaceCrossings& crossings);

  unsigned numLabels() const { return static_cast<unsigned>(numbers_.size()); }
  unsigned label(unsigned vertex) const { return labels_[vertex]; }
  int numberOf(unsigned label) const { return numbers_[label]; }

 private:
  struct Box {
    fcl::Vector3d low, high;
  };

  void labelVertices(const ClosedSurface& surface, Operand body, const SurfaceCrossings& crossings);
  void flood(unsigned from, const ClosedSurface& surface, Operand body,
             const SurfaceCrossings& crossings);
  void connectLabels(Operand body, const SurfaceCrossings& crossings);
  void setNumbers(const ClosedSurfaces& bodies, Operand body);
  static int countAround(const fcl::Vector3d& point, Operand body, const ClosedSurface& other,
                         const Box& box);
  static Box boxAround(const ClosedSurface& surface);
  unsigned rootOf(unsigned label);

  std::vector<unsigned> labels_;          ///< by vertex
  std::vector<std::uint8_t> has_cuts_;    ///< by vertex: whether an edge there crosses
  std::vector<unsigned> stack_;           ///< vertices still to visit
  std::vector<unsigned> first_vertices_;  ///< by label
  std::vector<unsigned> parents_;         ///< by label: a forest of labels that are connected
  std::vector<int> offsets_;              ///< by label: its number less that of its parent
  std::vector<int> numbers_;              ///< by label
  std::vector<std::uint8_t> is_known_;    ///< by label, of roots
};

}  // namespace adaptive_bvh
