#pragma once

#include <optional>
#include <vector>

#include <fcl/geometry/bvh/BVH_internal.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "mesh/vertex_summary.h"
#include "thesis/step.h"

namespace adaptive_bvh {

/// The positions of a step that is being supplied call by call, kept aside until it is complete.
/// Speaks FCL's return codes; what is refused changes nothing.
template <typename S>
class StepBuffer {
 public:
  using Point = fcl::Vector3<S>;

  /// Opens a step and moves `build_state` to FCL's "begun". Drops a step that was open.
  /// Allocates when it is the first for so many vertices.
  int begin(StepKind kind, fcl::BVHBuildState& build_state, int vertices) {
    const bool ready = build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
                       (kind == StepKind::TwoFrames && build_state == fcl::BVH_BUILD_STATE_UPDATED);
    if (!ready) return fcl::BVH_ERR_BUILD_EMPTY_PREVIOUS_FRAME;
    positions_.reserve(static_cast<std::size_t>(vertices));  // first: it may throw
    open_ = true;
    refused_ = false;
    kind_ = kind;
    resume_state_ = build_state;
    positions_.clear();
    build_state = begun(kind);
    return fcl::BVH_OK;
  }

  int add(StepKind kind, fcl::BVHBuildState build_state, int vertices, const Point* positions,
          std::size_t count) {
    if (!isOpen(kind, build_state)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
    refused_ |= positions_.size() + count > static_cast<std::size_t>(vertices) ||
                !usablePositions<S>(positions, count);
    if (refused_) return fcl::BVH_ERR_INCORRECT_DATA;
    positions_.insert(positions_.end(), positions, positions + count);
    return fcl::BVH_OK;
  }

  /// BVH_OK when the step is complete: it is closed, and `positions` are to be taken over. In
  /// any case `build_state` is again what it was before `begin`: the old positions can be queried.
  /// A step with vertices missing stays open for the rest.
  int end(StepKind kind, fcl::BVHBuildState& build_state, int vertices) {
    if (!isOpen(kind, build_state)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
    build_state = resume_state_;
    const bool missing = positions_.size() != static_cast<std::size_t>(vertices);
    open_ = missing && !refused_;
    return missing || refused_ ? fcl::BVH_ERR_INCORRECT_DATA : fcl::BVH_OK;
  }

  /// The step that `end` has just closed is complete, but cannot be taken over now.
  void reopen(fcl::BVHBuildState& build_state) {
    open_ = true;
    build_state = begun(kind_);
  }

  /// Drops a step that is open, if any.
  void abandon(fcl::BVHBuildState& build_state) {
    if (isOpen(kind_, build_state)) build_state = resume_state_;
    open_ = false;
  }

  const std::vector<Point>& positions() const { return positions_; }
  std::size_t bytes() const { return positions_.capacity() * sizeof(Point); }

 private:
  static fcl::BVHBuildState begun(StepKind kind) {
    return kind == StepKind::Replace ? fcl::BVH_BUILD_STATE_REPLACE_BEGUN
                                     : fcl::BVH_BUILD_STATE_UPDATE_BEGUN;
  }
  /// A build begun meanwhile, ours or FCL's, ends the step.
  bool isOpen(StepKind kind, fcl::BVHBuildState build_state) const {
    return open_ && kind_ == kind && (build_state == begun(kind) || build_state == resume_state_);
  }

  bool open_ = false;
  bool refused_ = false;
  StepKind kind_ = StepKind::Replace;
  fcl::BVHBuildState resume_state_ = fcl::BVH_BUILD_STATE_EMPTY;
  std::vector<Point> positions_;
};

/// All that a model holds beyond FCL's.
template <typename BV>
struct ModelState {
  using S = typename BV::S;

  RefitPolicy policy;
  AdaptiveTree<BV> tree;
  UpdateState<BV> update;
  StepBuffer<S> buffer;
  UpdateReport report;
  std::optional<DeformableMesh<S>> mesh;  ///< made by the first call of `mesh`
  int mesh_adoption = 0;                  ///< AdaptiveTree::adoptions when it was built
  std::vector<fcl::Vector3<S>> moved;     ///< of the last step of some vertices, for the mesh

  bool meshIsCurrent() const { return mesh && mesh_adoption == tree.adoptions; }
};

template <typename BV>
struct AdaptiveBVHModel<BV>::State : ModelState<BV> {};

// Steps of a whole model: FCL's part of it, what is kept beside, and the mesh of
// AdaptiveBVHModel::mesh if there is one.

/// A step of all vertices, or of some, and of the mesh. Returns false where a position cannot be
/// used. Then, and when it throws std::bad_alloc, nothing has changed: all that the mesh needs is
/// allocated before the model takes the step.
template <typename BV>
bool takeStep(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepInput<typename BV::S> input);

/// \name New positions by FCL's calls: `replace...` and `update...`
/// \{
template <typename BV>
int beginPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind);
template <typename BV>
int addPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind,
                 const fcl::Vector3<typename BV::S>* positions, std::size_t count);
/// A step, or, without `refit`, a new tree, as FCL builds it.
template <typename BV>
int endPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind, bool refit);
/// \}

/// Takes over a model of FCL's that it has just built, and begins at its tree. Its volumes are
/// sound when our fitter made them. Throws std::bad_alloc; the model then is what it was.
template <typename BV>
void takeOverBuild(fcl::BVHModel<BV>& model, ModelState<BV>& state, fcl::BVHModel<BV>& built);

/// Builds the mesh, in the object that there is if there is one.
template <typename BV>
void renewMesh(const fcl::BVHModel<BV>& model, ModelState<BV>& state);

namespace detail {

/// The library's own way to the state of a model.
template <typename BV>
struct ModelAccess {
  static const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) {
    return model.state_->tree;
  }
};

}  // namespace detail
}  // namespace adaptive_bvh
