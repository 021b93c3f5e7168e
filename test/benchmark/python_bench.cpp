// The C++ half of python_bench.py, which loads it: the same arrays, in the same process.
#include <chrono>
#include <cstddef>
#include <vector>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/query.h"

namespace {

using Clock = std::chrono::steady_clock;
using Positions = Eigen::Map<const Eigen::Matrix3Xd>;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What a model is built of: N x 3 numbers, and three indices for each triangle.
struct Arrays {
  const double* vertices;
  int num_vertices;
  const long* faces;
  int num_faces;

  adaptive_bvh::TriangleMesh<double> mesh() const {
    adaptive_bvh::TriangleMesh<double> mesh;
    for (int i = 0; i < num_vertices; ++i)
      mesh.vertices.emplace_back(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
    for (int t = 0; t < num_faces; ++t)
      mesh.triangles.emplace_back(faces[3 * t], faces[3 * t + 1], faces[3 * t + 2]);
    return mesh;
  }
};

/// A model of either volume.
class Subject {
 public:
  virtual ~Subject() = default;
  virtual double update(const double* vertices) = 0;
  virtual double distance(Subject& other, double z, int calls) = 0;
  virtual fcl::CollisionGeometry<double>& geometry() = 0;
};

template <typename BV>
class SubjectOf : public Subject {
 public:
  SubjectOf(const Arrays& arrays, bool on_demand) {
    adaptive_bvh::RefitPolicy policy;
    policy.volumes_on_demand = on_demand;
    model_.setRefitPolicy(policy);
    fillModel(arrays.mesh(), model_);
  }

  double update(const double* vertices) override {
    const auto start = Clock::now();
    model_.update(Positions(vertices, 3, model_.num_vertices));
    return secondsSince(start);
  }

  double distance(Subject& other, double z, int calls) override {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation().z() = z;
    const auto start = Clock::now();
    for (int i = 0; i < calls; ++i) {
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&geometry(), fcl::Transform3d(fcl::Transform3d::Identity()),
                             &other.geometry(), tf, fcl::DistanceRequestd(true), result);
    }
    return secondsSince(start) / calls;
  }

  fcl::CollisionGeometry<double>& geometry() override { return model_; }

 private:
  adaptive_bvh::AdaptiveBVHModel<BV> model_;
};

}  // namespace

extern "C" {

Subject* make(const double* vertices, int num_vertices, const long* faces, int num_faces,
              int is_obbrss, int on_demand) {
  const Arrays arrays{vertices, num_vertices, faces, num_faces};
  if (is_obbrss) return new SubjectOf<fcl::OBBRSSd>(arrays, on_demand != 0);
  return new SubjectOf<fcl::RSSd>(arrays, on_demand != 0);
}

void destroy(Subject* subject) { delete subject; }

/// Seconds of one update.
double update(Subject* subject, const double* vertices) { return subject->update(vertices); }

/// Seconds of one distance, the second model moved along z.
double distance(Subject* first, Subject* second, double z, int calls) {
  return first->distance(*second, z, calls);
}

/// Seconds of what python-fcl has users do in each step: a new FCL model of the arrays.
double rebuild(const double* vertices, int num_vertices, const long* faces, int num_faces) {
  const adaptive_bvh::TriangleMesh<double> mesh =
      Arrays{vertices, num_vertices, faces, num_faces}.mesh();
  const auto start = Clock::now();
  fcl::BVHModel<fcl::OBBRSSd> model;
  fillModel(mesh, model);
  return secondsSince(start);
}
}
