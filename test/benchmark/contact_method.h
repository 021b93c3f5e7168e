#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "method.h"

namespace adaptive_bvh_bench {

/// Continuous: what touches between two frames of one mesh, and when first.
enum class Job { SelfCollision, Collide, Distance, Continuous };
const char* toString(Job job);

/// What is measured: of a self-collision and of Continuous the first body alone.
struct ContactCase {
  Job job;
  scenarios::Scenario scenario;

  bool isSelf() const { return job == Job::SelfCollision || job == Job::Continuous; }
  /// Whose answer is a number, not pairs: a distance, or a time.
  bool isNumber() const { return job == Job::Distance || job == Job::Continuous; }
  std::size_t triangles() const {
    return isSelf() ? scenario.first.triangles().size() : scenario.triangles();
  }
  int frames() const { return isSelf() ? scenario.first.frames() : scenario.frames(); }
};

/// Of a self-collision the smaller index first.
using TrianglePair = std::pair<unsigned, unsigned>;

/// Counts of one query, or a sum; negative if the program does not report them.
struct ContactCounts {
  long box_tests = -1;       ///< pairs of nodes
  long candidates = -1;      ///< pairs of triangles whose boxes overlap, neighbours left out
  long triangle_tests = -1;  ///< pairs handed to the exact test of two triangles
  long contacts = -1;        ///< pairs that touch
};

/// What the last query found.
struct ContactAnswer {
  ContactCounts counts;
  std::vector<TrianglePair> pairs;  ///< sorted, each once
  /// Or the time of the earliest impact.
  double distance = std::numeric_limits<double>::quiet_NaN();
};

/// One or two meshes kept and queried in one way.
class ContactMethod {
 public:
  virtual ~ContactMethod() = default;
  virtual void update(const Frame& frame) = 0;
  virtual void query() = 0;
  /// Not timed.
  virtual ContactAnswer answer() = 0;
};

/// A row of the table.
struct ContactKind {
  std::string key, title;
  enum Owner { Ours, Peer } owner;
  /// Does FCL's test of two triangles say what touches? Else its contacts are not compared.
  bool by_fcl_test;
  std::vector<Job> jobs;
  std::function<std::unique_ptr<ContactMethod>(const ContactCase&)> make;
};

/// The methods that others are compared with.
constexpr const char *kContactReference = "fcl-rss", *kContactOurs = "mesh";

/// This library's; with a row on so many threads where they are more than one.
std::vector<ContactKind> adaptiveContactMethods(int threads);
std::vector<ContactKind> fclContactMethods();                    ///< FCL's RSS, refitted top-down
std::vector<ContactKind> continuousContactMethods(int threads);  ///< this library's
std::vector<ContactKind> embreeContactMethods();                 ///< where Embree 3 is found
std::vector<ContactKind> embreeContinuousMethods();              ///< where Embree 3 is found
std::vector<ContactKind> cgalContactMethods();                   ///< where CGAL is found

}  // namespace adaptive_bvh_bench
