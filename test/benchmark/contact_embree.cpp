// Embree 3: a tree of float boxes, refitted or built anew by rtcCommitScene, and rtcCollide. It
// only finds pairs of triangles whose boxes are near; what they are then is decided in the
// callback, by FCL's test.
#include <array>
#include <cfloat>
#include <stdexcept>
#include <thread>

#include "contact_judge.h"
#include "contact_pairs.h"
#include "embree_scene.h"

namespace adaptive_bvh_bench {
namespace {

/// One mesh: a box a triangle.
class EmbreeMesh {
 public:
  EmbreeMesh(RTCDevice device, const scenarios::Body& body, RTCBuildQuality quality)
      : mesh_(body.mesh()), boxes_(device, mesh_.triangles.size(), quality) {
    update(body.positions(0));
  }

  void update(const Positions& positions) {
    mesh_.vertices = positions;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const fcl::Triangle& t = mesh_.triangles[i];
      const Point &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
      boxes_.box(i) = {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
    }
    boxes_.commit();
  }

  const Mesh& mesh() const { return mesh_; }
  const Eigen::AlignedBox3d& box(unsigned i) const { return boxes_.box(i); }
  RTCScene scene() const { return boxes_.scene(); }

 private:
  Mesh mesh_;
  EmbreeBoxes boxes_;
};

/// Are the corners of `b` all on one side of the plane of `a`, by more than rounding? With E the
/// largest component of an edge of `a` and D of a difference b[k] - a[0], both in magnitude, a
/// component of the normal is at most 2 E^2 and wrong by at most 8 u E^2 (u = 2^-53); a product
/// with a difference, of three terms, by at most 48 u E^2 D. FCL projects on the same axis, with
/// the same error. Beyond twice that it sees the gap, too.
bool planeSeparates(const std::array<Point, 3>& a, const std::array<Point, 3>& b) {
  const Point u = a[1] - a[0], v = a[2] - a[0], normal = u.cross(v);
  const Point p = b[0] - a[0], q = b[1] - a[0], r = b[2] - a[0];
  const double edge = u.cwiseAbs().cwiseMax(v.cwiseAbs()).maxCoeff();
  const double far = p.cwiseAbs().cwiseMax(q.cwiseAbs()).cwiseMax(r.cwiseAbs()).maxCoeff();
  const double margin = 128 * (DBL_EPSILON / 2) * edge * edge * far;
  const double x = normal.dot(p), y = normal.dot(q), z = normal.dot(r);
  return std::min({x, y, z}) > margin || std::max({x, y, z}) < -margin;
}

bool planeSeparates(const Mesh& first, unsigned a, const Mesh& second, unsigned b) {
  const auto corners = [](const Mesh& mesh, unsigned t) -> std::array<Point, 3> {
    const fcl::Triangle& triangle = mesh.triangles[t];
    return {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]};
  };
  const auto p = corners(first, a), q = corners(second, b);
  return planeSeparates(p, q) || planeSeparates(q, p);
}

class EmbreeContact : public ContactMethod {
 public:
  EmbreeContact(const ContactCase& contact_case, bool with_rejections, RTCBuildQuality quality)
      : with_rejections_(with_rejections),
        device_(rtcNewDevice("threads=1")),
        first_(device_.get(), contact_case.scenario.first, quality) {
    if (!contact_case.isSelf())
      second_ = std::make_unique<EmbreeMesh>(device_.get(), contact_case.scenario.second, quality);
    requireNoError();
  }

  void update(const Frame& frame) override {
    first_.update(frame.first);
    if (second_) second_->update(frame.second);
  }

  void query() override {
    pairs_.clear();
    candidates_ = triangle_tests_ = 0;
    rtcCollide(first_.scene(), other().scene(), takeCollisions, this);
    requireNoError();
  }

  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.counts = {-1, candidates_, triangle_tests_, -1};
    answer.pairs = sorted(pairs_, !second_);
    return answer;
  }

 private:
  static void takeCollisions(void* user, RTCCollision* collisions, unsigned count) {
    auto& self = *static_cast<EmbreeContact*>(user);
    if (std::this_thread::get_id() != self.thread_) self.other_threads_ = true;
    for (unsigned i = 0; i < count; ++i) self.test(collisions[i].primID0, collisions[i].primID1);
  }

  /// A scene with itself gives both orders. Leaves of a refitted tree hold several triangles, whose
  /// own boxes Embree does not test.
  void test(unsigned a, unsigned b) {
    if (!second_ && a >= b) return;
    if (!first_.box(a).intersects(other().box(b))) return;
    const Mesh &first = first_.mesh(), &second = other().mesh();
    if (!second_ && areNeighbours(first.triangles[a], first.triangles[b])) return;
    ++candidates_;
    if (with_rejections_ && planeSeparates(first, a, second, b)) return;
    ++triangle_tests_;
    if (touchByFcl(first, a, second, b)) pairs_.emplace_back(a, b);
  }

  const EmbreeMesh& other() const { return second_ ? *second_ : first_; }

  void requireNoError() const {
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      throw std::runtime_error("Embree reports an error");
    if (other_threads_) throw std::runtime_error("Embree did not keep to one thread");
  }

  bool with_rejections_;
  Owned<RTCDevice> device_;
  EmbreeMesh first_;
  std::unique_ptr<EmbreeMesh> second_;
  const std::thread::id thread_ = std::this_thread::get_id();
  bool other_threads_ = false;
  std::vector<TrianglePair> pairs_;
  long candidates_ = 0, triangle_tests_ = 0;
};

}  // namespace

std::vector<ContactKind> embreeContactMethods() {
  const auto row = [](const char* key, const char* title, std::vector<Job> jobs,
                      bool with_rejections, RTCBuildQuality quality) -> ContactKind {
    return {key,
            title,
            ContactKind::Peer,
            true,
            std::move(jobs),
            [with_rejections, quality](const ContactCase& c) {
              return std::make_unique<EmbreeContact>(c, with_rejections, quality);
            }};
  };
  const std::vector<Job> jobs = {Job::SelfCollision, Job::Collide};
  return {
      row("embree", "Embree", jobs, false, RTC_BUILD_QUALITY_REFIT),
      row("embree-planes", "Embree, planes first", jobs, true, RTC_BUILD_QUALITY_REFIT),
      row("embree-build", "Embree, built anew", {Job::SelfCollision}, true, RTC_BUILD_QUALITY_LOW)};
}

}  // namespace adaptive_bvh_bench
