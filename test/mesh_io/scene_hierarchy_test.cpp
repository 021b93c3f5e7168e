// Scenes whose nodes are nested, shared or cyclic beyond all reason, and files that are no regular
// files: loadMesh gives an error at once. What is within reason is read as it is.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "support/bytes.h"
#include "support/load_reason.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace scene_hierarchy_test {

using adaptive_bvh::loadMesh;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

testing::AssertionResult isRefused(const std::string& path, const std::string& why) {
  const std::string reason = reasonOf(path);
  if (reason.find(why) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "the reason is '" << reason << "', not '" << why << "'";
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

// ---- glTF ---------------------------------------------------------------------------------------

/// `triangles` of the corners (0,0,0), (1,0,0), (0,1,0), each with corners of its own.
std::string corners(int triangles) {
  std::string bytes;
  for (int t = 0; t < triangles; ++t)
    for (float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(bytes, x);
  return bytes;
}

struct Gltf {
  std::string nodes;                   ///< elements of the array; the first is the scene's
  int triangles = 1;                   ///< of mesh 0
  std::string more = "\"extras\":{}";  ///< another member of the whole
  std::string primitives = R"({"attributes":{"POSITION":0}})";
  std::string uri = "";  ///< of the buffer: a member of it, with a comma

  std::string json() const {
    const std::string bytes = std::to_string(36 * triangles);
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
           R"(],"meshes":[{"primitives":[)" + primitives + R"(]}],"buffers":[{)" + uri +
           R"("byteLength":)" + bytes + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + bytes +
           R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" +
           std::to_string(3 * triangles) + R"(,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)" +
           more + "}";
  }

  std::string glb() const { return glbOf(json(), corners(triangles)); }
};

/// As binary and as text.
void expectRefused(const Gltf& gltf, const std::string& why) {
  const TemporaryFile glb("scene.glb", gltf.glb());
  EXPECT_TRUE(isRefused(glb.path(), why));
  const TemporaryFile text("scene.gltf", gltf.json());
  EXPECT_TRUE(isRefused(text.path(), why));
}

/// Levels of nodes; each but the last names the next so often, the last has the mesh.
Gltf nested(int levels, int times, const std::string& members = "") {
  Gltf gltf;
  for (int i = 1; i < levels; ++i) {
    const std::string next = std::to_string(i);
    gltf.nodes += "{" + members + "\"children\":[" + next + repeated("," + next, times - 1) + "]},";
  }
  gltf.nodes += "{\"mesh\":0}";
  return gltf;
}

TEST(GltfHierarchy, OfHundredLevelsIsReadWithItsTransforms) {
  const TemporaryFile file("deep.glb", nested(101, 1, "\"translation\":[1,0,-2],").glb());
  const Mesh mesh = loadMesh(file.path());
  ASSERT_EQ(3u, mesh.vertices.size());
  EXPECT_EQ(Point(100, 0, -200), mesh.vertices[0]);
  EXPECT_EQ(Point(101, 0, -200), mesh.vertices[1]);
  EXPECT_EQ(Point(100, 1, -200), mesh.vertices[2]);
}

TEST(GltfHierarchy, WithANodeNamedThousandTimesIsRead) {
  const TemporaryFile file("shared.glb", nested(11, 2).glb());
  EXPECT_EQ(1024u, loadMesh(file.path()).triangles.size());
}

TEST(GltfHierarchy, TooDeepIsRefused) { expectRefused(nested(50000, 1), "levels"); }

TEST(GltfHierarchy, WithTooManyWaysToANodeIsRefused) {
  expectRefused(nested(40, 2), "so often");
  expectRefused(nested(2, 30000), "so often");
}

TEST(GltfHierarchy, WithACycleIsRefused) {
  Gltf gltf;
  gltf.nodes = R"({"mesh":0,"children":[0]})";
  expectRefused(gltf, "descendants");
  gltf.nodes = R"({"mesh":0,"children":[1]},{"children":[2]},{"children":[1]})";
  expectRefused(gltf, "descendants");
}

TEST(GltfHierarchy, IsNotHiddenByAKeyThatComesTwice) {
  Gltf gltf = nested(40, 2);
  gltf.more = R"("nodes":[{"mesh":0}])";
  expectRefused(gltf, "two equal keys");
  gltf = nested(40, 2);
  gltf.more = R"("n\u006fdes":[{"mesh":0}])";
  expectRefused(gltf, "two equal keys");
}

TEST(GltfHierarchy, OfVersion1IsCheckedAsWell) {
  const auto reason = [](const std::string& nodes) {
    const TemporaryFile file("one.gltf", R"({"asset":{"version":"1.0"},"scene":"s","scenes":)"
                                         R"({"s":{"nodes":["a"]}},"nodes":{)" +
                                             nodes + "}}");
    return reasonOf(file.path());
  };
  const std::string cycle = R"("a":{"children":["b"]},"b":{"children":["a"]})";
  EXPECT_NE(std::string::npos, reason(cycle).find("descendants"));
  const std::string zero = R"("a":{"children":["b"]},"b":{"children":["a\u0000"]})";
  EXPECT_NE(std::string::npos, reason(zero).find("zero"));
}

TEST(GltfHierarchy, MeshesPlacedTooOftenAreRefused) {
  Gltf gltf = nested(14, 2);  // 8192 times 1000 triangles with 3000 vertices
  gltf.triangles = 1000;
  const TemporaryFile file("placed.glb", gltf.glb());
  EXPECT_TRUE(isRefused(file.path(), "place meshes so often"));
}

TEST(Gltf, MeshesThatReadTheSameDataTooOftenAreRefused) {
  Gltf gltf = nested(1, 1);
  gltf.triangles = 1000;
  const std::string primitive = gltf.primitives;
  gltf.primitives += repeated("," + primitive, 99);
  const TemporaryFile hundred("hundred.glb", gltf.glb());
  EXPECT_EQ(100000u, loadMesh(hundred.path()).triangles.size());
  gltf.primitives += repeated("," + primitive, 10000);
  const TemporaryFile many("many.glb", gltf.glb());
  EXPECT_TRUE(isRefused(many.path(), "the same data so often"));
}

TEST(Gltf, JsonThatIsNestedTooDeepIsRefused) {
  Gltf gltf = nested(1, 1);
  gltf.more = "\"extras\":" + repeated("[", 100) + repeated("]", 100);
  const TemporaryFile file("extras.glb", gltf.glb());
  EXPECT_EQ("", reasonOf(file.path()));
  gltf.more = "\"extras\":" + repeated("[", 50000) + repeated("]", 50000);
  expectRefused(gltf, "levels");
  gltf.more = "\"extras\":" + repeated("{\"a\":", 1000000);
  expectRefused(gltf, "levels");
}

TEST(Gltf, ExtensionsThatAreNestedTooDeepAreRefused) {
  Gltf gltf;
  const auto extension = [](int levels) {
    return R"({"mesh":0,"extensions":{"a":)" + repeated("[", levels) + repeated("]", levels) + "}}";
  };
  gltf.nodes = extension(60);  // some readers copy such things 2^60 times
  const TemporaryFile file("extension.glb", gltf.glb());
  EXPECT_EQ("", reasonOf(file.path()));
  gltf.nodes = extension(600);
  expectRefused(gltf, "levels");
}

TEST(Gltf, NamesInAnotherEncodingAreNoError) {
  Gltf gltf = nested(1, 1);
  gltf.more = "\"extras\":{\"gr\xFC\xDF\x65\":1,\"gr\xF6\xDF\x65\":2}";
  const TemporaryFile file("latin.glb", gltf.glb());
  EXPECT_EQ("", reasonOf(file.path()));
}

// ---- Collada ------------------------------------------------------------------------------------

/// `nodes` for the library, and for the scene; the geometry `#g` is the triangle of above, its list
/// of indices as given.
std::string collada(const std::string& library, const std::string& scene,
                    const std::string& indices = "<p>0 1 2</p>") {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
 <library_geometries><geometry id="g"><mesh><source id="p">
  <float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array>
  <technique_common><accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>
  <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
  </source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/>)" +
         indices + R"(</triangles>
  </mesh></geometry></library_geometries>
 <library_nodes>)" +
         library + R"(</library_nodes><library_visual_scenes><visual_scene id="s">)" + scene +
         R"(</visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

const std::string kGeometry = R"(<instance_geometry url="#g"/>)";

std::string instance(const std::string& id) { return "<instance_node url=\"#" + id + "\"/>"; }

/// Library nodes n0, n1, ...: each but the last instances the next so often.
std::string instancing(int levels, int times) {
  std::string library;
  for (int i = 0; i < levels; ++i)
    library +=
        "<node id=\"n" + std::to_string(i) + "\">" +
        (i + 1 < levels ? repeated(instance("n" + std::to_string(i + 1)), times) : kGeometry) +
        "</node>\n";
  return library;
}

testing::AssertionResult isRefusedCollada(const std::string& text, const std::string& why) {
  const TemporaryFile file("scene.dae", text);
  return isRefused(file.path(), why);
}

Mesh loadCollada(const std::string& text) {
  const TemporaryFile file("scene.dae", text);
  return loadMesh(file.path());
}

TEST(ColladaHierarchy, OfHundredLevelsIsReadWithItsTransforms) {
  const Mesh mesh = loadCollada(
      collada("", repeated("<node name='>'><!-- <node> --><translate>1 0 -2</translate>", 100) +
                      kGeometry + repeated("</node>", 100)));
  ASSERT_EQ(3u, mesh.vertices.size());
  Eigen::AlignedBox3d box;
  for (const Point& p : mesh.vertices) box.extend(p);
  EXPECT_EQ(100, box.min()[0]);
  EXPECT_EQ(101, box.max()[0]);
}

TEST(ColladaHierarchy, WithNodesInstancedThousandTimesIsRead) {
  EXPECT_EQ(1024u, loadCollada(collada(instancing(11, 2), "<node>" + instance("n0") + "</node>"))
                       .triangles.size());
  // A node called like the one of the library that it instances, as some writers have it.
  EXPECT_EQ(2u, loadCollada(collada(instancing(1, 1),
                                    repeated("<node name='n0'>" + instance("n0") + "</node>", 2)))
                    .triangles.size());
}

TEST(ColladaHierarchy, TooDeepIsRefused) {
  EXPECT_TRUE(isRefusedCollada(
      collada("", repeated("<node>", 50000) + kGeometry + repeated("</node>", 50000)), "levels"));
  EXPECT_TRUE(isRefusedCollada(collada(instancing(20000, 1), "<node>" + instance("n0") + "</node>"),
                               "levels"));
  EXPECT_TRUE(isRefusedCollada(collada("", "<extra>" + repeated("<a b='/'>", 50000)), "levels"));
}

TEST(ColladaHierarchy, WithTooManyWaysToANodeIsRefused) {
  EXPECT_TRUE(isRefusedCollada(collada(instancing(40, 2), "<node>" + instance("n0") + "</node>"),
                               "so often"));
}

TEST(ColladaHierarchy, WithACycleIsRefused) {
  const std::string in_scene = "<node>" + instance("a") + "</node>";
  for (const std::string& text : {
           collada("<node id='a'>" + instance("a") + "</node>", in_scene),
           collada(
               "<node id='a'>" + instance("b") + "</node><node id='b'>" + instance("a") + "</node>",
               in_scene),
           collada("<node id='a'><instance_node\n x=\" url='#b' \" url = '#a'/></node>", in_scene),
           collada("", "<node><node name='a'>" + instance("a") + "</node></node>"),
           collada("", "<node>" + instance("s") + kGeometry + "</node>"),
           collada("<node id='a\tb'>" + instance("a b") + "</node>", in_scene),
       })
    EXPECT_TRUE(isRefusedCollada(text, "descendants")) << text;
}

TEST(ColladaHierarchy, IsNotHiddenByWhatStandsForCharacters) {
  const std::string in_scene = "<node>" + instance("a") + "</node>";
  EXPECT_TRUE(isRefusedCollada(collada("<node id='&#97;'>" + instance("a") + "</node>", in_scene),
                               "references"));
  EXPECT_TRUE(isRefusedCollada(collada("<node id='a'>" + instance("&#97;") + "</node>", in_scene),
                               "no valid name"));
  EXPECT_TRUE(isRefusedCollada("<!DOCTYPE a [<!ENTITY b 'c'>]>" + collada("", ""), "type"));
  EXPECT_TRUE(isRefusedCollada(std::string("<\0?\0", 4), "UTF-8"));
}

TEST(Collada, ListsOfIndicesThatHideTextAreRefused) {
  const std::string scene = "<node>" + kGeometry + "</node>";
  for (const char* indices : {"<p>x 1 2</p>", "<p><!-- a --> x 1 2</p>", "<p> <![CDATA[x]]></p>",
                              "<p><a/>x</p>", "<p>\n<?a b?>x</p>", "<p>&#48; 1 2</p>"})
    EXPECT_TRUE(isRefusedCollada(collada("", scene, indices), "list of indices")) << indices;
  for (const char* indices : {"<p>0 1 2<!-- a --></p>", "<p a='>' >\n0 +1 2 </p>"})
    EXPECT_EQ(1u, loadCollada(collada("", scene, indices)).triangles.size()) << indices;
}

// ---- files that are none ------------------------------------------------------------------------

TEST(LoadMesh, RefusesWhatIsNoRegularFile) {
  const TemporaryFile pipe("pipe.obj");
  ASSERT_EQ(0, ::mkfifo(pipe.path().c_str(), 0600));
  EXPECT_TRUE(isRefused(pipe.path(), "no regular file"));
  EXPECT_TRUE(isRefused(testing::TempDir(), "no regular file"));
  EXPECT_TRUE(isRefused("/dev/null", "no regular file"));
}

TEST(LoadMesh, FollowsLinks) {
  const TemporaryFile file("linked.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const TemporaryFile link("link.obj");
  ASSERT_EQ(0, ::symlink(file.path().c_str(), link.path().c_str()));
  EXPECT_EQ(1u, loadMesh(link.path()).triangles.size());
  const TemporaryFile dangling("dangling.obj");
  ASSERT_EQ(0, ::symlink((file.path() + ".missing").c_str(), dangling.path().c_str()));
  EXPECT_TRUE(isRefused(dangling.path(), "does not exist"));
}

TEST(LoadMesh, DoesNotWaitForAPipeThatAMeshNames) {
  const TemporaryFile pipe("named_pipe");
  ASSERT_EQ(0, ::mkfifo(pipe.path().c_str(), 0600));
  const std::string name = pipe.path().substr(pipe.path().find_last_of('/') + 1);

  const TemporaryFile material("material.obj",
                               "mtllib " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(1u, loadMesh(material.path()).triangles.size());

  Gltf gltf = nested(1, 1);
  gltf.uri = "\"uri\":\"" + name + "\",";
  const TemporaryFile scene("buffer.gltf", gltf.json());
  EXPECT_NE("", reasonOf(scene.path()));
  const TemporaryFile buffer("buffer.bin", corners(1));
  gltf.uri = "\"uri\":\"" + buffer.path().substr(buffer.path().find_last_of('/') + 1) + "\",";
  const TemporaryFile whole("whole.gltf", gltf.json());
  EXPECT_EQ("", reasonOf(whole.path()));
}

}  // namespace scene_hierarchy_test
}  // namespace adaptive_bvh_test
