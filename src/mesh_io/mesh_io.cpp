#include "adaptive_bvh/mesh_io.h"

#include <cmath>
#include <new>
#include <stdexcept>

#include "formats.h"

namespace adaptive_bvh {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw MeshLoadError("cannot load mesh '" + path + "': " + reason);
}

/// The directions right, up and towards the viewer, as Collada has them.
Eigen::Matrix3d axesOf(UpAxis up) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (up == UpAxis::X) axes << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  if (up == UpAxis::Z) axes << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return axes;
}

/// From the file's frame and unit to the caller's.
Eigen::Matrix4d transformFor(const FileScene& scene, const MeshLoadOptions& options) {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  if (options.up != UpAxis::AsInFile && scene.up != UpAxis::AsInFile)
    transform.topLeftCorner<3, 3>() = axesOf(options.up) * axesOf(scene.up).transpose();
  transform.topRows<3>() *= options.scale * (options.metres ? scene.unit : 1);
  return transform;
}

void checkOptions(const MeshLoadOptions& options) {
  if (!(options.scale > 0) || !std::isfinite(options.scale))
    throw std::invalid_argument("loadMesh: the scale must be positive and finite");
  if (!(options.weld_tolerance >= 0) || !std::isfinite(options.weld_tolerance))
    throw std::invalid_argument("loadMesh: the weld tolerance must be finite, and not negative");
}

TriangleMesh<double> readMesh(const std::string& path, const MeshLoadOptions& options) {
  try {
    FileScene scene = readScene(path);
    const Eigen::Matrix4d transform = transformFor(scene, options);
    return flatten(std::move(scene), transform);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, error.what());
  }
}

}  // namespace

template <typename S>
TriangleMesh<S> loadMesh(const std::string& path, const MeshLoadOptions& options) {
  checkOptions(options);
  TriangleMesh<double> mesh = readMesh(path, options);
  if (mesh.triangles.empty()) fail(path, "it holds no triangles");
  TriangleMesh<S> result;
  for (const fcl::Vector3d& p : mesh.vertices)
    if (!p.cast<S>().allFinite()) fail(path, "a coordinate is not finite");
  if (options.weld) weldVertices(mesh, options.weld_tolerance);
  if (mesh.triangles.empty()) fail(path, "there are no triangles left when vertices are welded");
  result.triangles = std::move(mesh.triangles);
  result.vertices.reserve(mesh.vertices.size());
  for (const fcl::Vector3d& p : mesh.vertices) result.vertices.push_back(p.cast<S>());
  return result;
}

template TriangleMesh<float> loadMesh(const std::string&, const MeshLoadOptions&);
template TriangleMesh<double> loadMesh(const std::string&, const MeshLoadOptions&);

}  // namespace adaptive_bvh
