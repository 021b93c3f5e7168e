#pragma once

#include <functional>
#include <new>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support/allocations.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {

/// Numbers, with all their digits.
class Text {
 public:
  Text() { out_.precision(17); }
  template <typename T>
  Text& operator<<(const T& value) {
    out_ << value << ' ';
    return *this;
  }
  /// Of many points a sum of their bits.
  Text& operator<<(const std::vector<fcl::Vector3d>& points) {
    *this << points.size();
    std::size_t sum = 0;
    for (const auto& p : points)
      for (int k = 0; k < 3; ++k) sum = sum * 31 + std::hash<double>()(p[k]);
    return *this << sum;
  }
  std::string text() const { return out_.str(); }

 private:
  std::ostringstream out_;
};

/// Runs a function on a thread of its own, where the memory that queries lease is still empty.
template <typename Run>
void onNewThread(const Run& run) {
  std::thread(run).join();
}

/// Lets the first, the second, ... allocation of call(subject) fail, until there are no more: those
/// of leased memory too, as each call is the first one of its thread. A subject of `make` is there
/// for each. `stateOf(subject)` describes all that can be seen of one. After a failure the state is
/// what it was before; and after the call was repeated on the same thread, or if it succeeded in
/// spite of the failure, it is what it is where nothing fails. Returns how often the call failed.
/// `failed(call)` says whether it did: it may throw std::bad_alloc or return a code.
template <typename Make, typename Call, typename StateOf, typename Failed>
int failEachAllocation(const std::string& what, const Make& make, const Call& call,
                       const StateOf& stateOf, const Failed& failed) {
  const auto tryTo = [&](auto& subject) {
    try {
      return !failed(call(subject));
    } catch (const std::bad_alloc&) {
      return false;
    }
  };
  std::string before, after;
  {
    auto subject = make();
    before = stateOf(subject);
    EXPECT_TRUE(tryTo(subject)) << what;
    after = stateOf(subject);
  }
  int failures = 0;
  for (long n = 1;; ++n) {
    auto subject = make();
    bool succeeds = true, was_reached = false;
    onNewThread([&] {
      {
        const FailingAllocation failing(n);
        succeeds = tryTo(subject);
        was_reached = FailingAllocation::wasReached();
      }
      if (succeeds) return;
      ++failures;
      EXPECT_TRUE(was_reached) << what << ", allocation " << n;
      onNewThread([&] { EXPECT_EQ(before, stateOf(subject)) << what << ", allocation " << n; });
      EXPECT_TRUE(tryTo(subject)) << what << ", allocation " << n;
    });
    EXPECT_EQ(after, stateOf(subject)) << what << ", allocation " << n;
    if (!was_reached || testing::Test::HasFailure()) return failures;
  }
}

/// The same of a call that returns nothing that says whether it failed.
template <typename Make, typename Call, typename StateOf>
int failEachAllocation(const std::string& what, const Make& make, const Call& call,
                       const StateOf& stateOf) {
  return failEachAllocation(
      what, make,
      [&](auto& subject) {
        call(subject);
        return true;
      },
      stateOf, [](bool) { return false; });
}

}  // namespace adaptive_bvh_test
