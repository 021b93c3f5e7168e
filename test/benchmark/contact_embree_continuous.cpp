// Embree 3 between two frames: a refitted tree of swept boxes, and rtcCollide. Its callback makes
// the pairs of features of two triangles, each once, and finds the earliest impact by this
// library's own tests: four pairs at a time in single precision, then the time of impact.
#include <stdexcept>

#include "adaptive_bvh/feature_pairs.h"
#include "contact_continuous.h"
#include "contact_pairs.h"
#include "deformable/mesh_state.h"
#include "embree_scene.h"
#include "triangles/moving_pairs4.h"

namespace adaptive_bvh_bench {
namespace {

using adaptive_bvh::FeatureOwner;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::Float4;
using Box3 = Eigen::AlignedBox3d;

/// The earliest impact of pairs that come one by one.
class Earliest {
 public:
  void begin(const MovingPose& pose) {
    pose_ = std::make_unique<MovingPose>(pose);
    time_ = MovingFeatures::kNever;
    Box3 all;
    for (const Positions* positions : {&pose.start, &pose.end})
      for (const Point& x : *positions) all.extend(x);
    const double scale = std::ldexp(1., 1 - std::ilogb(all.sizes().maxCoeff()));
    const auto inFrame = [&](const Point& x) {
      const Point y = scale * (x - all.center());
      return Float4{float(y[0]), float(y[1]), float(y[2]), 0};
    };
    begins_.resize(pose.start.size());
    ends_.resize(pose.start.size());
    for (std::size_t v = 0; v < begins_.size(); ++v) {
      begins_[v] = inFrame(pose.start[v]);
      ends_[v] = inFrame(pose.end[v]);
    }
  }
  template <int kFirsts>
  void add(const FeatureCorners& corners) {
    auto& group = groups_[kFirsts - 1];
    group.corners[group.count++] = corners;
    if (group.count == 4) test<kFirsts>();
  }
  double finish() {
    test<1>();
    test<2>();
    return time_;
  }

 private:
  struct Group {
    FeatureCorners corners[4];
    int count = 0;
  };

  template <int kFirsts>
  void test() {
    Group& group = groups_[kFirsts - 1];
    if (group.count == 0) return;
    const int count = group.count;
    while (group.count < 4) group.corners[group.count++] = group.corners[0];
    adaptive_bvh::MovingPairs4 four;
    const FeatureCorners* c = group.corners;
    for (std::size_t i = 0; i < 4; ++i) {
      using adaptive_bvh::float4::columns;
      four.begin[i] =
          columns(begins_[c[0][i]], begins_[c[1][i]], begins_[c[2][i]], begins_[c[3][i]]);
      four.end[i] = columns(ends_[c[0][i]], ends_[c[1][i]], ends_[c[2][i]], ends_[c[3][i]]);
    }
    const double until = std::min(time_, 1.);
    const float share = std::min(1.f, float(until) * (1 + 1.f / (1 << 20)));
    const unsigned apart = adaptive_bvh::stayApart<kFirsts>(four, {0, 1.f / (1 << 22), share});
    constexpr FeatureKind kKind = kFirsts == 1 ? FeatureKind::VertexFace : FeatureKind::EdgeEdge;
    for (int k = 0; k < count; ++k)
      if (!(apart >> k & 1))
        time_ = std::min(time_, moving(*pose_, kKind, c[k]).timeOfImpact(0, until));
    group.count = 0;
  }

  std::unique_ptr<MovingPose> pose_;
  std::vector<Float4> begins_, ends_;
  Group groups_[2];
  double time_ = MovingFeatures::kNever;
};

class EmbreeContinuous : public ContactMethod {
 public:
  explicit EmbreeContinuous(const ContactCase& contact_case)
      : mesh_(contact_case.scenario.first.mesh()),
        end_(mesh_.vertices),
        owners_(ownersOf(mesh_)),
        device_(rtcNewDevice("threads=1")),
        faces_(device_.get(), mesh_.triangles.size()) {
    vertices_.resize(mesh_.vertices.size());
    edges_.resize(3 * mesh_.triangles.size());
    start_ = end_;
    sweep();
  }

  void update(const Frame& frame) override {
    start_.swap(end_);
    end_ = frame.first;
    sweep();
  }

  void query() override {
    pairs_.clear();
    earliest_.begin({mesh_, start_, end_});
    rtcCollide(faces_.scene(), faces_.scene(), takeCollisions, this);
    time_ = earliest_.finish();
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      throw std::runtime_error("Embree reports an error");
  }

  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.counts.candidates = long(pairs_.size());
    answer.distance = time_;
    return answer;
  }

 private:
  /// By triangle.
  static std::vector<FeatureOwner> ownersOf(const Mesh& mesh) {
    const adaptive_bvh::DeformableMesh deformable(mesh);
    const adaptive_bvh::FeatureOwners& owners =
        adaptive_bvh::detail::MeshAccess::state(deformable).topology->owners;
    std::vector<FeatureOwner> by_triangle(owners.size());
    for (std::size_t i = 0; i < owners.size(); ++i) by_triangle[owners[i].triangle] = owners[i];
    return by_triangle;
  }

  /// Of vertices, owned edges and faces.
  void sweep() {
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      vertices_[v] = {start_[v].cwiseMin(end_[v]), start_[v].cwiseMax(end_[v])};
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const fcl::Triangle& c = mesh_.triangles[t];
      faces_.box(t) = vertices_[c[0]].merged(vertices_[c[1]]).merged(vertices_[c[2]]);
      for (unsigned k = 0; k < 3; ++k)
        if (owners_[t].ownsEdge(k))
          edges_[3 * t + k] = vertices_[c[int(k)]].merged(vertices_[c[int(k + 1) % 3]]);
    }
    faces_.commit();
  }

  static void takeCollisions(void* user, RTCCollision* collisions, unsigned count) {
    auto& self = *static_cast<EmbreeContinuous*>(user);
    for (unsigned i = 0; i < count; ++i) self.test(collisions[i].primID0, collisions[i].primID1);
  }

  /// A scene with itself gives both orders. Leaves of a refitted tree hold several triangles, whose
  /// own boxes Embree does not test.
  void test(unsigned a, unsigned b) {
    if (a >= b || !faces_.box(a).intersects(faces_.box(b))) return;
    vertices(a, b);
    vertices(b, a);
    for (unsigned k = 0; k < 3; ++k) {
      if (!owners_[a].ownsEdge(k)) continue;
      for (unsigned l = 0; l < 3; ++l)
        if (owners_[b].ownsEdge(l) && edges_[3 * a + k].intersects(edges_[3 * b + l]))
          edges(a, k, b, l);
    }
  }
  void vertices(unsigned a, unsigned b) {
    const fcl::Triangle &t = mesh_.triangles[a], &face = mesh_.triangles[b];
    for (unsigned k = 0; k < 3; ++k) {
      const std::size_t v = t[int(k)];
      if (!owners_[a].ownsVertex(k) || v == face[0] || v == face[1] || v == face[2]) continue;
      if (!vertices_[v].intersects(faces_.box(b))) continue;
      pairs_.vertex_face.push_back({unsigned(v), b});
      earliest_.add<1>({v, face[0], face[1], face[2]});
    }
  }
  void edges(unsigned a, unsigned k, unsigned b, unsigned l) {
    const fcl::Triangle &s = mesh_.triangles[a], &t = mesh_.triangles[b];
    const FeatureCorners c = {s[int(k)], s[int(k + 1) % 3], t[int(l)], t[int(l + 1) % 3]};
    if (c[0] == c[2] || c[0] == c[3] || c[1] == c[2] || c[1] == c[3]) return;
    pairs_.edge_edge.push_back({3 * a + k, 3 * b + l});
    earliest_.add<2>(c);
  }

  const Mesh mesh_;
  Positions start_, end_;
  const std::vector<FeatureOwner> owners_;
  Owned<RTCDevice> device_;
  EmbreeBoxes faces_;
  std::vector<Box3> vertices_, edges_;
  adaptive_bvh::FeaturePairs pairs_;
  Earliest earliest_;
  double time_ = MovingFeatures::kNever;
};

}  // namespace

std::vector<ContactKind> embreeContinuousMethods() {
  return {{"embree-continuous",
           "Embree, swept boxes",
           ContactKind::Peer,
           false,
           {Job::Continuous},
           [](const ContactCase& c) { return std::make_unique<EmbreeContinuous>(c); }}};
}

}  // namespace adaptive_bvh_bench
