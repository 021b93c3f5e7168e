// Embree 3: for pairs a tree of boxes grown by half of the distance, refitted, and rtcCollide with
// our exact test in its callback; for points and rays its own triangles, in single precision.
#include <algorithm>
#include <stdexcept>

#include "contact_judge.h"
#include "embree_scene.h"
#include "proximity_method.h"
#include "triangles/feature_distance.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh_bench {
namespace {

std::array<Point, 3> cornersOf(const scenarios::Mesh& mesh, unsigned i) {
  const fcl::Triangle& t = mesh.triangles[i];
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

/// One mesh: a box a triangle, grown on all sides.
class GrownMesh {
 public:
  GrownMesh(RTCDevice device, const scenarios::Body& body, double growth)
      : mesh_(body.mesh()),
        growth_(Point::Constant(growth)),
        boxes_(device, mesh_.triangles.size()) {
    update(body.positions(0));
  }

  void update(const Positions& positions) {
    mesh_.vertices = positions;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const auto p = corners(unsigned(i));
      boxes_.box(i) = {p[0].cwiseMin(p[1]).cwiseMin(p[2]) - growth_,
                       p[0].cwiseMax(p[1]).cwiseMax(p[2]) + growth_};
    }
    boxes_.commit();
  }

  const scenarios::Mesh& mesh() const { return mesh_; }
  std::array<Point, 3> corners(unsigned i) const { return cornersOf(mesh_, i); }
  const Eigen::AlignedBox3d& box(unsigned i) const { return boxes_.box(i); }
  RTCScene scene() const { return boxes_.scene(); }

 private:
  scenarios::Mesh mesh_;
  const Point growth_;
  EmbreeBoxes boxes_;
};

/// One mesh as Embree's own triangles.
class EmbreeTriangles {
 public:
  EmbreeTriangles(RTCDevice device, const scenarios::Body& body)
      : mesh_(body.mesh()),
        geometry_(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE)),
        scene_(rtcNewScene(device)) {
    floats_ = static_cast<float*>(rtcSetNewGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX,
                                                          0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                          mesh_.vertices.size()));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh_.triangles.size()));
    for (const fcl::Triangle& t : mesh_.triangles)
      for (int k = 0; k < 3; ++k) *indices++ = unsigned(t[k]);
    rtcSetGeometryBuildQuality(geometry_.get(), RTC_BUILD_QUALITY_REFIT);
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW);
    rtcAttachGeometry(scene_.get(), geometry_.get());
    update(body.positions(0));
  }
  EmbreeTriangles(const EmbreeTriangles&) = delete;
  EmbreeTriangles& operator=(const EmbreeTriangles&) = delete;

  void update(const Positions& positions) {
    mesh_.vertices = positions;
    for (std::size_t i = 0; i < positions.size(); ++i)
      for (int k = 0; k < 3; ++k) floats_[3 * i + std::size_t(k)] = float(positions[i][k]);
    rtcUpdateGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_.get());
    rtcCommitScene(scene_.get());
  }
  std::array<Point, 3> corners(unsigned i) const { return cornersOf(mesh_, i); }
  RTCScene scene() const { return scene_.get(); }

 private:
  scenarios::Mesh mesh_;
  Owned<RTCGeometry> geometry_;
  Owned<RTCScene> scene_;
  float* floats_ = nullptr;
};

class EmbreePairs : public ProximityMethod {
 public:
  explicit EmbreePairs(const ProximityCase& c)
      : distance_(c.distance),
        device_(rtcNewDevice("threads=1")),
        first_(device_.get(), c.scenario.first, c.distance / 2) {
    if (!c.is_self)
      second_ = std::make_unique<GrownMesh>(device_.get(), c.scenario.second, c.distance / 2);
  }

  void update(const Frame& frame) override {
    first_.update(frame.first);
    if (second_) second_->update(frame.second);
  }
  void ask() override {
    pairs_.clear();
    rtcCollide(first_.scene(), other().scene(), takeCollisions, this);
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      throw std::runtime_error("Embree reports an error");
  }
  ProximityAnswer answer() const override {
    ProximityAnswer answer;
    answer.pairs = pairs_;
    std::sort(answer.pairs.begin(), answer.pairs.end());
    return answer;
  }

 private:
  static void takeCollisions(void* user, RTCCollision* collisions, unsigned count) {
    auto& self = *static_cast<EmbreePairs*>(user);
    for (unsigned i = 0; i < count; ++i) self.test(collisions[i].primID0, collisions[i].primID1);
  }
  /// A scene with itself gives both orders. Leaves of a refitted tree hold several triangles, whose
  /// own boxes Embree does not test.
  void test(unsigned a, unsigned b) {
    if (!second_ && a >= b) return;
    if (!first_.box(a).intersects(other().box(b))) return;
    if (!second_ && areNeighbours(first_.mesh().triangles[a], first_.mesh().triangles[b])) return;
    if (adaptive_bvh::gapOf(first_.corners(a), other().corners(b)).distance <= distance_)
      pairs_.emplace_back(a, b);
  }
  const GrownMesh& other() const { return second_ ? *second_ : first_; }

  const double distance_;
  Owned<RTCDevice> device_;
  GrownMesh first_;
  std::unique_ptr<GrownMesh> second_;
  std::vector<std::pair<unsigned, unsigned>> pairs_;
};

/// Closest points: Embree walks, the callback has the nearest point of a triangle, in its floats.
class EmbreePoints : public ProximityMethod {
 public:
  explicit EmbreePoints(const ProximityCase& c)
      : case_(c),
        device_(rtcNewDevice("threads=1")),
        body_(device_.get(), c.scenario.first),
        results_(c.points.size()) {}

  void update(const Frame& frame) override { body_.update(frame.first); }
  void ask() override {
    for (std::size_t i = 0; i < results_.size(); ++i) {
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      One one{this, case_.points[i].cast<float>(), std::numeric_limits<float>::infinity()};
      RTCPointQuery query = {};
      query.x = one.point[0];
      query.y = one.point[1];
      query.z = one.point[2];
      query.radius = one.distance;
      rtcPointQuery(body_.scene(), &query, &context, test, &one);
      results_[i] = one.distance;
    }
  }
  ProximityAnswer answer() const override {
    return {{}, std::vector<double>(results_.begin(), results_.end())};
  }

 private:
  struct One {
    const EmbreePoints* self;
    Eigen::Vector3f point;
    float distance;
  };
  static bool test(RTCPointQueryFunctionArguments* arguments) {
    One& one = *static_cast<One*>(arguments->userPtr);
    const auto corners = one.self->body_.corners(arguments->primID);
    const auto distance =
        float(adaptive_bvh::vertexFaceDistance(one.point.cast<double>(), corners).distance);
    if (!(distance < one.distance)) return false;
    one.distance = arguments->query->radius = distance;
    return true;
  }

  const ProximityCase& case_;
  Owned<RTCDevice> device_;
  EmbreeTriangles body_;
  std::vector<float> results_;
};

/// The t of first hits; or, with kAny, whether rays hit anything: 1 or 0.
template <bool kAny>
class EmbreeRays : public ProximityMethod {
 public:
  explicit EmbreeRays(const ProximityCase& c)
      : case_(c),
        device_(rtcNewDevice("threads=1")),
        body_(device_.get(), c.scenario.first),
        results_(c.points.size()) {}

  void update(const Frame& frame) override { body_.update(frame.first); }
  void ask() override {
    for (std::size_t i = 0; i < results_.size(); ++i) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRayHit ray = {};
      ray.ray.org_x = float(case_.points[i][0]);
      ray.ray.org_y = float(case_.points[i][1]);
      ray.ray.org_z = float(case_.points[i][2]);
      ray.ray.dir_x = float(case_.directions[i][0]);
      ray.ray.dir_y = float(case_.directions[i][1]);
      ray.ray.dir_z = float(case_.directions[i][2]);
      ray.ray.tfar = std::numeric_limits<float>::infinity();
      ray.ray.mask = ~0u;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      if constexpr (kAny) {
        rtcOccluded1(body_.scene(), &context, &ray.ray);
        results_[i] = ray.ray.tfar < 0 ? 1.f : 0.f;
      } else {
        rtcIntersect1(body_.scene(), &context, &ray);
        results_[i] = ray.ray.tfar;
      }
    }
  }
  ProximityAnswer answer() const override {
    return {{}, std::vector<double>(results_.begin(), results_.end())};
  }

 private:
  const ProximityCase& case_;
  Owned<RTCDevice> device_;
  EmbreeTriangles body_;
  std::vector<float> results_;
};

template <typename M>
ProximityKind kind(const char* title, Question question) {
  return {title, {question}, [](const ProximityCase& c) { return std::make_unique<M>(c); }};
}

}  // namespace

std::vector<ProximityKind> embreeProximityMethods() {
  return {kind<EmbreePairs>("Embree", Question::Pairs),
          kind<EmbreePoints>("Embree, single precision", Question::Points),
          kind<EmbreeRays<false>>("Embree, single precision", Question::Rays),
          kind<EmbreeRays<true>>("Embree, single precision", Question::AnyRays)};
}

}  // namespace adaptive_bvh_bench
