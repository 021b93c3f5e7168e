// Scenes: a hose and the nearest of many rigid parts; a crowd of bodies that deform. Milliseconds a
// step, updates included, medians; all rows of a table in turns in one process. Ends with status 1
// when the rows do not agree.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "base/task_pool.h"
#include "fcl_support.h"
#include "median.h"
#include "round_grids.h"
#include "stopwatch.h"
#ifdef ADAPTIVE_BVH_HAS_EMBREE
#include "contact_judge.h"
#include "embree_scene.h"
#endif

namespace {

using adaptive_bvh::BodyId;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Scene;
using adaptive_bvh_bench::around;
using adaptive_bvh_bench::ball;
using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;
using Positions = std::vector<Point>;
using FclModel = fcl::BVHModel<fcl::OBBRSSd>;
using DropIn = adaptive_bvh::AdaptiveBVHModel<fcl::OBBRSSd>;

bool failed = false;
void require(bool holds, const char* what) {
  if (holds) return;
  std::printf("WRONG: %s\n", what);
  failed = true;
}

std::shared_ptr<FclModel> fclModel(const Mesh& mesh) {
  auto model = std::make_shared<FclModel>();
  model->beginModel();
  model->addSubModel(mesh.vertices, mesh.triangles);
  model->endModel();
  return model;
}

void print(const char* name, const std::vector<double>& times, double base) {
  const double time = median(times);
  std::printf("| %s | %.3g | %.3g |\n", name, time, base / time);
}

// ---- The hose -----------------------------------------------------------------------------------

struct FclNearest {
  fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
};
bool takeDistance(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data, double& limit) {
  auto& nearest = *static_cast<FclNearest*>(data);
  fcl::distance(a, b, nearest.request, nearest.result);
  limit = nearest.result.min_distance;
  return limit <= 0;
}

/// A hose of 20,000 triangles that swings between parts of some 1,850 triangles.
void hose(int parts, int steps) {
  const auto course = [](double v, double time) -> Point {
    return {20 * v - 10, 2 * std::sin(5 * v + time), 1.5 * std::cos(4 * v + 0.7 * time)};
  };
  const auto hoseAt = [&](double time) {
    return around(20, 500, [&](double u, double v) -> Point {
      const double angle = 2 * M_PI * u;
      return course(v, time) + 0.15 * Point(0, std::cos(angle), std::sin(angle));
    });
  };
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Mesh> bodies;
  while (int(bodies.size()) < parts) {
    const Point at(11 * any(random), 6 * any(random), 6 * any(random));
    const double radius = 0.3 + 0.1 * any(random);
    const double off = std::hypot(at[1], at[2]);
    if (off > 2.8 + radius) bodies.push_back(ball(43, 21, radius, at));
  }
  DeformableMesh mesh(hoseAt(0));
  std::vector<std::unique_ptr<DeformableMesh>> meshes;
  std::vector<adaptive_bvh::CoherentDistance> pairs;
  Scene scene;
  const BodyId id = scene.add(mesh);
  auto fcl_hose = fclModel(hoseAt(0));
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  fcl::DynamicAABBTreeCollisionManagerd manager;
  for (const Mesh& body : bodies) {
    meshes.push_back(std::make_unique<DeformableMesh>(body));
    pairs.emplace_back(mesh, *meshes.back());
    scene.add(*meshes.back());
    objects.push_back(std::make_unique<fcl::CollisionObjectd>(fclModel(body)));
    manager.registerObject(objects.back().get());
  }
  manager.setup();
  fcl::CollisionObjectd fcl_object(fcl_hose);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  std::vector<double> of_scene, of_pairs, of_fcl, of_update;
  for (int step = 1; step <= steps; ++step) {
    const Positions positions = hoseAt(0.02 * step).vertices;
    double with_scene = 0, with_pairs = 1e300;
    of_update.push_back(milliseconds([&] { mesh.update(positions); }));
    of_scene.push_back(of_update.back() + milliseconds([&] {
                         scene.update();
                         with_scene = scene.nearest(id).distance;
                       }));
    of_pairs.push_back(
        of_update.back() + milliseconds([&] {
          for (auto& pair : pairs) {
            fcl::DistanceResultd result;
            with_pairs =
                std::min(with_pairs, pair.distance(still, still, fcl::DistanceRequestd(), result));
          }
        }));
    require(std::abs(with_scene - with_pairs) < 1e-12, "the distance of the hose");
    if (step % 4) continue;  // takes long
    FclNearest nearest;
    of_fcl.push_back(milliseconds([&] {
      adaptive_bvh_bench::refitTopDown(*fcl_hose, positions);
      fcl_object.computeAABB();
      manager.distance(&fcl_object, &nearest, takeDistance);
    }));
    require(std::abs(nearest.result.min_distance - with_scene) < 1e-6, "the distance by FCL");
  }
  std::printf("\nHose of %zu triangles, nearest of %d parts, ms a step, updates included\n",
              mesh.triangles().size(), parts);
  std::printf("| | ms | times faster than FCL |\n| --- | ---: | ---: |\n");
  print("FCL's manager, OBBRSS refitted top-down", of_fcl, median(of_fcl));
  print("a CoherentDistance for each part", of_pairs, median(of_fcl));
  print("Scene::nearest", of_scene, median(of_fcl));
  print("of that, the update of the hose", of_update, median(of_fcl));
}

// ---- The crowd ----------------------------------------------------------------------------------

struct FclContacts {
  fcl::CollisionRequestd request;
  std::size_t pairs = 0, touching = 0, contacts = 0;
};
bool takeContacts(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  auto& all = *static_cast<FclContacts*>(data);
  fcl::CollisionResultd result;
  ++all.pairs;
  fcl::collide(a, b, all.request, result);
  all.touching += result.isCollision();
  all.contacts += result.numContacts();
  return false;
}

struct NearPairs {
  adaptive_bvh::ProximityRequest request;
  adaptive_bvh::TrianglePairs pairs;
  std::size_t found = 0;
};
bool takeNearPairs(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  auto& all = *static_cast<NearPairs*>(data);
  const auto meshOf = [](const fcl::CollisionObjectd* object) -> const DeformableMesh& {
    return static_cast<const DeformableMesh&>(*object->collisionGeometry());
  };
  all.found += adaptive_bvh::pairsWithin(meshOf(a), a->getTransform(), meshOf(b), b->getTransform(),
                                         all.request, all.pairs);
  return false;
}

/// FCL's managers compare boxes as they are.
void computeGrownBox(DeformableMesh& mesh, fcl::CollisionObjectd& object, double by) {
  const fcl::AABBd box = mesh.aabb_local;
  mesh.aabb_local.expand(Point::Constant(by));
  object.computeAABB();
  mesh.aabb_local = box;
}

struct Crowd {
  std::vector<Mesh> rest;
  std::vector<Point> at;

  /// Blobs of 320 triangles in a cube.
  Crowd(int count, double side) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(0, side);
    for (int i = 0; i < count; ++i) {
      at.push_back({any(random), any(random), any(random)});
      rest.push_back(ball(16, 10, 1, Point::Zero()));
    }
  }
  Positions positions(std::size_t i, double time) const {
    Positions moved = rest[i].vertices;
    const Point to =
        at[i] + 0.3 * Point(std::sin(time + double(i)), std::cos(0.9 * time + 2. * double(i)),
                            std::sin(1.1 * time + 3. * double(i)));
    for (Point& x : moved)
      x = to + x * (1 + 0.08 * std::sin(3 * x[0] + 2 * x[1] + 2 * time + double(i)));
    return moved;
  }
};

#ifdef ADAPTIVE_BVH_HAS_EMBREE
/// All bodies in one scene, each a geometry of boxes of triangles.
class EmbreeCrowd {
 public:
  EmbreeCrowd(const Crowd& crowd) : device_(rtcNewDevice("threads=1")) {
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW);
    for (const Mesh& mesh : crowd.rest) {
      bodies_.push_back(std::make_unique<Body>());
      Body& body = *bodies_.back();
      body.mesh = mesh;
      body.geometry.reset(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER));
      rtcSetGeometryUserPrimitiveCount(body.geometry.get(), unsigned(mesh.triangles.size()));
      rtcSetGeometryUserData(body.geometry.get(), &body);
      rtcSetGeometryBoundsFunction(body.geometry.get(), writeBounds, nullptr);
      rtcSetGeometryBuildQuality(body.geometry.get(), RTC_BUILD_QUALITY_REFIT);
      rtcAttachGeometry(scene_.get(), body.geometry.get());
    }
  }
  void update(const std::vector<Positions>& positions) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i]->mesh.vertices = positions[i];
      rtcCommitGeometry(bodies_[i]->geometry.get());
    }
    rtcCommitScene(scene_.get());
  }
  /// Pairs of triangles of two bodies that touch, decided by our exact test.
  std::size_t contacts() {
    found_ = 0;
    rtcCollide(scene_.get(), scene_.get(), take, this);
    return found_;
  }

 private:
  struct Body {
    Mesh mesh;
    adaptive_bvh_bench::Owned<RTCGeometry> geometry;
    Eigen::AlignedBox3d box(unsigned t) const {
      const fcl::Triangle& v = mesh.triangles[t];
      const Point &x = mesh.vertices[v[0]], &y = mesh.vertices[v[1]], &z = mesh.vertices[v[2]];
      return {x.cwiseMin(y).cwiseMin(z), x.cwiseMax(y).cwiseMax(z)};
    }
  };
  static void writeBounds(const RTCBoundsFunctionArguments* arguments) {
    using adaptive_bvh_bench::roundedDown;
    using adaptive_bvh_bench::roundedUp;
    const auto& body = *static_cast<const Body*>(arguments->geometryUserPtr);
    const Eigen::AlignedBox3d box = body.box(arguments->primID);
    const Point low = box.min(), high = box.max();
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = roundedDown(low[0]);
    bounds.lower_y = roundedDown(low[1]);
    bounds.lower_z = roundedDown(low[2]);
    bounds.upper_x = roundedUp(high[0]);
    bounds.upper_y = roundedUp(high[1]);
    bounds.upper_z = roundedUp(high[2]);
  }
  static void take(void* user, RTCCollision* collisions, unsigned count) {
    auto& self = *static_cast<EmbreeCrowd*>(user);
    for (unsigned i = 0; i < count; ++i) {
      const RTCCollision& c = collisions[i];
      if (c.geomID0 >= c.geomID1) continue;  // both orders come, and bodies with themselves
      const Body &first = *self.bodies_[c.geomID0], &second = *self.bodies_[c.geomID1];
      if (!first.box(c.primID0).intersects(second.box(c.primID1))) continue;
      self.found_ += adaptive_bvh_bench::touchByFcl(first.mesh, c.primID0, second.mesh, c.primID1);
    }
  }

  adaptive_bvh_bench::Owned<RTCDevice> device_;
  adaptive_bvh_bench::Owned<RTCScene> scene_;
  std::vector<std::unique_ptr<Body>> bodies_;
  std::size_t found_ = 0;
};
#endif

/// `with_peers`: also FCL and Embree, and near pairs.
double crowd(int count, double side, int steps, bool with_peers) {
  const Crowd bodies(count, side);
  std::vector<std::shared_ptr<DeformableMesh>> meshes;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects, mesh_objects, drop_in_objects;
  std::vector<std::shared_ptr<FclModel>> models;
  std::vector<std::shared_ptr<DropIn>> drop_ins;
  fcl::DynamicAABBTreeCollisionManagerd manager, mesh_manager, drop_in_manager;
  Scene scene;
  for (std::size_t i = 0; i < bodies.rest.size(); ++i) {
    meshes.push_back(std::make_shared<DeformableMesh>(bodies.rest[i]));
    scene.add(meshes[i]);
    if (!with_peers) continue;
    models.push_back(fclModel(bodies.rest[i]));
    objects.push_back(std::make_unique<fcl::CollisionObjectd>(models[i]));
    mesh_objects.push_back(std::make_unique<fcl::CollisionObjectd>(meshes[i]));
    manager.registerObject(objects.back().get());
    mesh_manager.registerObject(mesh_objects.back().get());
    drop_ins.push_back(std::make_shared<DropIn>());
    adaptive_bvh::fillModel(bodies.rest[i], *drop_ins.back());
    drop_in_objects.push_back(std::make_unique<fcl::CollisionObjectd>(drop_ins[i]));
    drop_in_manager.registerObject(drop_in_objects.back().get());
  }
#ifdef ADAPTIVE_BVH_HAS_EMBREE
  std::unique_ptr<EmbreeCrowd> embree;
  if (with_peers) embree = std::make_unique<EmbreeCrowd>(bodies);
#endif
  const double edge = 0.35;
  adaptive_bvh::SceneCollisions contacts;
  adaptive_bvh::SceneTrianglePairs near;
  std::vector<double> updates, all, pairs_only, threads, of_fcl, fcl_pairs, of_drop_in,
      drop_in_pairs, within, by_manager, of_embree;
  const adaptive_bvh::TaskPool two(2);
  std::size_t touching = 0, num_contacts = 0, num_near = 0;
  for (int step = 1; step <= steps; ++step) {
    std::vector<Positions> positions;
    for (std::size_t i = 0; i < meshes.size(); ++i)
      positions.push_back(bodies.positions(i, 0.05 * step));
    updates.push_back(milliseconds([&] {
      for (std::size_t i = 0; i < meshes.size(); ++i) meshes[i]->update(positions[i]);
      scene.update();
    }));
    all.push_back(updates.back() + milliseconds([&] {
                    scene.collide(adaptive_bvh::SceneCollisionRequest(), contacts);
                  }));
    touching = contacts.pairs.size();
    num_contacts = contacts.contacts.size();
    adaptive_bvh::SceneCollisionRequest few;
    few.contacts_per_pair = 0;
    pairs_only.push_back(updates.back() + milliseconds([&] { scene.collide(few, contacts); }));
    require(contacts.pairs.size() == touching, "touching pairs");
    if (!with_peers) {  // Embree limits oneTBB to its own number of threads
      // A mesh that does not move is not refitted. The second thread is awake, as in a program that
      // works on two threads in each step.
      two.forEach(int(meshes.size()), [&](int i, int) {
        meshes[std::size_t(i)]->update(bodies.positions(std::size_t(i), 0.05 * (step - 1)));
      });
      scene.setThreads(2);
      threads.push_back(milliseconds([&] {
        two.forEach(int(meshes.size()),
                    [&](int i, int) { meshes[std::size_t(i)]->update(positions[std::size_t(i)]); });
        scene.update();
        scene.collide(adaptive_bvh::SceneCollisionRequest(), contacts);
      }));
      scene.setThreads(1);
      require(contacts.contacts.size() == num_contacts, "contacts by two threads");
      continue;
    }
    NearPairs near_pairs;
    near_pairs.request.distance = edge;
    within.push_back(updates.back() +
                     milliseconds([&] { num_near = scene.pairsWithin(near_pairs.request, near); }));
    by_manager.push_back(updates.back() + milliseconds([&] {
                           for (std::size_t i = 0; i < meshes.size(); ++i)
                             computeGrownBox(*meshes[i], *mesh_objects[i], edge / 2);
                           mesh_manager.update();
                           mesh_manager.collide(&near_pairs, takeNearPairs);
                         }));
    require(near_pairs.found == num_near, "pairs of triangles that are near");
#ifdef ADAPTIVE_BVH_HAS_EMBREE
    std::size_t of_rtc = 0;
    of_embree.push_back(milliseconds([&] {
      embree->update(positions);
      of_rtc = embree->contacts();
    }));
#endif
    if (step % 4) continue;
    const auto collide = [&](const auto& refit, auto& models_of, auto& objects_of, auto& manager_of,
                             std::vector<double>& times_of_all,
                             std::vector<double>& times_of_pairs) {
      const double update = milliseconds([&] {
        for (std::size_t i = 0; i < models_of.size(); ++i) {
          refit(*models_of[i], positions[i]);
          objects_of[i]->computeAABB();
        }
        manager_of.update();
      });
      FclContacts every, only;
      every.request = fcl::CollisionRequestd(100000, true);
      only.request = fcl::CollisionRequestd(1, false);
      const auto timed = [&](FclContacts& contacts_of) -> double {
        return update + milliseconds([&] { manager_of.collide(&contacts_of, takeContacts); });
      };
      times_of_all.push_back(timed(every));
      times_of_pairs.push_back(timed(only));
      require(only.touching == touching, "pairs that touch in FCL's manager");
    };
    const auto refit = [](FclModel& model, const Positions& to) {
      adaptive_bvh_bench::refitTopDown(model, to);
    };
    const auto adapt = [](DropIn& model, const Positions& to) { model.update(to); };
    collide(refit, models, objects, manager, of_fcl, fcl_pairs);
    collide(adapt, drop_ins, drop_in_objects, drop_in_manager, of_drop_in, drop_in_pairs);
  }
  std::printf("\nCrowd of %d blobs of %zu triangles: %zu pairs touch, %zu contacts; ms a step\n",
              count, bodies.rest[0].triangles.size(), touching, num_contacts);
  std::printf("| | ms | times faster than the first |\n| --- | ---: | ---: |\n");
  const double base = median(with_peers ? of_fcl : all);
  if (with_peers) {
    print("FCL's manager, OBBRSS refitted top-down: all contacts", of_fcl, base);
    print("FCL's manager: pairs only", fcl_pairs, base);
    print("FCL's manager, drop-in: all contacts", of_drop_in, base);
    print("FCL's manager, drop-in: pairs only", drop_in_pairs, base);
  }
  print("Scene::collisions: all contacts", all, base);
  if (!with_peers) print("Scene::collisions: all contacts, two threads", threads, base);
  print("Scene::collisions: pairs only", pairs_only, base);
  print("of these, updates", updates, base);
  if (with_peers) {
#ifdef ADAPTIVE_BVH_HAS_EMBREE
    print("Embree, one scene, FCL's test in its callback", of_embree, base);
#endif
    std::printf("%zu pairs of triangles within %.2f\n", num_near, edge);
    print("pair by pair by FCL's manager, pairsWithin", by_manager, base);
    print("Scene::pairsWithin", within, base);
  }
  return median(all);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Scenes: milliseconds a step");
  int steps = 24;
  bool is_small = false;
  app.add_option("--steps", steps, "Tables show medians")->check(CLI::Range(4, 1000));
  app.add_flag("--small", is_small, "Fewer bodies, to see that it works");
  CLI11_PARSE(app, argc, argv);
  if (is_small) {
    hose(6, steps);
    crowd(40, 8, steps, true);
    crowd(40, 8, steps, false);
  } else {
    hose(60, steps);
    hose(600, steps);
    crowd(300, 16, steps, true);
    const double small = crowd(300, 16, steps, false);
    const double large = crowd(3000, 16 * std::cbrt(10.), steps, false);
    std::printf("3000 blobs take %.1f times as long as 300\n", large / small);
  }
  return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
