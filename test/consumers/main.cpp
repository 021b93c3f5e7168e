// A user's program: builds, deforms and queries a model through the installed or embedded library.
#include <cstdio>

#include <adaptive_bvh/adaptive_bvh_model.h>
#include <adaptive_bvh/query.h>
#ifdef WITH_MESH_IO
#include <adaptive_bvh/mesh_io.h>
#endif
#ifdef WITH_POLICY_JSON
#include <adaptive_bvh/policy_json.h>
#endif
#ifdef WITH_RECORDING
#include <adaptive_bvh/recording.h>
#endif
#ifdef WITH_TUNING
#include <adaptive_bvh/tuning.h>
#endif

int main() {
  adaptive_bvh::AdaptiveBVHModel<fcl::RSSd> model;
  model.beginModel();
  model.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  model.addTriangle({2, 0, 0}, {3, 0, 0}, {2, 1, 0});
  model.endModel();
  const std::vector<fcl::Vector3d> lifted = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1},
                                             {2, 0, 1}, {3, 0, 1}, {2, 1, 1}};
  model.update(lifted);

  fcl::Transform3d above = fcl::Transform3d::Identity();
  above.translation().z() = 0.25;
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&model, fcl::Transform3d::Identity(), &model, above,
                         fcl::DistanceRequestd(), result);
  std::printf("distance %.3f\n", result.min_distance);
#ifdef WITH_MESH_IO
  try {
    adaptive_bvh::loadMesh("missing.obj");
    return 1;
  } catch (const adaptive_bvh::MeshLoadError& error) {
    std::printf("%s\n", error.what());
  }
#endif
#ifdef WITH_RECORDING
  adaptive_bvh::Recording recording;
  recording.add(model, fcl::Transform3d::Identity(), "model");
  recording.frame(result);
  recording.write("run.html");
#endif
#if defined(WITH_POLICY_JSON) || defined(WITH_TUNING)
  model.setRefitPolicy(adaptive_bvh::policyFromJson(adaptive_bvh::toJson(model.refitPolicy())));
#endif
  return result.min_distance == 0.25 && model.validate() ? 0 : 1;
}
