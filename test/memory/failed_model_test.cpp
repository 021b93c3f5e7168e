// What a call of an AdaptiveBVHModel leaves behind that failed for want of memory: what was there
// before. Every allocation of every call that changes something fails once.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/failing.h"
#include "support/fcl_float.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace failed_model_test {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::Propagation;
using adaptive_bvh::RefitPolicy;

class FailedModelCall : public testing::Test {
 protected:
  using Model = adaptive_bvh::AdaptiveBVHModel<TestVolume<double>>;
  using Plain = fcl::BVHModel<TestVolume<double>>;
  using Point = fcl::Vector3d;
  using Points = std::vector<Point>;

  FailedModelCall() : sheet_(plate(4, 4)) {
    for (Point& p : sheet_.vertices) p[2] = 0.1 * std::sin(5 * p[0]);
    TriangleMesh tool = tube(4, 4);
    for (Point& p : tool.vertices) p[2] += 0.7;
    fillModel(tool, tool_);
  }

  static Points moved(Points points, int number) {
    for (Point& p : points) p[2] += 0.05 * std::sin(double(number) + 7 * p[1]);
    return points;
  }
  Points moved(int number) const { return moved(sheet_.vertices, number); }
  Model make(const RefitPolicy& policy = RefitPolicy()) const {
    Model model(policy);
    fillModel(sheet_, model);
    model.update(moved(1));
    return model;
  }
  Model makeWithMesh() const {
    Model model = make();
    model.mesh();
    return model;
  }

  /// All that can be seen of a model, and of what updates make of it later.
  std::string stateOf(const Model& model) const {
    Text text;
    describe(model, text);
    if (model.num_vertices > 1000 || model.build_state != fcl::BVH_BUILD_STATE_PROCESSED)
      return text.text();
    Model later = model;
    const Points to = moved(Points(later.vertices, later.vertices + later.num_vertices), 9);
    later.update(std::vector<int>{1, 0, 2, 1}, {to[0], to[1], to[2], to[3]});
    describe(later, text);
    later.update(to);
    describe(later, text);
    return text.text();
  }
  void describe(const Model& model, Text& text) const {
    std::string reason;
    EXPECT_TRUE(model.validate(&reason)) << reason;
    const auto positionsOf = [&](const Point* at) {
      return Points(at, at + (at ? model.num_vertices : 0));
    };
    text << model.build_state << model.num_tris << positionsOf(model.vertices)
         << positionsOf(model.prev_vertices) << model.lastUpdate().nodes
         << model.lastUpdate().largest_displacement << int(model.refitPolicy().propagation)
         << int(model.refitPolicy().criterion) << model.hasMesh();
    if (model.build_state != fcl::BVH_BUILD_STATE_PROCESSED &&
        model.build_state != fcl::BVH_BUILD_STATE_UPDATED)
      return;
    // Not the radius: volumes that are computed anew may have a smaller one.
    text << model.aabb_local.min_.transpose() << model.aabb_local.max_.transpose();
    if (model.hasMesh()) text << model.mesh().vertices() << model.mesh().previousVertices();
    fcl::DistanceResultd result;
    const auto identity = fcl::Transform3d::Identity();
    // Not the triangles: others may be as near, and volumes that are computed anew meet them first.
    text << adaptive_bvh::distance(&model, identity, &tool_, identity, fcl::DistanceRequestd(),
                                   result);
  }

  template <typename Make, typename Call>
  int failEach(const std::string& what, const Make& make, const Call& call) {
    return failEachAllocation(
        what, make,
        [&](Model& model) {
          call(model);
          return fcl::BVH_OK;
        },
        [&](const Model& model) { return stateOf(model); }, [](int) { return false; });
  }
  template <typename Call>
  int failEach(const std::string& what, const Call& call) {
    return failEach(
        what, [&] { return make(); }, call);
  }
  /// Of a call of FCL's, which returns a code.
  template <typename Make, typename Call>
  int failEachCode(const std::string& what, const Make& make, const Call& call) {
    return failEachAllocation(
        what, make, call, [&](const Model& model) { return stateOf(model); },
        [](int code) { return code == fcl::BVH_ERR_MODEL_OUT_OF_MEMORY; });
  }

  TriangleMesh sheet_;
  Model tool_;
};

TEST_F(FailedModelCall, AnUpdate) {
  using Model = Model;
  const auto to = this->moved(2);
  const std::vector<unsigned> some = {3, 5, 3, 11};
  const Points few = {to[0], to[5], to[3], to[11]};
  const auto all = [&](Model& model) { model.update(to); };
  const auto ofSome = [&](Model& model) { model.update(some.data(), few.data(), 4); };
  const auto withMesh = [&] { return this->makeWithMesh(); };
  this->failEach("all", all);
  this->failEach("with a mesh", withMesh, all);
  EXPECT_GE(this->failEach("some", ofSome), 4) << "which leaves a vertex has, and what is marked";
  EXPECT_GE(this->failEach("some with a mesh", withMesh, ofSome), 8);
  for (const auto criterion : {FitnessCriterion::RefitAll, FitnessCriterion::A}) {
    for (const auto propagation :
         {Propagation::TranslationCompensated, Propagation::Displacements}) {
      RefitPolicy policy;
      policy.criterion = criterion;
      policy.propagation = propagation;
      const auto make = [&] { return this->make(policy); };
      this->failEach("policy", make, all);
      this->failEach("policy, some", make, ofSome);
    }
  }
}

/// After FCL has changed the tree, or too far to be followed.
TEST_F(FailedModelCall, AnUpdateThatBeginsAnew) {
  using Model = Model;
  using Plain = Plain;
  const auto changed = [&] {
    Model model = this->makeWithMesh();
    Plain& plain = model;
    plain.beginReplaceModel();
    plain.replaceSubModel(this->moved(4));
    plain.endReplaceModel();
    return model;
  };
  const auto to = this->moved(2);
  // (FCL's volumes are not sound, and the mesh is that of before, until the first call.)
  const auto stateOf = [&](const Model& model) {
    Text text;
    text << Points(model.vertices, model.vertices + model.num_vertices);
    return text.text();
  };
  EXPECT_GT(failEachAllocation(
                "repair", changed, [&](Model& model) { model.update(to); }, stateOf),
            5);
  EXPECT_GT(failEachAllocation(
                "mesh", changed, [&](Model& model) { model.mesh(); }, stateOf),
            20);
  auto far = to;
  for (auto& p : far) p *= 1e20;
  this->failEach("far", [&](Model& model) { model.update(far); });
  RefitPolicy other;
  other.propagation = Propagation::Displacements;
  EXPECT_GT(this->failEach("policy", [&](Model& model) { model.setRefitPolicy(other); }), 3);
}

TEST_F(FailedModelCall, AStepOfFclsCalls) {
  using Model = Model;
  const auto to = this->moved(2);
  const auto make = [&] { return this->makeWithMesh(); };
  const auto begunReplace = [&] {
    Model model = this->makeWithMesh();
    model.beginReplaceModel();
    model.replaceSubModel(to);
    return model;
  };
  const auto begunUpdate = [&] {
    Model model = this->makeWithMesh();
    model.beginUpdateModel();
    model.updateSubModel(to);
    return model;
  };
  EXPECT_EQ(
      1, this->failEachCode("begin", make, [](Model& model) { return model.beginReplaceModel(); }));
  EXPECT_EQ(1, this->failEachCode("begin two", make,
                                  [](Model& model) { return model.beginUpdateModel(); }));
  for (const bool refit : {true, false}) {
    this->failEachCode("end", begunReplace,
                       [&](Model& model) { return model.endReplaceModel(refit); });
    EXPECT_GE(this->failEachCode("end two", begunUpdate,
                                 [&](Model& model) { return model.endUpdateModel(refit); }),
              1);
  }
}

TEST_F(FailedModelCall, ABuild) {
  using Model = Model;
  const auto& sheet = this->sheet_;
  const TriangleMesh more = plate(9, 9);
  const auto empty = [] { return Model(); };
  const auto begun = [&] {
    Model model;
    model.beginModel();
    model.addSubModel(sheet.vertices, sheet.triangles);
    return model;
  };
  EXPECT_GE(this->failEachCode("begin", empty, [](Model& model) { return model.beginModel(9, 9); }),
            2);
  this->failEachCode(
      "begin anew", [&] { return this->makeWithMesh(); },
      [](Model& model) { return model.beginModel(9, 9); });
  EXPECT_GE(this->failEachCode("add", begun,
                               [&](Model& model) {
                                 return model.addSubModel(more.vertices,
                                                          more.triangles);  // FCL grows both
                               }),
            2);
  EXPECT_GE(this->failEachCode("end", begun, [](Model& model) { return model.endModel(); }), 10);
  const auto none = [] { return std::unique_ptr<Model>(); };
  const auto stateOf = [&](const std::unique_ptr<Model>& model) {
    return model ? this->stateOf(*model) : std::string("none");
  };
  const Model built = this->makeWithMesh();
  EXPECT_GT(failEachAllocation(
                "copy", none, [&](auto& copy) { copy = std::make_unique<Model>(built); }, stateOf),
            8);
  Plain plain;
  fillModel(sheet, plain);
  EXPECT_GT(failEachAllocation(
                "of a plain model", none,
                [&](auto& copy) { copy = std::make_unique<Model>(plain); }, stateOf),
            8);
  // A move by assignment allocates nothing.
  Model from = this->makeWithMesh(), to = this->make();
  const std::string state = this->stateOf(from);
  {
    const FailingAllocation failing(1);
    to = std::move(from);
  }
  EXPECT_EQ(state, this->stateOf(to));
  EXPECT_EQ(fcl::BVH_OK, fillModel(sheet, from));
  EXPECT_TRUE(from.validate());
}

TEST_F(FailedModelCall, AnUpdateOnTwoThreads) {
  using Model = Model;
  Model large;
  fillModel(plate(180, 140), large);
  large.setThreads(2);
  const auto to = this->moved(
      std::vector<fcl::Vector3d>(large.vertices, large.vertices + large.num_vertices), 2);
  const auto make = [&] { return Model(large); };
  EXPECT_GE(this->failEach("all", make, [&](Model& model) { model.update(to); }), 2);
}

}  // namespace failed_model_test
}  // namespace adaptive_bvh_test
