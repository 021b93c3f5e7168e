// Files that are broken in every way we can think of: loadMesh throws MeshLoadError, or what it
// returns is sound. No crash, no leak of ours (the sanitizers look on), no time and memory beyond
// what the size of the file explains. With ADAPTIVE_BVH_LONG_TESTS 10^5 damaged files a format.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <random>
#include <unordered_map>

#include "support/bytes.h"
#include "support/load_limits.h"
#include "support/long_mode.h"
#include "support/temporary_file.h"
#include "support/zip.h"

/// assimp forgets what it has read so far when it gives a file up.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp.so"; }

namespace adaptive_bvh_test {
namespace corrupt_meshes_test {

/// Loads `text` as a file of this kind, within the limits. True when there was a mesh in it.
bool load(const std::string& extension, const std::string& text) {
  const TemporaryFile file("corrupt." + extension, text);
  return loadWithinLimits(file.path(), text.size()).empty();
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

/// With bytes after each triangle, as many as its attribute count says.
std::string stlPayloads(const Counts& counts) {
  std::string bytes(80, ' ');
  put(bytes, std::uint32_t(counts.triangles));
  const std::string plain = stlBinary(counts);
  for (unsigned t = 0; t < kTriangles; ++t) {
    bytes += plain.substr(84 + 50 * t, 48);
    put(bytes, std::uint16_t(t % 7));
    bytes += std::string(t % 7, 'p');
  }
  return bytes;
}

std::string amf(const Counts& counts) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<amf unit=\"inch\"><object id=\"0\"><mesh><vertices>";
  for (unsigned v = 0; v < kVertices; ++v)
    text += "<vertex><coordinates><x>" + std::to_string(vertex(v)[0]) + "</x><y>" +
            std::to_string(vertex(v)[1]) + "</y><z>" + std::to_string(vertex(v)[2]) +
            "</z></coordinates></vertex>";
  text += "</vertices><volume>";
  for (unsigned t = 0; t < kTriangles; ++t) {
    const auto c = corners(counts, t);
    text += "<triangle><v1>" + std::to_string(c[0]) + "</v1><v2>" + std::to_string(c[1]) +
            "</v2><v3>" + std::to_string(c[2]) + "</v3></triangle>";
  }
  return text + "</volume></mesh></object></amf>";
}

std::string model3mf(const Counts& counts) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<model unit=\"inch\" xmlns=\"http://schemas.microsoft.com/"
      "3dmanufacturing/core/2015/02\"><resources><object id=\"1\" type=\"model\"><mesh><vertices>";
  for (unsigned v = 0; v < kVertices; ++v)
    text += "<vertex x=\"" + std::to_string(vertex(v)[0]) + "\" y=\"" +
            std::to_string(vertex(v)[1]) + "\" z=\"" + std::to_string(vertex(v)[2]) + "\"/>";
  text += "</vertices><triangles>";
  for (unsigned t = 0; t < kTriangles; ++t) {
    const auto c = corners(counts, t);
    text += "<triangle v1=\"" + std::to_string(c[0]) + "\" v2=\"" + std::to_string(c[1]) +
            "\" v3=\"" + std::to_string(c[2]) + "\"/>";
  }
  return text +
         "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>";
}

/// A sound archive of a model, which may be broken.
std::string archiveOf(const std::string& model) {
  return zipOf({{"_rels/.rels",
                 "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/"
                 "relationships\"><Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
                 "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
                 "</Relationships>"},
                {"3D/3dmodel.model", model}},
               Zipped::OwnCode);
}

std::string archive3mf(const Counts& counts) { return archiveOf(model3mf(counts)); }

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
  return given ? unsigned(std::atoi(given)) : isLongMode() ? 100000 : 300;
}

/// A piece of a file: a line of a text, or some bytes.
struct Piece {
  std::size_t begin, size;

  Piece(const std::string& text, std::mt19937& random) : begin(random() % text.size()) {
    if (random() % 2) {
      const std::size_t before = text.rfind('\n', begin), after = text.find('\n', begin);
      begin = before == text.npos ? 0 : before + 1;
      size = (after == text.npos || after < begin ? text.size() : after + 1) - begin;
    } else {
      size = 1 + random() % 40;
    }
    size = std::min({size, text.size() - begin, std::size_t(200)});
  }
};

/// Numbers and words that readers may stumble over.
const std::string& awkward(std::mt19937& random) {
  static const std::vector<std::string> kWords = {"0",
                                                  "-1",
                                                  "1e999",
                                                  "-1e-999",
                                                  "nan",
                                                  "inf",
                                                  "4294967295",
                                                  "2147483648",
                                                  "18446744073709551616",
                                                  "1.5",
                                                  "0x10",
                                                  "+",
                                                  "-",
                                                  ".",
                                                  "\\\n",
                                                  "#",
                                                  "\r",
                                                  "\n\n",
                                                  " ",
                                                  std::string(1, '\0'),
                                                  "\xEF\xBB\xBF",
                                                  "\xE9",
                                                  "\xFF\xFE",
                                                  "1/2/3",
                                                  "f 1 2 3\n",
                                                  "v 1 2 3\n",
                                                  "endsolid\n",
                                                  "facet normal",
                                                  "element vertex 0\n",
                                                  "element x 9\n",
                                                  "property list char char c\n",
                                                  "end_header\n",
                                                  "</vertices>",
                                                  "<a>",
                                                  "\"",
                                                  "&#1;"};
  return kWords[random() % kWords.size()];
}

/// Damages a file in one of many ways: bytes, words, pieces that are moved, doubled or lost.
void damage(std::string& text, std::mt19937& random) {
  const std::string original = text;
  for (int k = int(random() % 4); k >= 0 && !text.empty(); --k) {
    const Piece piece(text, random);
    const std::size_t where = random() % text.size();
    switch (random() % 9) {
      case 0: text[where] = char(random()); break;
      case 1: text[where] = "0123456789 -.e\n\"{}[],<>/"[random() % 24]; break;
      case 2: text[where] = char(text[where] ^ 1 << random() % 8); break;
      case 3: text.erase(piece.begin, piece.size); break;
      case 4: text.insert(where, text.substr(piece.begin, piece.size)); break;
      case 5: text.insert(where, awkward(random)); break;
      case 6:
        text.replace(piece.begin, std::min<std::size_t>(piece.size, 4), awkward(random));
        break;
      case 7: text.resize(where + 1); break;
      default:
        if (random() % 8 == 0) text += original;
        for (int doubled = int(random() % 30); doubled > 0; --doubled)
          text.insert(piece.begin, text.substr(piece.begin, piece.size));
    }
  }
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
    return corrupt_meshes_test::load(GetParam().extension, text);
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

TEST_P(CorruptMesh, DamagedInManyWays) {
  const std::string whole = write();
  unsigned loaded = 0;
  for (unsigned seed = 1; seed <= seeds() && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(testSeed(seed));
    std::string text = whole;
    damage(text, random);
    loaded += load(text);
  }
  if (isLongMode()) std::printf("%u of %u were read, the others refused\n", loaded, seeds());
}

INSTANTIATE_TEST_SUITE_P(
    Formats, CorruptMesh,
    testing::Values(Format{"Obj", "obj", obj}, Format{"Off", "off", off},
                    Format{"PlyText", "ply", plyText}, Format{"PlyBinary", "ply", plyBinary},
                    Format{"StlText", "stl", stlText}, Format{"StlBinary", "stl", stlBinary},
                    Format{"StlPayloads", "stl", stlPayloads}, Format{"Amf", "amf", amf},
                    Format{"Archive3mf", "3mf", archive3mf}, Format{"Collada", "dae", collada},
                    Format{"Gltf", "gltf", gltf}, Format{"Glb", "glb", glb}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Corrupt3mf, WithADamagedModelInASoundArchive) {
  const std::string whole = model3mf(Counts());
  unsigned loaded = 0;
  for (unsigned seed = 1; seed <= seeds() && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(testSeed(seed));
    std::string model = whole;
    damage(model, random);
    loaded += load("3mf", archiveOf(model));
  }
  if (isLongMode()) std::printf("%u of %u were read, the others refused\n", loaded, seeds());
}

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

// ---- small files that would take long -----------------------------------------------------------

/// A PLY file of a triangle, and what its header announces before.
std::string plyAfter(const std::string& elements, const std::string& format = "ascii") {
  return "ply\nformat " + format + " 1.0\n" + elements +
         "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
}

TEST(HostilePly, ElementsWithoutPropertiesTakeNoTime) {
  std::string elements;
  for (int i = 0; i < 45000; ++i) elements += "element a" + std::to_string(i) + " 900000\n";
  EXPECT_TRUE(load("ply", plyAfter(elements) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
}

// Of a byte each: corners of strips, positions, and corners of polygons.
TEST(HostilePly, NumbersOfAByteTakeLittleMemory) {
  std::mt19937 random(testSeed(1));
  const auto header = [](unsigned vertices, const std::string& faces) {
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
           "\nproperty char x\nproperty char y\nproperty char z\n" + faces + "end_header\n";
  };
  const auto bytes = [&random](unsigned count, unsigned below) {
    std::string text;
    for (unsigned i = 0; i < count; ++i) text += char(random() % below);
    return text;
  };
  std::string strips =
      header(200, "element tristrips 1\nproperty list int uchar vertex_indices\n") +
      bytes(600, 256);
  put(strips, 900000);
  EXPECT_TRUE(load("ply", strips + bytes(900000, 200)));
  std::string positions =
      header(300000, "element face 1\nproperty list uchar uchar vertex_indices\n") +
      bytes(900000, 256);
  EXPECT_TRUE(load("ply", positions + "\3\2\1" + '\0'));
  std::string polygons =
      header(250, "element face 3500\nproperty list uchar uchar vertex_indices\n") +
      bytes(750, 256);
  for (int face = 0; face < 3500; ++face) polygons += char(250) + bytes(250, 250);
  load("ply", polygons);
}

/// An OBJ file of polygons over all of its points.
std::string objOf(const std::vector<fcl::Vector3d>& points, int faces = 1) {
  std::string text, face = "f";
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (int k = 0; k < 3; ++k) text += (k ? " " : "v ") + std::to_string(points[v][k]);
    text += "\n";
    face += " " + std::to_string(v + 1);
  }
  for (; faces > 0; --faces) text += face + "\n";
  return text;
}

TEST(HostileObj, PolygonsOfManyCornersAreReadOrRefusedInTime) {
  constexpr int kCorners = 10000;
  const auto polygon = [](const auto& point) {
    std::vector<fcl::Vector3d> points;
    for (int i = 0; i < kCorners; ++i) points.push_back(point(i));
    return points;
  };
  using Point = fcl::Vector3d;
  for (const double slope : {0., 1., 0.3}) {
    auto line = polygon([&](int i) { return Point(0.1 * i, slope * 0.1 * i, 0); });
    EXPECT_FALSE(load("obj", objOf(line))) << "no area";
    line.back() = {0, 1000, 0};  // an apex
    load("obj", objOf(line));
    line.back() = {0, 0, 1000};
    load("obj", objOf(line));
  }
  const auto onCircle = [](int i) {
    return Point(1000 * std::cos(2e-4 * M_PI * i), 1000 * std::sin(2e-4 * M_PI * i), 0);
  };
  EXPECT_TRUE(load("obj", objOf(polygon(onCircle), 20)));
  const auto spiral = [](int i) {
    const int turn = i < kCorners / 2 ? i : kCorners - i;
    const double radius = 10 + 0.02 * turn + (turn == i ? 0 : 1), angle = 0.02 * M_PI * turn;
    return Point(radius * std::cos(angle), radius * std::sin(angle), 0);
  };
  EXPECT_TRUE(load("obj", objOf(polygon(spiral))));
  const auto comb = [](int i) { return Point(i, 7 * i, 0) + (i % 2) * Point(-70000, 10000, 0); };
  load("obj", objOf(polygon(comb)));
  std::mt19937 random(testSeed(3));
  std::uniform_real_distribution<double> anywhere(-1, 1);
  EXPECT_FALSE(load("obj", objOf(polygon([&](int) {
                                   return Point(anywhere(random), anywhere(random),
                                                anywhere(random));
                                 }),
                                 5)));
}

/// A number of which std::hash of libstdc++ is this; it multiplies and shifts 64 bits.
double unhashed(std::uint64_t hash) {
  constexpr std::uint64_t kFactor = (std::uint64_t(0xc6a4a793UL) << 32) + 0x5bd1e995UL;
  std::uint64_t inverse = 1;
  for (int k = 0; k < 6; ++k) inverse *= 2 - kFactor * inverse;  // Newton
  const auto unmix = [](std::uint64_t x) { return x ^ x >> 47; };
  hash = unmix(unmix(hash) * inverse);
  hash = hash * inverse ^ std::uint64_t(0xc70f6907UL) ^ 8 * kFactor;
  hash = unmix(hash * inverse) * inverse;
  double number;
  std::memcpy(&number, &hash, sizeof(number));
  return number;
}

// All in one bucket of an unordered container with the standard hash: by its count of buckets.
TEST(HostileObj, VerticesCannotMeetInABucketOfWelding) {
  constexpr std::size_t kVertices = 84000;
  std::unordered_multimap<double, int> counted;
  for (std::size_t i = 0; i < kVertices; ++i) counted.emplace(double(i), 0);
  std::string text;
  std::size_t found = 0;
  char line[64];
  for (std::uint64_t k = 1; found < kVertices; ++k) {
    const double z = unhashed(k * counted.bucket_count());
    if (!std::isfinite(z) || z == 0) continue;
    std::snprintf(line, sizeof(line), "v 0 0 %.17g\n", z);
    text += line;
    ++found;
  }
  EXPECT_EQ(7 * counted.bucket_count(), std::hash<double>()(unhashed(7 * counted.bucket_count())));
  EXPECT_TRUE(load("obj", text + "f 1 2 3\n"));
}

TEST(HostileObj, LongLinesAndWordsTakeNoTime) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", face = "f 1 2 3\n";
  std::string joined = vertices;
  for (int i = 0; i < 400000; ++i) joined += "\\\n";
  EXPECT_TRUE(load("obj", joined + face));
  EXPECT_TRUE(load("obj", "v 0." + std::string(900000, '1') + " 0 0\n" + vertices + face));
  EXPECT_FALSE(load("obj", vertices + "f 1 2 " + std::string(900000, '9') + "\n"));
  std::string small;
  for (int i = 0; i < 40000; ++i) small += "v 1e-399 1e-399 1e-399\n";
  EXPECT_TRUE(load("obj", small + vertices + face));
}

// Zeros compress by a factor of a thousand.
TEST(Hostile3mf, ArchivesAreNotDecompressedWithoutBound) {
  EXPECT_FALSE(load("3mf", archiveOf(model3mf(Counts()) + std::string(4000000, '0'))));
}

}  // namespace corrupt_meshes_test
}  // namespace adaptive_bvh_test
