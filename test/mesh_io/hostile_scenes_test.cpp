// glTF and Collada files that are made to take long: at most 1 s and 100 MB for each megabyte that
// is begun, or a refusal. Each kind is a megabyte large, so that quadratic work shows.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "support/bytes.h"
#include "support/load_limits.h"

namespace adaptive_bvh_test {
namespace hostile_scenes_test {

/// Below this a file is one megabyte that is begun.
constexpr std::size_t kMegabyte = 998000;

std::string loadText(const std::string& name, const std::string& text) {
  return loadWithinLimits(TemporaryFile(name, text).path(), text.size());
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

/// What a function writes of the numbers from 0, joined, until the text has so many bytes.
std::string listed(std::size_t bytes, const std::function<std::string(std::size_t)>& write) {
  std::string all = write(0);
  for (std::size_t i = 1; all.size() < bytes; ++i) all += "," + write(i);
  return all;
}

/// What a function writes of so many numbers from 0, with spaces between.
std::string listedNumbers(std::size_t count, const std::function<std::string(std::size_t)>& write) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += write(i) + " ";
  return all;
}

std::string text(std::size_t number) { return std::to_string(number); }

// ---- glTF ---------------------------------------------------------------------------------------

/// The members of a document, of one triangle unless they are changed.
struct Gltf {
  std::string scenes = R"([{"nodes":[0]}])", nodes = R"([{"mesh":0}])",
              meshes = R"([{"primitives":[{"attributes":{"POSITION":0}}]}])",
              accessors = R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}])",
              views = R"([{"buffer":0,"byteLength":36}])", buffers = "[{\"byteLength\":36}]",
              more = "{}";
  std::string buffer = triangle();

  static std::string triangle() {
    std::string bytes;
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(bytes, x);
    return bytes;
  }

  std::string json() const {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":)" + scenes + R"(,"nodes":)" + nodes +
           R"(,"meshes":)" + meshes + R"(,"accessors":)" + accessors + R"(,"bufferViews":)" +
           views + R"(,"buffers":)" + buffers + R"(,"extras":)" + more + "}";
  }
  std::string glb() const { return glbOf(json(), buffer); }
};

std::string primitive(const std::string& position, const std::string& more = "") {
  return R"({"attributes":{"POSITION":)" + position + "}" + more + "}";
}

std::string loadGltf(const Gltf& gltf) { return loadText("hostile.glb", gltf.glb()); }

TEST(HostileGltf, AnnouncesElementsThatAreNotThere) {
  for (const char* count : {"249999", "250001", "10000000", "18446744073709551615"})
    for (const bool is_sparse : {false, true}) {
      Gltf gltf;
      gltf.accessors = std::string(R"([{"componentType":5126,"type":"VEC3","count":)") + count;
      if (is_sparse)
        gltf.accessors += std::string(R"(,"sparse":{"count":)") + count +
                          R"(,"indices":{"bufferView":0,"componentType":5121},)"
                          R"("values":{"bufferView":0}})";
      gltf.accessors += "}]";
      EXPECT_EQ(std::string("249999") == count && !is_sparse, loadGltf(gltf).empty()) << count;
    }
}

TEST(HostileGltf, SparseAccessorsChangeNoMoreThanThereIs) {
  Gltf gltf;
  gltf.buffer = std::string(kMegabyte, '\0');
  gltf.views = R"([{"buffer":0,"byteLength":)" + text(kMegabyte) + "}]";
  const auto withChanges = [&](std::size_t count, std::size_t changes) {
    gltf.accessors = R"([{"componentType":5121,"type":"VEC3","count":)" + text(count) +
                     R"(,"sparse":{"count":)" + text(changes) +
                     R"(,"indices":{"bufferView":0,"componentType":5121},)"
                     R"("values":{"bufferView":0,"byteOffset":0}}}])";
    gltf.meshes =
        R"([{"primitives":[)" + primitive("0") + "," + primitive("0", R"(,"mode":6)") + "]}]";
    return loadGltf(gltf);
  };
  EXPECT_NE("", withChanges(10, 11));
  EXPECT_NE("", withChanges(330000, 330000));
  EXPECT_NE("", withChanges(600000, 600000));
}

TEST(HostileGltf, EmptyBuffersOfABinaryFile) {
  Gltf gltf;
  gltf.buffers = "[" + repeated("{},", 20000) + "{}]";
  gltf.buffer = std::string(400000, '\0');
  gltf.views =
      "[" +
      listed(150000, [](auto b) { return "{\"buffer\":" + text(b) + ",\"byteLength\":400000}"; }) +
      "]";
  gltf.accessors = "[" +
                   listed(200000,
                          [](auto v) {
                            return "{\"bufferView\":" + text(v) +
                                   R"(,"componentType":5121,"count":100000,"type":"VEC3"})";
                          }) +
                   "]";
  gltf.meshes =
      R"([{"primitives":[)" + listed(100000, [](auto a) { return primitive(text(a)); }) + "]}]";
  EXPECT_NE("", loadGltf(gltf));
}

/// Buffers of a file that have one name each.
Gltf namingBuffers(const std::string& name, std::size_t buffers, bool are_used) {
  Gltf gltf;
  std::string views, accessors, primitives;
  gltf.buffers.clear();
  for (std::size_t b = 0; b < buffers; ++b) {
    const std::string comma = b > 0 ? "," : "", used = text(are_used ? b : 0);
    gltf.buffers += comma + R"({"uri":")" + repeated("./", b % 3) + name + "\"}";
    views += comma + "{\"buffer\":" + used + ",\"byteLength\":12}";
    accessors +=
        comma + "{\"bufferView\":" + text(b) + R"(,"componentType":5121,"count":3,"type":"VEC3"})";
    primitives += comma + primitive(text(b));
  }
  gltf.buffers = "[" + gltf.buffers + "]";
  gltf.views = "[" + views + "]";
  gltf.accessors = "[" + accessors + "]";
  gltf.meshes = R"([{"primitives":[)" + primitives + "]}]";
  return gltf;
}

std::string nameOf(const TemporaryFile& file) {
  return file.path().substr(file.path().find_last_of('/') + 1);
}

TEST(HostileGltf, BuffersThatNameTheFileItselfOrALargeOne) {
  const TemporaryFile large("large.bin", std::string(20 * kMegabyte, 'x'));
  const TemporaryFile itself("itself.gltf");
  for (const bool are_used : {false, true}) {
    const std::string json = namingBuffers(nameOf(itself), 4000, are_used).json();
    std::ofstream(itself.path()) << json;
    EXPECT_EQ("", loadWithinLimits(itself.path(), json.size()));
    Gltf gltf = namingBuffers(nameOf(large), 4000, are_used);
    std::ofstream(itself.path()) << gltf.json();
    EXPECT_EQ("", loadWithinLimits(itself.path(), 20 * kMegabyte + 1000000));
  }
  Gltf unused = namingBuffers(nameOf(large), 4000, false);
  unused.buffers.replace(0, 1, R"([{},)");
  EXPECT_EQ("", loadGltf(unused));
}

TEST(HostileGltf, NamesOfBuffersThatAreLong) {
  Gltf gltf;
  gltf.buffers = R"([{"uri":")" + repeated("a/../", kMegabyte / 5) + "b\"}]";
  EXPECT_NE("", loadGltf(gltf));
  gltf.buffers = R"([{"uri":"data:,)" + base64(std::string(kMegabyte * 3 / 4, '\0')) + "\"}]";
  EXPECT_EQ("", loadGltf(gltf));
}

TEST(HostileGltf, AccessorsThatAreReadOften) {
  Gltf gltf;
  gltf.buffer = std::string(500000, '\0');
  gltf.views = R"([{"buffer":0,"byteLength":500000}])";
  gltf.accessors = R"([{"bufferView":0,"componentType":5121,"count":166666,"type":"VEC3"},)"
                   R"({"bufferView":0,"componentType":5121,"count":500000,"type":"SCALAR"}])";
  for (const bool have_indices : {false, true})
    for (const bool in_one_mesh : {false, true}) {
      const std::string one = primitive("0", have_indices ? R"(,"indices":1,"mode":5)" : "");
      const std::string end = R"(]},{"primitives":[)";
      gltf.meshes = R"([{"primitives":[)" + one +
                    repeated((in_one_mesh ? "," : end) + one, 400000 / (one + end).size()) + "]}]";
      gltf.nodes = R"([{"meshes":[)" + listed(100000, text) + "]}]";
      EXPECT_NE("", loadGltf(gltf));
    }
}

TEST(HostileGltf, StripsOfBytes) {
  Gltf gltf;
  gltf.buffer = Gltf::triangle() + std::string(kMegabyte - 1000, '\1');
  gltf.views = R"([{"buffer":0,"byteLength":)" + text(gltf.buffer.size()) + "}]";
  gltf.accessors = R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
                   R"({"bufferView":0,"byteOffset":36,"componentType":5121,"count":)" +
                   text(kMegabyte - 1000) + R"(,"type":"SCALAR"}])";
  for (const char* mode : {"4", "5", "6"}) {
    gltf.meshes = R"([{"primitives":[)" +
                  primitive("0", std::string(R"(,"indices":1,"mode":)") + mode) + "]}]";
    EXPECT_EQ("", loadGltf(gltf));
  }
}

TEST(HostileGltf, NodesWithoutEnd) {
  const auto withNodes = [](const std::string& nodes, const std::string& scenes) {
    Gltf gltf;
    gltf.nodes = "[" + nodes + "]";
    gltf.scenes = scenes;
    return loadGltf(gltf);
  };
  const std::string first = R"([{"nodes":[0]}])";
  withNodes(R"({"mesh":0},)" + repeated("{},", kMegabyte / 3) + "{}", first);
  withNodes(R"({"mesh":0},)" + repeated("{},", kMegabyte / 3) + "{}", "[]");
  withNodes(R"({"mesh":0},)" + repeated("0,", kMegabyte / 2) + "{}", first);
  const std::string all = "[{\"nodes\":[" + listed(600000, text) + "]}]";
  withNodes(R"({"mesh":0},)" + repeated("{},", 100000) + "{}", all);
  withNodes(R"({"mesh":0},)" + repeated("0,", 100000) + "0", all);
  withNodes(listed(kMegabyte, [](auto) { return R"({"mesh":0})"; }), "[]");
  withNodes(listed(kMegabyte, [](auto) { return R"({"children":[0]})"; }), "[]");
  withNodes(listed(kMegabyte, [](auto n) { return "{\"children\":[" + text(n + 1) + "]}"; }), "[]");
  withNodes(R"({"mesh":0,"children":[)" + repeated("1,", kMegabyte / 2) + R"(1]},{"mesh":0})",
            first);
  withNodes(
      R"({"children":[)" + repeated("1,", 300000) + R"(1]},{"mesh":0})" + repeated(",{}", 100000),
      first);
  // Each level names the next twice.
  withNodes(
      listed(20000,
             [](auto n) { return "{\"children\":[" + text(n + 1) + "," + text(n + 1) + "]}"; }),
      first);
}

TEST(HostileGltf, MeshesWithoutEnd) {
  Gltf gltf;
  for (const char* mesh : {"{}", "0", "[]", R"({"primitives":[]})", R"({"primitives":[{}]})"}) {
    gltf.meshes =
        "[" + repeated(std::string(mesh) + ",", 500000 / std::string(mesh).size()) + "{}]";
    gltf.nodes = R"([{"meshes":[)" + listed(500000, text) + "]}]";
    EXPECT_NE("", loadGltf(gltf));
    gltf.scenes = "null";
    EXPECT_NE("", loadGltf(gltf));
    gltf.scenes = Gltf().scenes;
  }
  // An empty mesh, placed as often as nodes can.
  gltf.nodes = R"([{"children":[)" + repeated("1,", 20000) + R"(1]},{"meshes":[)" +
               repeated("0,", kMegabyte / 2) + "0]}]";
  EXPECT_NE("", loadGltf(gltf));
  gltf = Gltf();
  gltf.meshes = R"([{"primitives":[)" + repeated("{},", kMegabyte / 3) + "0]}]";
  EXPECT_NE("", loadGltf(gltf));
}

/// Corners that differ, a list of `triangles`.
Gltf withCorners(std::size_t triangles) {
  Gltf gltf;
  gltf.buffer.clear();
  for (std::size_t t = 0; t < triangles; ++t)
    for (std::size_t k = 0; k < 9; ++k) put(gltf.buffer, float(t + (k % 4 == 0 ? 1 : 0)));
  const std::string bytes = text(gltf.buffer.size());
  gltf.views = R"([{"buffer":0,"byteLength":)" + bytes + "}]";
  gltf.accessors = R"([{"bufferView":0,"componentType":5126,"count":)" + text(3 * triangles) +
                   R"(,"type":"VEC3"}])";
  return gltf;
}

/// A mesh that is placed often, from few bytes: as often as it may be, and more often.
// Whether primitives share vertices depends on their morph targets.
TEST(HostileGltf, MorphTargetsWithoutEnd) {
  Gltf gltf;
  for (const std::size_t primitives : {10, 300, 5000}) {
    const std::size_t bytes = kMegabyte / primitives - 60;
    gltf.meshes = R"([{"primitives":[)" +
                  listed(kMegabyte - bytes - 500,
                         [&](std::size_t number) {
                           return R"({"attributes":{"POSITION":0},"targets":[)" +
                                  listed(bytes, [](std::size_t) { return std::string("{}"); }) +
                                  ",[" + text(number) + "]]}";
                         }) +
                  "]}]";
    loadGltf(gltf);
  }
}

TEST(HostileGltf, PlacedOften) {
  for (const std::size_t triangles : {std::size_t(5000), std::size_t(20000)}) {
    Gltf gltf = withCorners(triangles);
    for (const std::size_t times : {490000 / (4 * triangles + 1), std::size_t(1000)}) {
      std::string children;
      gltf.nodes.clear();
      for (std::size_t n = 1; n <= times; ++n) {
        children += (n > 1 ? "," : "") + text(n);
        gltf.nodes += R"(,{"mesh":0,"translation":[0,)" + text(n) + ",0.3]}";
      }
      gltf.nodes = R"([{"children":[)" + children + "]}" + gltf.nodes + "]";
      EXPECT_EQ(times != 1000, loadGltf(gltf).empty());
    }
  }
  // Vertices that no triangle has.
  Gltf gltf = withCorners(20000);
  gltf.accessors.back() = ',';
  gltf.accessors += R"({"bufferView":0,"componentType":5121,"count":3,"type":"SCALAR"}])";
  gltf.meshes = R"([{"primitives":[)" + primitive("0", R"(,"indices":1)") + "]}]";
  gltf.nodes = R"([{"mesh":0,"children":[)" + listed(14, [](auto n) { return text(n + 1); }) + "]}";
  for (std::size_t n = 1; n <= 7; ++n)
    gltf.nodes += R"(,{"mesh":0,"translation":[0,)" + text(n) + ",0.3]}";
  gltf.nodes += "]";
  EXPECT_EQ("", loadGltf(gltf));
  // Each level names the next twice.
  gltf = withCorners(60);
  for (const std::size_t levels : {10, 13, 40}) {
    gltf.nodes = R"({"mesh":0})";
    for (std::size_t n = levels; n > 0; --n)
      gltf.nodes = R"({"translation":[0.1,0.2,)" + text(n) + R"(],"children":[)" + text(n) + "," +
                   text(n) + "]}," + gltf.nodes;
    gltf.nodes = "[" + gltf.nodes + "]";
    EXPECT_EQ(levels == 10, loadGltf(gltf).empty());
  }
}

TEST(HostileGltf, VerticesThatAreThere) {
  Gltf gltf = withCorners(27500);
  EXPECT_EQ("", loadGltf(gltf));
  gltf.buffer.clear();  // of bytes, all different
  for (std::size_t v = 0; v < 330000; ++v)
    for (std::size_t k = 0; k < 3; ++k) gltf.buffer += char(v >> (8 * k));
  gltf.views = R"([{"buffer":0,"byteLength":990000}])";
  gltf.accessors = R"([{"bufferView":0,"componentType":5121,"count":330000,"type":"VEC3"}])";
  EXPECT_EQ("", loadGltf(gltf));
  gltf.meshes = R"([{"primitives":[)" + primitive("0", R"(,"mode":5)") + "]}]";
  EXPECT_EQ("", loadGltf(gltf));
}

TEST(HostileGltf, LongNamesOfVersion1) {
  const std::string name(150000, 'a');
  for (const char* long_member : {"bufferView", "buffer", "accessor", "type"}) {
    const auto nameOf = [&](const char* member) {
      return "\"" + (member == std::string(long_member) ? name : member) + "\"";
    };
    const std::string json =
        R"({"asset":{"version":"1.0"},"scene":"s","scenes":{"s":{"nodes":["n"]}},"nodes":{"n":)"
        R"({"meshes":["m"]}},"meshes":{"m":{"primitives":[)" +
        listed(700000, [](auto) { return primitive("\"a\"", R"(,"indices":"i")"); }) +
        R"(]}},"accessors":{"a":{"bufferView":)" + nameOf("bufferView") +
        R"(,"componentType":5126,"count":0,"type":"VEC3"},"i":{"bufferView":)" +
        nameOf("bufferView") + R"(,"componentType":5121,"count":0,"type":)" +
        (long_member == std::string("type") ? nameOf("type") : "\"SCALAR\"") +
        R"(}},"bufferViews":{)" + nameOf("bufferView") + ":{\"buffer\":" + nameOf("buffer") +
        R"(,"byteLength":36}},"buffers":{)" + nameOf("buffer") + R"(:{"uri":"data:,)" +
        base64(Gltf::triangle()) + "\"}}}";
    EXPECT_NE("", loadText("names.gltf", json));
  }
}

TEST(HostileGltf, JsonWithoutEnd) {
  Gltf gltf;
  for (const char* element :
       {"[]", "{}", "0", "\"\"", "[[]]", "{\"\":0}", R"({"":{"":[{}]}})", "[0,[0,[0]]]", "1e400",
        "\"\\u0000\"", "\"\\ud800\"", "tru", "\"", "[", "{\"a\":"}) {
    gltf.more =
        "[" + repeated(std::string(element) + ",", kMegabyte / (strlen(element) + 1)) + "0]";
    loadGltf(gltf);
  }
  gltf.more = "{" + listed(kMegabyte, [](auto n) { return "\"" + text(n) + "\":0"; }) + "}";
  EXPECT_EQ("", loadGltf(gltf));
  gltf.more = repeated("[", 490) + listed(kMegabyte, text) + repeated("]", 490);
  EXPECT_EQ("", loadGltf(gltf));
}

// ---- Collada ------------------------------------------------------------------------------------

/// Two triangles in a scene, unless parts are changed.
struct Collada {
  std::string array = R"(<float_array id="a">0 0 0 1 0 0 0 1 0</float_array>)",
              accessor = R"(<accessor source="#a" count="3" stride="3"/>)", sources,
              vertices = R"(<input semantic="POSITION" source="#p"/>)",
              primitives =
                  R"(<triangles><input semantic="VERTEX" source="#v"/><p>0 1 2</p></triangles>)",
              geometries, library, nodes = R"(<instance_geometry url="#g"/>)";

  std::string text() const {
    return "<COLLADA><library_geometries><geometry id=\"g\"><mesh><source id=\"p\">" + array +
           "<technique_common>" + accessor + "</technique_common></source>" + sources +
           "<vertices id=\"v\">" + vertices + "</vertices>" + primitives + "</mesh></geometry>" +
           geometries + "</library_geometries>" + library +
           "<library_visual_scenes><visual_scene id=\"s\"><node>" + nodes +
           "</node></visual_scene></library_visual_scenes><scene><instance_visual_scene "
           "url=\"#s\"/></scene></COLLADA>";
  }
};

constexpr const char* kInput = R"(<input semantic="VERTEX" source="#v"/>)";

std::string loadCollada(const Collada& collada) { return loadText("hostile.dae", collada.text()); }

TEST(HostileCollada, CountsOfPolygonsWithManyLists) {
  Collada collada;
  collada.primitives = std::string("<polylist>") + kInput + "<vcount>" + repeated("0 ", 250000) +
                       "</vcount>" + repeated("<p/>", 125000) + "</polylist>";
  EXPECT_NE("", loadCollada(collada));
  collada.primitives = std::string("<polylist>") + kInput + "<vcount>" + repeated("3 ", 100000) +
                       "</vcount>" + repeated("<p>0 1 2</p>", 70000) + "</polylist>";
  EXPECT_NE("", loadCollada(collada));
  for (const char* kind : {"polygons", "trifans", "tristrips", "triangles"}) {
    collada.primitives =
        std::string("<") + kind + ">" + kInput + repeated("<p/>", 250000) + "</" + kind + ">";
    EXPECT_NE("", loadCollada(collada));
    collada.primitives = std::string("<") + kind + ">" + kInput + repeated("<p>0 1 2</p>", 80000) +
                         "</" + kind + ">";
    EXPECT_EQ("", loadCollada(collada));
  }
  collada.primitives =
      std::string("<tristrips>") + kInput + "<p>" + repeated("0 1 ", 250000) + "</p></tristrips>";
  EXPECT_EQ("", loadCollada(collada));
}

/// Outlines of 9,000 corners: round ones, on a line, zigzags, spirals.
TEST(HostileCollada, PolygonsOfManyCorners) {
  const std::size_t corners = 9000;
  const auto outline = [&](auto write) {
    Collada collada;
    collada.array = "<float_array id=\"a\">" + listedNumbers(corners, write) + "</float_array>";
    collada.accessor = "<accessor source=\"#a\" count=\"" + text(corners) + "\" stride=\"3\"/>";
    const std::string polygon = "<p>" + listedNumbers(corners, text) + "</p>";
    collada.primitives = std::string("<polygons>") + kInput +
                         repeated(polygon, (kMegabyte - collada.text().size()) / polygon.size()) +
                         "</polygons>";
    loadCollada(collada);
  };
  const auto point = [](double x, double y) {
    return std::to_string(x) + " " + std::to_string(y) + " 0";
  };
  outline([&](std::size_t i) {
    const double angle = 2 * M_PI * double(i) / double(corners);
    return point(1000 * std::cos(angle), 1000 * std::sin(angle));
  });
  outline([&](std::size_t i) { return point(double(i), 0); });
  outline([&](std::size_t i) { return point(double(i), double(i % 2)); });
  outline([&](std::size_t i) { return point(double(i * i % 7919), double(i * 31 % 8111)); });
  outline([&](std::size_t i) {
    const bool is_back = 2 * i > corners;
    const double at = double(is_back ? corners - i : i), radius = at + (is_back ? 3 : 0);
    return point(radius * std::cos(0.05 * at), radius * std::sin(0.05 * at));
  });
}

TEST(HostileCollada, SourcesInTurn) {
  Collada collada;
  collada.array = "<float_array id=\"a\">" + repeated("0 ", 300000) + "</float_array>";
  collada.accessor = R"(<accessor source="#a" count="100000" stride="3"/>)";
  const auto copy = [&](const std::string& number) {
    return "<source id=\"p" + number + "\"><technique_common>" + collada.accessor +
           "</technique_common></source><vertices id=\"v" + number +
           R"("><input semantic="POSITION" source="#p)" + number + "\"/></vertices>";
  };
  const auto using_ = [](const std::string& number) {
    return R"(<triangles><input semantic="VERTEX" source="#v)" + number +
           R"("/><p>0 1 2</p></triangles>)";
  };
  collada.sources = copy("1") + copy("2");
  collada.primitives = repeated(using_("1") + using_("2"), 3000);
  EXPECT_EQ("", loadCollada(collada));
  collada.sources = collada.primitives = "";
  for (std::size_t n = 0; n < 1500; ++n) {
    collada.sources += copy(text(n));
    collada.primitives += using_(text(n));
  }
  EXPECT_NE("", loadCollada(collada));
  collada.sources.clear();
  collada.primitives.clear();
  collada.nodes.clear();
  for (std::size_t n = 0; n < 1500; ++n) {
    collada.geometries +=
        "<geometry id=\"h" + text(n) + "\"><mesh>" + using_("") + "</mesh></geometry>";
    collada.nodes += "<instance_geometry url=\"#h" + text(n) + "\"/>";
  }
  EXPECT_NE("", loadCollada(collada));
}

TEST(HostileCollada, ControllersInCirclesAndChains) {
  Collada collada;
  const auto controller = [](const std::string& id, const std::string& source) {
    return "<controller id=\"" + id + "\"><skin source=\"#" + source + "\"/></controller>";
  };
  const auto instance = [](const std::string& id) {
    return "<instance_controller url=\"#" + id + "\"/>";
  };
  collada.library = controller("c", "c");
  collada.nodes = repeated(instance("c"), 30000);
  EXPECT_NE(std::string::npos, loadCollada(collada).find("own sources"));
  collada.library = controller("c", "d") + controller("d", "c");
  EXPECT_NE(std::string::npos, loadCollada(collada).find("own sources"));
  const std::string name(300000, 'c');
  collada.library = controller("c", name) + controller(name, "g");
  collada.nodes = repeated(instance("c"), 10000);
  EXPECT_EQ("", loadCollada(collada));
  collada.library = collada.nodes = "";
  for (std::size_t n = 0; n < 8000; ++n) {
    collada.library += controller("c" + text(n), n > 0 ? "c" + text(n - 1) : "g");
    collada.nodes += instance("c" + text(7999 - n)) + instance("c" + text(n));
  }
  EXPECT_EQ("", loadCollada(collada));
}

TEST(HostileCollada, InputsWithoutEnd) {
  Collada collada;
  const std::string input = kInput;
  collada.vertices = repeated("<a/>", 100000) + collada.vertices;
  collada.primitives = "<triangles>" + repeated(input, 6000) + "<p>0 1 2</p></triangles>" +
                       repeated(collada.primitives, 5000);
  EXPECT_EQ("", loadCollada(collada));
  collada = Collada();
  collada.accessor = R"(<accessor source="#a" count="3" stride="3">)" +
                     repeated("<param/>", 50000) + "</accessor>";
  collada.primitives = repeated(collada.primitives, 6000);
  EXPECT_EQ("", loadCollada(collada));
  const std::string name(300000, 'p');
  collada = Collada();
  collada.vertices = R"(<input semantic="POSITION" source="#)" + name + "\"/>";
  collada.sources = "<source id=\"" + name + "\"><technique_common>" + collada.accessor +
                    "</technique_common></source>";
  collada.primitives = repeated(collada.primitives, 4000);
  EXPECT_EQ("", loadCollada(collada));
}

TEST(HostileCollada, ElementsWithoutEnd) {
  for (const char* element : {"<a/>",
                              "<a></a>",
                              "<a b=''/>",
                              "<node/>",
                              "<node id=''/>",
                              "<node id='a' name='b'/>",
                              "<node><node/></node>",
                              "<instance_node url='#s'/>",
                              "<instance_node url='#n'/>",
                              "<instance_geometry url='#g'/>",
                              "<instance_geometry url='#h'/>",
                              "<instance_controller url='#g'/>",
                              "<translate>0 0 0</translate>",
                              "<!---->",
                              "<?x?>",
                              "<![CDATA[]]>",
                              "<!-- ",
                              "<![CDATA[",
                              "<!",
                              "<?",
                              "<a ",
                              "<a b=",
                              "<",
                              "</a>",
                              "&lt;",
                              "<!a>",
                              "<a b=\"'\" c='\"'/>"}) {
    Collada collada;
    collada.nodes += repeated(element, kMegabyte / strlen(element));
    loadCollada(collada);
  }
}

TEST(HostileCollada, AttributesWithoutEnd) {
  Collada collada;
  for (const char* attribute : {" b=''", " b='\r\n'", " id='a'", " b", " =", " b = 'c'"}) {
    collada.nodes =
        "<node" + repeated(attribute, kMegabyte / strlen(attribute)) + "/>" + Collada().nodes;
    loadCollada(collada);
  }
  for (const char* character : {"\r\n", "\r", "\n", " ", "&#97;", "\xC3\xA9", "'", ">"}) {
    collada.nodes = "<node name=\"" + repeated(character, kMegabyte / strlen(character)) + "\"/>" +
                    Collada().nodes;
    loadCollada(collada);
  }
}

TEST(HostileCollada, NodesThatInstanceEachOther) {
  Collada collada;
  collada.library = "<library_nodes>";
  for (std::size_t n = 0; n < 5000; ++n)
    collada.library += "<node id=\"n" + text(n) + "\">" +
                       repeated("<instance_node url=\"#n" + text(n + 1) + "\"/>", 2) + "</node>";
  collada.library += "<node id=\"n5000\"/></library_nodes>";
  collada.nodes += "<instance_node url=\"#n0\"/>";
  EXPECT_NE("", loadCollada(collada));
  collada.library = R"(<library_nodes><node id="n">)" +
                    repeated("<instance_geometry url='#g'/>", 15000) + "</node></library_nodes>";
  collada.nodes = repeated("<instance_node url=\"#n\"/>", 15000);
  EXPECT_NE("", loadCollada(collada));
}

}  // namespace hostile_scenes_test
}  // namespace adaptive_bvh_test
