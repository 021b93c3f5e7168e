#pragma once

#include <memory>
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
  Leased() : object_(std::move(free())) {
    if (object_)
      free() = std::move(object_->next);
    else
      object_.reset(new Object);
  }
  ~Leased() {
    object_->next = std::move(free());
    free() = std::move(object_);
  }
  Leased(const Leased&) = delete;
  Leased& operator=(const Leased&) = delete;

  T& operator*() const { return object_->value; }
  T* operator->() const { return &object_->value; }

 private:
  struct Object {
    T value{};
    std::unique_ptr<Object> next;
  };
  /// The thread's list of objects that are not leased.
  static std::unique_ptr<Object>& free() {
    static thread_local std::unique_ptr<Object> first;
    return first;
  }

  std::unique_ptr<Object> object_;
};

}  // namespace adaptive_bvh
