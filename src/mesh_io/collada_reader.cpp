// Reads Collada: indexes the elements by id, reads nodes and the meshes that they place, then links
// instances of nodes. A reference ("url") is '#' and an id.
#include <map>
#include <vector>

#include "formats.h"
#include "tokens.h"
#include "xml.h"

namespace adaptive_bvh {
namespace {

/// The numbers in the text of an element.
std::vector<double> numbersOf(const XmlElement& element) {
  std::vector<double> numbers;
  Words words(element.text);
  for (std::string_view word; !(word = words.next()).empty();) {
    const auto number = numberOf(word);
    if (!number)
      throw std::runtime_error("<" + element.name + "> contains " + quote(word) +
                               ", which is no number");
    numbers.push_back(*number);
  }
  return numbers;
}

/// The same, if there are `count` numbers. Throws otherwise.
std::vector<double> numbersOf(const XmlElement& element, std::size_t count) {
  std::vector<double> numbers = numbersOf(element);
  if (numbers.size() != count)
    throw std::runtime_error("<" + element.name + "> has not " + std::to_string(count) +
                             " numbers");
  return numbers;
}

/// The indices in the text of an element.
std::vector<std::size_t> indicesOf(const XmlElement& list) {
  std::vector<std::size_t> indices;
  Words words(list.text);
  for (std::string_view word; !(word = words.next()).empty();) {
    const auto index = integerOf(word);
    if (!index || *index < 0) throw std::runtime_error("a list of indices contains " + quote(word));
    indices.push_back(static_cast<std::size_t>(*index));
  }
  if (!list.children.empty()) throw std::runtime_error("a list of indices contains an element");
  return indices;
}

/// The transform of <lookat>, whose numbers are an eye point, a target and an up vector.
Eigen::Matrix4d lookAt(const std::vector<double>& n) {
  const Eigen::Vector3d eye(n[0], n[1], n[2]), target(n[3], n[4], n[5]), up(n[6], n[7], n[8]);
  const Eigen::Vector3d back = (eye - target).normalized(), right = up.cross(back).normalized();
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRows<3>() << right, back.cross(right), back, eye;
  return matrix;
}

/// The transform that an element of a node describes; the identity for other elements.
Eigen::Matrix4d transformOf(const XmlElement& element) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  if (element.name == "translate") {
    transform.translate(Eigen::Vector3d(numbersOf(element, 3).data()));
  } else if (element.name == "scale") {
    transform.scale(Eigen::Vector3d(numbersOf(element, 3).data()));
  } else if (element.name == "rotate") {
    const std::vector<double> n = numbersOf(element, 4);
    const Eigen::Vector3d axis(n[0], n[1], n[2]);
    if (!axis.isZero(0)) transform.rotate(Eigen::AngleAxisd(n[3] * M_PI / 180, axis.normalized()));
  } else if (element.name == "matrix") {
    return Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(numbersOf(element, 16).data());
  } else if (element.name == "lookat") {
    return lookAt(numbersOf(element, 9));
  } else if (element.name == "skew") {
    throw std::runtime_error("a node is skewed, which is not read");
  }
  return transform.matrix();
}

class ColladaReader {
 public:
  explicit ColladaReader(const std::string& text)
      : document_(parseXml(text)), limit_(kReadsTooOften, text.size()) {
    scene_.bytes = text.size();
    scene_.nodes.reserve(index(document_));
  }

  FileScene read() {
    if (document_.name != "COLLADA") throw std::runtime_error("it is no Collada file");
    readAsset(document_.child("asset"));
    for (const XmlElement& library : document_.children)
      for (const XmlElement& element : library.children)
        if (isNode(element)) addNode(element);
    linkInstances();
    scene_.root = rootNode();
    return std::move(scene_);
  }

 private:
  static bool isNode(const XmlElement& element) {
    return element.name == "node" || element.name == "visual_scene";
  }

  /// Indexes an element and those below it by name and id, because some writers give a node the id
  /// of its geometry. Returns the number of nodes.
  std::size_t index(const XmlElement& element) {
    const std::string id = element.attribute("id");
    if (!id.empty()) by_id_.emplace(element.name + '#' + id, &element);
    std::size_t nodes = isNode(element) ? 1 : 0;
    for (const XmlElement& child : element.children) nodes += index(child);
    return nodes;
  }

  /// The element with that name that "#id" refers to; null if there is none.
  const XmlElement* find(const std::string& name, const std::string& url) const {
    const auto found = by_id_.find(name + url);
    return found == by_id_.end() ? nullptr : found->second;
  }
  /// The same; throws if there is none.
  const XmlElement& resolve(const std::string& url, const std::string& name) const {
    if (const XmlElement* const element = find(name, url)) return *element;
    throw std::runtime_error("there is no <" + name + "> '" + url + "' in it");
  }

  void readAsset(const XmlElement& asset) {
    const auto unit = numberOf(asset.child("unit").attribute("meter", "1"));
    if (!unit || !(*unit > 0)) throw std::runtime_error("its unit is no length");
    scene_.unit = *unit;
    const std::string_view up = Words(asset.child("up_axis").text).next();
    scene_.up = up == "X_UP" ? UpAxis::X : up == "Z_UP" ? UpAxis::Z : UpAxis::Y;
  }

  /// Adds a node, the nodes below it and the meshes that they place. Returns its number.
  std::size_t addNode(const XmlElement& element) {
    const std::size_t number = scene_.nodes.size();
    scene_.nodes.emplace_back();
    SceneNode node;
    const std::string id = element.attribute("id"), name = element.attribute("name");
    has_references_ |= id.find("&#") != id.npos || name.find("&#") != name.npos;
    node_numbers_.emplace(&element, number);
    nodes_by_name_.emplace(name, number);
    for (const XmlElement& child : element.children) {
      node.transform *= transformOf(child);
      if (child.name == "instance_geometry")
        node.meshes.push_back(meshOf(resolve(child.attribute("url"), "geometry")));
      else if (child.name == "instance_controller")
        node.meshes.push_back(meshOf(geometryOf(child.attribute("url"))));
      else if (child.name == "instance_node")
        instances_.emplace_back(number, child.attribute("url"));
      else if (isNode(child))
        node.children.push_back(addNode(child));
    }
    scene_.nodes[number] = std::move(node);
    return number;
  }

  /// The geometry of a skin or a morph, whose source is a geometry or another controller.
  const XmlElement& geometryOf(const std::string& url) {
    std::string source = url;
    std::vector<const XmlElement**> unresolved;  // where to store the geometry of each controller
    while (const XmlElement* const controller = find("controller", source)) {
      const auto [geometry, is_new] = geometries_.emplace(controller, nullptr);
      if (!is_new && !geometry->second)
        throw std::runtime_error("a controller is among its own sources");
      if (!is_new) return store(*geometry->second, unresolved);
      unresolved.push_back(&geometry->second);
      const XmlElement& skin = controller->child("skin");
      source = (skin.name.empty() ? controller->child("morph") : skin).attribute("source");
    }
    return store(resolve(source, "geometry"), unresolved);
  }

  /// Stores a pointer to an element in all targets. Returns the element.
  static const XmlElement& store(const XmlElement& element,
                                 const std::vector<const XmlElement**>& targets) {
    for (const XmlElement** target : targets) *target = &element;
    return element;
  }

  /// Adds instances as children, found by id, or by name if no node has that id (as some writers
  /// refer to nodes). Then checks the hierarchy.
  void linkInstances() {
    if (!instances_.empty() && has_references_)
      throw std::runtime_error(
          "it has instances of nodes, and character references in the names of some nodes");
    std::string unknown;
    for (const auto& [parent, url] : instances_) {
      if (url.find_first_of("&<>\"'") != url.npos)
        throw std::runtime_error("it has an instance of a node that has no valid name");
      const XmlElement* const node = find("node", url);
      const auto by_id = node_numbers_.find(node ? node : find("visual_scene", url));
      const auto by_name = nodes_by_name_.find(url.substr(std::min<std::size_t>(1, url.size())));
      if (by_id != node_numbers_.end())
        scene_.nodes[parent].children.push_back(by_id->second);
      else if (by_name != nodes_by_name_.end())
        scene_.nodes[parent].children.push_back(by_name->second);
      else
        unknown = url;
    }
    checkHierarchy(scene_.nodes);
    if (!unknown.empty())
      throw std::runtime_error("it has an instance of the unknown node '" + unknown + "'");
  }

  /// The visual scene that is instantiated, or the first one.
  std::size_t rootNode() const {
    const XmlElement& instance = document_.child("scene").child("instance_visual_scene");
    const XmlElement& scene = instance.name.empty()
                                  ? document_.child("library_visual_scenes").child("visual_scene")
                                  : resolve(instance.attribute("url"), "visual_scene");
    const auto found = node_numbers_.find(&scene);
    if (found == node_numbers_.end()) throw std::runtime_error("it has no scene");
    return found->second;
  }

  /// The number of the mesh of a geometry. Reads it at its first use.
  std::size_t meshOf(const XmlElement& geometry) {
    const auto [found, is_new] = mesh_numbers_.emplace(&geometry, scene_.meshes.size());
    if (is_new) {
      scene_.meshes.emplace_back();
      first_vertices_.clear();
      for (const XmlElement& primitive : geometry.child("mesh").children) addPrimitive(primitive);
    }
    return found->second;
  }

  /// Adds an element of faces to the last mesh. Ignores other elements.
  void addPrimitive(const XmlElement& primitive) {
    const std::string& kind = primitive.name;
    if (kind != "triangles" && kind != "polylist" && kind != "polygons" && kind != "tristrips" &&
        kind != "trifans")
      return;
    if (!primitive.child("ph").name.empty())
      throw std::runtime_error("polygons with holes (<ph>) are not read");
    std::size_t stride = 0, offset = 0;
    const std::size_t first = addVertices(primitive, stride, offset);
    std::size_t faces = 0;
    std::vector<std::size_t> corners;
    for (const XmlElement& list : primitive.children) {
      if (list.name != "p") continue;
      const std::vector<std::size_t> indices = indicesOf(list);
      if (kind != "polylist") corners.clear();  // for a polylist, sizes refer to all lists together
      for (std::size_t i = offset; i < indices.size(); i += stride)
        corners.push_back(first + indices[i]);
      if (indices.size() % stride != 0) throw std::runtime_error("a list of indices ends early");
      if (kind != "polylist") faces += addFaces(kind, {corners.size()}, corners);
    }
    if (kind == "polylist") faces = addFaces(kind, indicesOf(primitive.child("vcount")), corners);
    const std::string count = primitive.attribute("count", std::to_string(faces));
    if (kind[0] != 't' || kind == "triangles")
      if (integerOf(count) != static_cast<std::int64_t>(faces))
        throw std::runtime_error("it announces '" + count + "' faces, and has " +
                                 std::to_string(faces));
  }

  /// Adds the vertices of a primitive, and returns the index of the first one. Primitives of a mesh
  /// that use the same source share its vertices. In the primitive's lists of indices, every
  /// `stride`-th number is a vertex, from `offset` on; the others are normals and so on.
  std::size_t addVertices(const XmlElement& primitive, std::size_t& stride, std::size_t& offset) {
    const XmlElement* source = nullptr;
    for (const XmlElement& input : primitive.children) {
      if (input.name != "input") continue;
      const std::size_t its_offset = countOf("offsets", input.attribute("offset", "0"), 1000);
      stride = std::max(stride, its_offset + 1);
      if (input.attribute("semantic") != "VERTEX") continue;
      offset = its_offset;
      source = &sourceOf(resolve(input.attribute("source"), "vertices"));
    }
    if (!source) throw std::runtime_error("a <" + primitive.name + "> has no vertices");
    std::vector<fcl::Vector3d>& vertices = scene_.meshes.back().vertices;
    const auto [first, is_new] = first_vertices_.emplace(source, vertices.size());
    if (is_new) {
      const std::vector<fcl::Vector3d>& positions = positionsOf(*source);
      limit_.take(positions.size());
      vertices.insert(vertices.end(), positions.begin(), positions.end());
    }
    return first->second;
  }

  /// The source of the positions of a <vertices> element.
  const XmlElement& sourceOf(const XmlElement& vertices) {
    const auto [found, is_new] = sources_.emplace(&vertices, nullptr);
    if (is_new) {
      std::string source;
      for (const XmlElement& data : vertices.children)
        if (data.attribute("semantic") == "POSITION") source = data.attribute("source");
      found->second = &resolve(source, "source");
    }
    return *found->second;
  }

  /// The positions of a <source> element, each read once.
  const std::vector<fcl::Vector3d>& positionsOf(const XmlElement& source) {
    const auto [found, is_new] = positions_.try_emplace(&source);
    if (is_new) found->second = readPositions(source);
    return found->second;
  }

  std::vector<fcl::Vector3d> readPositions(const XmlElement& source) {
    const XmlElement& accessor = source.child("technique_common").child("accessor");
    const XmlElement& array = resolve(accessor.attribute("source"), "float_array");
    const std::vector<double> numbers = numbersOf(array);
    const std::size_t size = numbers.size();
    limit_.take(size);
    const std::size_t count = countOf("positions", accessor.attribute("count"), size),
                      stride = countOf("numbers apart", accessor.attribute("stride", "1"), size),
                      offset = countOf("numbers before", accessor.attribute("offset", "0"), size);
    std::size_t columns[3] = {0, 1, 2}, column = 0;
    for (const XmlElement& param : accessor.children) {
      const std::string name = param.attribute("name");
      if (name.size() == 1 && name[0] >= 'X' && name[0] <= 'Z') columns[name[0] - 'X'] = column;
      ++column;
    }
    const std::size_t last = std::max({columns[0], columns[1], columns[2]});
    if (count > 0 && (last >= stride || offset + count * stride > size))
      throw std::runtime_error("an accessor reaches past its array");
    std::vector<fcl::Vector3d> positions;
    positions.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double* const p = numbers.data() + offset + stride * i;
      positions.emplace_back(p[columns[0]], p[columns[1]], p[columns[2]]);
    }
    return positions;
  }

  /// Adds faces of a primitive of this kind to the last mesh. For polygons, `sizes` are their
  /// numbers of corners. Returns the number of faces.
  std::size_t addFaces(const std::string& kind, const std::vector<std::size_t>& sizes,
                       const std::vector<std::size_t>& corners) {
    PolygonMesh& mesh = scene_.meshes.back();
    const std::size_t before = mesh.sizes.size();
    if (kind == "polygons" || kind == "polylist") {
      std::size_t begin = 0;
      for (const std::size_t size : sizes) {
        if (size > corners.size() - begin) throw std::runtime_error("a list of indices ends early");
        const auto first = corners.begin() + static_cast<std::ptrdiff_t>(begin);
        mesh.corners.insert(mesh.corners.end(), first, first + static_cast<std::ptrdiff_t>(size));
        mesh.endFace();
        begin += size;
      }
    } else {
      using Layout = PolygonMesh::Layout;
      mesh.addTriangles(corners, kind == "triangles"   ? Layout::List
                                 : kind == "tristrips" ? Layout::Strip
                                                       : Layout::Fan);
    }
    return mesh.sizes.size() - before;
  }

  const XmlElement document_;
  ElementLimit limit_;
  FileScene scene_;
  std::map<std::string, const XmlElement*> by_id_;    ///< by "name#id", name of the element
  std::map<std::string, std::size_t> nodes_by_name_;  ///< by the attribute "name"
  std::map<const XmlElement*, std::size_t> node_numbers_, mesh_numbers_;
  std::vector<std::pair<std::size_t, std::string>> instances_;  ///< number of the parent, url
  bool has_references_ = false;  ///< whether a node's id or name has character references

  std::map<const XmlElement*, const XmlElement*>
      geometries_;  ///< by controller; null while being resolved
  std::map<const XmlElement*, const XmlElement*>
      sources_;  ///< source of the positions of <vertices>
  std::map<const XmlElement*, std::vector<fcl::Vector3d>> positions_;  ///< by source
  std::map<const XmlElement*, std::size_t> first_vertices_;  ///< by source, for the last mesh
};

}  // namespace

FileScene readCollada(const std::string& text) { return ColladaReader(text).read(); }

}  // namespace adaptive_bvh
