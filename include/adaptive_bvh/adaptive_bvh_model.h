#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>  // BVH_model.h calls fit() without declaring it

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/hierarchy.h"
#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"

namespace adaptive_bvh {

namespace detail {
template <typename BV>
struct ModelAccess;

template <typename BV>
struct Supported {
  static constexpr bool kHolds =
      std::is_same<BV, fcl::RSS<float>>::value || std::is_same<BV, fcl::RSS<double>>::value ||
      std::is_same<BV, fcl::OBBRSS<float>>::value || std::is_same<BV, fcl::OBBRSS<double>>::value;
  using Type = std::conditional_t<kHolds, BV, fcl::RSS<double>>;  // one error is enough
};
}  // namespace detail

/// A fcl::BVHModel for a mesh that deforms. Change the type's name, keep the calls: FCL's queries
/// give the same answers as for a newly built model, while an update costs a fraction of FCL's.
///
/// In each step the model measures how far the vertices moved, moves and inflates every bounding
/// volume just enough to enclose its triangles, and recomputes only the volumes that its
/// RefitPolicy calls unfit (*Adaptive Bounding Volume Hierarchies for Deformable Surface Models*,
/// Chalmers 2011, chapter III; cited as "thesis").
///
/// **Invariant.** After every call, every bounding volume contains every triangle below it,
/// rounding included; `validate` checks it. So every FCL query is exact in every step, with any
/// policy. (FCL's own default refit, bottom-up, violates the invariant for RSS and OBBRSS:
/// distances are too large, and collisions of RSS are missed.)
///
/// **Queries.** fcl::distance, fcl::collide, FCL's managers, and adaptive_bvh::distance and collide
/// (query.h), which also record what the fitness tests need. All other queries of this library take
/// a DeformableMesh: `mesh` returns that of this model. Queries of this library take models in
/// double precision; those in single precision are for FCL's, and for `mesh`. If FCL's queries are
/// not needed, use a DeformableMesh alone: its update costs a fraction.
///
/// **Units and frames.** Positions are in the mesh's own frame and any one unit of length.
/// Coordinates must be finite and at most 2^252 (7e75, double) or 2^28 (2.7e8, float) in magnitude:
/// beyond that the products of four lengths in FCL's tests of triangles overflow. Small coordinates
/// are as for DeformableMesh.
///
/// **Errors.** FCL's calls return FCL's codes and print nothing. `update`, which FCL does not have,
/// throws. A refused call or step leaves the model unchanged.
///
/// **Threads.** Any number of threads may query a model at once, by FCL or by query.h. Updates,
/// policy changes, builds and the non-const `mesh` need the model for themselves: hold a
/// std::shared_mutex shared for queries and unique for updates.
///
/// **Memory.** Where there is none, FCL's calls return BVH_ERR_MODEL_OUT_OF_MEMORY, and all other
/// calls throw std::bad_alloc. The model, its mesh, and a step or a build that was begun then are
/// what they were before, and the call can be repeated. (If memory fails after an update has
/// written positions, the update takes place, and all volumes are recomputed, at the latest when
/// the tree is read next.) To construct a model by a move needs memory for an empty one, and ends
/// the program without it. To assign by a move needs none.
///
/// **Ownership.** As in FCL the model owns its arrays. The address of `vertices` stays the same
/// over replace* and `update`. Positions given to any call may lie in the model's own `vertices`
/// and `prev_vertices`: they are read before anything is written. (`update` then copies them
/// first.)
///
/// **Writing into `vertices`.** Positions change through the calls below, which compare with those
/// that the volumes enclose. So what was written into `vertices` may be handed in by these calls,
/// as in FCL; a step that is refused, incomplete or abandoned restores the positions of the last
/// one. Only `update` does not read `vertices`: unless a step by FCL's calls was begun, what was
/// written there stays, and is not enclosed, where an update of some vertices does not name the
/// vertex, or an update of all is at rest (its positions are those of the last step).
///
/// BV is fcl::RSS<S> or fcl::OBBRSS<S>, S float or double; all four are compiled into the library.
/// An OBBRSS is a box beside the swept sphere: FCL's collisions test the box, its distances the
/// swept sphere. Its node is nearly twice as large (256 bytes in double precision), its updates
/// take longer. As in FCL two meshes of a query have the same volumes.
template <typename BV>
class AdaptiveBVHModel : public fcl::BVHModel<typename detail::Supported<BV>::Type> {
 public:
  using S = typename detail::Supported<BV>::Type::S;  ///< float or double
  using Point = fcl::Vector3<S>;                      ///< x, y, z in the mesh's frame
  using Base = fcl::BVHModel<typename detail::Supported<BV>::Type>;  ///< FCL's own model
  static_assert(
      detail::Supported<BV>::kHolds,
      "adaptive_bvh: the bounding volume must be fcl::RSS<S> or fcl::OBBRSS<S>, S float or double");

  /// `strategy` says how trees are built, by endModel and by endReplaceModel(false). It sits in
  /// FCL's `bv_splitter`; a splitter of your own put there takes its place.
  explicit AdaptiveBVHModel(const RefitPolicy& policy = RefitPolicy(),
                            HierarchyStrategy strategy = HierarchyStrategy::BottomUp);
  /// With the default policy.
  explicit AdaptiveBVHModel(HierarchyStrategy strategy);

  /// Deep: the copy is updated and queried apart from the original. Copies every array, nodes
  /// included: about 440 bytes a triangle in double precision; and the mesh, if there is one.
  AdaptiveBVHModel(const AdaptiveBVHModel& other);

  /// Takes over everything, in constant time. `other` is then in the state of the default
  /// constructor: it can be built anew.
  AdaptiveBVHModel(AdaptiveBVHModel&& other) noexcept;
  /// Takes over everything; what this model held is freed.
  AdaptiveBVHModel& operator=(AdaptiveBVHModel&& other) noexcept;

  /// Copies mesh and tree of a plain FCL model. Every volume is recomputed, so the model's last
  /// refit does not matter. `strategy` is used if the tree is rebuilt.
  explicit AdaptiveBVHModel(const Base& plain, const RefitPolicy& policy = RefitPolicy(),
                            HierarchyStrategy strategy = HierarchyStrategy::BottomUp);

  /// Deleted: FCL's assignment copies pointers and frees them twice.
  AdaptiveBVHModel& operator=(const AdaptiveBVHModel&) = delete;

  ~AdaptiveBVHModel() override;

  /// \name Building, as in FCL
  /// beginModel, add..., endModel. FCL's return codes, and beyond FCL:
  /// - add... before beginModel or after endModel is refused (BVH_ERR_BUILD_OUT_OF_SEQUENCE), where
  ///   FCL writes out of bounds.
  /// - endModel refuses a triangle with an index past the vertices, and a coordinate that is not
  ///   finite or too large (BVH_ERR_INCORRECT_DATA); the model stays in the state "begun".
  ///
  /// A model without triangles is a point cloud: it can be built and updated, and FCL cannot query
  /// it. Degenerate and duplicate triangles and unused vertices are fine; unused vertices count in
  /// the local AABB, as in FCL.
  /// \{
  /// Begins a mesh; the counts are hints.
  int beginModel(int num_tris = 0, int num_vertices = 0);
  /// One more vertex.
  int addVertex(const Point& p);
  /// One more triangle, with three vertices of its own.
  int addTriangle(const Point& p1, const Point& p2, const Point& p3);
  /// More vertices, and triangles that index them, from 0.
  int addSubModel(const std::vector<Point>& ps, const std::vector<fcl::Triangle>& ts);
  /// More vertices.
  int addSubModel(const std::vector<Point>& ps);
  /// Builds the tree.
  int endModel();
  /// \}

  /// \name A step by FCL's calls
  /// beginReplaceModel, replace... for all vertices in order, endReplaceModel. FCL's return codes,
  /// and beyond FCL: the positions are kept aside until endReplaceModel, which takes over all or
  /// nothing.
  /// - Too few vertices: endReplaceModel returns BVH_ERR_INCORRECT_DATA and the old positions stay.
  ///   Supply the rest and end again, as in FCL, or begin anew.
  /// - A vertex too many, or a coordinate that is not finite or too large: that replace... call
  ///   returns BVH_ERR_INCORRECT_DATA and takes nothing; endReplaceModel then returns the same and
  ///   drops the step.
  ///
  /// `refit == true` is the adaptive update: `bottomup` is accepted and without effect.
  /// `refit == false` builds a new tree, as in FCL.
  /// \{
  /// Begins a step.
  int beginReplaceModel();
  /// The next vertex.
  int replaceVertex(const Point& p);
  /// The next three.
  int replaceTriangle(const Point& p1, const Point& p2, const Point& p3);
  /// The next ps.size().
  int replaceSubModel(const std::vector<Point>& ps);
  /// Takes the positions over, and brings the tree up to date.
  int endReplaceModel(bool refit = true, bool bottomup = true);
  /// \}

  /// \name A two-frame update by FCL's calls
  /// For continuous collision: `prev_vertices` holds the positions of the previous step, and every
  /// volume contains the triangles of both steps. Errors are those of a step by FCL's calls. As in
  /// FCL, replace... is refused from then on (build_state is UPDATED), and fcl::collide ignores the
  /// transform of a model in that state; adaptive_bvh::collide does not. `update` drops the
  /// previous positions and ends the state.
  /// \{
  /// Begins a step.
  int beginUpdateModel();
  /// The next vertex.
  int updateVertex(const Point& p);
  /// The next three.
  int updateTriangle(const Point& p1, const Point& p2, const Point& p3);
  /// The next ps.size().
  int updateSubModel(const std::vector<Point>& ps);
  /// Takes the positions over, and brings the tree up to date.
  int endUpdateModel(bool refit = true, bool bottomup = true);
  /// \}

  /// Takes the positions of a step, one per vertex in order, without an intermediate copy, and
  /// updates the tree. Abandons a step that was begun by FCL's calls. Allocates nothing. Throws
  /// std::invalid_argument if `count` is wrong, or if a coordinate is not finite or too large (the
  /// message names the vertex). Throws std::logic_error if the model is not built.
  /// The model then keeps its positions.
  const UpdateReport& update(const Point* positions, std::size_t count);
  /// From a vector.
  const UpdateReport& update(const std::vector<Point>& positions);
  /// From a matrix, a vertex a column (3 x N) or a row (N x 3): an Eigen::Matrix3Xd, an
  /// Eigen::MatrixX3d, an Eigen::Map of your simulation's or NumPy's array. Read in place where its
  /// type says that the vertices follow each other in memory (3 x N in columns, N x 3 in rows, as
  /// Eigen::Matrix<S, 3, Dynamic> or Eigen::Matrix<S, Dynamic, 3, RowMajor>); else copied first.
  /// Pass positions.cast<double>() for another number type. Throws like the other overloads, and
  /// std::invalid_argument on other shapes and on a 3 x 3 matrix whose type does not state whether
  /// rows or columns are the vertices.
  template <typename Derived>
  const UpdateReport& update(const Eigen::MatrixBase<Derived>& positions) {
    static_assert(std::is_same<typename Derived::Scalar, S>::value,
                  "adaptive_bvh: positions of another number type; pass positions.cast<S>()");
    constexpr int kRows = Derived::RowsAtCompileTime, kColumns = Derived::ColsAtCompileTime;
    if constexpr (kRows == 3 && kColumns != 3) {
      return updateColumns(positions.derived());
    } else if constexpr (kColumns == 3 && kRows != 3) {
      return updateColumns(positions.derived().transpose());
    } else {
      const bool columns = positions.rows() == 3, rows = positions.cols() == 3;
      if (columns == rows) detail::refusePointMatrix(positions.rows(), positions.cols());
      return columns ? updateColumns(positions.derived().template topRows<3>())
                     : updateColumns(positions.derived().template leftCols<3>().transpose());
    }
  }

  /// Takes new positions of some vertices: positions[i] is that of vertex indices[i], in any order.
  /// If an index occurs twice, its last position counts. All other vertices keep theirs. The cost
  /// is in proportion to the nodes above those vertices, not to the whole tree. The first such call
  /// for a tree allocates 16 bytes a triangle and 4 a vertex. If a vertex moves away from a side of
  /// the local AABB, all vertices are read; afterwards `aabb_radius` is that of the ball around the
  /// AABB. (With Propagation::Displacements, or after endUpdateModel, all vertices are updated.)
  /// Throws like `update`, and std::invalid_argument if an index is out of range or the two vectors
  /// differ in length; the model then keeps its positions.
  const UpdateReport& update(const unsigned* indices, const Point* positions, std::size_t count);
  /// From vectors.
  const UpdateReport& update(const std::vector<unsigned>& indices,
                             const std::vector<Point>& positions);
  /// From vectors with another integer type, which are copied first.
  template <typename Index, typename = std::enable_if_t<std::is_integral<Index>::value>>
  const UpdateReport& update(const std::vector<Index>& indices,
                             const std::vector<Point>& positions) {
    std::vector<unsigned> converted;
    converted.reserve(indices.size());
    for (const Index i : indices) {
      const auto index = static_cast<unsigned>(i);
      converted.push_back(static_cast<Index>(index) == i && i >= 0 ? index : ~0u);
    }
    return update(converted, positions);
  }

  /// Report of the last build or update.
  const UpdateReport& lastUpdate() const;

  /// The policy in use.
  const RefitPolicy& refitPolicy() const;
  /// Sets the policy of the next updates. Throws std::invalid_argument on a negative or non-finite
  /// parameter.
  void setRefitPolicy(const RefitPolicy& policy);

  /// Returns the model's triangles as a DeformableMesh (in double precision, also of a model in
  /// single precision), for the queries that take one. The first
  /// call makes it. From then on every update of the model keeps it current, which takes the time
  /// of DeformableMesh::update and the memory of one mesh. Its address stays the same until the
  /// model is moved from, built anew or destroyed. A build renews it; after a change through a
  /// fcl::BVHModel reference, the next update or call of `mesh` does so. Like an update, the call
  /// needs the model for itself. Throws std::logic_error if the model is not built or has no
  /// triangles.
  const DeformableMesh& mesh();
  /// Returns that mesh if it was made before. Throws std::logic_error if not, or if the model was
  /// changed through a fcl::BVHModel& and the mesh has not been renewed since then.
  const DeformableMesh& mesh() const;
  /// Whether the mesh was made.
  bool hasMesh() const;

  /// Lets updates of all vertices use up to `threads` threads of the caller's oneTBB task arena, if
  /// the model has 50,000 triangles or more; also DeformableMesh::setThreads of mesh(). 1 by
  /// default. The result has the same bits for any number. With more than one thread an update
  /// allocates. Without effect if the library was built without oneTBB. Throws
  /// std::invalid_argument below 1.
  void setThreads(int threads);

  /// Returns whether the invariant holds: every volume contains every triangle below it (of both
  /// frames after a two-frame update), up to the rounding error of the check itself, which is at
  /// most 6 epsilon times the extent of the volume. Also checks the links of the tree, and the
  /// mesh, if there is one. If the result is false, `reason` describes the error and its place.
  /// Takes O(n depth).
  bool validate(std::string* reason = nullptr) const;

  /// \name State of the algorithm (thesis 4.2), for tests, tuning and drawings
  /// Lengths in the mesh's unit, rounded up. 0 <= node < getNumBVs(), 0 <= triangle < num_tris.
  /// \{
  S originalRadius(int node) const;  ///< radius when the node was last refitted
  /// Largest corner displacement in the last step; 0 without Propagation::Displacements.
  S latestDisplacement(int triangle) const;
  /// Largest corner displacement since the triangle's leaf was last refitted; 0 without
  /// Propagation::Displacements.
  S overallDisplacement(int triangle) const;
  /// Test B: whether a recording query went below the node since the update.
  bool traversed(int node) const;
  /// The nodes whose volumes the last update recomputed from their triangles, in ascending order.
  /// None after a build.
  std::vector<int> refittedNodes() const;
  QueryWork recordedWork() const;  ///< work of the recorded queries since the last update
  /// Memory in bytes in addition to FCL's own, including the mesh.
  std::size_t trackingBytes() const;
  /// \}

  /// BV_RSS or BV_OBBRSS; BV_UNKNOWN without triangles, so that FCL's distance and collide report
  /// an unsupported pair instead of crashing. FCL calls this first in every query, so it also
  /// detects and repairs a tree that was changed through a fcl::BVHModel reference.
  fcl::NODE_TYPE getNodeType() const override;

  /// Computes the local AABB, which is current after every update. FCL calls this when it makes a
  /// fcl::CollisionObject.
  void computeLocalAABB() override;

 private:
  struct State;
  friend struct detail::ModelAccess<BV>;

  using Columns = Eigen::Ref<const Eigen::Matrix<S, 3, Eigen::Dynamic>, 0, Eigen::OuterStride<3>>;

  void clear();
  void repair() const;
  const UpdateReport& take(const Point* positions, std::size_t count, const unsigned* indices);
  const UpdateReport& updateColumns(const Columns& positions);
  void requireBuilt() const;

  std::unique_ptr<State> state_;
};

using AdaptiveBVHModelf = AdaptiveBVHModel<fcl::RSS<float>>;
using AdaptiveBVHModeld = AdaptiveBVHModel<fcl::RSS<double>>;
using AdaptiveOBBRSSModelf = AdaptiveBVHModel<fcl::OBBRSS<float>>;
using AdaptiveOBBRSSModeld = AdaptiveBVHModel<fcl::OBBRSS<double>>;

extern template class AdaptiveBVHModel<fcl::RSS<float>>;
extern template class AdaptiveBVHModel<fcl::RSS<double>>;
extern template class AdaptiveBVHModel<fcl::OBBRSS<float>>;
extern template class AdaptiveBVHModel<fcl::OBBRSS<double>>;

}  // namespace adaptive_bvh
