// Variants of the formats that users have: read, or refused with a message that names the problem.
// docs/guide.md has the table.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <functional>

#include "support/bytes.h"
#include "support/load_reason.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace mesh_formats_test {

using adaptive_bvh::loadMesh;
using adaptive_bvh::MeshLoadOptions;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

Mesh load(const std::string& name, const std::string& bytes) {
  MeshLoadOptions options;
  options.weld = false;
  const TemporaryFile file(name, bytes);
  return loadMesh(file.path(), options);
}

/// The triangle (0,0,0), (1,0,0), (0,2,0).
void expectTriangle(const Mesh& mesh) {
  ASSERT_EQ(1u, mesh.triangles.size());
  const Point corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(corners[k], mesh.vertices[mesh.triangles[0][k]]);
}

void expectRead(const std::string& name, const std::string& bytes) {
  SCOPED_TRACE(name + ": " + bytes.substr(0, 60));
  EXPECT_NO_THROW(expectTriangle(load(name, bytes)));
}

void expectRefused(const std::string& name, const std::string& bytes, const std::string& why) {
  const TemporaryFile file(name, bytes);
  const std::string reason = reasonOf(file.path());
  EXPECT_NE(std::string::npos, reason.find(why)) << name << ": " << reason;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

// ---- STL ----------------------------------------------------------------------------------------

const std::string kStl =
    "solid a part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
    "   vertex 0 2 0\n  endloop\n endfacet\nendsolid a part\n";

std::string upperCase(std::string text) {
  for (char& c : text) c = char(std::toupper(c));
  return text;
}

TEST(Stl, TextIsReadInItsVariants) {
  expectRead("plain.stl", kStl);
  expectRead("upper.stl", upperCase(kStl));
  expectRead("mixed.stl", replaced(kStl, "facet", "Facet"));
  expectRead("blanks.stl", "  \n\t" + kStl);
  expectRead("no_end.stl", kStl.substr(0, kStl.find("endsolid")));
  expectRead("cr.stl", replaced(kStl, "\n", "\r"));
  expectRead("crlf.stl", replaced(kStl, "\n", "\r\n"));
  expectRead("no_name.stl", replaced(kStl, " a part", ""));
  expectRead("facet_in_name.stl", replaced(kStl, "a part", "facet vertex"));
  expectRead("indefinite.stl", replaced(kStl, "normal 0 0 1", "normal -nan(ind) nan +0"));
}

TEST(Stl, TextIsRefusedByLineAndWord) {
  expectRefused("cut.stl", kStl.substr(0, kStl.find("endloop")), "within a facet");
  expectRefused("word.stl", replaced(kStl, "outer", "inner"), "line 3: 'inner'");
  expectRefused("comma.stl", replaced(kStl, "0 2 0", "0 2,5 0"), "line 6: '2,5' is no number");
  expectRefused("two.stl", replaced(kStl, "   vertex 1 0 0\n", ""), "three vertices");
  expectRefused("empty.stl", "solid\nendsolid\n", "no triangles");
}

std::string binaryStl(const std::string& header, std::uint32_t announced = 1) {
  std::string bytes = header;
  bytes.resize(80, ' ');
  put(bytes, announced);
  for (const float x : {0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(bytes, x);
  put(bytes, std::uint16_t(0));
  return bytes;
}

TEST(Stl, BinaryIsReadWithAnyHeaderAndBytesAfterTheLastTriangle) {
  for (const char* header : {"part", "solid part", "SOLID part"}) {
    expectRead("binary.stl", binaryStl(header));
    expectRead("more.stl", binaryStl(header) + "x");
    expectRead("much_more.stl", binaryStl(header) + std::string(500, '\n'));
  }
  expectRefused("cut.stl", binaryStl("part").substr(0, 130),
                "it announces 1 triangles, and has bytes for 0");
  expectRefused("many.stl", binaryStl("part", 4000000000u), "announces 4000000000 triangles");
}

// ---- OFF ----------------------------------------------------------------------------------------

const std::string kOffBody = "0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n";

TEST(Off, IsReadWithCommentsWhereverTheyStand) {
  expectRead("plain.off", "OFF\n3 1 0\n" + kOffBody);
  expectRead(
      "comments.off",
      "# a\nOFF # b\n# c\n\n3 1 0 # d\n# e\n0 0 0 # f\n#\n1 0 0\n0 2 0\n\n# g\n3 0 1 2 # h\n#");
  expectRead("one_line.off", "OFF 3 1 0\n" + kOffBody);
  expectRead("no_edges.off", "OFF\n3 1\n" + kOffBody);
  expectRead("edges_apart.off", "OFF\n3 1\n7\n" + kOffBody);
  expectRead("cr.off", replaced("OFF\n3 1 0\n" + kOffBody, "\n", "\r"));
  expectRead("colours.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 2 255 0 0 # red\n");
  expectRead("coff.off", "COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 2 0 1 0 0 1\n3 0 1 2\n");
  expectRead("stcn.off", replaced("STCNOFF\n3 1 0\n" + kOffBody, " 0\n", " 0 9 9 9\n"));
  expectRead("4.off", "4OFF\n3 1 0\n0 0 0 2\n2 0 0 2\n0 1 0 0.5\n3 0 1 2\n");
}

TEST(Off, IsRefusedByName) {
  expectRefused("dimensions.off", "nOFF 5\n3 1 0\n" + kOffBody, "'nOFF' is no first word");
  expectRefused("binary.off", "OFF BINARY\n" + kOffBody, "announces 'BINARY' vertices");
  expectRefused("cut.off", "OFF\n3 2 0\n" + kOffBody, "fewer vertices or faces than it announces");
  expectRefused("word.off", "OFF\n3 1 0\n0 0 0\n1 zero 0\n0 2 0\n3 0 1 2\n", "line 4: a vertex");
  expectRefused("corner.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 3\n", "vertex 3 of 3");
}

// ---- OBJ ----------------------------------------------------------------------------------------

TEST(Obj, IsReadInItsVariants) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 2 0\n";
  expectRead("plain.obj", vertices + "f 1 2 3");
  expectRead("relative.obj", vertices + "f -3 -2 -1\n");
  expectRead("parts.obj", "# a\no part\ng side\ns off\nvn 0 0 1\nvt 0 0\n" + vertices +
                              "usemtl none\nf 1/1/1 2//1 3/1 # end\n");
  expectRead("lines.obj", vertices + "f 1 \\\n 2 \\\r\n3\n");
  expectRead("cr.obj", replaced(vertices + "f 1 2 3\n", "\n", "\r"));
  expectRead("colours.obj", replaced(vertices, "\n", " 1 0.5 0\n") + "f 1 2 3\n");
  expectRead("repeated.obj", vertices + "f 1 1 2 2 3 3\n");
  expectRefused("zero.obj", vertices + "f 0 1 2\n", "line 4: '0' is no corner");
  expectRefused("before.obj", vertices + "f -4 1 2\n", "before the first");
  expectRefused("after.obj", vertices + "f 1 2 4\n", "face 1 names vertex 4 of 3");
  expectRefused("word.obj", "v 0 0\nf 1 1 1\n", "line 1: a vertex has not three numbers");
}

// ---- PLY ----------------------------------------------------------------------------------------

std::string plyHeader(const std::string& format, const std::string& number) {
  return "ply\nformat " + format + " 1.0\ncomment a part\nelement vertex 3\nproperty " + number +
         " x\nproperty " + number + " y\nproperty " + number +
         " z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
}

template <typename Number>
std::string plyBody(bool is_turned) {
  std::string bytes;
  const auto add = [&](auto number) {
    std::string one;
    put(one, number);
    bytes += is_turned ? std::string(one.rbegin(), one.rend()) : one;
  };
  for (const int x : {0, 0, 0, 1, 0, 0, 0, 2, 0}) add(Number(x));
  add(std::uint8_t(3));
  for (const int v : {0, 1, 2}) add(v);
  return bytes;
}

TEST(Ply, IsReadInItsVariants) {
  const std::string text = plyHeader("ascii", "float") + kOffBody;
  expectRead("text.ply", text);
  expectRead("cr.ply", replaced(text, "\n", "\r"));
  expectRead("index.ply", replaced(text, "vertex_indices", "vertex_index"));
  for (const auto& [format, is_turned] :
       {std::pair{"binary_little_endian", false}, {"binary_big_endian", true}}) {
    expectRead("float.ply", plyHeader(format, "float") + plyBody<float>(is_turned));
    expectRead("double.ply", plyHeader(format, "double") + plyBody<double>(is_turned));
    expectRead("short.ply", plyHeader(format, "int16") + plyBody<std::int16_t>(is_turned));
    expectRead("crlf.ply",
               replaced(plyHeader(format, "float"), "\n", "\r\n") + plyBody<float>(is_turned));
  }
  std::string first_byte = plyBody<std::int16_t>(false);
  first_byte[0] = '\n';  // the first x is 10
  const Mesh mesh = load(
      "mac.ply", replaced(plyHeader("binary_little_endian", "short"), "\n", "\r") + first_byte);
  EXPECT_EQ(Point(10, 0, 0), mesh.vertices[0]);

  const std::string strips = replaced(replaced(text, "element face", "element tristrips"), kOffBody,
                                      "0 0 0\n1 0 0\n0 2 0\n9 0 1 2 1 -1 2 1 0 -1\n");
  const Mesh stripped = load("strips.ply", strips);
  ASSERT_EQ(3u, stripped.triangles.size());
  EXPECT_EQ(2u, stripped.triangles[1][0]);
  EXPECT_EQ(1u, stripped.triangles[1][1]);
  EXPECT_EQ(2u, stripped.triangles[2][0]);
}

TEST(Ply, IsRefusedByElement) {
  const std::string text = plyHeader("ascii", "float") + kOffBody;
  expectRefused("cut.ply", text.substr(0, text.size() - 6), "element 0 of 1 'face'");
  expectRefused("no_z.ply", replaced(text, "float z", "float w"), "no property z");
  expectRefused("type.ply", replaced(text, "uchar", "quad"), "no known type");
  expectRefused("format.ply", replaced(text, "ascii", "utf8"), "no known format");
  expectRefused("binary.ply", plyHeader("binary_little_endian", "double") + "few", "it ends early");
  expectRefused("magic.ply", "polygon file", "does not begin as ply files do");
}

// ---- glTF ---------------------------------------------------------------------------------------

struct Gltf {
  std::string buffer;
  std::string accessor;              ///< of the positions: members of it
  std::string node = R"("mesh":0)";  ///< of the only node
  std::string primitives = R"({"attributes":{"POSITION":0}})";
  std::string more = R"("extras":0)";

  std::string glb() const { return glbOf(json(), buffer); }
  std::string json() const {
    const std::string bytes = std::to_string(buffer.size());
    return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{)" + node +
           R"(}],"meshes":[{"primitives":[)" + primitives + R"(]}],"buffers":[{"byteLength":)" +
           bytes + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + bytes +
           R"(}],"accessors":[{"count":3,"type":"VEC3",)" + accessor + "}]," + more + "}";
  }
};

template <typename Number>
std::string positions(std::size_t padding) {
  std::string bytes;
  for (const int x : {1, 2, 3, -1, 0, 0, 0, 0, 1}) {
    put(bytes, Number(x));
    if (bytes.size() % (3 * sizeof(Number) + padding) == 3 * sizeof(Number))
      bytes += std::string(padding, '\x55');
  }
  return bytes;
}

TEST(GltfAccessors, OfEveryTypeAreRead) {
  struct Case {
    int type;
    std::string buffer;
    int stride;
    double unit;  ///< of a normalized one
  };
  for (const Case& c :
       {Case{5120, positions<std::int8_t>(1), 4, 127},
        Case{5122, positions<std::int16_t>(2), 8, 32767}, Case{5126, positions<float>(0), 12, 0}})
    for (const bool normalized : {false, true}) {
      Gltf gltf;
      gltf.buffer = c.buffer;
      gltf.accessor = R"("bufferView":0,"componentType":)" + std::to_string(c.type) +
                      R"(,"byteStride":)" + std::to_string(c.stride) +
                      (normalized ? R"(,"normalized":true)" : "");
      gltf.more = R"("extensionsRequired":["KHR_mesh_quantization","KHR_materials_unlit"])";
      const double unit = normalized && c.unit > 0 ? c.unit : 1;
      const Mesh mesh = load("quantized.glb", gltf.glb());
      ASSERT_EQ(3u, mesh.vertices.size());
      EXPECT_EQ(Point(1 / unit, 2 / unit, 3 / unit), mesh.vertices[0]);
      EXPECT_EQ(Point(-1 / unit, 0, 0), mesh.vertices[1]);
    }
  Gltf gltf;
  gltf.buffer = std::string("\xFF\x80\x00", 3) + std::string(6, '\0');
  gltf.accessor = R"("bufferView":0,"componentType":5121)";
  EXPECT_EQ(Point(255, 128, 0), load("unsigned.glb", gltf.glb()).vertices[0]);
  gltf.accessor = R"("bufferView":0,"componentType":5120,"normalized":true)";
  EXPECT_EQ(Point(-1 / 127., -1, 0), load("signed.glb", gltf.glb()).vertices[0]);
}

TEST(GltfAccessors, ThatAreSparseAreRead) {
  Gltf gltf;
  gltf.buffer.assign("\x01\x02\0\0", 4);
  for (const float x : {1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(gltf.buffer, x);
  gltf.accessor = R"("componentType":5126,"sparse":{"count":2,"indices":{"bufferView":0,)"
                  R"("componentType":5121},"values":{"bufferView":0,"byteOffset":4}})";
  expectRead("sparse.glb", gltf.glb());
}

TEST(GltfAccessors, AreRefusedByName) {
  Gltf gltf;
  gltf.buffer = positions<float>(0);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  gltf.more = R"("extensionsRequired":["KHR_draco_mesh_compression"])";
  expectRefused("draco.glb", gltf.glb(), "requires the extension KHR_draco_mesh_compression");
  gltf.more = R"("extensionsUsed":["KHR_draco_mesh_compression"])";
  EXPECT_NO_THROW(load("used.glb", gltf.glb()));
  gltf.accessor = R"("bufferView":0,"componentType":5130)";
  expectRefused("type.glb", gltf.glb(), "unknown component type 5130");
  gltf.accessor = R"("bufferView":0,"componentType":5126,"byteOffset":4)";
  expectRefused("past.glb", gltf.glb(), "reaches past its part");
  gltf.accessor = R"("bufferView":0,"componentType":5126,"count":4000000000000000000)";
  expectRefused("twice.glb", gltf.glb(), "twice");
  gltf.accessor = R"("componentType":5126)";
  std::string many = gltf.glb();
  expectRefused("many.glb", many.replace(many.find("\"count\":3"), 9, "\"count\":8000000000000"),
                "");
}

TEST(GltfNodes, WithASkinDoNotPlaceTheirMeshes) {
  Gltf gltf;
  gltf.buffer = positions<float>(0);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  gltf.node = R"("mesh":0,"translation":[5,0,0],"scale":[-1,1,1])";
  EXPECT_EQ(Point(4, 2, 3), load("placed.glb", gltf.glb()).vertices[0]);
  EXPECT_EQ(2u, load("placed.glb", gltf.glb()).triangles[0][1]) << "turned over";
  gltf.node += R"(,"skin":0)";
  gltf.more = R"("skins":[{"joints":[0]}])";
  EXPECT_EQ(Point(4, 2, 3), load("without.glb", gltf.glb()).vertices[0]) << "there are no joints";
  gltf.primitives = R"({"attributes":{"POSITION":0,"JOINTS_0":1}})";
  EXPECT_EQ(Point(1, 2, 3), load("skinned.glb", gltf.glb()).vertices[0]);
  EXPECT_EQ(1u, load("skinned.glb", gltf.glb()).triangles[0][1]);
}

TEST(GltfPrimitives, ShareVerticesUnlessTheyMoveInOtherWays) {
  Gltf gltf;
  gltf.buffer = positions<float>(0);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  const std::string with = R"({"attributes":{"POSITION":0,"JOINTS_0":)";
  for (const auto& [primitives, vertices] : std::vector<std::pair<std::string, std::size_t>>{
           {R"({"attributes":{"POSITION":0}},{"attributes":{"POSITION":0,"NORMAL":1}})", 3},
           {R"({"attributes":{"POSITION":0}},{"attributes":{"POSITION":0},"targets":[{}]})", 6},
           {with + "1}}," + with + "1}}", 3},
           {with + "1}}," + with + "2}}", 6}}) {
    gltf.primitives = primitives;
    const Mesh mesh = load("shared.glb", gltf.glb());
    EXPECT_EQ(vertices, mesh.vertices.size()) << primitives;
    EXPECT_EQ(2u, mesh.triangles.size());
  }
}

TEST(GltfPrimitives, AreListsStripsAndFans) {
  Gltf gltf;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 1.f, 0.f})
    put(gltf.buffer, x);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  std::string json = gltf.glb();
  const auto withMode = [&](int mode) {
    std::string text =
        R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":)" +
        std::to_string(mode) +
        R"(}]}],"buffers":[{"byteLength":48}],"bufferViews":[{"buffer":0,)"
        R"("byteLength":48}],"accessors":[{"bufferView":0,"componentType":5126,)"
        R"("count":4,"type":"VEC3"}]})";
    return load("mode.glb", glbOf(text, gltf.buffer)).triangles;
  };
  EXPECT_EQ(1u, withMode(4).size());
  ASSERT_EQ(2u, withMode(5).size());
  EXPECT_EQ(2u, withMode(5)[1][0]);
  EXPECT_EQ(1u, withMode(5)[1][1]);
  ASSERT_EQ(2u, withMode(6).size());
  EXPECT_EQ(0u, withMode(6)[1][0]);
  EXPECT_EQ(2u, withMode(6)[1][1]);
  EXPECT_THROW(withMode(1), adaptive_bvh::MeshLoadError) << "lines";
}

/// Version 1 refers by keys, and nodes have several meshes.
TEST(GltfOfVersion1, IsReadAsTextAndBinary) {
  const std::string body =
      R"("scene":"s","scenes":{"s":{"nodes":["n"]}},"nodes":{"n":{"meshes":["m"],)"
      R"("translation":[0,0,0]}},"meshes":{"m":{"primitives":[{"attributes":{"POSITION":"a"},)"
      R"("primitive":4}]}},"accessors":{"a":{"bufferView":"v","byteOffset":0,"byteStride":12,)"
      R"("componentType":5126,"count":3,"type":"VEC3"}},"bufferViews":{"v":{"buffer":"binary_glTF",)"
      R"("byteOffset":0,"byteLength":36}},"buffers":{"binary_glTF":{"byteLength":36,"uri":)";
  std::string buffer;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(buffer, x);
  const TemporaryFile external("buffer of one.bin", buffer);
  const std::string name = external.path().substr(external.path().find_last_of('/') + 1);
  expectRead("one.gltf",
             R"({"asset":{"version":"1.0"},)" + body + "\"" + replaced(name, " ", "%20") + "\"}}}");
  std::string json = R"({"asset":{"version":"1.0"},)" + body + "\"data:,\"}}}";
  std::string binary = "glTF";
  for (const std::size_t word :
       {std::size_t(1), 20 + json.size() + buffer.size(), json.size(), std::size_t(0)})
    put(binary, std::uint32_t(word));
  expectRead("one.glb", binary + json + buffer);
}

/// Without scenes: nodes that are no children, and meshes that no node names.
TEST(GltfScenes, AreNotNeeded) {
  std::string buffer;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(buffer, x);
  const auto firstVertices = [&](const std::string& members) {
    const std::string primitives = R"({"primitives":[{"attributes":{"POSITION":0}}]})";
    const Mesh mesh = load(
        "scenes.glb",
        glbOf(R"({"asset":{"version":"2.0"},)" + members + R"("meshes":[)" + primitives + "," +
                  primitives + R"(],"buffers":[{}],"bufferViews":[{"buffer":0,"byteLength":36}],)" +
                  R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})",
              buffer));
    std::vector<double> x;
    for (const fcl::Triangle& t : mesh.triangles) x.push_back(mesh.vertices[t[0]][0]);
    std::sort(x.begin(), x.end());
    return x;
  };
  const std::string nodes =
      R"("nodes":[{"mesh":1,"translation":[5,0,0]},{"children":[0],"translation":[20,0,0]}],)";
  EXPECT_EQ((std::vector<double>{0, 0}), firstVertices(""));
  EXPECT_EQ((std::vector<double>{0, 0}), firstVertices(R"("scenes":[],"scene":0,"nodes":[],)"));
  EXPECT_EQ((std::vector<double>{0, 25}), firstVertices(nodes));
  EXPECT_EQ((std::vector<double>{0, 25}), firstVertices(R"("scenes":[],)" + nodes));
  EXPECT_EQ((std::vector<double>{5}), firstVertices(R"("scenes":[{"nodes":[0]}],)" + nodes));
  EXPECT_EQ((std::vector<double>{25}), firstVertices(R"("scenes":[{"nodes":[1]}],)" + nodes));
  EXPECT_THROW(firstVertices(R"("nodes":[{"mesh":1,"children":[0]}],)"),
               adaptive_bvh::MeshLoadError);
}

/// Primitives that share positions, as many writers have it, share vertices.
TEST(GltfPrimitives, ShareTheVerticesOfAnAccessor) {
  Gltf gltf;
  gltf.buffer = positions<float>(0);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  const std::string one = R"({"attributes":{"POSITION":0}})";
  std::string json = replaced(gltf.json(), one, one + "," + one);
  adaptive_bvh::MeshLoadOptions options;
  options.weld = false;
  const TemporaryFile file("shared.glb", glbOf(json, gltf.buffer));
  const Mesh mesh = adaptive_bvh::loadMesh(file.path(), options);
  EXPECT_EQ(3u, mesh.vertices.size());
  EXPECT_EQ(2u, mesh.triangles.size());
}

TEST(GltfPrimitives, NameTheirVerticesAsIntegers) {
  Gltf gltf;
  gltf.buffer = positions<float>(0) + std::string("\0\0\1\0\xFF\xFF", 6);
  gltf.accessor = R"("bufferView":0,"componentType":5126},{"bufferView":0,"byteOffset":36,)"
                  R"("count":3,"type":"SCALAR","componentType":5123)";
  const std::string with_indices =
      replaced(gltf.json(), R"("POSITION":0})", R"("POSITION":0},"indices":1)");
  expectRefused("index.glb", glbOf(with_indices, gltf.buffer), "vertex 65535 of 3");
  expectRefused("real.glb", glbOf(replaced(with_indices, "5123", "5126"), gltf.buffer), "integers");
}

// ---- Collada ------------------------------------------------------------------------------------

/// One geometry; the scene as given.
std::string collada(const std::string& primitives, const std::string& scenes) {
  return "<?xml version='1.0'?>\n<!-- a --><COLLADA><library_geometries><geometry id='g'><mesh>"
         "<source id='p'><float_array id='a' count='12'>9 0 0 0 9 1 0 0 9 0 2 0</float_array>"
         "<technique_common><accessor source='#a' count='3' stride='4'><param/>"
         "<param name='X'/><param name='Y'/><param name='Z'/></accessor></technique_common>"
         "</source><vertices id='v'><input semantic='POSITION' source='#p'/></vertices>" +
         primitives + "</mesh></geometry></library_geometries>" + scenes + "</COLLADA>";
}

const std::string kInput = "<input semantic='VERTEX' source='#v' offset='1'/>";
const std::string kScene =
    "<library_visual_scenes><visual_scene id='s'><node><instance_geometry url='#g'/></node>"
    "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/></scene>";

TEST(Collada, IsReadInItsVariants) {
  for (const char* primitive : {"triangles count='1'", "trifans", "tristrips", "polygons count='1'",
                                "polylist count='1'"}) {
    const std::string name = std::string(primitive).substr(0, std::string(primitive).find(' '));
    const std::string count = name == "polylist" ? "<vcount>3</vcount>" : "";
    expectRead("primitives.dae", collada("<" + std::string(primitive) + ">" + kInput + count +
                                             "<p>9 0 9 1 9 2</p></" + name + ">",
                                         kScene));
  }
  const std::string triangles = "<triangles count='1'>" + kInput + "<p>9 0 9 1 9 2</p></triangles>";
  const std::string library = "<library_visual_scenes><visual_scene>",
                    end = "</visual_scene></library_visual_scenes>";
  const std::string geometry = "<instance_geometry url='#g'/>";
  // A node with the id of its geometry; a scene that nothing names, after a node without an id.
  expectRead("ids.dae", collada(triangles, library + "<node id='g'>" + geometry + "</node>" + end));
  expectRead("scene.dae", collada(triangles, "<library_nodes><node/></library_nodes>" + library +
                                                 "<node>" + geometry + "</node>" + end));
  expectRead("skin.dae",
             collada(triangles,
                     "<library_controllers><controller id='c'><skin source='#m'/></controller>"
                     "<controller id='m'><morph source='#g'/></controller></library_controllers>" +
                         library + "<node><instance_controller url='#c'/></node>" + end));
  expectRead("turns.dae",
             collada(triangles, library +
                                    "<node><matrix>0 -1 0 1  1 0 0 0  0 0 1 0  0 0 0 1</matrix>"
                                    "<matrix>0 1 0 0  -1 0 0 1  0 0 1 0  0 0 0 1</matrix>"
                                    "<lookat>0 0 0 0 0 -1 0 1 0</lookat>" +
                                    geometry + "</node>" + end));
}

TEST(Gltf, AndColladaMayBeginWithAByteOrderMark) {
  Gltf gltf;
  gltf.buffer = positions<float>(0);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(1u, load("mark.glb", glbOf(mark + gltf.json(), gltf.buffer)).triangles.size());
  const TemporaryFile buffer("mark.bin", gltf.buffer);
  const std::string uri =
      R"("uri":")" + buffer.path().substr(buffer.path().find_last_of('/') + 1) + "\",";
  const std::string json = replaced(gltf.json(), R"("buffers":[{)", R"("buffers":[{)" + uri);
  EXPECT_EQ(1u, load("mark.gltf", mark + json).triangles.size());
  EXPECT_EQ(1u, load("mark.gltf", mark + json + std::string(3, '\0')).triangles.size());
  expectRead("mark.dae",
             mark + collada("<triangles>" + kInput + "<p>9 0 9 1 9 2</p></triangles>", kScene));
}

TEST(Collada, IsRefusedByName) {
  const std::string triangles = "<triangles count='1'>" + kInput + "<p>9 0 9 1 9 2</p></triangles>";
  const auto scene = [](const std::string& node) {
    return "<library_visual_scenes><visual_scene><node>" + node +
           "</node></visual_scene></library_visual_scenes>";
  };
  const std::string geometry = "<instance_geometry url='#g'/>";
  expectRefused("skew.dae", collada(triangles, scene("<skew>1 0 0 0 0 1 0</skew>" + geometry)),
                "skewed");
  expectRefused("holes.dae",
                collada("<polygons count='1'>" + kInput + "<ph><p>9 0</p></ph></polygons>", kScene),
                "holes");
  expectRefused("count.dae", collada(replaced(triangles, "count='1'", "count='2'"), kScene),
                "announces '2' faces, and has 1");
  expectRefused("cut.dae", collada(replaced(triangles, " 2<", "<"), kScene), "ends early");
  expectRefused("geometry.dae", collada(triangles, scene("<instance_geometry url='#h'/>")),
                "no <geometry> '#h'");
  expectRefused("node.dae",
                collada(triangles, scene("<instance_node url='#n'/>" + geometry) +
                                       "<extra><a><node id='n'/></a></extra>"),
                "unknown node '#n'");
  expectRefused("numbers.dae", collada(triangles, scene("<scale>1 2</scale>" + geometry)),
                "<scale> has not 3 numbers");
  expectRefused(
      "past.dae",
      replaced(collada(triangles, kScene), "count='3' stride='4'", "count='4' stride='4'"),
      "past its array");
  expectRefused("no_scene.dae", collada(triangles, ""), "no scene");
  expectRefused("tags.dae", collada(triangles + "</p>", kScene),
                "does not match the open element: 'p'");
  expectRefused("root.dae", "<x3d/>", "no Collada file");
}

// ---- by content ---------------------------------------------------------------------------------

TEST(LoadMesh, KnowsFilesWithoutAnExtensionByTheirContent) {
  const std::string obj = "# a\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";
  const std::string ply = plyHeader("ascii", "float") + kOffBody;
  Gltf gltf;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(gltf.buffer, x);
  gltf.accessor = R"("bufferView":0,"componentType":5126)";
  const std::string json =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36,"uri":)"
      R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA"}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3"}]})";
  for (const std::string& content : {kStl, upperCase(kStl), binaryStl("part"), binaryStl("solid"),
                                     "OFF\n3 1 0\n" + kOffBody, obj, ply, gltf.glb(), json})
    for (const char* name : {"without", "unknown.xyzzy", "a.b/../dots"}) {
      if (name[1] == '.') continue;
      expectRead(name, content);
    }
  expectRead("ply.stl", ply);
  expectRead("glb.obj", gltf.glb());
  expectRead("UPPER.STL", kStl);
}

// ---- precision ----------------------------------------------------------------------------------

// A shape of 1 mm, 1000 km away.
TEST(LoadMesh, KeepsSmallShapesFarFromTheOrigin) {
  const std::string a = "1000000 0 0", b = "1000000.001 0 0", c = "1000000 0.001 0";
  const std::string points = a + "\n" + b + "\n" + c + "\n";
  const std::string ply = plyHeader("ascii", "double") + points + "3 0 1 2\n";
  std::string binary = plyHeader("binary_little_endian", "double");
  for (const double x : {1000000., 0., 0., 1000000.001, 0., 0., 1000000., 0.001, 0.})
    put(binary, x);
  put(binary, std::uint8_t(3));
  for (const int v : {0, 1, 2}) put(binary, v);
  const std::string dae =
      "<COLLADA><library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' "
      "count='9'>" +
      points +
      "</float_array><technique_common><accessor source='#a' count='3' stride='3'/>"
      "</technique_common></source><vertices id='v'><input semantic='POSITION' source='#p'/>"
      "</vertices><triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/>"
      "<p>0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>"
      "<visual_scene id='s'><node><instance_geometry url='#g'/></node></visual_scene>"
      "</library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>";
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"far.obj", "v " + a + "\nv " + b + "\nv " + c + "\nf 1 2 3\n"},
           {"far.off", "OFF\n3 1 0\n" + points + "3 0 1 2\n"},
           {"far.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b +
                           "\nvertex " + c + "\nendloop\nendfacet\nendsolid\n"},
           {"text.ply", ply},
           {"binary.ply", binary},
           {"far.dae", dae}}) {
    const Mesh mesh = load(name, text);
    ASSERT_EQ(1u, mesh.triangles.size()) << name;
    EXPECT_EQ(1000000.001, mesh.vertices[1].x()) << name;
    EXPECT_EQ(0.001, mesh.vertices[2].y()) << name;
  }
  // AC3D, as another format that assimp reads.
  const auto ac = [](const std::string& at) {
    return "AC3Db\nMATERIAL \"\" rgb 1 1 1 amb 0 0 0 emis 0 0 0 spec 0 0 0 shi 0 trans 0\n"
           "OBJECT world\nkids 1\nOBJECT poly\nnumvert 3\n" +
           at + " 0 0\n" + at + ".001 0 0\n" + at +
           " 0.001 0\nnumsurf 1\nSURF 0x30\nmat 0\nrefs 3\n0 0 0\n1 0 0\n2 0 0\nkids 0\n";
  };
  EXPECT_EQ(1u, load("near.ac", ac("1")).triangles.size());
  expectRefused("far.ac", ac("1000000"), "single precision");
}

}  // namespace mesh_formats_test
}  // namespace adaptive_bvh_test
