#pragma once

namespace adaptive_bvh::python {

/// While a query calls a function of Python's, this thread holds the locks of the scene and of its
/// meshes. Another call that takes locks could wait for itself.
class CallbackScope {
 public:
  CallbackScope() { ++depth(); }
  ~CallbackScope() { --depth(); }
  CallbackScope(const CallbackScope&) = delete;
  CallbackScope& operator=(const CallbackScope&) = delete;

  /// Throws std::logic_error (RuntimeError in Python) inside of a callback. Called by all that
  /// takes locks.
  static void refuse();

 private:
  static int& depth();
};

}  // namespace adaptive_bvh::python
