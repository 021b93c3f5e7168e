#pragma once

#include <limits>

#include "query/line_separation.h"
#include "query/nearest_pair.h"
#include "query/vertex_separation.h"
#include "volume/volume_separation.h"

namespace adaptive_bvh {

/// How near the boxes of two nodes came to pruning them.
enum class BoxGap {
  Loose,   ///< far from it
  Short,   ///< by not much more than loose boxes are off
  Nearly,  ///< boxes without error might have
};

/// What bounds the distance of two of FCL's nodes where their boxes did not. Where parts lie askew
/// in body coordinates, boxes are loose and prune late: FCL's volumes are tested. And the vertices
/// themselves, where these may be parallel flat parts, whose boxes and volumes fall short of the
/// distance by what they are rounded to.
template <typename BV>
class NodeSeparation {
 public:
  using S = typename BV::S;

  /// `box_error`: of the pair's boxes.
  NodeSeparation(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                 const NearestPair<BV>& nearest, double box_error)
      : first_(first),
        second_(second),
        nearest_(nearest),
        statistics_(statisticsOf(first, second)),
        has_volumes_(first.tree->volumesAreCurrent() && second.tree->volumesAreCurrent()),
        volumes_(separationsOf(nearest.triangles(), first, second, has_volumes_)),
        vertices_(first, second, nearest.triangles().R(), nearest.triangles().T()),
        line_(first, second, nearest.triangles().R(), nearest.triangles().T(),
              box_error + static_cast<double>(volumes_.error())) {}

  /// Whether nothing below two nodes is nearer than the limit: `bound` is then a lower bound of
  /// their distance. `box_tests`: of the search so far.
  bool prunes(int node1, int node2, BoxGap gap, long box_tests) {
    look();
    const S limit = nearest_.limit();
    volume_separation_ = std::numeric_limits<S>::quiet_NaN();
    S bound = has_volumes_ ? testVolumes(node1, node2) : S(0);
    if (bound < limit) bound = std::max(bound, S(line_(node1, node2, has_volumes_)));
    if (bound < limit) {
      if (!mayReadVertices(gap, bound, box_tests)) return false;
      const S enough = nearest_.limitWithinRounding();
      bound =
          S(vertices_(node1, node2, nearest_.triangles().direction(), static_cast<double>(enough)));
      if (bound < enough) return false;
    }
    bound_ = static_cast<double>(bound);
    return true;
  }
  double bound() const { return bound_; }
  /// What the volumes said, if they were tested and did not prune; else NaN.
  S volumeSeparation() const { return volume_separation_; }
  /// Tests of volumes so far.
  long tests() const { return tests_; }
  /// Vertices read so far.
  long read() const { return vertices_.read(); }

 private:
  /// Volumes that prune up to this share of the limit may do so with exact positions.
  static constexpr double kNearly = 63. / 64;

  /// Only while volumes are not being brought up to date by a query on another thread.
  static VolumeSeparation<BV> separationsOf(const TriangleSeparation<S>& placement,
                                            const PlacedMesh<BV>& first,
                                            const PlacedMesh<BV>& second, bool are_current) {
    if (!are_current) return {placement.R(), placement.T(), 0, 0};
    return {placement.R(), placement.T(), first.tree->motion.coordinateSum(),
            second.tree->motion.coordinateSum()};
  }

  /// Along the line of the nearest pair.
  void look() {
    if (looks_along_ == nearest_.limit()) return;
    looks_along_ = nearest_.limit();
    line_.lookAlong(nearest_.triangles().direction());
  }

  /// When the volumes would prune the pair without their inflation, that counts for test D.
  S testVolumes(int node1, int node2) {
    ++tests_;
    const S limit = nearest_.limit();
    const S separation = volumes_(first_.model->getBV(node1).bv, second_.model->getBV(node2).bv,
                                  nearest_.triangles().direction(), limit);
    if (separation >= limit) return separation;
    volume_separation_ = separation;
    const auto inflation = [](const PlacedMesh<BV>& mesh, int node) {
      return S(mesh.tree->motion.inflation(node)) * mesh.tree->boxes->frame.unit();
    };
    if (separation + inflation(first_, node1) + inflation(second_, node2) >= limit)
      statistics_.recordObstruction(node1, node2);
    return separation;
  }

  /// Vertices are read where exact boxes may have pruned, or the volumes fell just short of it; and
  /// in proportion to the search.
  bool mayReadVertices(BoxGap gap, S separation, long box_tests) const {
    const long all = first_.model->num_tris + second_.model->num_tris;
    return (gap == BoxGap::Nearly || separation >= nearest_.limit() * S(kNearly)) &&
           vertices_.read() < 2 * all + 4 * box_tests;
  }

  const PlacedMesh<BV>&first_, &second_;
  const NearestPair<BV>& nearest_;
  const PairStatistics statistics_;
  /// FCL's volumes may be read: none waits to be brought up to date.
  const bool has_volumes_;
  const VolumeSeparation<BV> volumes_;
  VertexSeparation<BV> vertices_;
  LineSeparation<BV> line_;
  S looks_along_ = std::numeric_limits<S>::quiet_NaN();  ///< the limit whose line that is
  S volume_separation_ = std::numeric_limits<S>::quiet_NaN();
  double bound_ = 0;
  long tests_ = 0;
};

}  // namespace adaptive_bvh
