#pragma once

#include <memory>
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
  /// A list of the thread's objects that no lease holds.
  static std::unique_ptr<Object>& free() {
    static thread_local std::unique_ptr<Object> first;
    return first;
  }

  std::unique_ptr<Object> object_;
};

}  // namespace adaptive_bvh
