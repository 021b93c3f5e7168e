#pragma once

#include <utility>

namespace adaptive_bvh {

/// Memory that a query keeps from call to call, for the time of one call: an object of the calling
/// thread that no other lease holds. A call from within the query, by a callback of the user, gets
/// another object. The end of the lease, also by an exception, gives the object back. An object
/// keeps its contents from lease to lease: clear what has to be empty.
///
/// The thread that takes a lease must end it.
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
  /// The thread's objects that no lease holds. (With plain pointers: to move a unique_ptr compiles
  /// the destruction of T into every caller.)
  struct List {
    Object* first = nullptr;

    ~List() {
      while (first) delete std::exchange(first, first->next);
    }
  };
  static List& free() {
    static thread_local List list;
    return list;
  }

  Object* object_;
};

}  // namespace adaptive_bvh
