// Meshes from files: formats, transforms, units, welding, and files that are broken.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/load_reason.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace mesh_io_test {

using adaptive_bvh::loadMesh;
using adaptive_bvh::MeshLoadOptions;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

double area(const Mesh& mesh) {
  double sum = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    sum += (mesh.vertices[t[1]] - mesh.vertices[t[0]])
               .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
               .norm() /
           2;
  return sum;
}

/// The enclosed volume: positive when a closed surface faces outside.
double volume(const Mesh& mesh) {
  double sum = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    sum += mesh.vertices[t[0]].cross(mesh.vertices[t[1]]).dot(mesh.vertices[t[2]]) / 6;
  return sum;
}

/// An ASCII PLY file that announces so many vertices and faces; `body` may hold others.
std::string ply(int vertices, int faces, const std::string& body) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n" + body;
}

// Two unit quads of different materials that share an edge, a line and a point.
const char kQuads[] =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
    "usemtl red\nf 1 2 3 4\nusemtl blue\nf 2 5 6 3\nl 1 2\np 1\n";

TEST(LoadMesh, ObjWithQuadsTwoMaterialsLinesAndPoints) {
  const TemporaryFile file("quads.obj", kQuads);
  const Mesh mesh = loadMesh(file.path());
  EXPECT_EQ(4u, mesh.triangles.size());
  EXPECT_EQ(6u, mesh.vertices.size()) << "the two materials' meshes are welded along their edge";
  EXPECT_NEAR(2, area(mesh), 1e-12);

  adaptive_bvh::AdaptiveBVHModeld swept;
  adaptive_bvh::AdaptiveOBBRSSModeld both;
  ASSERT_EQ(fcl::BVH_OK, fillModel(mesh, swept));
  ASSERT_EQ(fcl::BVH_OK, fillModel(mesh, both)) << "models of either volume take it";
  EXPECT_TRUE(swept.validate() && both.validate());
  const adaptive_bvh::DeformableMesh deformable(mesh);
  EXPECT_TRUE(deformable.validate());
  EXPECT_EQ(mesh.vertices, deformable.vertices());
  EXPECT_EQ(4, both.num_tris);

  MeshLoadOptions options;
  options.weld = false;
  const Mesh loose = loadMesh(file.path(), options);
  EXPECT_EQ(4u, loose.triangles.size());
  EXPECT_EQ(6u, loose.vertices.size()) << "the file's vertices";
  EXPECT_NEAR(2, area(loose), 1e-12);
}

TEST(LoadMesh, StlRepeatsVerticesAndIsWelded) {
  const TemporaryFile file(
      "two.stl",
      "solid two\n"
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
      "endloop\nendfacet\n"
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex -0 1 0\n"
      "endloop\nendfacet\nendsolid two\n");
  const Mesh mesh = loadMesh(file.path());
  EXPECT_EQ(2u, mesh.triangles.size());
  EXPECT_EQ(4u, mesh.vertices.size());
  EXPECT_EQ(Point(0, 0, 0), mesh.vertices[mesh.triangles[0][0]]);
}

TEST(LoadMesh, PlyKeepsItsVertexOrder) {
  const TemporaryFile file("tetra.ply", ply(4, 4,
                                            "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
                                            "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"));
  const auto mesh = loadMesh(file.path());
  ASSERT_EQ(4u, mesh.vertices.size());
  EXPECT_EQ(fcl::Vector3d(0, 1, 0), mesh.vertices[2]);
  EXPECT_EQ(2u, mesh.triangles[0][1]);
  adaptive_bvh::AdaptiveBVHModelf model;
  EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, model));
  EXPECT_EQ(4, model.num_tris);
  EXPECT_TRUE(model.validate());
}

/// A tetrahedron of volume 1/6 in a Collada scene, placed twice in one node tree.
std::string collada(const std::string& unit, const std::string& first, const std::string& second) {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset>)" +
         unit + R"(<up_axis>Y_UP</up_axis></asset>
 <library_geometries><geometry id="g" name="g"><mesh>
  <source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
   <technique_common><accessor source="#pa" count="4" stride="3">
    <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
   </accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
   <p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s" name="s">
  <node id="a" name="a">)" +
         first + R"(<instance_geometry url="#g"/>
   <node id="b" name="b">)" +
         second + R"(<instance_geometry url="#g"/></node></node>
 </visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>)";
}

TEST(LoadMesh, ColladaAppliesUnitAndNestedTransforms) {
  const TemporaryFile file("unit.dae",
                           collada("<unit name=\"millimetre\" meter=\"0.001\"/>",
                                   "<translate>10 0 0</translate>", "<scale>2 2 2</scale>"));
  const Mesh mesh = loadMesh(file.path());
  EXPECT_EQ(8u, mesh.triangles.size());
  // In metres: one tetrahedron at x = 0.01, and one twice as large at the same place.
  EXPECT_NEAR((1 + 8) / 6e9, volume(mesh), 1e-14);
  Eigen::AlignedBox3d box;
  for (const Point& p : mesh.vertices) box.extend(p);
  EXPECT_NEAR(0.010, box.min()[0], 1e-8);
  EXPECT_NEAR(0.012, box.max()[0], 1e-8);
}

TEST(LoadMesh, AMirrorTurnsTheTrianglesOver) {
  const TemporaryFile file("mirror.dae", collada("<unit name=\"metre\" meter=\"1\"/>",
                                                 "<scale>-1 1 1</scale>", "<scale>1 -2 1</scale>"));
  const Mesh mesh = loadMesh(file.path());
  // The first faces outside after one mirror, the second after two.
  EXPECT_NEAR((1 + 2) / 6., volume(mesh), 1e-6);
}

TEST(LoadMesh, NamesPathAndReasonOfWhatItCannotUse) {
  EXPECT_NE(std::string::npos, reasonOf("/nowhere/at all.obj").find("does not exist"));
  const TemporaryFile empty("empty.obj", "");
  EXPECT_FALSE(reasonOf(empty.path()).empty());
  const TemporaryFile points("points.obj", "v 0 0 0\nv 1 0 0\np 1\nl 1 2\n");
  EXPECT_FALSE(reasonOf(points.path()).empty());
  const TemporaryFile foreign("text.xyzzy", "hello");
  EXPECT_FALSE(reasonOf(foreign.path()).empty());
  const TemporaryFile cut("cut.ply", ply(400, 4, "0 0 0\n1 0 0\n"));
  EXPECT_FALSE(reasonOf(cut.path()).empty());
  const TemporaryFile index("index.ply", ply(3, 1, "0 0 0\n1 0 0\n0 1 0\n3 0 1 77\n"));
  EXPECT_FALSE(reasonOf(index.path()).empty());
  const TemporaryFile xml("broken.dae", "<COLLADA><unclosed>");
  EXPECT_FALSE(reasonOf(xml.path()).empty());
  const TemporaryFile nan("nan.ply", ply(3, 1, "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n"));
  EXPECT_NE(std::string::npos, reasonOf(nan.path()).find("not finite"));
  const TemporaryFile huge("huge.obj", "v 0 0 0\nv 1e400 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(std::string::npos, reasonOf(huge.path()).find("not finite"));
  const TemporaryFile large("large.obj", "v 0 0 0\nv 1e60 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(1e60, loadMesh(large.path()).vertices[1].x());
}

TEST(FillModel, TakesNewAndUsedModelsOfEitherKind) {
  const TemporaryFile file("quads2.obj", kQuads);
  const Mesh mesh = loadMesh(file.path());
  adaptive_bvh::AdaptiveBVHModeld adaptive;
  fcl::BVHModel<fcl::RSSd> plain;
  testing::internal::CaptureStderr();  // FCL remarks on a model that is built twice
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, adaptive));
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, plain));
    EXPECT_EQ(4, adaptive.num_tris);
    EXPECT_EQ(4, plain.num_tris);
    EXPECT_TRUE(adaptive.validate());
  }
  testing::internal::GetCapturedStderr();
}

}  // namespace mesh_io_test
}  // namespace adaptive_bvh_test
