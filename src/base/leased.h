#pragma once

#include <utility>

namespace adaptive_bvh {

/// Reusable memory of the calling thread, leased for the duration of one query. No two leases share
/// an object: a query that is called from within another, by a user's callback, gets another
/// object. The lease's destructor returns the object, also after an exception. An object keeps its
/// contents between leases, so clear what must be empty.
///
/// A lease must end on the thread that took it.
template <typename T>
class Leased {
 public:
  Leased() : object_(free().first ? free().first : new Object) { free().first = object_->next; }
  ~Leased() {
    object_->next = free().first;
    free().first = object_;
  }
  Leased(const Leased&) = delete;
  Leased& operator=(const Leased&) = delete;

  T& operator*() const { return object_->value; }
  T* operator->() const { return &object_->value; }

 private:
  struct Object {
    T value{};
    Object* next = nullptr;
  };
  /// A linked list of objects that are not leased. Its pointers are plain: moving a unique_ptr
  /// would compile the destruction of T into every caller.
  struct List {
    Object* first = nullptr;

    ~List() {
      while (first) delete std::exchange(first, first->next);
    }
  };
  /// The list of the calling thread.
  static List& free() {
    static thread_local List list;
    return list;
  }

  Object* object_;
};

}  // namespace adaptive_bvh
