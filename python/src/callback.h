#pragma once

#include <pybind11/pybind11.h>

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

/// Shows the function that a T keeps to Python's garbage collector, because the function may refer
/// to what owns the T: for py::custom_type_setup. T has visitFunction and clearFunction.
template <typename T>
void collectGarbage(PyHeapTypeObject* heap_type) {
  // Null of an object whose __init__ was not called.
  static constexpr auto constructed = [](PyObject* object) -> T* {
    const auto holder =
        reinterpret_cast<pybind11::detail::instance*>(object)->get_value_and_holder();
    return holder.holder_constructed() ? static_cast<T*>(holder.value_ptr()) : nullptr;
  };
  PyTypeObject& type = heap_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* object, visitproc visit, void* arg) -> int {
    Py_VISIT(Py_TYPE(object));
    const T* owner = constructed(object);
    return owner ? owner->visitFunction(visit, arg) : 0;
  };
  type.tp_clear = [](PyObject* object) -> int {
    if (T* owner = constructed(object)) owner->clearFunction();
    return 0;
  };
}

}  // namespace adaptive_bvh::python
