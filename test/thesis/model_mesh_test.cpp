// AdaptiveBVHModel::mesh: a DeformableMesh of the model's triangles that follows every update,
// build and repair, and is copied and moved with the model.
#include <gtest/gtest.h>

#include <utility>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/fcl_float.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace model_mesh_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

template <typename BV>
class ModelMesh : public testing::Test {
 protected:
  using S = typename BV::S;
  using Model = AdaptiveBVHModel<BV>;
  using Points = std::vector<fcl::Vector3<S>>;

  ModelMesh() { fillModel(mesh_, model_); }

  /// Positions that differ from one call to the next.
  Points next() { return pointsIn<S>(deformation_.next()); }

  static void expectFollowed(const Model& model) {
    const DeformableMesh& mesh = model.mesh();
    const auto count = std::size_t(model.num_vertices);
    EXPECT_EQ(Points(model.vertices, model.vertices + count), pointsIn<S>(mesh.vertices()));
    const Points before =
        model.prev_vertices ? Points(model.prev_vertices, model.prev_vertices + count) : Points();
    EXPECT_EQ(before, pointsIn<S>(mesh.previousVertices()));
    ASSERT_EQ(std::size_t(model.num_tris), mesh.triangles().size());
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t)
      for (int k = 0; k < 3; ++k) EXPECT_EQ(model.tri_indices[t][k], mesh.triangles()[t][k]);
    std::string reason;
    EXPECT_TRUE(mesh.validate(&reason)) << reason;
    EXPECT_TRUE(model.validate(&reason)) << reason;
  }

  TriangleMesh mesh_ = plate(7, 5);
  Deformation deformation_{mesh_, Deformation::Kind::Smooth, 5};
  Model model_;
};

using Volumes = testing::Types<fcl::RSSf, fcl::RSSd, fcl::OBBRSSd>;
TYPED_TEST_SUITE(ModelMesh, Volumes);

/// A model whose mesh() was never called has no cost for it.
TYPED_TEST(ModelMesh, IsMadeByTheFirstCall) {
  const auto& constant = this->model_;
  const std::size_t before = this->model_.trackingBytes();
  EXPECT_FALSE(constant.hasMesh());
  EXPECT_THROW(std::as_const(constant).mesh(), std::logic_error);
  this->model_.update(this->next());
  EXPECT_FALSE(constant.hasMesh());
  const auto* mesh = &this->model_.mesh();
  EXPECT_TRUE(constant.hasMesh());
  EXPECT_EQ(mesh, &this->model_.mesh());
  EXPECT_EQ(mesh, &std::as_const(constant).mesh());
  EXPECT_GE(this->model_.trackingBytes(), before + mesh->bytes() - sizeof(*mesh));
  this->expectFollowed(this->model_);
}

TYPED_TEST(ModelMesh, FollowsStepsOfEveryKind) {
  const auto* mesh = &this->model_.mesh();
  for (const RefitPolicy& policy : {RefitPolicy(), RefitPolicy::thesis(FitnessCriterion::AB)}) {
    this->model_.setRefitPolicy(policy);
    this->model_.update(this->next());
    this->expectFollowed(this->model_);

    const auto to = this->next();
    this->model_.update(std::vector<unsigned>{3, 7, 3}, {to[7], to[7], to[3]});
    EXPECT_EQ(to[3].template cast<double>(), mesh->vertices()[3]);
    this->expectFollowed(this->model_);

    ASSERT_EQ(fcl::BVH_OK, this->model_.beginReplaceModel());
    this->model_.replaceSubModel(this->next());
    ASSERT_EQ(fcl::BVH_OK, this->model_.endReplaceModel());
    this->expectFollowed(this->model_);

    for (int frame = 0; frame < 2; ++frame) {
      ASSERT_EQ(fcl::BVH_OK, this->model_.beginUpdateModel());
      this->model_.updateSubModel(this->next());
      ASSERT_EQ(fcl::BVH_OK, this->model_.endUpdateModel());
      EXPECT_FALSE(mesh->previousVertices().empty());
      this->expectFollowed(this->model_);
    }
    // From the model's own arrays: back to the frame before, of some vertices and of all.
    this->model_.update(std::vector<unsigned>{0}, {this->model_.prev_vertices[0]});
    this->expectFollowed(this->model_);
    this->model_.beginUpdateModel();
    this->model_.updateSubModel(this->next());
    ASSERT_EQ(fcl::BVH_OK, this->model_.endUpdateModel());
    this->model_.update(this->model_.prev_vertices, std::size_t(this->model_.num_vertices));
    this->expectFollowed(this->model_);
  }
  EXPECT_EQ(mesh, &this->model_.mesh()) << "its address stays";
}

/// A refused step leaves model and mesh on their positions.
TYPED_TEST(ModelMesh, StaysWhereAStepIsRefused) {
  using S = typename TypeParam::S;
  this->model_.mesh();
  auto wrong = this->next();
  wrong[5][1] = std::numeric_limits<S>::quiet_NaN();
  EXPECT_THROW(this->model_.update(wrong), std::invalid_argument);
  EXPECT_THROW(this->model_.update(std::vector<unsigned>{5}, {wrong[5]}), std::invalid_argument);
  this->expectFollowed(this->model_);
}

/// A step that is too large for the model to follow, and a tree that was changed through the base:
/// the next step, or the next call of mesh, brings the mesh up to date.
TYPED_TEST(ModelMesh, FollowsRepairs) {
  using S = typename TypeParam::S;
  const auto* mesh = &this->model_.mesh();
  auto far = this->next();
  for (auto& p : far) p *= S(1e7);
  far[0] = fcl::Vector3<S>::Zero();
  this->model_.update(far);
  this->expectFollowed(this->model_);
  this->model_.update(this->next());
  this->expectFollowed(this->model_);

  const auto change = [&] {
    fcl::BVHModel<TypeParam>& base = this->model_;
    base.beginReplaceModel();
    base.replaceSubModel(this->next());
    base.endReplaceModel();
  };
  change();
  EXPECT_NE(fcl::BV_UNKNOWN, this->model_.getNodeType()) << "repairs the tree";
  this->model_.mesh();
  this->expectFollowed(this->model_);
  change();
  this->model_.update(this->next());
  this->expectFollowed(this->model_);
  EXPECT_EQ(mesh, &this->model_.mesh());
}

TYPED_TEST(ModelMesh, IsRenewedByABuild) {
  const auto* mesh = &this->model_.mesh();
  this->model_.beginReplaceModel();
  this->model_.replaceSubModel(this->next());
  ASSERT_EQ(fcl::BVH_OK, this->model_.endReplaceModel(false));
  this->expectFollowed(this->model_);
  testing::internal::CaptureStderr();  // FCL remarks on a model that is built twice
  ASSERT_EQ(fcl::BVH_OK, fillModel(tube(5, 6), this->model_));
  testing::internal::GetCapturedStderr();
  this->expectFollowed(this->model_);
  EXPECT_EQ(mesh, &this->model_.mesh());
}

/// Copies, by mutating one side and looking at the other; moves take the mesh along.
TYPED_TEST(ModelMesh, IsCopiedAndMovedWithTheModel) {
  using Model = typename TestFixture::Model;
  this->model_.mesh();
  this->model_.update(this->next());
  Model copy(this->model_);
  ASSERT_TRUE(copy.hasMesh());
  EXPECT_NE(&this->model_.mesh(), &copy.mesh());
  const auto before = copy.mesh().vertices();
  this->model_.update(this->next());
  EXPECT_EQ(before, copy.mesh().vertices());
  this->expectFollowed(copy);
  copy.update(this->next());
  this->expectFollowed(copy);
  this->expectFollowed(this->model_);

  const auto* mesh = &copy.mesh();
  Model moved(std::move(copy));
  EXPECT_EQ(mesh, &moved.mesh());
  EXPECT_FALSE(copy.hasMesh());
  moved.update(this->next());
  this->expectFollowed(moved);
  moved = Model();
  EXPECT_FALSE(moved.hasMesh());
  EXPECT_THROW(moved.mesh(), std::logic_error);
}

TYPED_TEST(ModelMesh, NeedsTriangles) {
  typename TestFixture::Model model;
  EXPECT_THROW(model.mesh(), std::logic_error) << "not built";
  model.beginModel();
  model.addSubModel(this->next());
  ASSERT_EQ(fcl::BVH_OK, model.endModel());
  EXPECT_THROW(model.mesh(), std::logic_error) << "a point cloud";
  EXPECT_FALSE(model.hasMesh());
}

}  // namespace model_mesh_test
}  // namespace adaptive_bvh_test
