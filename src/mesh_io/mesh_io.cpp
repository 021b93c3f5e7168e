// Chooses the reader of a file, and transforms its mesh to the caller's axes and unit.
#include "adaptive_bvh/mesh_io.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <new>
#include <optional>

#include "formats.h"
#include "gltf_document.h"
#include "printable.h"
#include "tokens.h"
#include "xml.h"
#include "zip.h"

namespace adaptive_bvh {
namespace {

bool isOneOf(std::initializer_list<const char*> words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool contains(std::string_view text, const char* part) { return text.find(part) != text.npos; }

/// The extension of a file's name, in lower case and without the dot.
std::string extensionOf(const std::string& path) {
  return inLowerCase(path.substr(path.find_last_of('.') + 1));
}

/// The first word that is not part of a comment.
std::string_view firstWord(std::string_view text) {
  Words words(text);
  std::string_view word = words.next();
  for (; !word.empty() && word[0] == '#'; word = words.next()) words.restOfLine();
  return word;
}

/// Whether the first word is OFF, possibly after letters for additional vertex data.
bool beginsAsOff(std::string_view text) {
  const std::string_view word = firstWord(text);
  return word.substr(std::min(word.find_first_not_of("STCN4n"), word.size())) == "OFF";
}

bool beginsAsStl(const std::string& bytes) {
  return inLowerCase(Words(withoutByteOrderMark(bytes)).next()) == "solid" ||
         hasLengthOfBinaryStl(bytes);
}

bool beginsAsObj(std::string_view text) {
  return isOneOf({"v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"}, firstWord(text));
}

/// The extension of the file's format, if this library reads it itself; empty for other formats.
/// Beginnings that no other format has come first, then the name, then other beginnings. Throws if
/// the name is that of a format whose files all begin alike, and this one does not.
std::string formatOf(const std::string& path, const std::string& bytes) {
  const std::string_view beginning = withoutByteOrderMark(std::string_view(bytes).substr(0, 4096));
  const std::string magic = inLowerCase(beginning.substr(0, 3));
  if (beginning.substr(0, 4) == "glTF") return "gltf";
  if (magic == "ply") return "ply";
  if (contains(beginning, "<COLLADA")) return "dae";
  const std::string extension = extensionOf(path);
  if (isOneOf({"obj", "stl", "off", "gltf", "dae"}, extension)) return extension;
  if (extension == "glb" || extension == "ply")
    throw std::runtime_error("it does not begin as " + extension + " files do");
  if (beginsAsOff(beginning)) return "off";
  if (beginsAsStl(bytes)) return "stl";
  if (Words(beginning).next().substr(0, 1) == "{" && contains(bytes, "\"asset\"")) return "gltf";
  return beginsAsObj(beginning) ? "obj" : "";
}

/// Whether assimp would read a file as XML: by its first character in any encoding, or by its name.
bool isXml(const std::string& path, const std::string& bytes) {
  const std::size_t first =
      bytes.find_first_not_of(std::string_view("\xEF\xBB\xBF\xFE\xFF\0 \t\r\n", 10));
  return (first != bytes.npos && bytes[first] == '<') ||
         isOneOf({"amf", "irr", "irrmesh", "x3d", "xgl", "xml"}, extensionOf(path));
}

/// Reads a file with assimp, after checks of what assimp itself does not check.
FileScene readOther(const std::string& path, const std::string& bytes) {
  std::optional<double> unit;
  // Also for XML without a unit: parseXml limits the nesting, which assimp does not.
  if (isXml(path, bytes)) unit = unitOfAmf(parseXml(bytes));
  const std::string extension = extensionOf(path);
  if (extension == "3mf" || (isZip(bytes) && !isOneOf({"pk3", "zae"}, extension)))
    unit = unitOf3mf(bytes);
  FileScene scene = readByAssimp(path);
  if (unit) scene.unit = unit;
  return scene;
}

/// A scene of one node, which places one mesh.
FileScene sceneWith(PolygonMesh mesh) {
  FileScene scene;
  scene.meshes.push_back(std::move(mesh));
  scene.nodes.emplace_back();
  scene.nodes[0].meshes = {0};
  return scene;
}

}  // namespace

bool isRegularFile(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

std::string readFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !isRegularFile(path))
    throw std::runtime_error("'" + path + "' is no regular file");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file.good()) throw std::runtime_error("'" + path + "' does not exist or cannot be read");
  std::string bytes(static_cast<std::size_t>(file.tellg()), '\0');
  file.seekg(0).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));  // it may have become shorter
  return bytes;
}

bool declaresUnit(const std::string& path) {
  const std::string bytes = readFile(path), format = formatOf(path, bytes);
  return format.empty() ? readOther(path, bytes).unit.has_value()
                        : format == "gltf" || format == "dae";
}

std::unique_ptr<GltfDocument> openGltf(const std::string& path) {
  const std::string bytes = readFile(path);
  if (formatOf(path, bytes) != "gltf") return nullptr;
  return std::make_unique<GltfDocument>(bytes, NamedFiles(path, false));
}

FileScene readScene(const std::string& path, const MeshLoadOptions& options) {
  const std::string bytes = readFile(path), format = formatOf(path, bytes);
  if (format == "obj") return sceneWith(readObj(bytes));
  if (format == "stl") return sceneWith(readStl(bytes));
  if (format == "ply") return sceneWith(readPly(bytes));
  if (format == "off") return sceneWith(readOff(bytes));
  if (format == "gltf") {
    GltfDocument document(bytes, NamedFiles(path, options.buffers_outside_folder));
    return sceneOf(document).scene;
  }
  if (format == "dae") return readCollada(bytes);
  return readOther(path, bytes);
}

void failToLoad(const std::string& path, const std::string& reason) {
  throw MeshLoadError(printable("cannot load mesh '" + path + "': " + reason));
}

namespace {

/// The directions right, up and towards the viewer (columns), as Collada defines them.
Eigen::Matrix3d axesOf(UpAxis up) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (up == UpAxis::X) axes << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  if (up == UpAxis::Z) axes << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return axes;
}

/// The transform from the file's frame and unit to the caller's.
Eigen::Matrix4d transformFor(const FileScene& scene, const MeshLoadOptions& options) {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  if (options.up != UpAxis::AsInFile && scene.up != UpAxis::AsInFile)
    transform.topLeftCorner<3, 3>() = axesOf(options.up) * axesOf(scene.up).transpose();
  const double unit = scene.unit.value_or(options.undeclared_unit);
  transform.topRows<3>() *= options.scale * (options.metres ? unit / options.unit : 1);
  return transform;
}

void checkOptions(const MeshLoadOptions& options) {
  for (const double factor : {options.scale, options.unit, options.undeclared_unit})
    if (!(factor > 0) || !std::isfinite(factor))
      throw std::invalid_argument("loadMesh: scale and units must be positive and finite");
  if (!(options.weld_tolerance >= 0) || !std::isfinite(options.weld_tolerance))
    throw std::invalid_argument("loadMesh: the weld tolerance must be finite, and not negative");
}

TriangleMesh readMesh(const std::string& path, const MeshLoadOptions& options) {
  try {
    FileScene scene = readScene(path, options);
    const Eigen::Matrix4d transform = transformFor(scene, options);
    return flatten(std::move(scene), transform);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    failToLoad(path, error.what());
  }
}

}  // namespace

TriangleMesh loadMesh(const std::string& path, const MeshLoadOptions& options) {
  checkOptions(options);
  TriangleMesh mesh = readMesh(path, options);
  if (mesh.triangles.empty()) failToLoad(path, "it holds no triangles");
  for (const fcl::Vector3d& p : mesh.vertices)
    if (!p.allFinite()) failToLoad(path, "a coordinate is not finite");
  if (options.weld) weldVertices(mesh, options.weld_tolerance);
  if (mesh.triangles.empty())
    failToLoad(path, "there are no triangles left when vertices are welded");
  return mesh;
}

}  // namespace adaptive_bvh
