#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "method.h"

namespace adaptive_bvh_bench {

enum class Question {
  Pairs,    ///< all pairs of triangles within a distance
  Nearer,   ///< whether two bodies are nearer than that
  Points,   ///< the closest point of each of many points
  Rays,     ///< the first hit of each of many rays
  AnyRays,  ///< whether each of many rays hits anything
};

struct ProximityCase {
  Question question;
  std::string title;
  scenarios::Scenario scenario;
  bool is_self = false;  ///< the first body with itself
  double distance = 0;
  std::vector<Point> points = {}, directions = {};
};

/// What was answered in one frame, to be compared.
struct ProximityAnswer {
  std::vector<std::pair<unsigned, unsigned>> pairs;  ///< sorted; of one body the smaller first
  std::vector<double> numbers;                       ///< of points and rays; 0 or 1
};

/// A method to update and query bodies.
class ProximityMethod {
 public:
  virtual ~ProximityMethod() = default;
  virtual void update(const Frame& frame) = 0;
  virtual void ask() = 0;
  /// Not timed.
  virtual ProximityAnswer answer() const = 0;
};

struct ProximityKind {
  std::string title;
  std::vector<Question> questions;
  std::function<std::unique_ptr<ProximityMethod>(const ProximityCase&)> make;
};

/// The first row is the one that others are compared with.
std::vector<ProximityKind> adaptiveProximityMethods(int threads);
std::vector<ProximityKind> fclProximityMethods();
std::vector<ProximityKind> embreeProximityMethods();  ///< where Embree 3 is found

}  // namespace adaptive_bvh_bench
