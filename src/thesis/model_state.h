#pragma once

#include <cstring>
#include <optional>
#include <vector>

#include <fcl/geometry/bvh/BVH_internal.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "mesh/vertex_summary.h"
#include "thesis/step.h"

// The private state of an AdaptiveBVHModel (ModelState), and the updates of a whole model.
namespace adaptive_bvh {

/// Buffers the positions of a step that FCL's calls supply piece by piece, until it is complete.
/// Functions return FCL's codes. `build_state` is the model's, `vertices` its number of vertices.
template <typename S>
class StepBuffer {
 public:
  using Point = fcl::Vector3<S>;

  /// Opens a step and sets `build_state` to FCL's "begun". Drops a step that was open. Allocates at
  /// the first step for this number of vertices.
  int begin(StepKind kind, fcl::BVHBuildState& build_state, int vertices) {
    const bool ready = build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
                       (kind == StepKind::TwoFrames && build_state == fcl::BVH_BUILD_STATE_UPDATED);
    if (!ready) return fcl::BVH_ERR_BUILD_EMPTY_PREVIOUS_FRAME;
    positions_.reserve(static_cast<std::size_t>(vertices));  // first: it may throw
    open_ = true;
    refused_ = moved_ = false;
    kind_ = kind;
    resume_state_ = build_state;
    positions_.clear();
    build_state = begun(kind);
    return fcl::BVH_OK;
  }

  /// Appends positions to the open step. It fails if there are too many, or one is not usable.
  /// `last` are the positions of all vertices in the last step, or null: these are usable.
  int add(StepKind kind, fcl::BVHBuildState build_state, int vertices, const Point* positions,
          std::size_t count, const Point* last = nullptr) {
    if (!isOpen(kind, build_state)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
    const std::size_t first = positions_.size();
    const bool fit = first + count <= static_cast<std::size_t>(vertices);
    const bool same =
        count == 0 ||
        (fit && last && std::memcmp(positions, last + first, count * sizeof(Point)) == 0);
    moved_ |= !same;
    refused_ |= !fit || !(same || usablePositions<S>(positions, count));
    if (refused_) return fcl::BVH_ERR_INCORRECT_DATA;
    positions_.insert(positions_.end(), positions, positions + count);
    return fcl::BVH_OK;
  }

  /// Returns BVH_OK if the step is complete; then it is closed, and the caller applies `positions`.
  /// In any case, `build_state` is restored to its value before `begin`, so that the old positions
  /// can be queried. A step with missing vertices stays open for them.
  int end(StepKind kind, fcl::BVHBuildState& build_state, int vertices) {
    if (!isOpen(kind, build_state)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
    build_state = resume_state_;
    const bool missing = positions_.size() != static_cast<std::size_t>(vertices);
    open_ = missing && !refused_;
    return missing || refused_ ? fcl::BVH_ERR_INCORRECT_DATA : fcl::BVH_OK;
  }

  /// Reopens the step that `end` has just closed, if it cannot be applied now.
  void reopen(fcl::BVHBuildState& build_state) {
    open_ = true;
    build_state = begun(kind_);
  }

  bool isOpen(fcl::BVHBuildState build_state) const { return isOpen(kind_, build_state); }
  /// Drops the open step, if any.
  void abandon(fcl::BVHBuildState& build_state) {
    if (isOpen(build_state)) build_state = resume_state_;
    open_ = false;
  }

  const std::vector<Point>& positions() const { return positions_; }
  /// Whether a position differs from that of the last step.
  bool moved() const { return moved_; }
  std::size_t bytes() const { return positions_.capacity() * sizeof(Point); }

 private:
  /// FCL's build state while a step of this kind is open.
  static fcl::BVHBuildState begun(StepKind kind) {
    return kind == StepKind::Replace ? fcl::BVH_BUILD_STATE_REPLACE_BEGUN
                                     : fcl::BVH_BUILD_STATE_UPDATE_BEGUN;
  }
  /// Whether a step of this kind is open. A build begun in the meantime, by this class or by FCL,
  /// ends the step.
  bool isOpen(StepKind kind, fcl::BVHBuildState build_state) const {
    return open_ && kind_ == kind && (build_state == begun(kind) || build_state == resume_state_);
  }

  bool open_ = false;
  bool refused_ = false;  ///< whether `add` has refused positions of this step
  bool moved_ = false;
  StepKind kind_ = StepKind::Replace;
  fcl::BVHBuildState resume_state_ = fcl::BVH_BUILD_STATE_EMPTY;  ///< build state before `begin`
  std::vector<Point> positions_;                                  ///< of vertices 0, 1, ...
};

/// The private state of a model beyond FCL's.
template <typename BV>
struct ModelState {
  using S = typename BV::S;

  RefitPolicy policy;
  AdaptiveTree<BV> tree;
  UpdateState<BV> update;
  StepBuffer<S> buffer;
  UpdateReport report;
  /// Created by the first call of AdaptiveBVHModel::mesh, then updated in every step.
  std::optional<DeformableMesh> mesh;
  std::vector<fcl::Vector3d> converted;  ///< positions of a step in single precision, for the mesh
  int mesh_resets = 0;  ///< value of AdaptiveTree::resets when `mesh` was last built or updated

  /// False after a change of the model that `mesh` has not followed.
  bool meshIsCurrent() const { return mesh && mesh_resets == tree.resets; }
};

template <typename BV>
struct AdaptiveBVHModel<BV>::State : ModelState<BV> {};

// Steps of a whole model: FCL's part, the data beside it, and the mesh of AdaptiveBVHModel::mesh if
// it exists.

/// Applies a step of all or some vertices to the model and its mesh. Abandons a step that was begun
/// through FCL's calls. Throws std::invalid_argument if a coordinate is not finite or too large.
/// Then, and if it throws std::bad_alloc, nothing has changed: all memory for the mesh is allocated
/// before the model takes the step.
template <typename BV>
void takeStep(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepInput<typename BV::S> input);

/// \name New positions by FCL's calls `replace...` and `update...`; return FCL's codes
/// \{
template <typename BV>
int beginPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind);
template <typename BV>
int addPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind,
                 const fcl::Vector3<typename BV::S>* positions, std::size_t count);
/// Applies the step. Without `refit`, builds a new tree, like FCL. If it is incomplete or refused,
/// undoes what the user has written into the model's `vertices`.
template <typename BV>
int endPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind, bool refit);
/// \}

/// Swaps the FCL parts of `model` and of `built`, which FCL has just built, and resets the state to
/// the new tree. Recomputes the volumes unless our fitter made them. If it throws std::bad_alloc,
/// the model is unchanged.
template <typename BV>
void takeOverBuild(fcl::BVHModel<BV>& model, ModelState<BV>& state, fcl::BVHModel<BV>& built);

/// Builds the mesh from the model's triangles, in place if it exists; removes it if there are none.
/// The tree must be current; restores the model's positions.
template <typename BV>
void renewMesh(fcl::BVHModel<BV>& model, ModelState<BV>& state);

namespace detail {

/// Gives the library access to the private state of a model.
template <typename BV>
struct ModelAccess {
  static const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) {
    return model.state_->tree;
  }
};

}  // namespace detail
}  // namespace adaptive_bvh
