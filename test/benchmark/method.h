#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scenarios.h"

namespace adaptive_bvh_bench {

using Point = scenarios::Point;
using Positions = std::vector<Point>;

/// Counted work of one frame; 0 if a method does not count.
struct Work {
  long bv_tests = 0, leaf_tests = 0, refitted = 0;
  void operator+=(const Work& other) {
    bv_tests += other.bv_tests;
    leaf_tests += other.leaf_tests;
    refitted += other.refitted;
  }
};

/// One frame: the positions of both bodies, in their own coordinates, and where the objects stand.
struct Frame {
  Positions first, second;
  fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
};

/// Two bodies kept and queried in one way.
class Method {
 public:
  virtual ~Method() = default;
  virtual void update(const Frame& frame) = 0;
  virtual double distance(const Frame& frame) = 0;
  /// Of the last update and query. Not timed: some count by asking again.
  virtual Work work(const Frame& frame) = 0;
  /// Both models with all that belongs to them.
  virtual std::size_t bytes() const = 0;
};

/// A row of the table.
struct MethodKind {
  std::string key;                        ///< for --method
  std::string title;                      ///< for the table
  enum Note { Plain, Slow, Wrong } note;  ///< but for Plain: by default at resolution 1 only
  bool is_fcl;                            ///< one of the peers
  std::function<std::unique_ptr<Method>(const scenarios::Scenario&)> make;
};

/// The one that all others are compared with.
constexpr const char* kReference = "fcl-rss";

std::vector<MethodKind> adaptiveMethods();  ///< this library's
std::vector<MethodKind> fclMethods();       ///< FCL's own volumes and refits
std::vector<MethodKind> larssonMethods();   ///< Larsson and Akenine-Moeller 2006

}  // namespace adaptive_bvh_bench
