// What files say beside the plain numbers of a format: byte order marks, the lines of a PLY text,
// payloads of binary STL, units, bytes that are not UTF-8; and what assimp returns of a broken
// file.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "support/bytes.h"
#include "support/load_reason.h"
#include "support/long_mode.h"
#include "support/temporary_file.h"
#include "support/zip.h"

namespace adaptive_bvh_test {
namespace mesh_contents_test {

using adaptive_bvh::loadMesh;
using adaptive_bvh::MeshLoadError;
using adaptive_bvh::MeshLoadOptions;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;

Mesh load(const std::string& name, const std::string& bytes, MeshLoadOptions options = {}) {
  options.weld = false;
  const TemporaryFile file(name, bytes);
  return loadMesh(file.path(), options);
}

std::string refusal(const std::string& name, const std::string& bytes) {
  const TemporaryFile file(name, bytes);
  return reasonOf(file.path());
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != text.npos;
}

// ---- byte order marks ---------------------------------------------------------------------------

const std::string kMark = "\xEF\xBB\xBF";
const std::string kStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 9 9 9\nvertex 1 0 0\nvertex 0 2 0\nendloop\n"
    "endfacet\nendsolid a\n";
const std::string kObj = "v 9 9 9\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";
const std::string kOff = "OFF\n3 1 0\n9 9 9\n1 0 0\n0 2 0\n3 0 1 2\n";
const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kPlyBody = "9 9 9\n1 0 0\n0 2 0\n3 0 1 2\n";

void expectTriangle(const Mesh& mesh) {
  ASSERT_EQ(1u, mesh.triangles.size());
  ASSERT_EQ(3u, mesh.vertices.size());
  EXPECT_EQ(Point(9, 9, 9), mesh.vertices[mesh.triangles[0][0]]);
  EXPECT_EQ(Point(0, 2, 0), mesh.vertices[mesh.triangles[0][2]]);
}

TEST(ByteOrderMark, IsSkippedInEveryTextFormat) {
  for (const auto& [name, text] :
       std::vector<std::pair<std::string, std::string>>{{"mark.obj", kObj},
                                                        {"mark.stl", kStl},
                                                        {"mark.off", kOff},
                                                        {"mark.ply", kPly + kPlyBody},
                                                        {"commented.obj", "# a\n" + kObj},
                                                        {"lines.obj", "\n" + kObj}})
    for (const std::string& extension : {std::string(), std::string("_without")}) {
      SCOPED_TRACE(name + extension);  // by its name, and by its content
      EXPECT_NO_THROW(expectTriangle(load(name + extension, kMark + text)));
    }
}

// What `copy a.obj + b.obj` makes.
TEST(ByteOrderMark, IsSkippedWhereObjFilesWereJoined) {
  const Mesh mesh = load("joined.obj", kMark + "v 9 9 9\nv 1 0 0\n" + kMark + "v 0 2 0\nf 1 2 3\n");
  expectTriangle(mesh);
}

TEST(ByteOrderMark, InABinaryFileIsPartOfIt) {
  std::string bytes = kMark;
  bytes.resize(80, ' ');
  put(bytes, std::uint32_t(1));
  for (const float x : {0.f, 0.f, 1.f, 9.f, 9.f, 9.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(bytes, x);
  put(bytes, std::uint16_t(0));
  expectTriangle(load("binary.stl", bytes));
  expectTriangle(load("trailing.stl", bytes + "\n"));
}

// ---- PLY by lines -------------------------------------------------------------------------------

TEST(PlyText, HasAnElementALine) {
  expectTriangle(load("blank.ply", kPly + "\n9 9 9\n \n1 0 0\n0 2 0\n\n3 0 1 2\n\n \n"));
  expectTriangle(load("no_end.ply", kPly + kPlyBody.substr(0, kPlyBody.size() - 1)));
  const auto why = [](const std::string& body) { return refusal("lines.ply", kPly + body); };
  EXPECT_TRUE(contains(why("9 9 9 7\n1 0 0\n0 2 0\n3 0 1 2\n"), "line 10: '7' is more than"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n0 2\n0 3 0 1 2\n"), "line 12: its line ends early"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n0 2 0\n3 0 1 2 255\n"), "line 13: '255' is more than"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n0 2 0\n3 0 1\n"), "line 13: its line ends early"));
  EXPECT_TRUE(contains(why(kPlyBody + "3 2 1 0\n"), "line 14: '3' is more than"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n3 0 1 2\n"), "element 2 of 3 'vertex'"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n0 2 0\n3 0 1.5 2\n"), "'1.5' is no integer"));
  EXPECT_TRUE(contains(why("9 9 9\n1 0 0\n0 2 0\n2.5 0 1 2\n"), "'2.5' is no integer"));
}

/// A PLY text of elements that need not be read, and the mesh in it.
struct RandomPly {
  struct Row {
    std::size_t element;
    std::string text;
  };
  std::string header;
  std::vector<Row> rows;
  std::vector<Point> vertices;
  std::size_t faces = 0;

  explicit RandomPly(std::mt19937& random) {
    header = "ply\nformat ascii 1.0\n";
    const auto number = [&] { return std::to_string(int(random() % 100)); };
    const std::size_t before = random() % 3, count = 3 + random() % 6;
    addElement("other", before, "property float a\nproperty list uchar int b\n", [&](std::size_t) {
      const std::size_t size = random() % 3;
      std::string row = number() + " " + std::to_string(size);
      for (std::size_t k = 0; k < size; ++k) row += " " + number();
      return row;
    });
    const bool has_colour = random() % 2 == 0;
    addElement("vertex", count,
               std::string("property double x\nproperty double y\nproperty double z\n") +
                   (has_colour ? "property uchar red\n" : ""),
               [&](std::size_t) {
                 vertices.emplace_back(random() % 100, random() % 100, random() % 100);
                 std::ostringstream row;
                 row << vertices.back().transpose();
                 return row.str() + (has_colour ? " " + number() : "");
               });
    faces = 1 + random() % 5;
    addElement("face", faces, "property list uchar int vertex_indices\n", [&](std::size_t) {
      std::string row = "3";
      for (int k = 0; k < 3; ++k) row += " " + std::to_string(random() % count);
      return row;
    });
    header += "end_header\n";
  }

  template <typename Row>
  void addElement(const std::string& name, std::size_t count, const std::string& properties,
                  const Row& row) {
    header += "element " + name + " " + std::to_string(count) + "\n" + properties;
    for (std::size_t i = 0; i < count; ++i) rows.push_back({rows.size(), row(i)});
  }

  std::string text() const {
    std::string all = header;
    for (const Row& row : rows) all += row.text + "\n";
    return all;
  }
};

// A row too many or too few, a number too many or too few in a row: refused. Whole: the mesh.
TEST(PlyText, WithRowsOrNumbersTooManyOrTooFewIsRefused) {
  std::mt19937 random(testSeed(19));
  for (int round = 0; round < manySteps(1500); ++round) {
    RandomPly ply(random);
    SCOPED_TRACE("round " + std::to_string(round));
    const Mesh mesh = load("whole.ply", ply.text());
    ASSERT_EQ(ply.vertices, mesh.vertices);
    ASSERT_EQ(ply.faces, mesh.triangles.size());
    const std::size_t row = random() % ply.rows.size();
    std::string& text = ply.rows[row].text;
    switch (random() % 5) {
      case 0: text += " 7"; break;
      case 1: text.erase(text.find_last_of(' ')); break;
      case 2: ply.rows.erase(ply.rows.begin() + long(row)); break;
      case 3: ply.rows.insert(ply.rows.begin() + long(row), ply.rows[row]); break;
      default: ply.rows.push_back({0, std::to_string(random() % 9)});
    }
    EXPECT_NE("", refusal("damaged.ply", ply.text())) << ply.text();
  }
}

// ---- binary STL with payloads -------------------------------------------------------------------

std::string binaryStl(const std::vector<std::uint16_t>& counts, bool has_payloads) {
  std::string bytes(80, 'x');
  put(bytes, std::uint32_t(counts.size()));
  for (std::size_t f = 0; f < counts.size(); ++f) {
    for (const float x : {0.f, 0.f, 1.f}) put(bytes, x);
    for (int k = 0; k < 9; ++k) put(bytes, float(9 * f) + float(k));
    put(bytes, counts[f]);
    if (has_payloads) bytes += std::string(counts[f], char(0x7B + f));
  }
  return bytes;
}

void expectFacets(std::size_t facets, const Mesh& mesh) {
  ASSERT_EQ(facets, mesh.triangles.size());
  ASSERT_EQ(3 * facets, mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_EQ(Point(3. * double(v), 3. * double(v) + 1, 3. * double(v) + 2), mesh.vertices[v]);
}

TEST(BinaryStl, WithAPayloadAfterEachTriangleIsRead) {
  std::mt19937 random(testSeed(20));
  for (int round = 0; round < 300; ++round) {
    std::vector<std::uint16_t> counts(1 + random() % 8);
    for (std::uint16_t& count : counts) count = std::uint16_t(random() % 3 ? random() % 90 : 0);
    for (const char* name : {"payload.stl", "payload"})
      expectFacets(counts.size(), load(name, binaryStl(counts, true)));
    expectFacets(counts.size(), load("colours.stl", binaryStl(counts, false)));
  }
}

TEST(BinaryStl, WithAttributesThatMayBePayloadsOrColoursIsRefused) {
  const std::string payloads = binaryStl({10, 20}, true), colours = binaryStl({10, 20}, false);
  EXPECT_TRUE(contains(refusal("more.stl", payloads + "\n"), "attribute counts announce"));
  EXPECT_TRUE(contains(refusal("less.stl", payloads.substr(0, 209)), "") &&
              !refusal("less.stl", payloads.substr(0, 180)).empty());
  expectFacets(2, load("colours.stl", binaryStl({0x7FFF, 0x801F}, false) + "\n"));
  expectFacets(2, load("newline.stl", binaryStl({0, 0}, false) + "\n"));
  expectFacets(2, load("colours.stl", colours));
}

// ---- units --------------------------------------------------------------------------------------

const char* const kVertices[] = {"0 0 0", "1 0 0", "0 2 0"};

std::string amf(const std::string& attributes) {
  std::string vertices;
  for (const char* vertex : kVertices) {
    double x[3];
    std::istringstream(vertex) >> x[0] >> x[1] >> x[2];
    vertices += "<vertex><coordinates><x>" + std::to_string(x[0]) + "</x><y>" +
                std::to_string(x[1]) + "</y><z>" + std::to_string(x[2]) +
                "</z></coordinates></vertex>";
  }
  return "<?xml version=\"1.0\"?>\n<!-- <amf unit='meter'> -->\n<amf " + attributes +
         "><object id=\"0\"><mesh><vertices>" + vertices +
         "</vertices><volume><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume></mesh>"
         "</object></amf>";
}

std::string model3mf(const std::string& attributes) {
  return "<?xml version=\"1.0\"?>\n<model " + attributes +
         " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>"
         "<object id=\"1\" type=\"model\"><mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/>"
         "<vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"2\" z=\"0\"/></vertices>"
         "<triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh></object>"
         "</resources><build><item objectid=\"1\"/></build></model>";
}

std::string archive3mf(const std::string& model, Zipped how) {
  return zipOf({{"_rels/.rels",
                 "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/"
                 "relationships\"><Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
                 "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
                 "</Relationships>"},
                {"3D/3dmodel.model", model}},
               how);
}

void expectScale(double scale, const std::string& name, const std::string& bytes) {
  SCOPED_TRACE(name);
  const Mesh mesh = load(name, bytes);
  ASSERT_EQ(3u, mesh.vertices.size());
  EXPECT_EQ(Point(scale, 0, 0), mesh.vertices[1]);
  EXPECT_EQ(Point(0, 2 * scale, 0), mesh.vertices[2]);
  MeshLoadOptions as_in_file;
  as_in_file.metres = false;
  EXPECT_EQ(Point(1, 0, 0), load(name, bytes, as_in_file).vertices[1]);
}

TEST(Units, OfAmfAndOf3mfAreApplied) {
  const std::vector<std::pair<std::string, double>> both = {{"", 1e-3},
                                                            {"unit=\"millimeter\"", 1e-3},
                                                            {"unit=\"inch\"", 0.0254},
                                                            {"unit=\"meter\"", 1},
                                                            {"unit=\"micron\"", 1e-6}};
  for (const auto& [unit, metres] : both) {
    expectScale(metres, "unit.amf", amf(unit));
    for (const Zipped how : {Zipped::Stored, Zipped::FixedCode, Zipped::OwnCode})
      expectScale(metres, "unit.3mf", archive3mf(model3mf(unit), how));
  }
  expectScale(0.3048, "feet.amf", amf("unit=\"feet\""));
  expectScale(0.3048, "foot.3mf", archive3mf(model3mf("unit=\"foot\""), Zipped::OwnCode));
  expectScale(0.01, "cm.3mf", archive3mf(model3mf("unit='centimeter'"), Zipped::Stored));
  EXPECT_TRUE(contains(refusal("ell.amf", amf("unit=\"ell\"")), "unit 'ell' is unknown"));
  EXPECT_TRUE(contains(refusal("ell.3mf", archive3mf(model3mf("unit=\"ell\""), Zipped::OwnCode)),
                       "unit 'ell' is unknown"));
}

std::string fbx(const std::string& centimetres) {
  return "; FBX 7.5.0 project file\nFBXHeaderExtension: {\n FBXVersion: 7500\n}\nGlobalSettings: "
         "{\n"
         " Version: 1000\n Properties70: {\n" +
         (centimetres.empty()
              ? ""
              : "  P: \"UnitScaleFactor\", \"double\", \"Number\", \"\", " + centimetres + "\n") +
         " }\n}\nDefinitions: {\n Version: 100\n Count: 0\n}\nObjects: {\n"
         " Geometry: 2, \"Geometry::\", \"Mesh\" {\n"
         "  Vertices: *9 {\n   a: 0,0,0,1,0,0,0,2,0\n  }\n"
         "  PolygonVertexIndex: *3 {\n   a: 0,1,-3\n  }\n }\n"
         " Model: 3, \"Model::m\", \"Mesh\" {\n  Version: 232\n }\n}\n"
         "Connections: {\n C: \"OO\", 3, 0\n C: \"OO\", 2, 3\n}\n";
}

TEST(Units, OfFbxAreCentimetresOrWhatItSays) {
  expectScale(0.01, "centimetres.fbx", fbx(""));
  expectScale(0.025, "other.fbx", fbx("2.5"));
  expectScale(1, "metres.fbx", fbx("100"));
  for (const char* no_unit : {"0", "-1", "nan"})
    EXPECT_NE("", refusal("none.fbx", fbx(no_unit))) << no_unit;
}

// Byte by byte: refused, or of the unit.
TEST(Units, OfDamagedArchivesAreRefusedOrRead) {
  for (const Zipped how : {Zipped::Stored, Zipped::FixedCode, Zipped::OwnCode}) {
    const std::string whole = archive3mf(model3mf("unit=\"inch\""), how);
    std::mt19937 random(testSeed(21));
    for (int round = 0; round < manySteps(400); ++round) {
      std::string bytes = whole;
      bytes[random() % bytes.size()] = char(random());
      if (random() % 4 == 0) bytes.resize(random() % bytes.size());
      try {
        for (const Point& p : load("damaged.3mf", bytes).vertices) EXPECT_TRUE(p.allFinite());
      } catch (const MeshLoadError&) {
      }
    }
  }
}

// ---- messages -----------------------------------------------------------------------------------

/// Whether a text is UTF-8, by the table of RFC 3629.
bool isUtf8(const std::string& text) {
  const auto in = [&](std::size_t at, int from, int to) {
    const int byte = at < text.size() ? std::uint8_t(text[at]) : -1;
    return from <= byte && byte <= to;
  };
  static constexpr int kForms[][4] = {
      {0x00, 0x7F, 0, 0},       {0xC2, 0xDF, 0x80, 0xBF}, {0xE0, 0xE0, 0xA0, 0xBF},
      {0xE1, 0xEC, 0x80, 0xBF}, {0xED, 0xED, 0x80, 0x9F}, {0xEE, 0xEF, 0x80, 0xBF},
      {0xF0, 0xF0, 0x90, 0xBF}, {0xF1, 0xF3, 0x80, 0xBF}, {0xF4, 0xF4, 0x80, 0x8F}};
  for (std::size_t at = 0; at < text.size();) {
    const int first = std::uint8_t(text[at]);
    const std::size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    bool is_valid = false;
    for (const auto& form : kForms)
      is_valid =
          is_valid || (in(at, form[0], form[1]) && (length == 1 || in(at + 1, form[2], form[3])));
    for (std::size_t k = 2; k < length; ++k) is_valid = is_valid && in(at + k, 0x80, 0xBF);
    if (!is_valid) return false;
    at += length;
  }
  return true;
}

std::string messageOf(const std::string& path) {
  try {
    loadMesh(path);
  } catch (const MeshLoadError& error) {
    return error.what();
  }
  return "";
}

TEST(Messages, AreUtf8WhateverTheFileHolds) {
  std::mt19937 random(testSeed(12));
  int refused = 0;
  for (int round = 0; round < manySteps(1500); ++round)
    for (const auto& [name, whole] :
         std::vector<std::pair<std::string, std::string>>{{"byte.obj", kObj},
                                                          {"byte.stl", kStl},
                                                          {"byte.off", kOff},
                                                          {"byte.ply", kPly + kPlyBody}}) {
      std::string text = whole;
      for (int k = int(random() % 3); k >= 0; --k)
        text[random() % text.size()] = char(random() % 4 ? 0x80 + random() % 0x80 : random() % 32);
      const TemporaryFile file(name, text);
      const std::string message = messageOf(file.path());
      EXPECT_TRUE(isUtf8(message)) << message;
      refused += !message.empty();
    }
  EXPECT_GT(refused, 1000);
}

TEST(Messages, QuoteBytesThatAreNotUtf8) {
  const auto why = [](const std::string& number) {
    return refusal("quoted.off", "OFF\n3 " + number + " 0\n");
  };
  EXPECT_TRUE(contains(why("\xE9"), "'\\xE9' faces"));
  EXPECT_TRUE(contains(why("\xC3\xA9"), "'\xC3\xA9' faces"));
  EXPECT_TRUE(contains(why("\xC0\xAF"), "'\\xC0\\xAF' faces"));
  EXPECT_TRUE(contains(why("\xED\xA0\x80"), "'\\xED\\xA0\\x80' faces"));
  EXPECT_TRUE(contains(why("\xF4\x90\x80\x80"), "'\\xF4\\x90\\x80\\x80' faces"));
  EXPECT_TRUE(contains(why(std::string("1\0", 2) + "2"), "'1\\x002' faces"));
  const std::string message = messageOf("/nowhere/caf\xE9.obj");
  EXPECT_TRUE(contains(message, "/nowhere/caf\\xE9.obj")) << message;
  EXPECT_TRUE(contains(messageOf("/nowhere/caf\xC3\xA9.obj"), "/nowhere/caf\xC3\xA9.obj"));
}

TEST(Messages, NameVerticesByWholeNumbers) {
  std::string buffer;
  for (const int x : {0, 0, 0, 1, 0, 0, 0, 2, 0}) put(buffer, float(x));
  for (const int index : {0, 1, 65535}) put(buffer, std::uint16_t(index));
  const std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      R"("buffers":[{"byteLength":42}],"bufferViews":[{"buffer":0,"byteLength":36},)"
      R"({"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5123,)"
      R"("count":3,"type":"SCALAR"}]})";
  EXPECT_TRUE(contains(refusal("index.glb", glbOf(json, buffer)), "vertex 65535 of 3"));
}

// ---- what assimp returns ------------------------------------------------------------------------

struct Assbin {
  std::uint32_t mesh_of_node = 0, corner = 2, components = 1, meshes = 1;

  std::string bytes() const {
    std::string node;
    put(node, std::uint32_t(1));
    node += "n";
    for (int k = 0; k < 16; ++k) put(node, k % 5 == 0 ? 1.f : 0.f);
    for (const std::uint32_t count : {0u, 1u, 0u}) put(node, count);  // children, meshes, metadata
    put(node, mesh_of_node);
    std::string mesh;
    for (const std::uint32_t count : {4u, 3u, 1u, 0u, 0u, components}) put(mesh, count);
    if (components & 1)
      for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) put(mesh, x);
    put(mesh, std::uint16_t(3));
    for (const std::uint32_t index : {0u, 1u, corner}) put(mesh, std::uint16_t(index));
    std::string scene;
    for (const std::uint32_t count : {0u, meshes, 0u, 0u, 0u, 0u, 0u}) put(scene, count);
    scene += chunk(0x123c, node) + chunk(0x1237, mesh);
    std::string all = "ASSIMP.binary-dump.";
    all.resize(512, '\0');
    all[44] = 1;  // the version
    return all + chunk(0x1239, scene);
  }
  static std::string chunk(std::uint32_t kind, const std::string& content) {
    std::string bytes;
    put(bytes, kind);
    put(bytes, std::uint32_t(content.size()));
    return bytes + content;
  }
};

TEST(Assimp, IsNotBelieved) {
  EXPECT_EQ(1u, load("whole.assbin", Assbin().bytes()).triangles.size());
  for (const std::uint32_t mesh : {1u, 2u, 1000u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    Assbin file;
    file.mesh_of_node = mesh;
    EXPECT_NE("", refusal("mesh.assbin", file.bytes())) << mesh;
  }
  for (const std::uint32_t corner : {3u, 1000u, 0xFFFFu}) {
    Assbin file;
    file.corner = corner;
    EXPECT_NE("", refusal("corner.assbin", file.bytes())) << corner;
  }
  Assbin file;
  file.components = 0;
  EXPECT_NE("", refusal("no_vertices.assbin", file.bytes()));
  file = Assbin();
  file.meshes = 0;
  EXPECT_NE("", refusal("no_mesh.assbin", file.bytes()));
}

// assimp reads XML recursively, whatever stands before it and in any encoding.
TEST(Assimp, DoesNotSeeXmlThatIsNestedTooDeep) {
  std::string text = "<X3D><Scene>";
  for (int k = 0; k < 200000; ++k) text += "<Group>";
  for (int k = 0; k < 200000; ++k) text += "</Group>";
  text += "</Scene></X3D>";
  std::string wide = "\xFF\xFE";
  for (const char c : text) wide += std::string{c, '\0'};
  for (const std::string& bytes : {text, "x" + text, kMark + text, wide, wide.substr(2)})
    EXPECT_NE("", refusal("deep.x3d", bytes));
}

}  // namespace mesh_contents_test
}  // namespace adaptive_bvh_test
