// What loadMesh does to positions: units, the axis that is up, scale, and welding.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/proximity.h"
#include "support/bytes.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace load_options_test {

using adaptive_bvh::loadMesh;
using adaptive_bvh::MeshLoadOptions;
using adaptive_bvh::UpAxis;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

/// The triangle (1,2,3), (4,5,7), (0,0,0) in millimetres; `up` is an element of its asset.
std::string collada(const std::string& up) {
  return "<COLLADA><asset><unit meter='0.001'/>" + up +
         "</asset><library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' "
         "count='9'>1 2 3 4 5 7 0 0 0</float_array><technique_common><accessor source='#a' "
         "count='3' "
         "stride='3'/></technique_common></source><vertices id='v'><input semantic='POSITION' "
         "source='#p'/></vertices><triangles count='1'><input semantic='VERTEX' source='#v' "
         "offset='0'/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>"
         "<library_visual_scenes><visual_scene id='s'><node><instance_geometry url='#g'/></node>"
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/></scene>"
         "</COLLADA>";
}

Point firstOf(const std::string& name, const std::string& text, const MeshLoadOptions& options) {
  const TemporaryFile file(name, text);
  return loadMesh(file.path(), options).vertices[0];
}

TEST(MeshOptions, ColladaIsInMetresUnlessTheFilesUnitIsWanted) {
  MeshLoadOptions options;
  EXPECT_EQ(Point(0.001, 0.002, 0.003), firstOf("unit.dae", collada(""), options));
  options.metres = false;
  EXPECT_EQ(Point(1, 2, 3), firstOf("unit.dae", collada(""), options));
  options.scale = 0.5;
  EXPECT_EQ(Point(0.5, 1, 1.5), firstOf("unit.dae", collada(""), options));
  options.metres = true;
  EXPECT_EQ(Point(0.0005, 0.001, 0.0015), firstOf("unit.dae", collada(""), options));
}

TEST(MeshOptions, UnitsAreThoseOfTheContentAndNotOfTheName) {
  const std::string stl =
      "solid a\nfacet normal 0 0 1 outer loop vertex 1 2 3 vertex 4 5 7 vertex "
      "0 0 0 endloop endfacet endsolid";
  MeshLoadOptions options;
  options.unit = options.undeclared_unit = 0.3048;
  for (const char* name : {"unit.stl", "unit.dae\n", "unit.model"}) {
    EXPECT_EQ(Point(1, 2, 3), firstOf(name, stl, options)) << "the same unit: nothing is rounded";
    EXPECT_NEAR(0.003 / 0.3048, firstOf(name, collada(""), options)[2], 1e-15);
  }
  options.unit = 0.001;
  EXPECT_NEAR(914.4, firstOf("unit.gltf\n", stl, options)[2], 1e-12);
  EXPECT_NEAR(3, firstOf("unit.model", collada(""), options)[2], 1e-15);
  options.metres = false;
  EXPECT_EQ(Point(1, 2, 3), firstOf("unit.stl", stl, options));
  options.undeclared_unit = 0;
  EXPECT_THROW(firstOf("unit.stl", stl, options), std::invalid_argument);
  options.undeclared_unit = 1;
  options.unit = std::numeric_limits<double>::infinity();
  EXPECT_THROW(firstOf("unit.stl", stl, options), std::invalid_argument);
}

// Right, up and towards the viewer are -y, x, z of X_UP; x, y, z of Y_UP; x, z, -y of Z_UP.
TEST(MeshOptions, TheAxisThatIsUpIsTheFilesOrTheGivenOne) {
  const std::string x_up = "<up_axis>X_UP</up_axis>", y_up = "<up_axis>\n Y_UP </up_axis>",
                    z_up = "<up_axis>Z_UP</up_axis>";
  const auto loaded = [](const std::string& asset, UpAxis up) {
    MeshLoadOptions options;
    options.metres = false;
    options.up = up;
    return firstOf("up.dae", collada(asset), options);
  };
  for (const std::string& asset : {x_up, y_up, z_up, std::string()})
    EXPECT_EQ(Point(1, 2, 3), loaded(asset, UpAxis::AsInFile)) << asset;
  EXPECT_EQ(Point(1, 2, 3), loaded(x_up, UpAxis::X));
  EXPECT_EQ(Point(-2, 1, 3), loaded(x_up, UpAxis::Y));
  EXPECT_EQ(Point(-2, -3, 1), loaded(x_up, UpAxis::Z));
  for (const std::string& asset : {y_up, std::string()}) {
    EXPECT_EQ(Point(2, -1, 3), loaded(asset, UpAxis::X));
    EXPECT_EQ(Point(1, 2, 3), loaded(asset, UpAxis::Y));
    EXPECT_EQ(Point(1, -3, 2), loaded(asset, UpAxis::Z));
  }
  EXPECT_EQ(Point(3, -1, -2), loaded(z_up, UpAxis::X));
  EXPECT_EQ(Point(1, 3, -2), loaded(z_up, UpAxis::Y));
  EXPECT_EQ(Point(1, 2, 3), loaded(z_up, UpAxis::Z));
}

TEST(MeshOptions, GltfIsYUpAndOtherFormatsAreNeverTurned) {
  std::string buffer;
  for (const float x : {1.f, 2.f, 3.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(buffer, x);
  const std::string glb =
      glbOf(R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":)"
            R"([{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],)"
            R"("bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,)"
            R"("componentType":5126,"count":3,"type":"VEC3"}]})",
            buffer);
  const std::string obj = "v 1 2 3\nv 0 0 0\nv 0 1 0\nf 1 2 3\n";
  MeshLoadOptions options;
  EXPECT_EQ(Point(1, 2, 3), firstOf("up.glb", glb, options));
  options.up = UpAxis::Z;
  options.scale = 2;
  EXPECT_EQ(Point(2, -6, 4), firstOf("up.glb", glb, options));
  EXPECT_EQ(Point(2, 4, 6), firstOf("up.obj", obj, options));
}

TEST(MeshOptions, OutOfRangeAreRefused) {
  const TemporaryFile file("options.obj", "v 1 2 3\nv 0 0 0\nv 0 1 0\nf 1 2 3\n");
  const double bad[] = {-1, std::nan(""), std::numeric_limits<double>::infinity()};
  for (const double number : bad) {
    MeshLoadOptions options;
    options.scale = number;
    EXPECT_THROW(loadMesh(file.path(), options), std::invalid_argument);
    options.scale = 1;
    options.weld_tolerance = number;
    EXPECT_THROW(loadMesh(file.path(), options), std::invalid_argument);
    Mesh mesh;
    EXPECT_THROW(weldVertices(mesh, number), std::invalid_argument);
  }
  MeshLoadOptions options;
  options.scale = 0;
  EXPECT_THROW(loadMesh(file.path(), options), std::invalid_argument);
  options.scale = 1e308;
  EXPECT_THROW(loadMesh(file.path(), options), adaptive_bvh::MeshLoadError);
}

// ---- welding ------------------------------------------------------------------------------------

/// A cube as a text of STL, each corner of each triangle off by up to one unit in the last place.
std::string roughCube() {
  std::mt19937 random(1);
  std::string text = "solid\n";
  const auto add = [&](int v) {
    text += "vertex";
    for (int k = 0; k < 3; ++k) {
      const double x = v >> k & 1 ? 2.3 : 0.7;
      const double moved[] = {x, std::nextafter(x, 0), std::nextafter(x, 9)};
      char word[40];
      std::snprintf(word, sizeof(word), " %.17g", moved[random() % 3]);
      text += word;
    }
    text += "\n";
  };
  const int sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& side : sides)
    for (const int second : {1, 2}) {
      text += "facet normal 0 0 0\nouter loop\n";
      for (const int corner : {0, second, second + 1}) add(side[corner]);
      text += "endloop\nendfacet\n";
    }
  return text + "endsolid\n";
}

TEST(MeshOptions, ACubeOfRoughCornersIsClosedWithATolerance) {
  const TemporaryFile file("rough.stl", roughCube());
  const fcl::Vector3d centre(1.5, 1.5, 1.5);
  const auto distanceTo = [&](const Mesh& mesh) {
    const adaptive_bvh::DeformableMesh cube(mesh);
    const adaptive_bvh::DeformableMesh point(std::vector<Point>{centre, centre, centre},
                                             {fcl::Triangle(0, 1, 2)});
    const fcl::Transform3d identity = fcl::Transform3d::Identity();
    std::vector<double> result;
    signedVertexDistances(point, identity, cube, identity, 10., result);
    return result;
  };
  const Mesh rough = loadMesh(file.path());
  EXPECT_GT(rough.vertices.size(), 8u);
  EXPECT_THROW(distanceTo(rough), std::invalid_argument);

  MeshLoadOptions options;
  options.weld_tolerance = 1e-12;
  const Mesh mesh = loadMesh(file.path(), options);
  EXPECT_EQ(8u, mesh.vertices.size());
  EXPECT_EQ(12u, mesh.triangles.size());
  for (const double distance : distanceTo(mesh)) EXPECT_NEAR(-0.8, distance, 1e-12);
}

/// By the definition: the first kept vertex that is not farther away.
Mesh weldedByDefinition(const Mesh& mesh, double tolerance) {
  Mesh result;
  std::vector<std::size_t> index;
  for (const Point& p : mesh.vertices) {
    std::size_t v = 0;
    while (v < result.vertices.size() && (result.vertices[v] - p).norm() > tolerance) ++v;
    if (v == result.vertices.size()) result.vertices.push_back(p);
    index.push_back(v);
  }
  for (const fcl::Triangle& t : mesh.triangles) {
    const std::size_t a = index[t[0]], b = index[t[1]], c = index[t[2]];
    if (a != b && b != c && c != a) result.triangles.emplace_back(a, b, c);
  }
  return result;
}

TEST(WeldVertices, TakesTheFirstVertexWithinTheTolerance) {
  std::mt19937 random(2);
  for (int round = 0; round < 60; ++round) {
    Mesh mesh;
    const double far = round % 3 == 0 ? 0 : round % 3 == 1 ? -1e6 : 1e17;
    for (int v = 0; v < 80; ++v)
      mesh.vertices.emplace_back(far + 0.25 * double(random() % 8), 0.25 * double(random() % 8),
                                 -0.25 * double(random() % 3));
    for (int t = 0; t < 60; ++t)
      mesh.triangles.emplace_back(random() % 80, random() % 80, random() % 80);
    for (const double tolerance : {1e-9, 0.25, 0.5, 0.6, 5.}) {
      Mesh welded = mesh;
      weldVertices(welded, tolerance);
      const Mesh expected = weldedByDefinition(mesh, tolerance);
      ASSERT_EQ(expected.vertices, welded.vertices);
      ASSERT_EQ(expected.triangles.size(), welded.triangles.size());
      for (std::size_t t = 0; t < expected.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) ASSERT_EQ(expected.triangles[t][k], welded.triangles[t][k]);
    }
  }
}

// 0, 0.6 and 1.2 do not become one with a tolerance of 0.7: no vertex moves farther than that.
TEST(WeldVertices, DoesNotChain) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.6, 0, 0}, {1.2, 0, 0}};
  weldVertices(mesh, 0.7);
  EXPECT_EQ((std::vector<Point>{{0, 0, 0}, {1.2, 0, 0}}), mesh.vertices);
}

}  // namespace load_options_test
}  // namespace adaptive_bvh_test
