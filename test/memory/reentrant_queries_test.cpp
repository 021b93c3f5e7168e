// Questions from within a callback: a filter of a scene, or a test of pairs to ignore, may run any
// query, which may call it again, and it may throw. Each answer is that of a call from outside.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>

#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/self_collision.h"
#include "adaptive_bvh/trust_region.h"
#include "support/closed_bodies.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/shapes.h"

namespace adaptive_bvh_test {
namespace reentrant_queries_test {

using namespace adaptive_bvh;

/// Numbers that differ if answers differ.
using Answer = std::vector<double>;

void add(const fcl::Vector3d& x, Answer& to) {
  for (int k = 0; k < 3; ++k) to.push_back(double(x[k]));
}
void add(const std::vector<FeaturePair>& pairs, Answer& to) {
  to.push_back(double(pairs.size()));
  for (const FeaturePair& p : pairs) to.insert(to.end(), {double(p.first), double(p.second)});
}
void add(const FeaturePairs& pairs, Answer& to) {
  add(pairs.vertex_face, to);
  add(pairs.face_vertex, to);
  add(pairs.edge_edge, to);
}
void add(const std::vector<BodyPair>& pairs, Answer& to) {
  to.push_back(double(pairs.size()));
  for (const BodyPair& p : pairs) to.insert(to.end(), {double(p.first), double(p.second)});
}
void add(const Impact& impact, Answer& to) {
  to.insert(to.end(), {impact.exists() ? impact.time : 2, double(impact.pair.first),
                       double(impact.pair.second)});
}
void add(const fcl::CollisionResultd& result, Answer& to) {
  to.push_back(double(result.numContacts()));
  for (std::size_t i = 0; i < result.numContacts(); ++i) {
    const fcl::Contactd& c = result.getContact(i);
    to.insert(to.end(), {double(c.b1), double(c.b2), double(c.penetration_depth)});
  }
}
void add(const SceneDistance& nearest, Answer& to) {
  to.insert(to.end(), {double(nearest.bodies.first), double(nearest.bodies.second),
                       double(nearest.distance)});
}

/// Bodies of different sizes that touch each other, and questions about them. Those with a callback
/// call `interrupt`.
class Questions {
 public:
  struct Question {
    std::string name;
    bool calls_back, is_const;
    std::function<Answer()> ask;
  };

  explicit Questions(int threads) : threads_(threads) {
    addMesh(gridBall(9, 8), fcl::Vector3d::Zero());
    addMesh(gridBall(24, 17), fcl::Vector3d(1.6, 0.1, 0.2));
    addMesh(latticeBox(6), fcl::Vector3d(-1.1, 0, 0.3), 0.2);
    shape_ = std::make_shared<fcl::Sphered>(0.7);
    fillScenes();
    fillPairs();
    fillSingles();
  }

  std::function<void()> interrupt;

  const std::vector<Question>& all() const { return questions_; }

 private:
  using Transform = fcl::Transform3d;

  void addMesh(TriangleMesh mesh, const fcl::Vector3d& at, double scale = 1) {
    for (fcl::Vector3d& p : mesh.vertices) p *= scale;
    meshes_.push_back(std::make_shared<DeformableMesh>(mesh));
    meshes_.back()->setThreads(threads_);
    std::vector<fcl::Vector3d> moved = mesh.vertices;
    for (fcl::Vector3d& p : moved) p *= 1.05;
    meshes_.back()->updateTwoFrames(moved);
    Transform tf = Transform::Identity();
    tf.translation() = at;
    tf.rotate(Eigen::AngleAxis<double>(0.3 * double(meshes_.size()),
                                       fcl::Vector3d(1, 2, 3).normalized()));
    tfs_.push_back(tf);
  }
  /// A question about a scene of its own, whose filter interrupts.
  template <typename Ask>
  void addScene(const std::string& name, bool is_const, const Ask& ask) {
    auto scene = std::make_shared<Scene>();
    BodyOptions options;
    options.self_collision = true;
    for (std::size_t i = 0; i < meshes_.size(); ++i) scene->add(meshes_[i], tfs_[i], options);
    scene->add(shape_, tfs_[1]);
    scene->setFilter([this](BodyId, BodyId) {
      interrupt();
      return true;
    });
    scene->setThreads(threads_);
    scene->beginStep();
    scene->update();
    questions_.push_back({name, true, is_const, [scene, ask] {
                            Answer answer;
                            ask(*scene, answer);
                            return answer;
                          }});
  }
  template <typename Ask>
  void add(const std::string& name, bool calls_back, const Ask& ask) {
    questions_.push_back({name, calls_back, true, [ask] {
                            Answer answer;
                            ask(answer);
                            return answer;
                          }});
  }

  void fillScenes() {
    addScene("scene: collisions", true, [](Scene& scene, Answer& to) {
      SceneCollisions found;
      scene.collide({}, found);
      reentrant_queries_test::add(found.pairs, to);
      to.push_back(double(found.contacts.size()));
    });
    addScene("scene: pairs within", true, [](Scene& scene, Answer& to) {
      SceneTrianglePairs found;
      scene.pairsWithin({0.05}, found);
      reentrant_queries_test::add(found.found.triangles, to);
    });
    addScene("scene: feature pairs within", true, [](Scene& scene, Answer& to) {
      SceneFeaturePairs found;
      scene.featurePairsWithin(0.02, found);
      reentrant_queries_test::add(found.found, to);
    });
    addScene("scene: vertex contacts", true, [](Scene& scene, Answer& to) {
      SceneVertexContacts found;
      scene.vertexContacts(0.02, found);
      to.assign(found.found.vertices.begin(), found.found.vertices.end());
    });
    addScene("scene: nearer", true,
             [](Scene& scene, Answer& to) { to.push_back(scene.isNearer(0.01)); });
    addScene("scene: distance", false,
             [](Scene& scene, Answer& to) { reentrant_queries_test::add(scene.distance(), to); });
    addScene("scene: nearest", false, [](Scene& scene, Answer& to) {
      reentrant_queries_test::add(scene.nearest(scene.bodies()[1]), to);
    });
    addScene("scene: three nearest", true, [](Scene& scene, Answer& to) {
      std::vector<SceneDistance> found;
      scene.nearest(scene.bodies()[0], 3, found);
      for (const auto& one : found) reentrant_queries_test::add(one, to);
    });
    addScene("scene: earliest impact", true, [](Scene& scene, Answer& to) {
      reentrant_queries_test::add(scene.earliestImpact().impact, to);
    });
  }

  Ignored ignored() {
    Ignored pairs = {NeighbourFilter::None};
    pairs.triangles.test = [this](unsigned first, unsigned second) {
      interrupt();
      return (first + second) % 7 == 0;
    };
    pairs.vertex_face = pairs.face_vertex = pairs.edge_edge = pairs.triangles;
    return pairs;
  }
  void fillPairs() {
    add("pairs within", true, [this](Answer& to) {
      TrianglePairs found;
      ProximityRequest request{0.1};
      request.ignored = ignored();
      adaptive_bvh::pairsWithin(*meshes_[0], tfs_[0], *meshes_[1], tfs_[1], request, found);
      reentrant_queries_test::add(found.triangles, to);
    });
    add("pairs within one", true, [this](Answer& to) {
      TrianglePairs found;
      ProximityRequest request{0.02};
      request.ignored = ignored();
      adaptive_bvh::selfPairsWithin(*meshes_[2], request, found);
      reentrant_queries_test::add(found.triangles, to);
    });
    add("self-collision", true, [this](Answer& to) {
      fcl::CollisionResultd result;
      adaptive_bvh::selfCollide(*meshes_[0], ignored(), fcl::CollisionRequestd(1000, true), result);
      reentrant_queries_test::add(result, to);
    });
    add("feature pairs within", true, [this](Answer& to) {
      FeaturePairs found;
      FeatureProximityRequest request{0.05};
      request.ignored = ignored();
      adaptive_bvh::featurePairsWithin(*meshes_[1], tfs_[1], *meshes_[0], tfs_[0], request, found);
      reentrant_queries_test::add(found, to);
    });
    add("feature pairs within one", true, [this](Answer& to) {
      FeaturePairs found;
      FeatureProximityRequest request{0.15};
      request.ignored = ignored();
      adaptive_bvh::selfFeaturePairsWithin(*meshes_[2], request, found);
      reentrant_queries_test::add(found, to);
    });
  }

  /// Without a callback: they only interrupt others.
  void fillSingles() {
    add("distance", false, [this](Answer& to) {
      fcl::DistanceResultd result;
      to.push_back(double(adaptive_bvh::distance(meshes_[2].get(), tfs_[2], meshes_[1].get(),
                                                 tfs_[1], fcl::DistanceRequestd(), result)));
    });
    add("collide", false, [this](Answer& to) {
      fcl::CollisionResultd result;
      adaptive_bvh::collide(meshes_[0].get(), tfs_[0], meshes_[1].get(), tfs_[1],
                            fcl::CollisionRequestd(1000, true), result);
      reentrant_queries_test::add(result, to);
    });
    add("nearer", false, [this](Answer& to) {
      to.push_back(adaptive_bvh::isNearer(*meshes_[2], tfs_[2], *meshes_[1], tfs_[1], 0.2));
    });
    add("signed distance", false, [this](Answer& to) {
      const SignedDistance found =
          adaptive_bvh::signedDistance(*meshes_[0], tfs_[0], *meshes_[1], tfs_[1], 0.05);
      to = {double(found.lower), double(found.upper)};
    });
    add("contact regions", false, [this](Answer& to) {
      ContactRegions found;
      to.push_back(
          double(adaptive_bvh::contactRegions(*meshes_[0], tfs_[0], *meshes_[1], tfs_[1], found)));
      for (const auto volume : found.volumes) to.push_back(double(volume));
    });
    add("vertex contacts", false, [this](Answer& to) {
      VertexContacts found;
      adaptive_bvh::vertexContacts(*meshes_[1], tfs_[1], *meshes_[0], tfs_[0], 0.05, found);
      to.assign(found.vertices.begin(), found.vertices.end());
      DistanceDerivatives derivatives;
      adaptive_bvh::distanceDerivatives(*meshes_[1], tfs_[1], *meshes_[0], tfs_[0], found,
                                        derivatives);
      for (const auto& x : derivatives.second.gradients) reentrant_queries_test::add(x, to);
    });
    add("candidates", false, [this](Answer& to) {
      FeaturePairs found;
      adaptive_bvh::candidates(motion(0), motion(1), 0, found);
      reentrant_queries_test::add(found, to);
    });
    add("earliest impact", false, [this](Answer& to) {
      reentrant_queries_test::add(adaptive_bvh::earliestImpact(motion(2), motion(1)), to);
    });
    add("shares of ways", false, [this](Answer& to) {
      std::vector<double> of_second;
      adaptive_bvh::truncateMotion(motion(2), motion(1), 0, to, of_second);
    });
    add("trust region", false, [this](Answer& to) {
      adaptive_bvh::TrustRegionRequest request;
      request.radius = 0.2;
      adaptive_bvh::TrustRegion region(*meshes_[2], request);
      region.addObstacle(*meshes_[1], tfs_[1]);
      auto accepted = meshes_[2]->vertices();
      region.begin(accepted);
      for (auto& x : accepted) x *= 0.9;
      to.push_back(double(region.truncate(accepted, accepted).held_back));
      for (const auto& x : accepted) to.push_back(double(x[0]));
    });
    add("winding numbers", false, [this](Answer& to) {
      std::vector<double> found;
      const std::vector<fcl::Vector3d> points(64, fcl::Vector3d(0.2, 0.1, 0.3));
      adaptive_bvh::windingNumbers(*meshes_[1], points.data(), points.size(), found);
      to.assign(found.begin(), found.end());
    });
    add("build", false, [](Answer& to) {
      const DeformableMesh mesh(gridBall(7, 5));
      to.push_back(mesh.validate());
    });
  }
  Motion motion(std::size_t i) const { return Motion(*meshes_[i], tfs_[i], tfs_[i]); }

  const int threads_;
  std::vector<std::shared_ptr<DeformableMesh>> meshes_;
  std::vector<Transform> tfs_;
  std::shared_ptr<fcl::Sphered> shape_;
  std::vector<Question> questions_;
};

class ReentrantQueries : public testing::Test {
 protected:
  static constexpr int kDepth = 3;

  static void ignoreCallback() {}

  /// Asks each question with a callback, which asks `nested` others in all, to a depth of three.
  void judge(int threads, long nested) {
    Questions questions(threads);
    questions.interrupt = ignoreCallback;
    std::vector<Answer> expected;
    for (const auto& question : questions.all()) expected.push_back(question.ask());
    std::atomic<unsigned> next{firstQuestion()};
    std::atomic<long> asked{0}, wrong{0}, callbacks{0};
    std::atomic<int> depth{0};  // of all threads together
    const auto ask = [&](std::size_t i) {
      if (questions.all()[i].ask() == expected[i]) return true;
      ++wrong;
      ADD_FAILURE() << questions.all()[i].name << " at depth " << depth;
      return false;
    };
    questions.interrupt = [&] {
      if (depth >= kDepth || asked >= nested || ++callbacks % 13 != 1) return;
      std::size_t i;
      do i = next++ * 7 % questions.all().size();
      while (threads > 1 && !questions.all()[i].is_const);
      ++depth;
      ask(i);
      --depth;
      ++asked;
    };
    for (long round = 0; asked < nested && wrong == 0; ++round) {
      ASSERT_LT(round, 1000);
      for (std::size_t i = 0; i < questions.all().size(); ++i)
        if (questions.all()[i].calls_back && asked < nested) ask(i);
    }
    EXPECT_EQ(0, wrong);
    RecordProperty("nested", std::to_string(asked));
  }
  static unsigned firstQuestion() { return std::mt19937(testSeed(5201))() % 1000; }
};

TEST_F(ReentrantQueries, AnswerAsFromOutside) { this->judge(1, manySteps(2500)); }
TEST_F(ReentrantQueries, AnswerAsFromOutsideOnTwoThreads) { this->judge(2, manySteps(2500)); }

TEST_F(ReentrantQueries, MayBeEndedByAnException) {
  for (const int threads : {1, 2}) {
    Questions questions(threads);
    questions.interrupt = this->ignoreCallback;
    for (const auto& question : questions.all()) {
      const Answer expected = question.ask();
      for (const long at : {1, 2, 40}) {
        std::atomic<long> calls{0};
        questions.interrupt = [&] {
          if (++calls == at) throw std::runtime_error("no more");
        };
        bool has_thrown = false;
        try {
          question.ask();
        } catch (const std::runtime_error& error) {
          has_thrown = std::string("no more") == error.what();
        }
        EXPECT_EQ(calls >= at, has_thrown) << question.name;
        questions.interrupt = this->ignoreCallback;
        EXPECT_EQ(expected, question.ask()) << question.name;
      }
    }
  }
}

/// The example of a scene: three tetrahedra that touch each other.
TEST(ReentrantScene, FindsAllPairsWhenAFilterAsksAnotherScene) {
  const TriangleMesh shape{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                           {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const DeformableMesh mesh(shape);
  Scene scene, other;
  other.update();
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    tf.translation().x() = 0.1 * i;
    scene.add(mesh, tf);
  }
  scene.setFilter([&](BodyId, BodyId) {
    SceneCollisions none;
    other.collide({}, none);
    return true;
  });
  scene.update();
  SceneCollisions found;
  EXPECT_EQ(3u, scene.collide({}, found));
}

}  // namespace reentrant_queries_test
}  // namespace adaptive_bvh_test
