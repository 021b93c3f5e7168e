#pragma once

namespace adaptive_bvh::python {

class LockedScene;

/// While a query calls a function of Python's. The query holds the locks of its scene and of the
/// scene's meshes, also where it calls from another thread than that which took them. So a query
/// from within the function does not lock these again, and no change may wait for a lock.
class CallbackScope {
 public:
  /// Null: the function may not run queries either.
  explicit CallbackScope(const LockedScene* scene) : scene_(scene), outer_(innermost()) {
    innermost() = this;
  }
  ~CallbackScope() { innermost() = outer_; }
  CallbackScope(const CallbackScope&) = delete;
  CallbackScope& operator=(const CallbackScope&) = delete;

  /// Throws std::logic_error (RuntimeError in Python) inside of a callback. Called by all that
  /// takes locks for itself alone.
  static void refuseChange();
  /// Whether this thread is inside of a callback of a query that holds the lock of a mesh or scene.
  /// Throws std::logic_error inside of a callback that may not run queries.
  static bool holds(const void* mesh_or_scene);

 private:
  static const CallbackScope*& innermost();

  const LockedScene* const scene_;
  const CallbackScope* const outer_;
};

}  // namespace adaptive_bvh::python
