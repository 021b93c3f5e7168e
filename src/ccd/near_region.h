#pragma once

#include <array>
#include <vector>

#include "ccd/placed_motion.h"

namespace adaptive_bvh {

/// The pairs of features of one deforming mesh and of its obstacles that may come together while no
/// vertex is farther than a radius from its reference, and shares of ways that keep them apart.
/// Vertices of all bodies are numbered through, those of the mesh first. docs/bounds.md, 15.
class NearRegion {
 public:
  using Points = std::vector<fcl::Vector3d>;

  NearRegion(double radius, double separation) : radius_(radius), separation_(separation) {}

  /// Finds the pairs around the present positions, which become the references. `bodies`: the mesh
  /// and its obstacles, at rest. If it throws, nothing has changed.
  void search(const std::vector<PlacedMotion>& bodies);

  /// Sets the shares of the ways of the mesh's vertices from where they are to `proposed`. Returns
  /// how many ways end at the radius before they end at a plane.
  std::size_t truncate(const Points& proposed);
  const std::vector<double>& shares() const { return shares_; }

  /// Positions of the mesh's vertices; each may be set to one on its way, within its share.
  Points& positions() { return now_; }
  std::size_t numPairs() const {
    return found_.pairs.vertex_face.size() + found_.pairs.edge_edge.size();
  }

 private:
  class Search;

  struct Pair {
    std::array<unsigned, 4> corners;
    float gap;  ///< lower bound of the distance of the references, less the separation and rounding
  };
  struct Pairs {
    std::vector<Pair> vertex_face, edge_edge;
  };
  /// What a search finds, and around which positions.
  struct Found {
    Pairs pairs;
    Points references;
    double error = 0;     ///< bound of the error of a position
    double rounding = 0;  ///< bound of how far a position on its way may be beside it
    SweptFrame frame{fcl::Vector3d::Zero(), fcl::Vector3d::Ones()};
    float position_error = 0;  ///< in the frame

    void begin(const std::vector<PlacedMotion>& bodies, double radius);
  };

  void addPairs(const ContinuousQuery& query, unsigned first_of_second);
  void limitToRadius(const Points& proposed);
  template <int kNumFirst>
  void limitToPlanes(const std::vector<Pair>& pairs, const Points& proposed);
  template <int kNumFirst>
  void limitFour(const std::array<const Pair*, 4>& four, std::size_t count, const Points& proposed);
  void limit(int firsts, const Pair& pair, const Points& proposed);

  const double radius_, separation_;
  Found found_, spare_;                     ///< of the last search, and memory of the next
  Points now_;                              ///< the first of these vertices are those of the mesh
  std::vector<double> shares_, in_radius_;  ///< with and without the planes
  std::vector<Float4> begins_, ends_;       ///< of the ways within the radius, in the frame
  std::vector<float> reach_;  ///< bounds of the distances from the references in this iterate
};

}  // namespace adaptive_bvh
