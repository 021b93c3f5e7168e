// What a call leaves behind that failed for want of memory: what was there before. Every allocation
// of every call that changes something fails once.
#include <gtest/gtest.h>

#include <sstream>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "support/failing.h"
#include "support/fcl_float.h"
#include "support/meshes.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace failed_mesh_test {

using adaptive_bvh::DeformableMesh;
using fcl::Transform3d;

class FailedMeshCall : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Point = fcl::Vector3d;
  using Points = std::vector<Point>;

  FailedMeshCall() : sheet_(plate(4, 4)), tool_(tube(4, 4)) {
    for (Point& p : sheet_.vertices) p[2] = 0.1 * std::sin(5 * p[0]);
    for (Point& p : tool_.vertices) p[2] += 0.7;
  }

  /// Of all vertices; that of no number is the same as another one's.
  Points moved(int number) const { return moved(sheet_.vertices, number); }
  static Points moved(Points points, int number) {
    for (Point& p : points) p[2] += 0.05 * std::sin(double(number) + 7 * p[1]);
    return points;
  }
  Mesh make() const {
    Mesh mesh(sheet_);
    mesh.update(moved(1));
    return mesh;
  }

  /// All that can be seen of a mesh, and of what updates make of it later.
  std::string stateOf(const Mesh& mesh) const {
    Text text;
    describe(mesh, text);
    if (mesh.triangles().size() > 1000) return text.text();
    Mesh later = mesh;
    const Points to = moved(mesh.vertices(), 9);
    const std::vector<unsigned> some = {1, 0, 2, 1};
    later.update(some, {to[0], to[1], to[2], to[3]});
    describe(later, text);
    later.updateTwoFrames(to);
    describe(later, text);
    return text.text();
  }
  void describe(const Mesh& mesh, Text& text) const {
    std::string reason;
    EXPECT_TRUE(mesh.validate(&reason)) << reason;
    const auto& report = mesh.lastUpdate();
    text << mesh.vertices() << mesh.previousVertices() << mesh.triangles().size() << report.vertices
         << report.largest_displacement << report.turned;
    text << mesh.aabb_local.min_.transpose() << mesh.aabb_local.max_.transpose()
         << mesh.aabb_radius;
    fcl::DistanceResultd result;
    const Mesh tool(tool_);
    const auto identity = fcl::Transform3d::Identity();
    text << adaptive_bvh::distance(&mesh, identity, &tool, identity, fcl::DistanceRequestd(true),
                                   result)
         << result.b1 << result.b2 << adaptive_bvh::isNearer(mesh, identity, tool, identity, 0.5);
  }

  /// Fails each allocation of a call that changes a mesh.
  template <typename Make, typename Call>
  int failEach(const std::string& what, const Make& make, const Call& call) {
    return failEachAllocation(what, make, call, [&](const Mesh& mesh) { return stateOf(mesh); });
  }
  template <typename Call>
  int failEach(const std::string& what, const Call& call) {
    return failEach(
        what, [&] { return make(); }, call);
  }

  TriangleMesh sheet_, tool_;
};

TEST_F(FailedMeshCall, AnUpdateOfAllVertices) {
  using Mesh = DeformableMesh;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  const auto to = this->moved(2);
  EXPECT_EQ(0, this->failEach("all", [&](Mesh& mesh) { mesh.update(to); }));
  // The positions of the frame before, in single precision in both.
  const int frames = 1;
  EXPECT_EQ(frames, this->failEach("two frames", [&](Mesh& mesh) { mesh.updateTwoFrames(to); }));
  Rows rows(to.size(), 3);
  for (std::size_t v = 0; v < to.size(); ++v) rows.row(Eigen::Index(v)) = to[v].transpose();
  EXPECT_EQ(0, this->failEach("rows", [&](Mesh& mesh) { mesh.update(rows); }));
  // At rest, and after two frames.
  const auto rest = this->moved(1);
  EXPECT_EQ(frames, this->failEach("none moves", [&](Mesh& mesh) { mesh.updateTwoFrames(rest); }));
  const auto twoFrames = [&] {
    Mesh mesh = this->make();
    mesh.updateTwoFrames(this->moved(3));
    return mesh;
  };
  EXPECT_EQ(0,
            this->failEach("two again", twoFrames, [&](Mesh& mesh) { mesh.updateTwoFrames(to); }));
  EXPECT_EQ(0, this->failEach("one after two", twoFrames, [&](Mesh& mesh) { mesh.update(to); }));
}

TEST_F(FailedMeshCall, AnUpdateOfSomeVertices) {
  using Mesh = DeformableMesh;
  const std::vector<unsigned> some = {3, 5, 3, 11};
  const auto all = this->moved(2);
  const std::vector<fcl::Vector3d> to = {all[0], all[5], all[3], all[11]};
  const auto update = [&](Mesh& mesh) { mesh.update(some.data(), to.data(), some.size()); };
  EXPECT_GE(this->failEach("first", update), 5) << "which leaves a vertex has, and what is marked";
  const auto again = [&] {
    Mesh mesh = this->make();
    mesh.update(std::vector<int>{7}, {all[7]});
    return mesh;
  };
  EXPECT_EQ(0, this->failEach("second", again, update));
  EXPECT_EQ(1, this->failEach("int", again, [&](Mesh& mesh) {
    mesh.update(std::vector<int>{3, 5, 3, 11}, to);
  }) - 1);
  // So far that all boxes are refitted; and from the mesh's own positions.
  EXPECT_EQ(0, this->failEach("far", again, [&](Mesh& mesh) {
    const fcl::Vector3d far(50, 60, 70);
    mesh.update(some.data(), &far, 1);
  }));
  EXPECT_EQ(1, this->failEach("own", again, [&](Mesh& mesh) {
    mesh.update(some.data(), mesh.vertices().data() + 2, some.size());
  }));
}

TEST_F(FailedMeshCall, ABuildOrALoad) {
  using Mesh = DeformableMesh;
  const auto none = [] { return std::unique_ptr<Mesh>(); };
  const auto stateOf = [&](const std::unique_ptr<Mesh>& mesh) {
    return mesh ? this->stateOf(*mesh) : std::string("none");
  };
  EXPECT_GT(
      failEachAllocation(
          "build", none, [&](auto& mesh) { mesh = std::make_unique<Mesh>(this->sheet_); }, stateOf),
      20);
  std::stringstream saved;
  this->make().save(saved);
  EXPECT_GT(failEachAllocation(
                "load", none,
                [&](auto& mesh) {
                  saved.clear();
                  saved.seekg(0);
                  mesh = std::make_unique<Mesh>(Mesh::load(saved));
                },
                stateOf),
            20);
  Mesh mesh = this->make();
  mesh.updateTwoFrames(this->moved(2));
  EXPECT_GE(failEachAllocation(
                "copy", none, [&](auto& copy) { copy = std::make_unique<Mesh>(mesh); }, stateOf),
            5);
  EXPECT_EQ(1, failEachAllocation(
                   "move", none,
                   [&](auto& copy) {
                     auto memory = std::make_unique<Mesh>(std::move(mesh));
                     copy = std::move(memory);
                   },
                   [&](const std::unique_ptr<Mesh>& copy) { return std::to_string(!!copy); }));
}

/// To larger and smaller meshes, from any state into any.
TEST_F(FailedMeshCall, AnAssignment) {
  using Mesh = DeformableMesh;
  std::vector<Mesh> meshes;
  meshes.emplace_back(plate(1, 1));
  meshes.push_back(this->make());
  meshes.push_back(this->make());
  meshes.back().updateTwoFrames(this->moved(4));
  meshes.push_back(this->make());
  meshes.back().update(std::vector<int>{7}, {this->moved(5)[7]});
  meshes.emplace_back(tube(9, 9));
  for (const Mesh& from : meshes)
    for (const Mesh& to : meshes) {
      const bool is_roomy = to.vertices().size() >= from.vertices().size() &&
                            to.triangles().size() >= from.triangles().size() &&
                            to.previousVertices().capacity() >= from.previousVertices().size();
      const int failures = this->failEach(
          "assign", [&] { return Mesh(to); }, [&](Mesh& mesh) { mesh = from; });
      if (is_roomy) {
        EXPECT_EQ(0, failures);
      }
    }
}

/// With more triangles than it takes to use threads.
TEST_F(FailedMeshCall, AnUpdateOnTwoThreads) {
  using Mesh = DeformableMesh;
  const Mesh large(plate(180, 140));
  const auto to = this->moved(large.vertices(), 2);
  const auto make = [&] {
    Mesh mesh = large;
    mesh.setThreads(2);
    return mesh;
  };
  EXPECT_GE(this->failEach("all", make, [&](Mesh& mesh) { mesh.update(to); }), 2);
  EXPECT_GE(this->failEach("two", make, [&](Mesh& mesh) { mesh.updateTwoFrames(to); }), 3);
  const std::vector<unsigned> some = {3, 5, 3, 11};
  EXPECT_GE(
      this->failEach("some", make, [&](Mesh& mesh) { mesh.update(some.data(), to.data(), 4); }), 5);
}

}  // namespace failed_mesh_test
}  // namespace adaptive_bvh_test
