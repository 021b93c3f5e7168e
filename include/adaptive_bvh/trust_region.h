#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

/// \file
/// Iterates of a solver that stay free of penetration, by planes between near features.
namespace adaptive_bvh {

/// How far vertices may go, in the unit of the mesh.
struct TrustRegionRequest {
  /// How far each vertex may go from where pairs were found last; above 0. A larger radius finds
  /// more pairs: about a fifth to half of an edge is a good value for a step of a solver.
  double radius = 0;
  /// The distance that features keep; at least 0.
  double distance = 0;
  /// Pairs are found anew, around the accepted positions, when the radius held back more than this
  /// share of the vertices. 0: as soon as it held back one. 1: never.
  double most_held = 0.01;
};

/// What TrustRegion::truncate did.
struct TrustRegionReport {
  std::size_t held_back = 0;       ///< how many vertices did not reach the proposed position
  std::size_t held_by_radius = 0;  ///< how many of them because of the radius
  bool has_searched = false;       ///< whether pairs were found anew first
};

/// Keeps the iterates of a solver apart: finds the pairs of near features once, for several
/// iterations.
///
///     TrustRegion region(cloth, request);
///     region.addObstacle(ball);
///     region.begin(positions);            // once a step
///     for (...) {                         // iterations
///       ...                               // the solver proposes positions
///       region.truncate(proposed, positions);
///     }
///
/// Every vertex stays within the radius of where it was when pairs were found, so no other pair can
/// come together. In each iteration a fixed plane separates each two features that the motion could
/// bring together, and all their vertices keep to their sides of it, as by `truncateMotion`
/// (continuous_collision.h). So no features come together on the straight ways from iterate to
/// iterate, in whatever order vertices move. Features that are at most the distance apart come no
/// nearer; features that touch do not move. Rounding included (docs/bounds.md, 15).
///
/// The mesh deforms, its positions are given in each call: its own positions are not read. A
/// system of several deforming bodies is one mesh. Obstacles do not move from one `begin` to the
/// next. Pairs within the mesh, and of the mesh and each obstacle, count; features that share a
/// vertex do not.
///
/// One object serves one thread at a time. In a steady state nothing is allocated.
///
/// Throws std::invalid_argument, and changes nothing, if the radius is not above 0, if a number is
/// negative, infinite or not a number, if the number of positions is not that of the vertices, if
/// a transform is not a rigid motion, or if `truncate` is called before `begin`.
class TrustRegion {
 public:
  using Mesh = DeformableMesh;                ///< the mesh type
  using Points = std::vector<fcl::Vector3d>;  ///< positions, one for each vertex
  using Transform = fcl::Transform3d;         ///< places an obstacle in the frame of the mesh

  /// Keeps a reference to the mesh, which must outlive this object.
  TrustRegion(const Mesh& mesh, const TrustRegionRequest& request);
  ~TrustRegion();
  /// The moved-from object can only be destroyed.
  TrustRegion(TrustRegion&&) noexcept;
  TrustRegion(const TrustRegion&) = delete;
  TrustRegion& operator=(const TrustRegion&) = delete;

  /// Adds a mesh that does not deform by itself: `begin` reads its vertices, which may change until
  /// the next `begin`; its triangles may not. Keeps a reference; the obstacle counts from the next
  /// `begin` on. Returns its number, from 0.
  std::size_t addObstacle(const Mesh& obstacle, const Transform& tf = Transform::Identity());
  /// Places an obstacle, from the next `begin` on. Throws std::out_of_range if there is none.
  void setTransform(std::size_t obstacle, const Transform& tf);

  /// Accepts these positions, and finds the pairs around them.
  void begin(const Points& positions);
  /// Moves each vertex from its accepted position as far toward the proposed one as is proven safe.
  /// Overwrites `accepted` with the result, from which the next call goes on. Both arguments may be
  /// the same.
  TrustRegionReport truncate(const Points& proposed, Points& accepted);

  /// The positions from which the next call goes on; empty before `begin`.
  const Points& accepted() const;
  /// How many pairs of features the last search found.
  std::size_t numPairs() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace adaptive_bvh
