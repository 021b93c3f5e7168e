#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "support/bytes.h"

// Random scenes of small integers, as glTF and as Collada text, with the triangles that they must
// become. No arithmetic here rounds.
namespace adaptive_bvh_test {

using IntegerPoint = std::array<int, 3>;
using IntegerTriangle = std::array<IntegerPoint, 3>;

/// Triangles, each begun at its least corner, in ascending order: equal where the surface is.
inline std::vector<IntegerTriangle> sorted(std::vector<IntegerTriangle> triangles) {
  for (IntegerTriangle& t : triangles)
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

/// Nodes that scale by 1 or -1, then translate; a node names only later ones.
struct RandomNode {
  IntegerPoint scale = {1, 1, 1}, translation = {0, 0, 0};
  std::vector<std::size_t> children, meshes;
};

class RandomScene {
 public:
  explicit RandomScene(unsigned seed) : random_(seed) {}

  std::size_t below(std::size_t count) { return std::size_t(random_() % count); }
  bool chance(std::size_t one_in) { return below(one_in) == 0; }

  std::vector<IntegerPoint> points(std::size_t count, int least = -9) {
    std::vector<IntegerPoint> points(count);
    for (IntegerPoint& p : points)
      for (int& x : p) x = least + int(below(std::size_t(10 - least)));
    return points;
  }

  /// Adds the triangles of corners: a list, a strip or a fan.
  void addTriangles(std::size_t mesh, const std::vector<IntegerPoint>& corners, char layout) {
    const auto& c = corners;
    if (layout == 'l')
      for (std::size_t i = 0; i + 2 < c.size(); i += 3) add(mesh, {c[i], c[i + 1], c[i + 2]});
    if (layout == 'f')
      for (std::size_t i = 1; i + 1 < c.size(); ++i) add(mesh, {c[0], c[i], c[i + 1]});
    for (std::size_t i = 0; layout == 's' && i + 2 < c.size(); ++i)
      if (i % 2 == 0)
        add(mesh, {c[i], c[i + 1], c[i + 2]});
      else
        add(mesh, {c[i + 1], c[i], c[i + 2]});
  }

  void addNodes(std::size_t count, std::size_t mesh_count) {
    meshes.resize(mesh_count);
    nodes.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
      for (int& x : nodes[n].scale) x = chance(3) ? -1 : 1;
      for (int& x : nodes[n].translation) x = int(below(19)) - 9;
      while (n + 1 < count && chance(2)) nodes[n].children.push_back(n + 1 + below(count - n - 1));
      if (!chance(4)) nodes[n].meshes.push_back(below(mesh_count));
    }
  }

  /// Triangles below a node, each on its own way there.
  std::vector<IntegerTriangle> placed(std::size_t number) const {
    const RandomNode& node = nodes[number];
    std::vector<IntegerTriangle> triangles;
    for (const std::size_t m : node.meshes)
      triangles.insert(triangles.end(), meshes[m].begin(), meshes[m].end());
    for (const std::size_t child : node.children)
      for (const IntegerTriangle& t : placed(child)) triangles.push_back(t);
    for (IntegerTriangle& t : triangles) {
      for (IntegerPoint& p : t)
        for (std::size_t k = 0; k < 3; ++k) p[k] = node.scale[k] * p[k] + node.translation[k];
      if (node.scale[0] * node.scale[1] * node.scale[2] < 0) std::swap(t[1], t[2]);
    }
    return triangles;
  }

  std::vector<RandomNode> nodes;
  std::vector<std::vector<IntegerTriangle>> meshes;

 private:
  void add(std::size_t mesh, const IntegerTriangle& triangle) { meshes[mesh].push_back(triangle); }

  std::mt19937 random_;
};

/// "[a,b]" of things that a function writes.
template <typename Things, typename Write>
std::string joined(const Things& things, const Write& write, const std::string& between = ",") {
  std::string all;
  for (const auto& thing : things) all += (all.empty() ? "" : between) + write(thing);
  return all;
}

struct SceneFile {
  std::string text;   ///< glTF as JSON, or Collada
  std::string chunk;  ///< of a binary glTF file
  std::vector<IntegerTriangle> triangles;
};

/// A glTF document: accessors of all types, sparse ones and shared ones, buffers in the chunk, in
/// data URIs, or in another file; with scenes or without.
class RandomGltf {
 public:
  RandomGltf(unsigned seed, const std::string& external_name, bool is_binary)
      : scene_(seed), external_name_(external_name), is_binary_(is_binary) {}

  SceneFile write() {
    scene_.addNodes(1 + scene_.below(6), 1 + scene_.below(3));
    for (std::size_t a = 1 + scene_.below(3); a > 0; --a) addPositions();
    std::vector<std::string> meshes;
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      std::vector<std::string> primitives;
      for (std::size_t p = scene_.below(4); p > 0; --p) primitives.push_back(primitive(m));
      meshes.push_back(R"({"primitives":[)" + joined(primitives, same) + "]}");
    }
    SceneFile file;
    file.text = R"({"asset":{"version":"2.0"},)" + scenes(file.triangles) + R"("nodes":[)" +
                joined(scene_.nodes, node) + R"(],"meshes":[)" + joined(meshes, same) +
                R"(],"accessors":[)" + joined(accessors_, same) + R"(],"bufferViews":[)" +
                joined(views_, same) + R"(],"buffers":[)" + buffers() + "]}";
    file.chunk = bytes_[0];
    return file;
  }

  /// What the file of that name must hold.
  const std::string& external() const { return bytes_[2]; }

 private:
  static std::string same(const std::string& text) { return text; }
  static std::string number(std::size_t n) { return std::to_string(n); }
  static std::string integers(const IntegerPoint& p) {
    return "[" + joined(p, [](int x) { return std::to_string(x); }) + "]";
  }
  static std::string node(const RandomNode& node) {
    std::string members =
        "{\"translation\":" + integers(node.translation) + ",\"scale\":" + integers(node.scale);
    if (!node.children.empty()) members += ",\"children\":[" + joined(node.children, number) + "]";
    if (!node.meshes.empty()) members += ",\"mesh\":" + number(node.meshes[0]);
    return members + "}";
  }

  std::string scenes(std::vector<IntegerTriangle>& triangles) {
    const auto place = [&](std::size_t n) {
      for (const IntegerTriangle& t : scene_.placed(n)) triangles.push_back(t);
    };
    std::vector<bool> is_child(scene_.nodes.size()), is_named(scene_.meshes.size());
    for (const RandomNode& node : scene_.nodes) {
      for (const std::size_t child : node.children) is_child[child] = true;
      for (const std::size_t mesh : node.meshes) is_named[mesh] = true;
    }
    if (scene_.chance(2)) {
      place(0);
      return R"("scenes":[{"nodes":[0]}],)";
    }
    for (std::size_t n = 0; n < is_child.size(); ++n)
      if (!is_child[n]) place(n);
    for (std::size_t m = 0; m < is_named.size(); ++m)
      if (!is_named[m])
        triangles.insert(triangles.end(), scene_.meshes[m].begin(), scene_.meshes[m].end());
    return scene_.chance(2) ? "" : R"("scenes":[],)";
  }

  /// Numbers of a component type as bytes, padded to `stride`.
  template <typename Number>
  static std::string bytesOf(const std::vector<IntegerPoint>& points, std::size_t width,
                             std::size_t padding) {
    std::string bytes;
    for (const IntegerPoint& p : points) {
      for (std::size_t k = 0; k < width; ++k) put(bytes, Number(p[k]));
      bytes += std::string(padding, '\x7F');
    }
    return bytes;
  }
  static std::string bytesOf(int type, const std::vector<IntegerPoint>& points, std::size_t width,
                             std::size_t padding) {
    switch (type) {
      case 5120: return bytesOf<std::int8_t>(points, width, padding);
      case 5121: return bytesOf<std::uint8_t>(points, width, padding);
      case 5122: return bytesOf<std::int16_t>(points, width, padding);
      case 5123: return bytesOf<std::uint16_t>(points, width, padding);
      case 5125: return bytesOf<std::uint32_t>(points, width, padding);
      default: return bytesOf<float>(points, width, padding);
    }
  }

  /// Members of an accessor, or of a list of a sparse one, for points in a buffer.
  std::string view(int type, const std::vector<IntegerPoint>& points, std::size_t width) {
    const std::size_t padding = scene_.below(5), buffer = scene_.below(3), gap = scene_.below(9);
    const std::string bytes = bytesOf(type, points, width, padding);
    const std::size_t size = points.empty() ? 0 : bytes.size() / points.size() - padding;
    std::string& all = bytes_[buffer];
    all += std::string(gap, '\x7F');
    views_.push_back("{\"buffer\":" + number(buffer) + ",\"byteOffset\":" + number(all.size()) +
                     ",\"byteLength\":" + number(bytes.size()) +
                     (padding > 0 ? ",\"byteStride\":" + number(size + padding) : "") + "}");
    all += bytes;
    return "\"bufferView\":" + number(views_.size() - 1);
  }

  /// An accessor. A sparse one lists some of the points again, over a base without them.
  std::size_t addAccessor(int type, const std::vector<IntegerPoint>& points, std::size_t width) {
    std::string members = "\"componentType\":" + std::to_string(type) +
                          ",\"count\":" + number(points.size()) +
                          (width == 3 ? ",\"type\":\"VEC3\"" : ",\"type\":\"SCALAR\"");
    std::vector<IntegerPoint> base(points.size(), IntegerPoint{0, 0, 0}), changed, indices;
    const bool is_sparse = scene_.chance(3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_sparse || scene_.chance(2)) base[i] = points[i];
      if (base[i] == points[i]) continue;
      changed.push_back(points[i]);
      indices.push_back({int(i), 0, 0});
    }
    if (!is_sparse || std::any_of(base.begin(), base.end(), [](const IntegerPoint& p) {
          return p != IntegerPoint{0, 0, 0};
        }))
      members += "," + view(type, base, width);
    if (!changed.empty()) {
      const int index_type = std::array<int, 3>{5121, 5123, 5125}[scene_.below(3)];
      members += ",\"sparse\":{\"count\":" + number(changed.size()) + ",\"indices\":{" +
                 view(index_type, indices, 1) + ",\"componentType\":" + std::to_string(index_type) +
                 "},\"values\":{" + view(type, changed, width) + "}}";
    }
    accessors_.push_back("{" + members + "}");
    return accessors_.size() - 1;
  }

  void addPositions() {
    const int type = std::array<int, 5>{5120, 5121, 5122, 5123, 5126}[scene_.below(5)];
    const auto points = scene_.points(scene_.below(12), type == 5121 || type == 5123 ? 0 : -9);
    positions_.push_back({addAccessor(type, points, 3), points});
  }

  std::string primitive(std::size_t mesh) {
    const auto& [accessor, points] = positions_[scene_.below(positions_.size())];
    const std::size_t mode = scene_.chance(8) ? scene_.below(4) : 4 + scene_.below(3);
    std::vector<IntegerPoint> corners = points;
    std::string members = R"({"attributes":{"POSITION":)" + number(accessor) + "}";
    if (mode != 4 || scene_.chance(2)) members += ",\"mode\":" + number(mode);
    if (!points.empty() && scene_.chance(2)) {
      std::vector<IntegerPoint> indices(scene_.below(20));
      corners.clear();
      for (IntegerPoint& index : indices) {
        index = {int(scene_.below(points.size())), 0, 0};
        corners.push_back(points[std::size_t(index[0])]);
      }
      const int type = std::array<int, 3>{5121, 5123, 5125}[scene_.below(3)];
      members += ",\"indices\":" + number(addAccessor(type, indices, 1));
    }
    scene_.addTriangles(mesh, corners, mode < 4 ? ' ' : "lsf"[mode - 4]);
    return members + "}";
  }

  std::string buffers() const {
    const auto withUri = [](const std::string& uri) { return "{\"uri\":\"" + uri + "\"}"; };
    const auto data = [&](std::size_t b) { return withUri("data:x;base64," + base64(bytes_[b])); };
    return (is_binary_ ? "{\"byteLength\":" + number(bytes_[0].size()) + "}" : data(0)) + "," +
           data(1) + "," + withUri(external_name_);
  }

  RandomScene scene_;
  std::string external_name_;
  bool is_binary_;
  std::vector<std::string> accessors_, views_;
  std::vector<std::pair<std::size_t, std::vector<IntegerPoint>>> positions_;
  std::array<std::string, 3> bytes_;  ///< of the chunk, the data URI, the external file
};

/// A Collada document: all kinds of primitives, several sources in a geometry, controllers in
/// chains, nodes within nodes and instanced ones.
class RandomCollada {
 public:
  explicit RandomCollada(unsigned seed) : scene_(seed) {}

  SceneFile write() {
    scene_.addNodes(1 + scene_.below(6), 1 + scene_.below(3));
    std::string geometries;
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) geometries += geometry(m);
    std::string nodes;
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) nodes += node(n);
    SceneFile file;
    file.triangles = scene_.placed(0);
    file.text = "<?xml version=\"1.0\"?>\n<COLLADA><library_geometries>" + geometries +
                "</library_geometries><library_controllers>" + controllers_ +
                "</library_controllers><library_nodes>" + nodes +
                "</library_nodes><library_visual_scenes><visual_scene id=\"s\"><node>"
                "<instance_node url=\"#n0\"/></node></visual_scene></library_visual_scenes>"
                "<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";
    return file;
  }

 private:
  static std::string number(std::size_t n) { return std::to_string(n); }
  static std::string integers(const IntegerPoint& p) {
    return joined(
        p, [](int x) { return std::to_string(x); }, " ");
  }
  static std::string element(const std::string& name, const std::string& content) {
    return "<" + name + ">" + content + "</" + name.substr(0, name.find(' ')) + ">\n";
  }

  std::string geometry(std::size_t mesh) {
    std::string content;
    std::vector<std::vector<IntegerPoint>> sources(1 + scene_.below(3));
    for (std::size_t s = 0; s < sources.size(); ++s) {
      sources[s] = scene_.points(1 + scene_.below(9));
      content += source("p" + number(mesh) + "_" + number(s), sources[s]);
    }
    for (std::size_t p = scene_.below(5); p > 0; --p) {
      const std::size_t s = scene_.below(sources.size());
      content += primitive(mesh, "v_p" + number(mesh) + "_" + number(s), sources[s]);
    }
    return element("geometry id=\"g" + number(mesh) + "\"", element("mesh", content));
  }

  std::string source(const std::string& id, const std::vector<IntegerPoint>& points) {
    const std::size_t gap = scene_.below(3);
    const std::string numbers = joined(
        points,
        [&](const IntegerPoint& p) {
          std::string all = integers(p);
          for (std::size_t k = 0; k < gap; ++k) all += " 77";
          return all;
        },
        "\n");
    return element("source id=\"" + id + "\"",
                   element("float_array id=\"a_" + id + "\"", numbers) +
                       element("technique_common", "<accessor source=\"#a_" + id + "\" count=\"" +
                                                       number(points.size()) + "\" stride=\"" +
                                                       number(3 + gap) + "\"/>")) +
           element("vertices id=\"v_" + id + "\"",
                   "<input semantic=\"POSITION\" source=\"#" + id + "\"/>");
  }

  std::string primitive(std::size_t mesh, const std::string& vertices,
                        const std::vector<IntegerPoint>& points) {
    const std::size_t kind = scene_.below(5), offset = scene_.below(3);
    const std::size_t stride = offset + 1 + scene_.below(2);
    const char* const name = std::array<const char*, 5>{"triangles", "polylist", "polygons",
                                                        "tristrips", "trifans"}[kind];
    std::string content = "<input semantic=\"VERTEX\" source=\"#" + vertices + "\" offset=\"" +
                          number(offset) + "\"/>";
    if (stride > offset + 1)
      content += "<input semantic=\"NORMAL\" source=\"#x\" offset=\"" + number(stride - 1) + "\"/>";
    std::string sizes, lists;
    for (std::size_t list = 1 + scene_.below(3); list > 0; --list) {
      std::size_t count = kind > 2 ? scene_.below(9) : kind == 2 ? 3 : 3 * scene_.below(4);
      for (std::size_t i = 0; i < count; i += 3) sizes += scene_.chance(4) ? "3 0 " : " 3\n";
      std::vector<IntegerPoint> corners;
      std::string indices;
      for (std::size_t i = 0; i < count * stride; ++i) {
        const std::size_t index = scene_.below(points.size());
        if (i % stride == offset) corners.push_back(points[index]);
        indices += number(index) + " ";
      }
      scene_.addTriangles(mesh, corners, kind == 3 ? 's' : kind == 4 ? 'f' : 'l');
      lists += element("p", indices);
    }
    if (kind == 1) content += element("vcount", sizes);
    return element(name, content + lists);
  }

  std::string instance(std::size_t mesh) {
    if (scene_.chance(2)) return "<instance_geometry url=\"#g" + number(mesh) + "\"/>";
    std::string target = "g" + number(mesh);
    for (std::size_t level = 1 + scene_.below(3); level > 0; --level) {
      const std::string kind = scene_.chance(2) ? "skin" : "morph",
                        id = "c" + number(controller_++);
      controllers_ +=
          element("controller id=\"" + id + "\"", "<" + kind + " source=\"#" + target + "\"/>");
      target = id;
    }
    return "<instance_controller url=\"#" + target + "\"/>";
  }

  std::string node(std::size_t n) {
    const RandomNode& node = scene_.nodes[n];
    std::string content =
        element("translate", integers(node.translation)) + element("scale", integers(node.scale));
    for (const std::size_t mesh : node.meshes) content += instance(mesh);
    for (const std::size_t child : node.children) {
      const std::string instanced = "<instance_node url=\"#n" + number(child) + "\"/>";
      content += scene_.chance(2) ? instanced : element("node", instanced);
    }
    return element("node id=\"n" + number(n) + "\"", content);
  }

  RandomScene scene_;
  std::string controllers_;
  std::size_t controller_ = 0;
};

}  // namespace adaptive_bvh_test
