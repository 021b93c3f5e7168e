// Drives random sequences of calls, sound ones and unsound ones, on a few models or meshes. After
// each call they must be valid, still have the frame that the calls so far have given them, and
// answer as brute force does; or the call must have been refused by its documented error and have
// left everything as it was.
//
// The first two bits choose a model of RSS or OBBRSS, or a DeformableMesh. LLVMFuzzerTestOneInput
// is libFuzzer's entry (preset "fuzz"); replay.cpp calls it for ctest. With FUZZ_TRACE in the
// environment, it says what it calls.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string>

#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "fuzz/mesh_subject.h"

namespace adaptive_bvh_test {
namespace {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;
/// A body that does not change, to ask distances to.
template <typename BV>
const AdaptiveBVHModel<BV>& obstacleOf() {
  static const auto* const model = [] {
    auto* built = new AdaptiveBVHModel<BV>;
    fillModel(tube(3, 2), *built);
    return built;
  }();
  return *model;
}

template <typename BV>
class Subject {
 public:
  using Model = AdaptiveBVHModel<BV>;
  using Plain = fcl::BVHModel<BV>;

  Subject() : model_(std::make_unique<Model>()) {}

  void step(Bytes& in) {
    const Points before = frame();
    const int state = model_->build_state;
    const int byte = in.byte();  // the last sixteen values stand for calls that came later
    const int call = byte < 240 ? byte % 24 : byte - 240 + 24;
    if (std::getenv("FUZZ_TRACE"))
      std::fprintf(stderr, "%p: call %d in state %d, %d vertices, %d triangles\n",
                   static_cast<void*>(this), call, state, model_->num_vertices, model_->num_tris);
    switch (call) {
      case 0: begin(in); break;
      case 1: add(model_->addVertex(in.point())); break;
      case 2: addTriangle(in); break;
      case 3: addMesh(in); break;
      case 4: add(model_->addSubModel(in.points(in.below(5)))); break;
      case 5: end(); break;
      case 6: model_->beginReplaceModel(); break;
      case 7: model_->replaceVertex(in.point()); break;
      case 8: replaceTriangle(in, false); break;
      case 9: model_->replaceSubModel(in.points(some(in))); break;
      case 10: model_->endReplaceModel(!in.oneIn(4), in.oneIn(2)); break;
      case 11: model_->beginUpdateModel(); break;
      case 12: model_->updateVertex(in.point()); break;
      case 13: replaceTriangle(in, true); break;
      case 14: model_->updateSubModel(in.points(some(in))); break;
      case 15: model_->endUpdateModel(!in.oneIn(4), in.oneIn(2)); break;
      case 16:
      case 17: update(in, before); break;
      case 18: updateSome(in, before); break;
      case 19: setPolicy(in); break;
      case 20: copy(in); break;
      case 21: changeThroughTheBase(in); break;
      case 22: query(in); break;
      case 23: settings(in); break;
      case 24:
      case 25: updateFromOwnArrays(in, before); break;
      case 26: move(); break;
      case 27:
      case 28: onMesh([&](MeshQueries& queries) { queries.excursion(in); }); break;
      case 29: contacts(in); break;
      case 30: sphere(in); break;
      case 31: octree(in); break;
      case 32: translate(in, before); break;
      case 33: otherVolumes(); break;
      case 34:
      case 35: onMesh([&](MeshQueries& queries) { queries.continuous(in); }); break;
      case 36: onMesh([&](MeshQueries& queries) { queries.proximity(in); }); break;
      case 37: onMesh([&](MeshQueries& queries) { queries.ray(in); }); break;
      case 38: onMesh([&](MeshQueries& queries) { queries.contactSets(in); }); break;
      default: criterion(in); break;
    }
    check(state, before);
  }

 private:
  static const Model& obstacle() { return obstacleOf<BV>(); }
  Points frame() const { return Points(model_->vertices, model_->vertices + model_->num_vertices); }
  bool isBuilt() const {
    return model_->build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
           model_->build_state == fcl::BVH_BUILD_STATE_UPDATED;
  }
  bool isQueryable() const { return isBuilt() && model_->num_tris > 0; }
  bool isBuilding() const {
    return model_->build_state == fcl::BVH_BUILD_STATE_EMPTY ||
           model_->build_state == fcl::BVH_BUILD_STATE_BEGUN;
  }
  /// Nearly always as many as there are vertices.
  int some(Bytes& in) { return in.oneIn(8) ? in.below(20) : model_->num_vertices; }

  void add(int code) {
    REQUIRE(code == fcl::BVH_OK || code == fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE ||
            code == fcl::BVH_ERR_INCORRECT_DATA);
  }

  void begin(Bytes& in) {
    // FCL says so on stderr, and forgets what it allocated, when a model is begun twice.
    if (model_->build_state != fcl::BVH_BUILD_STATE_EMPTY)
      model_ = std::make_unique<Model>(in.oneIn(2) ? adaptive_bvh::HierarchyStrategy::TopDown
                                                   : adaptive_bvh::HierarchyStrategy::BottomUp);
    REQUIRE(model_->beginModel(in.below(6), in.below(6)) == fcl::BVH_OK);
  }

  void addTriangle(Bytes& in) {
    const Points p = in.points(3);
    if (model_->num_tris < 24) add(model_->addTriangle(p[0], p[1], p[2]));
  }

  void addMesh(Bytes& in) {
    const int count = 3 + in.below(8);
    const Points points = in.points(count);
    std::vector<fcl::Triangle> triangles;
    for (int t = in.below(8); t > 0; --t) {
      const auto corner = [&] { return std::size_t(in.oneIn(32) ? 1000 : in.below(count)); };
      const std::size_t a = corner(), b = corner();
      triangles.emplace_back(a, b, corner());
    }
    if (model_->num_tris < 24) add(model_->addSubModel(points, triangles));
  }

  void end() {
    const bool begun = model_->build_state == fcl::BVH_BUILD_STATE_BEGUN;
    bool sound = isUsable(frame());
    for (int t = 0; t < model_->num_tris; ++t)
      for (int k = 0; k < 3; ++k)
        sound &= model_->tri_indices[t][k] < std::size_t(model_->num_vertices);
    const int code = model_->endModel();
    if (!begun)
      REQUIRE(code == fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE);
    else if (!sound)
      REQUIRE(code == fcl::BVH_ERR_INCORRECT_DATA);
    else
      REQUIRE(code == fcl::BVH_OK || model_->num_vertices == 0);
  }

  void replaceTriangle(Bytes& in, bool update) {
    const Points p = in.points(3);
    if (update)
      model_->updateTriangle(p[0], p[1], p[2]);
    else
      model_->replaceTriangle(p[0], p[1], p[2]);
  }

  /// The new frame must be there after it, or an error must have been thrown.
  template <typename Call>
  void updateTo(const Points& expected, bool sound, const Points& before, Call&& call) {
    const bool built = !isBuilding();
    try {
      call();
      REQUIRE(sound && built);
      REQUIRE(same(frame(), expected));
      checkLocalBounds();
    } catch (const std::invalid_argument&) {
      REQUIRE(!sound);
      REQUIRE(same(frame(), before));
    } catch (const std::logic_error&) {
      REQUIRE(!built);
      REQUIRE(same(frame(), before));
    }
  }

  /// The box of FCL's computeLocalAABB, found anew, and a radius around all vertices.
  void checkLocalBounds() const {
    Eigen::AlignedBox3d box;
    for (const Point& p : frame()) box.extend(p);
    REQUIRE(box.min() == model_->aabb_local.min_ && box.max() == model_->aabb_local.max_);
    REQUIRE(model_->aabb_center == model_->aabb_local.center());
    double radius = 0;
    for (const Point& p : frame()) radius = std::max(radius, (p - model_->aabb_center).norm());
    REQUIRE(model_->aabb_radius >= radius * (1 - 2e-15));
    const double rounding = 1e-15 * (box.min().cwiseAbs() + box.max().cwiseAbs()).maxCoeff();
    REQUIRE(model_->aabb_radius <= box.diagonal().norm() / 2 * (1 + 4e-15) + rounding);
  }

  void update(Bytes& in, const Points& before) {
    Points points = in.points(some(in));
    if (in.oneIn(4) && points.size() == before.size())  // one vertex only
      for (std::size_t v = 1; v < points.size(); ++v) points[v] = before[v];
    const bool sound = points.size() == before.size() && isUsable(points);
    updateTo(points, sound, before, [&] {
      if (in.oneIn(2)) {
        model_->update(points);
      } else {
        Eigen::Matrix3Xd columns(3, Eigen::Index(points.size()));
        for (std::size_t v = 0; v < points.size(); ++v) columns.col(Eigen::Index(v)) = points[v];
        model_->update(columns);
      }
    });
  }

  void updateSome(Bytes& in, const Points& before) {
    const int count = in.below(5);
    const Points points = in.points(count);
    std::vector<unsigned> indices;
    Points expected = before;
    bool sound = isUsable(points);
    for (int i = 0; i < count; ++i) {
      indices.push_back(unsigned(in.oneIn(32) ? 1000 : in.below(model_->num_vertices + 1)));
      if (indices.back() < expected.size())
        expected[indices.back()] = points[std::size_t(i)];
      else
        sound = false;
    }
    updateTo(expected, sound, before, [&] { model_->update(indices, points); });
  }

  /// Positions in the arrays that the update writes count as they were.
  void updateFromOwnArrays(Bytes& in, const Points& before) {
    const std::size_t n = before.size();
    if (isBuilding() || n == 0) return;
    if (model_->prev_vertices && in.oneIn(2)) {
      const Points last(model_->prev_vertices, model_->prev_vertices + n);
      updateTo(last, true, before, [&] { model_->update(model_->prev_vertices, n); });
      return;
    }
    if (in.oneIn(4)) {
      updateTo(before, true, before, [&] { model_->update(model_->vertices, n); });
      return;
    }
    const Point* const own =
        model_->prev_vertices && in.oneIn(2) ? model_->prev_vertices : model_->vertices;
    const std::size_t first = std::size_t(in.byte()) % n,
                      count = std::size_t(in.byte()) % (n - first);
    const Points values(own + first, own + first + count);
    std::vector<unsigned> indices;
    Points expected = before;
    for (std::size_t i = 0; i < count; ++i) {
      indices.push_back(unsigned(std::size_t(in.byte()) % n));
      expected[indices.back()] = values[i];
    }
    updateTo(expected, true, before, [&] { model_->update(indices.data(), own + first, count); });
  }

  /// There and back, by constructor and assignment.
  void move() {
    const Points before = frame();
    const Point* const vertices = model_->vertices;
    const int state = model_->build_state;
    Model other(std::move(*model_));
    REQUIRE(model_->vertices == nullptr && model_->getNumBVs() == 0);
    REQUIRE(model_->build_state == fcl::BVH_BUILD_STATE_EMPTY);
    REQUIRE(other.vertices == vertices && other.build_state == state);
    *model_ = std::move(other);
    REQUIRE(other.vertices == nullptr);
    REQUIRE(model_->vertices == vertices && same(frame(), before));
  }

  /// The library's own queries, on the model's mesh.
  template <typename Query>
  void onMesh(const Query& query) {
    if (!isQueryable()) return;
    const DeformableMesh& mesh = model_->mesh();
    REQUIRE(same(mesh.vertices(), frame()) && mesh.validate());
    if (&mesh != queries_of_) queries_ = std::make_unique<MeshQueries>(mesh);
    queries_of_ = &mesh;
    query(*queries_);
  }

  /// Contacts of the model have every field and do not depend on the requested fields.
  void contacts(Bytes& in) {
    const fcl::Transform3d tf = pose(in), still = fcl::Transform3d::Identity();
    if (!isQueryable() || !isPlainFrame()) return;
    fcl::CollisionResultd plain, full;
    const fcl::CollisionRequestd all(100000), with_contact(100000, true);
    adaptive_bvh::collide(model_.get(), still, &obstacle(), tf, all, plain);
    adaptive_bvh::collide(model_.get(), still, &obstacle(), tf, with_contact, full);
    REQUIRE(pairsOf(plain) == pairsOf(full));
    checkFields(full);
    onMesh([&](MeshQueries& queries) { queries.contacts(tf); });
  }

  /// The distance of a sphere, and its points in the world, in either order.
  void sphere(Bytes& in) {
    const fcl::Transform3d tf = pose(in);
    const fcl::Sphered ball(0.125 * (1 + in.below(8)));
    const bool ball_first = in.oneIn(2);
    if (!isQueryable() || !isPlainFrame()) return;
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    fcl::DistanceResultd result;
    if (ball_first)
      adaptive_bvh::distance(&ball, tf, model_.get(), still, fcl::DistanceRequestd(true), result);
    else
      adaptive_bvh::distance(model_.get(), still, &ball, tf, fcl::DistanceRequestd(true), result);
    const Point c = tf.translation();
    double expected = std::numeric_limits<double>::max();
    for (int t = 0; t < model_->num_tris; ++t) {
      const auto corner = [&](int k) {
        return quad::of(model_->vertices[model_->tri_indices[t][k]]);
      };
      expected = std::min(expected, static_cast<double>(quad::distance(
                                        quad::of(c), {corner(0), corner(1), corner(2)})));
    }
    expected = std::max(0., expected - ball.radius);
    REQUIRE(std::abs(result.min_distance - expected) < 1e-9);
    const auto& points = result.nearest_points;
    REQUIRE(std::abs((points[0] - points[1]).norm() - expected) < 1e-9);
  }

  /// Against FCL's own traversal over the same model.
  void octree(Bytes& in) {
    const fcl::Transform3d tf = pose(in), still = fcl::Transform3d::Identity();
    const double cell = in.oneIn(2) ? 0.25 : 2;
    if (!isQueryable() || !isPlainFrame()) return;
    const auto tree = std::make_shared<octomap::OcTree>(cell);
    for (int i = 0; i < 12; ++i)
      tree->updateNode(octomap::point3d(float(cell * (i % 3)), float(cell * (i % 4)), 0.1f), true);
    const fcl::OcTreed cells(tree);
    fcl::DistanceResultd ours;
    adaptive_bvh::distance(model_.get(), still, &cells, tf, fcl::DistanceRequestd(true), ours);
    fcl::CollisionResultd contacts;
    adaptive_bvh::collide(model_.get(), still, &cells, tf, fcl::CollisionRequestd(100000),
                          contacts);
    if (contacts.numContacts() > 0)
      REQUIRE(ours.min_distance < 1e-5);
    else
      REQUIRE(ours.min_distance > -1e-9 || ours.min_distance == -1);
  }

  /// A body that is carried along moves its volumes and inflates none.
  void translate(Bytes& in, const Points& before) {
    const Point by(in.below(9) / 8. - 0.5, in.below(9) / 8. - 0.5, in.below(9) / 8. - 0.5);
    if (isBuilding() || !isPlainFrame()) return;
    for (const Point& p : before)
      if (!isEighth(p[0]) || !isEighth(p[1]) || !isEighth(p[2])) return;  // sums are rounded
    const bool swept = model_->prev_vertices != nullptr;
    Points next = before;
    for (Point& p : next) p += by;
    updateTo(next, true, before, [&] { model_->update(next); });
    const adaptive_bvh::UpdateReport& report = model_->lastUpdate();
    if (model_->refitPolicy().propagation != adaptive_bvh::Propagation::TranslationCompensated ||
        swept || report.resynchronised || before.empty())
      return;
    REQUIRE(report.inflated == 0);
    REQUIRE(report.moved == report.nodes || (by.isZero(0) && report.moved == 0));
  }

  /// A pair that FCL cannot compute is refused, not answered.
  void otherVolumes() {
    using OtherBV = std::conditional_t<std::is_same<BV, fcl::RSSd>::value, fcl::OBBRSSd, fcl::RSSd>;
    static const auto* const other = [] {
      auto* built = new fcl::BVHModel<OtherBV>;
      fillModel(tube(3, 2), *built);
      return built;
    }();
    if (!isQueryable()) return;
    const fcl::Transform3d still = fcl::Transform3d::Identity();
    const fcl::CollisionGeometryd* const others[] = {other, &obstacleOf<OtherBV>()};
    for (int order = 0; order < 4; ++order) {
      const fcl::CollisionGeometryd *a = model_.get(), *b = others[order / 2];
      if (order % 2 == 1) std::swap(a, b);
      fcl::DistanceResultd distance;
      fcl::CollisionResultd contacts;
      int refused = 0;
      try {
        adaptive_bvh::distance(a, still, b, still, fcl::DistanceRequestd(), distance);
      } catch (const std::invalid_argument&) {
        ++refused;
      }
      try {
        adaptive_bvh::collide(a, still, b, still, fcl::CollisionRequestd(), contacts);
      } catch (const std::invalid_argument&) {
        ++refused;
      }
      REQUIRE(refused == 2);
    }
  }

  /// Each criterion, on either propagation.
  void criterion(Bytes& in) {
    RefitPolicy policy;
    policy.criterion = static_cast<FitnessCriterion>(in.below(10));
    policy.min_inflation = policy.child_distance_ratio = 0.01 * in.below(20);
    policy.max_inflation = 0.01 * in.below(20);
    if (in.oneIn(3)) policy.propagation = adaptive_bvh::Propagation::Displacements;
    in.byte();  // of a setting that there was
    model_->setRefitPolicy(policy);
  }

  bool isPlainFrame() const {
    for (const Point& p : frame())
      for (double x : p)
        if (!isPlain(x)) return false;
    return true;
  }

  void setPolicy(Bytes& in) {
    RefitPolicy policy = in.oneIn(3)
                             ? RefitPolicy::thesis(static_cast<FitnessCriterion>(in.below(9)))
                             : RefitPolicy();
    policy.criterion = static_cast<FitnessCriterion>(in.below(9));
    const double values[] = {0, 0.01, 0.14, 1, 100, -1, std::nan("")};
    policy.max_inflation = values[in.below(7)];
    policy.leaf_radius_may_shrink = in.oneIn(2);
    const RefitPolicy before = model_->refitPolicy();
    try {
      model_->setRefitPolicy(policy);
      REQUIRE(policy.max_inflation >= 0);
    } catch (const std::invalid_argument&) {
      REQUIRE(!(policy.max_inflation >= 0));
      REQUIRE(model_->refitPolicy().max_inflation == before.max_inflation);
    }
  }

  void copy(Bytes& in) {
    if (!isBuilt()) return;  // FCL copies what a model that is being built has no room for
    switch (in.below(3)) {
      case 0: model_ = std::make_unique<Model>(*model_); break;
      case 1: model_ = std::make_unique<Model>(std::move(*model_)); break;
      default: {
        const Plain plain(*model_);
        model_ = std::make_unique<Model>(plain, model_->refitPolicy());
      }
    }
  }

  /// FCL's own calls, that go past ours.
  void changeThroughTheBase(Bytes& in) {
    const Points points = in.points(model_->num_vertices);
    if (!isUsable(points) || model_->build_state != fcl::BVH_BUILD_STATE_PROCESSED ||
        model_->num_tris == 0)
      return;
    Plain& base = *model_;
    const bool refit = in.oneIn(2), bottomup = in.oneIn(2);
    if (in.oneIn(4)) {
      base.beginUpdateModel();
      base.updateSubModel(points);
      base.endUpdateModel(refit, bottomup);
    } else {
      base.beginReplaceModel();
      base.replaceSubModel(points);
      base.endReplaceModel(refit, bottomup);
    }
    REQUIRE(same(frame(), points));
    model_->getNodeType();  // every query of FCL's begins so
  }

  void settings(Bytes& in) {
    const int threads = in.below(4);
    try {
      model_->setThreads(threads);
      REQUIRE(threads >= 1);
    } catch (const std::invalid_argument&) {
      REQUIRE(threads < 1);
    }
    model_->computeLocalAABB();
    adaptive_bvh::measureHierarchy(*model_);
    model_->trackingBytes();
    model_->lastUpdate();
  }

  void query(Bytes& in) {
    const fcl::Transform3d tf = pose(in), still = fcl::Transform3d::Identity();
    fcl::DistanceResultd distance;
    fcl::CollisionResultd contacts;
    const fcl::CollisionRequestd all(100000);
    if (!isQueryable()) {
      if (!isBuilding()) return;  // a frame is open; checked when it is closed
      try {
        adaptive_bvh::distance(model_.get(), still, &obstacle(), tf, fcl::DistanceRequestd(),
                               distance);
        REQUIRE(false);
      } catch (const std::invalid_argument&) {
      }
      return;
    }
    if (!isPlainFrame()) {  // no crash; what FCL's triangle tests are worth then is open
      adaptive_bvh::distance(model_.get(), still, &obstacle(), tf, fcl::DistanceRequestd(),
                             distance);
      onMesh([&](MeshQueries& queries) {
        queries.distance(in, tf);
        queries.contacts(tf);
      });
      return;
    }
    const BruteForce brute_force(*model_, still, obstacle(), tf);
    const double expected = brute_force.distance();
    switch (in.below(4)) {
      case 0: onMesh([&](MeshQueries& queries) { queries.distance(in, tf); }); break;
      case 1:
        adaptive_bvh::distance(model_.get(), still, &obstacle(), tf, fcl::DistanceRequestd(true),
                               distance);
        REQUIRE(std::abs(distance.min_distance - expected) < 1e-9);
        break;
      case 2:
        fcl::distance(model_.get(), still, &obstacle(), tf, fcl::DistanceRequestd(), distance);
        // FCL's own distance of two triangles is too large where edges are parallel.
        REQUIRE(distance.min_distance > expected - 1e-6);
        break;
      default: {
        adaptive_bvh::collide(model_.get(), still, &obstacle(), tf, all, contacts);
        checkContacts(*model_, obstacle(), tf, brute_force.contacts(), contacts);
        onMesh([&](MeshQueries& queries) { queries.contacts(tf); });
      }
    }
  }

  /// What holds after every call.
  void check(int state_before, const Points& before) {
    if (isBuilding()) return;
    std::string reason;
    if (!model_->validate(&reason)) {
      std::fprintf(stderr, "not valid: %s\n", reason.c_str());
      std::abort();
    }
    REQUIRE(isUsable(frame()));
    // Frames that are being supplied are kept aside.
    const bool open = model_->build_state == fcl::BVH_BUILD_STATE_REPLACE_BEGUN ||
                      model_->build_state == fcl::BVH_BUILD_STATE_UPDATE_BEGUN;
    if (open && state_before == model_->build_state) REQUIRE(same(frame(), before));
  }

  std::unique_ptr<Model> model_;
  std::unique_ptr<MeshQueries> queries_;
  const DeformableMesh* queries_of_ = nullptr;
};

template <typename Subject>
void run(Bytes in) {
  Subject subjects[2];
  for (int steps = 0; steps < 200 && !in.isEmpty(); ++steps) subjects[in.below(8) == 7].step(in);
}

}  // namespace
}  // namespace adaptive_bvh_test

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace adaptive_bvh_test;
  const Bytes in(data, size);
  const int kind = size > 0 ? data[0] / 64 : 0;  // two bits that nothing else depends on
  if (kind == 1)
    run<MeshSubject>(in);
  else if (kind == 0)
    run<Subject<fcl::RSSd>>(in);
  else
    run<Subject<fcl::OBBRSSd>>(in);
  return 0;
}
