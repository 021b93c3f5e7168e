// Files that are broken in every way we can think of: loadMesh throws MeshLoadError, or what it
// returns is sound. No crash, no leak of ours (the sanitizers look on), no memory beyond what the
// size of the file explains.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <random>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/bytes.h"
#include "support/heap_peak.h"
#include "support/long_mode.h"
#include "support/temporary_file.h"

/// assimp forgets what it has read so far when it gives a file up.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp.so"; }

namespace adaptive_bvh_test {
namespace {

using Mesh = adaptive_bvh::TriangleMesh<double>;

/// More than any reader needs for files of some kilobytes.
constexpr long kFewMegabytes = 64 << 20;

/// Loads `text` as a file of this kind. True when there was a mesh in it.
bool load(const std::string& extension, const std::string& text) {
  const TemporaryFile file("corrupt." + extension, text);
  const std::string& path = file.path();
  const HeapPeak peak;
  bool loaded = false;
  try {
    const Mesh mesh = adaptive_bvh::loadMesh<double>(path);
    loaded = true;
    EXPECT_FALSE(mesh.triangles.empty());
    for (const auto& p : mesh.vertices) EXPECT_TRUE(p.allFinite());
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) EXPECT_LT(t[k], mesh.vertices.size());
  } catch (const adaptive_bvh::MeshLoadError& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find(path));
    EXPECT_GT(std::string(error.what()).size(), path.size() + 24) << "no reason: " << error.what();
  }
  EXPECT_LT(peak.bytes(), kFewMegabytes) << extension;
  return loaded;
}

// A strip of kCells quads, two triangles each.
constexpr unsigned kCells = 20;
constexpr unsigned kVertices = 2 * (kCells + 1), kTriangles = 2 * kCells;

fcl::Vector3f vertex(unsigned v) { return {float(v / 2), float(v % 2), 0.25f * float(v % 3)}; }
std::array<unsigned, 3> triangle(unsigned t) {
  const unsigned v = t / 2 * 2;
  if (t % 2) return {v + 1, v + 2, v + 3};
  return {v, v + 2, v + 1};
}

struct Counts {
  unsigned long vertices = kVertices, triangles = kTriangles;
  unsigned index = 2;  ///< of the last triangle's first corner
};

std::array<unsigned, 3> corners(const Counts& counts, unsigned t) {
  std::array<unsigned, 3> corners = triangle(t);
  if (t + 1 == kTriangles) corners[0] = counts.index;
  return corners;
}

std::string obj(const Counts& counts) {
  std::string text;
  for (unsigned v = 0; v < kVertices; ++v)
    text += "v " + std::to_string(vertex(v)[0]) + " " + std::to_string(vertex(v)[1]) + " " +
            std::to_string(vertex(v)[2]) + "\n";
  for (unsigned t = 0; t < kTriangles; ++t) {
    text += "f";
    for (unsigned v : corners(counts, t)) text += " " + std::to_string(v + 1);
    text += "\n";
  }
  return text;
}

std::string off(const Counts& counts) {
  std::string text =
      "OFF\n" + std::to_string(counts.vertices) + " " + std::to_string(counts.triangles) + " 0\n";
  for (unsigned v = 0; v < kVertices; ++v)
    text += std::to_string(vertex(v)[0]) + " " + std::to_string(vertex(v)[1]) + " " +
            std::to_string(vertex(v)[2]) + "\n";
  for (unsigned t = 0; t < kTriangles; ++t) {
    text += "3";
    for (unsigned v : corners(counts, t)) text += " " + std::to_string(v);
    text += "\n";
  }
  return text;
}

std::string plyHeader(const Counts& counts, const std::string& format) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(counts.vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(counts.triangles) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string plyText(const Counts& counts) {
  std::string text = plyHeader(counts, "ascii");
  const std::string body = off(counts);
  return text + body.substr(body.find('\n', 4) + 1);
}

std::string plyBinary(const Counts& counts) {
  std::string bytes = plyHeader(counts, "binary_little_endian");
  for (unsigned v = 0; v < kVertices; ++v)
    for (float x : vertex(v)) put(bytes, x);
  for (unsigned t = 0; t < kTriangles; ++t) {
    put(bytes, std::uint8_t(3));
    for (unsigned v : corners(counts, t)) put(bytes, v);
  }
  return bytes;
}

std::string stlText(const Counts&) {
  std::string text = "solid strip\n";
  for (unsigned t = 0; t < kTriangles; ++t) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (unsigned v : triangle(t))
      text += "vertex " + std::to_string(vertex(v)[0]) + " " + std::to_string(vertex(v)[1]) + " " +
              std::to_string(vertex(v)[2]) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid strip\n";
}

std::string stlBinary(const Counts& counts) {
  std::string bytes(80, ' ');
  put(bytes, std::uint32_t(counts.triangles));
  for (unsigned t = 0; t < kTriangles; ++t) {
    for (float x : {0.f, 0.f, 1.f}) put(bytes, x);
    for (unsigned v : triangle(t))
      for (float x : vertex(v)) put(bytes, x);
    put(bytes, std::uint16_t(0));
  }
  return bytes;
}

std::string collada(const Counts& counts) {
  std::string points, indices;
  for (unsigned v = 0; v < kVertices; ++v)
    for (float x : vertex(v)) points += std::to_string(x) + " ";
  for (unsigned t = 0; t < kTriangles; ++t)
    for (unsigned v : corners(counts, t)) indices += std::to_string(v) + " ";
  const std::string count = std::to_string(counts.vertices);
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
 <library_geometries><geometry id="g"><mesh><source id="p">
  <float_array id="pa" count=")" +
         std::to_string(3 * counts.vertices) + "\">" + points + R"(</float_array>
  <technique_common><accessor source="#pa" count=")" +
         count + R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
  <param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count=")" +
         std::to_string(counts.triangles) +
         R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)" + indices +
         R"(</p></triangles></mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node id="a"><instance_geometry url="#g"/></node>
 </visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

std::string gltfBuffer(const Counts& counts) {
  std::string bytes;
  for (unsigned t = 0; t < kTriangles; ++t)
    for (unsigned v : corners(counts, t)) put(bytes, v);
  for (unsigned v = 0; v < kVertices; ++v)
    for (float x : vertex(v)) put(bytes, x);
  return bytes;
}

std::string gltfJson(const Counts& counts, const std::string& uri) {
  const std::string index_bytes = std::to_string(12 * kTriangles);
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],)"
         R"("buffers":[{)" +
         uri + R"("byteLength":)" + std::to_string(12 * (kTriangles + kVertices)) +
         R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + index_bytes +
         R"(},{"buffer":0,"byteOffset":)" + index_bytes + R"(,"byteLength":)" +
         std::to_string(12 * kVertices) +
         R"(}],"accessors":[{"bufferView":0,"componentType":5125,"count":)" +
         std::to_string(3 * counts.triangles) +
         R"(,"type":"SCALAR"},{"bufferView":1,"componentType":5126,"count":)" +
         std::to_string(counts.vertices) + R"(,"type":"VEC3","min":[0,0,0],"max":[20,1,0.5]}]})";
}

std::string gltf(const Counts& counts) {
  return gltfJson(counts, R"("uri":"data:application/octet-stream;base64,)" +
                              base64(gltfBuffer(counts)) + "\",");
}

std::string glb(const Counts& counts) { return glbOf(gltfJson(counts, ""), gltfBuffer(counts)); }

/// More by hand: ADAPTIVE_BVH_SEEDS=20000.
unsigned seeds() {
  const char* given = std::getenv("ADAPTIVE_BVH_SEEDS");
  return given ? unsigned(std::atoi(given)) : 300;
}

struct Format {
  const char* name;
  const char* extension;
  std::string (*write)(const Counts&);

  friend void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }
};

class CorruptMesh : public testing::TestWithParam<Format> {
 protected:
  bool load(const std::string& text) const {
    return adaptive_bvh_test::load(GetParam().extension, text);
  }
  std::string write(const Counts& counts = Counts()) const { return GetParam().write(counts); }
};

TEST_P(CorruptMesh, IsReadWhileItIsWhole) { EXPECT_TRUE(load(write())); }

TEST_P(CorruptMesh, CutAnywhere) {
  const std::string whole = write();
  for (std::size_t k = 0; k < 60; ++k) load(whole.substr(0, whole.size() * k / 60));
}

TEST_P(CorruptMesh, WithCountsThatAreWrong) {
  for (unsigned long count : {0ul, 1ul, 7ul, 1000ul, 100000000ul, 715827882ul, 2147483647ul,
                              2147483648ul, 4294967295ul, 18446744073709551615ul}) {
    Counts counts;
    counts.vertices = count;
    load(write(counts));
    counts = Counts();
    counts.triangles = count;
    load(write(counts));
    counts.vertices = count;
    load(write(counts));
  }
}

TEST_P(CorruptMesh, WithAnIndexThatIsOutOfRange) {
  for (unsigned index : {kVertices, kVertices + 1, 1000u, 1u << 30, 2147483647u, 2147483648u,
                         4294967294u, 4294967295u}) {
    Counts counts;
    counts.index = index;
    load(write(counts));
  }
}

TEST_P(CorruptMesh, WithBytesOverwritten) {
  const std::string whole = write();
  for (unsigned seed = 1; seed <= seeds(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(testSeed(seed));
    std::string text = whole;
    for (int k = int(random() % 4); k >= 0; --k) {
      const std::size_t where = random() % text.size();
      if (random() % 2)
        text[where] = char(random());
      else
        text[where] = "0123456789 -.e\n\"{}[],<>/"[random() % 24];
    }
    if (random() % 8 == 0) text.erase(random() % text.size(), random() % 40);
    load(text);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, CorruptMesh,
                         testing::Values(Format{"Obj", "obj", obj}, Format{"Off", "off", off},
                                         Format{"PlyText", "ply", plyText},
                                         Format{"PlyBinary", "ply", plyBinary},
                                         Format{"StlText", "stl", stlText},
                                         Format{"StlBinary", "stl", stlBinary},
                                         Format{"Collada", "dae", collada},
                                         Format{"Gltf", "gltf", gltf}, Format{"Glb", "glb", glb}),
                         [](const auto& info) { return std::string(info.param.name); });

// The counts may stand beside the keyword, and both behind comments.
TEST(CorruptOff, CountsAreFoundWhereverTheyStand) {
  const std::string body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  for (const char* header : {"OFF\n3 1 0\n", "OFF 3 1 0\n", "# a\nOFF # b\n# c\n3 1\n0\n"}) {
    EXPECT_TRUE(load("off", header + body)) << header;
    std::string huge = header;
    EXPECT_FALSE(load("off", huge.replace(huge.find('3'), 1, "100000000") + body)) << header;
    EXPECT_FALSE(load("off", huge.replace(huge.find("100000000"), 9, "3000000000") + body));
  }
}

// Lines without corners are faces, too.
TEST(CorruptOff, WithMoreLinesThatAreNoFacesThanFaces) {
  EXPECT_FALSE(load("off", "OFF\n1 1 0\n0 0 0\nx\n0\n3 0 0 0\n"));
  EXPECT_FALSE(load("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n0 1 0\n12 0 1 2\n3 0 1 2\n"));
  EXPECT_TRUE(load("off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n0\n3 0 1 2\n3 0 1 2\n"));
}

TEST(CorruptOff, ALineMayBeLong) {
  const std::string file = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
  EXPECT_TRUE(load("off", file + std::string(4000, ' ') + "\n"));
  EXPECT_TRUE(load("off", file + std::string(5000, ' ') + "\n"));
}

// Three letters are enough to recognise the format.
TEST(CorruptPly, WithMoreBehindTheMagicWord) {
  std::string text = plyBinary(Counts());
  text.replace(0, 3, "pLy<p>");
  text.replace(text.find("end_header"), 10, "endrte_header");
  EXPECT_FALSE(load("ply", text));
}

}  // namespace
}  // namespace adaptive_bvh_test
