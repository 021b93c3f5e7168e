// The refits from vertex states (BodyFit): every volume holds every vertex of its triangles, in
// numbers that are finer than the model's; what is computed in single precision is covered by the
// error terms of docs/bounds.md, 11.
#include "thesis/body_fit.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "thesis/translation_propagation.h"

namespace adaptive_bvh_test {
namespace body_fit_test {

using adaptive_bvh::AdaptiveTree;
using adaptive_bvh::RefitPolicy;
using adaptive_bvh::StepInput;
using adaptive_bvh::StepKind;
using adaptive_bvh::TranslationPropagation;
using adaptive_bvh::UpdateTarget;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
S& radiusOf(fcl::RSS<S>& bv) {
  return bv.r;
}
template <typename S>
S& radiusOf(fcl::OBBRSS<S>& bv) {
  return bv.rss.r;
}
template <typename S>
void shrink(fcl::RSS<S>& bv, S by) {
  bv.r -= by;
}
template <typename S>
void shrink(fcl::OBBRSS<S>& bv, S by) {
  bv.rss.r -= by;
  bv.obb.extent.array() -= by;
}

/// A mesh in FCL's tree, with all that a refit reads.
template <typename BV>
class Body {
 public:
  using S = typename BV::S;
  using P = fcl::Vector3<S>;

  explicit Body(const TriangleMesh& mesh) : Body(mesh, nullptr) {}
  /// About the origin, in units of 1.
  static Body inItsOwnCoordinates(const TriangleMesh& mesh) {
    BV root;
    fcl::RSS<S> unit;
    unit.axis.setIdentity();
    unit.To.setZero();
    unit.To[0] = -1;
    unit.l[0] = 2;
    unit.l[1] = unit.r = 0;
    setSwept(root, unit);
    return Body(mesh, &root);
  }

  UpdateTarget<BV> target() { return {*model_, *tree_}; }
  int nodes() const { return model_->getNumBVs(); }
  BV volume(int node) const { return model_->getBV(node).bv; }
  const fcl::BVHModel<BV>& model() const { return *model_; }
  /// The largest coordinate, in the model's numbers.
  Real extent() const {
    Real largest = 0;
    for (int v = 0; v < model_->num_vertices; ++v)
      largest = std::max(largest, exact::of(model_->vertices[v]).cwiseAbs().maxCoeff());
    return largest;
  }

  /// As a step of the library does, but for the volumes.
  void move(const std::vector<P>& positions, StepKind kind = StepKind::Replace) {
    const StepInput<S> input{kind, positions.data(), positions.size(), nullptr};
    method_->begin(target(), input);
    const auto seen = method_->read(target(), input, 0, method_->readSize(target()));
    ASSERT_TRUE(method_->canFollow(seen.largestDisplacement()));
    method_->accept(target(), seen);
    delete[] model_->prev_vertices;
    model_->prev_vertices = nullptr;
    if (kind == StepKind::TwoFrames) {
      model_->prev_vertices = new P[positions.size()];
      std::copy_n(model_->vertices, positions.size(), model_->prev_vertices);
    }
    std::copy(positions.begin(), positions.end(), model_->vertices);
    tree_->positions = positions;
    adaptive_bvh::TaskPool alone(1);
    method_->propagate(target(), RefitPolicy(), alone);
    ASSERT_TRUE(method_->isInRange());
  }

  /// Calls visit(volume, node) for the refit of every node.
  template <typename Visit>
  void forEachFit(double axes_tolerance, Visit&& visit) {
    RefitPolicy policy;
    policy.axes_tolerance = axes_tolerance;
    auto fit = method_->fit(target(), policy);
    for (int i = 0; i < nodes(); ++i) fit.add(i);
    fit.finish();
    for (int i = 0; i < nodes(); ++i) {
      BV together = volume(i);
      fit.add(i);
      const S corner_sum = fit.finish();
      BV& alone = model_->getBV(i).bv;
      ASSERT_GE(corner_sum, adaptive_bvh::Volume<BV>::cornerSum(alone));
      if (model_->getBV(i).isLeaf()) expectSame(alone, together);  // no axes are kept
      visit(together, i);
      visit(alone, i);
    }
  }

  /// Expects the same volumes from four lanes as from as many as this processor has.
  void expectSameInAnyLanes() {
    RefitPolicy policy;
    policy.axes_tolerance = 1e30;
    using FourLanes = adaptive_bvh::FitKernels<adaptive_bvh::Float4>;
    const auto volumes = [&](const adaptive_bvh::FitFunctions& functions) {
      auto fit = method_->fit(target(), policy, functions);
      for (int i = 0; i < nodes(); ++i) fit.add(i);
      fit.finish();
      std::vector<BV> all;
      for (int i = 0; i < nodes(); ++i) all.push_back(volume(i));
      return all;
    };
    volumes(FourLanes::kFunctions);  // where there was no surface, axes are chosen now
    auto four = volumes(FourLanes::kFunctions), most = volumes(adaptive_bvh::fitFunctions());
    for (std::size_t i = 0; i < four.size(); ++i) expectSame(four[i], most[i]);
  }

  /// The largest excess of a vertex of the node's triangles over a volume; negative inside.
  Real excess(const BV& bv, int node) const {
    const auto& fcl_node = model_->getBV(node);
    const auto& slots = tree_->topology.slots;
    Real worst = std::numeric_limits<Real>::lowest();
    for (int leaf = 0; leaf < fcl_node.num_primitives; ++leaf)
      for (const unsigned v : slots.verticesOf(std::size_t(fcl_node.first_primitive + leaf))) {
        worst = std::max(worst, exact::excess(bv, exact::of(model_->vertices[v])));
        if (model_->prev_vertices)
          worst = std::max(worst, exact::excess(bv, exact::of(model_->prev_vertices[v])));
      }
    return worst;
  }

 private:
  static void expectSame(BV& a, BV& b) {
    using Volume = adaptive_bvh::Volume<BV>;
    for (int k = 0; k < Volume::kNumbers; ++k)
      ASSERT_EQ(Volume::number(a, k), Volume::number(b, k));
  }

  Body(const TriangleMesh& mesh, const BV* root) {
    fillModel(mesh, *model_);
    model_->computeLocalAABB();
    tree_->assign(*model_);
    method_->reset(target());
    method_->start(target(), root ? *root : model_->getBV(0).bv);
  }
  static void setSwept(fcl::RSS<S>& bv, const fcl::RSS<S>& swept) { bv = swept; }
  static void setSwept(fcl::OBBRSS<S>& bv, const fcl::RSS<S>& swept) {
    bv.rss = swept;
    bv.obb = fcl::OBB<S>(swept.axis, swept.To, P::Ones());
  }

  std::unique_ptr<fcl::BVHModel<BV>> model_ = std::make_unique<fcl::BVHModel<BV>>();
  std::unique_ptr<AdaptiveTree<BV>> tree_ = std::make_unique<AdaptiveTree<BV>>();
  std::unique_ptr<TranslationPropagation<BV>> method_ =
      std::make_unique<TranslationPropagation<BV>>();
};

constexpr int kKinds = 11;

template <typename BV>
class BodyFits : public testing::Test {
 protected:
  using S = typename BV::S;
  using P = fcl::Vector3<S>;

  /// A mesh of about the size 1.
  TriangleMesh mesh(int kind) {
    std::mt19937& engine = random_.engine();
    switch (kind) {
      case 0: return soup(1 + random_.below(12), engine);
      case 1: return plate(1 + random_.below(3), 1 + random_.below(3));
      case 2: return tube(5, 2 + random_.below(4));
      case 3: return dome(6, 2 + random_.below(3));
      case 4: return strewn(plate(2, 1), 3, S(1e-5));  // tiny triangles of a large body
      case 5:
        return triangles(12, [this](P& p, P& q, P& r) {  // needles
          r = p + (q - p) * S(0.3) + random_.point() * random_.size(-9, -2);
        });
      case 6: return triangles(8, [](P& p, P& q, P& r) { r = p + (q - p) * S(0.25); });
      case 7:
        return triangles(8, [this](P& p, P& q, P& r) {  // corners that are equal
          r = q;
          if (random_.oneIn(2)) q = r = p;
        });
      case 8: return triangles(8, [](P& p, P& q, P& r) { p[2] = q[2] = r[2] = S(0.5); });
      case 9: return soup(70, engine);  // several blocks of vertices
      default: {                        // triangles that name a vertex twice
        TriangleMesh mesh = plate(1 + random_.below(2), 1);
        for (fcl::Triangle& t : mesh.triangles)
          if (random_.oneIn(2)) t[random_.below(3)] = t[random_.below(3)];
        return mesh;
      }
    }
  }

  template <typename Shape>
  TriangleMesh triangles(int count, Shape&& shape) {
    TriangleMesh mesh;
    for (int t = 0; t < count; ++t) {
      P p = random_.point(), q = random_.point(), r = random_.point();
      shape(p, q, r);
      for (const P& x : {p, q, r}) mesh.vertices.push_back(x.template cast<double>());
      mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    return mesh;
  }
  TriangleMesh strewn(const TriangleMesh& part, int count, S size) {
    TriangleMesh mesh;
    for (int i = 0; i < count; ++i) {
      const std::size_t first = mesh.vertices.size();
      const P place = random_.point();
      const fcl::Matrix3<S> turn = random_.rotation();
      for (const P& p : pointsIn<S>(part.vertices)) {
        const P placed = place + turn * p * size;
        mesh.vertices.push_back(placed.template cast<double>());
      }
      for (const fcl::Triangle& t : part.triangles)
        mesh.triangles.emplace_back(first + t[0], first + t[1], first + t[2]);
    }
    return mesh;
  }

  static void place(TriangleMesh& mesh, S scale, const P& offset) {
    for (fcl::Vector3d& p : mesh.vertices) {
      const P placed = p.cast<S>() * scale + offset;
      p = placed.template cast<double>();
    }
  }
  P middle(const std::vector<P>& points) const {
    P sum = P::Zero();
    for (const P& p : points) sum += p / S(points.size());
    return sum;
  }

  /// Turned, strained and rippled about the middle.
  void deform(std::vector<P>& points, S size, S much) {
    const P about = middle(points);
    fcl::Matrix3<S> map = random_.rotation();
    for (int k = 0; k < 3; ++k) map.col(k) += random_.point() * much;
    for (P& p : points) p = about + map * (p - about) + random_.point() * (size * much / 10);
  }

  void expectHeld(Body<BV>& body, double axes_tolerance, const char* when, int kind) {
    body.forEachFit(axes_tolerance, [&](const BV& bv, int node) {
      const Real excess = body.excess(bv, node);
      ASSERT_LE(excess, 0) << when << ", kind " << kind << ", "
                           << body.model().getBV(node).num_primitives << " triangles";
      ++volumes_;
    });
  }

  RandomGeometryOf<S> random_{61};
  int volumes_ = 0;
};

using Volumes =
    testing::Types<fcl::RSS<float>, fcl::RSS<double>, fcl::OBBRSS<float>, fcl::OBBRSS<double>>;
TYPED_TEST_SUITE(BodyFits, Volumes);

/// Of any size, anywhere, also many steps after the axes were chosen, and of both frames of a
/// two-frame update.
TYPED_TEST(BodyFits, HoldEveryVertexOfTheirTriangles) {
  using S = typename TypeParam::S;
  auto& random = this->random_;
  for (int round = 0; round < manySteps(12); ++round)
    for (int kind = 0; kind < kKinds; ++kind) {
      TriangleMesh mesh = this->mesh(kind);
      const S scale = random.size(-3, 6);
      const S offset = random.oneIn(3) ? S(0) : scale * random.size(-1, sizeof(S) == 4 ? 3 : 8);
      this->place(mesh, scale, random.point() * offset);
      Body<TypeParam> body(mesh);
      this->expectHeld(body, 0.25, "at first", kind);
      auto points = pointsIn<S>(mesh.vertices);
      const S much = random.oneIn(2) ? S(0.02) : S(0.5);
      for (int step = 0; step < 12; ++step) {
        this->deform(points, scale, step % 4 == 3 ? S(0) : much);
        const bool two_frames = step % 5 == 4;
        body.move(points, two_frames ? StepKind::TwoFrames : StepKind::Replace);
        // Without limit, the first axes are kept over all steps; with 0, chosen in each.
        const double tolerance = round % 3 == 0 ? 0 : round % 3 == 1 ? 0.25 : 1e30;
        if (step % 3 == 1 || two_frames)
          this->expectHeld(body, tolerance, two_frames ? "two frames" : "later", kind);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  EXPECT_GT(this->volumes_, 5000);
}

/// Of any number of lanes: nothing is fused, and each lane does what it would do alone.
TYPED_TEST(BodyFits, AreTheSameInAnyNumberOfLanes) {
  for (int round = 0; round < 4; ++round)
    for (int kind = 0; kind < kKinds; ++kind) {
      TriangleMesh mesh = this->mesh(kind);
      Body<TypeParam> body(mesh);
      body.expectSameInAnyLanes();
      auto points = pointsIn<typename TypeParam::S>(mesh.vertices);
      this->deform(points, 1, typename TypeParam::S(0.3));
      body.move(points, round == 3 ? StepKind::TwoFrames : StepKind::Replace);
      body.expectSameInAnyLanes();
      if (testing::Test::HasFatalFailure()) return;
    }
}

/// Where positions are exact in body coordinates, all that is left are the operations of the fit in
/// single precision: their own term covers these, and they need no other.
TYPED_TEST(BodyFits, CoverTheirOperationsBesideTheErrorOfPositions) {
  using S = typename TypeParam::S;
  if (sizeof(S) == 4) return;  // which rounds as much itself
  auto& random = this->random_;
  Real worst = 0;
  for (int round = 0; round < manySteps(60); ++round)
    for (int kind = 0; kind < kKinds; ++kind) {
      TriangleMesh mesh = this->mesh(kind);
      if (kind == 4) continue;
      for (auto& p : mesh.vertices)
        for (int k = 0; k < 3; ++k) p[k] = std::round(std::ldexp(p[k], 20)) * std::ldexp(S(1), -20);
      auto body = Body<TypeParam>::inItsOwnCoordinates(mesh);
      const auto of_positions = S(body.extent() / (1 << 20));
      body.forEachFit(random.oneIn(2) ? 0 : 0.25, [&](TypeParam bv, int node) {
        shrink(bv, of_positions);
        const Real excess = body.excess(bv, node);
        ASSERT_LE(excess, 0) << kind << ", " << body.model().getBV(node).num_primitives;
        worst = std::max(worst, excess);
      });
    }
}

}  // namespace body_fit_test
}  // namespace adaptive_bvh_test
