// What the readers of `adaptive_bvh clearance` take from the component mesh_io.
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "adaptive_bvh/mesh_io.h"
#include "bind.h"
#include "mesh_io/formats.h"
#include "mesh_io/gltf_document.h"
#include "mesh_io/printable.h"
#include "meshes.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace {

/// Calls read(). Throws MeshLoadError if that throws std::runtime_error or the like.
template <typename Read>
auto readFrom(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    failToLoad(path, error.what());
  }
}

bool declaresUnitOf(const py::object& path) {
  const std::string name = pathFrom(path);
  const py::gil_scoped_release nogil;
  return readFrom(name, [&] { return declaresUnit(name); });
}

/// A glTF document with its scene.
class GltfFile {
 public:
  GltfFile(std::string path, std::unique_ptr<GltfDocument> document)
      : path_(std::move(path)),
        document_(std::move(document)),
        scene_(sceneOf(*document_)),
        placed_(placedMeshes(scene_.scene)) {}

  std::string json() const { return document_->json.dump(); }

  /// (placements, 2): a node of the scene, and its level.
  py::array placements() const {
    std::vector<std::array<std::int64_t, 2>> rows;
    for (const Placement& p : placed_.placements)
      rows.push_back({static_cast<std::int64_t>(p.node), static_cast<std::int64_t>(p.level)});
    return adopt(std::move(rows));
  }

  /// Of each node of the scene: its number in the document (-1: none), its transform, the numbers
  /// of its meshes in the scene, and whether joints move them.
  py::list nodes() const {
    py::list nodes;
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) {
      const SceneNode& node = scene_.scene.nodes[n];
      std::array<std::array<double, 4>, 4> rows;
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) rows[std::size_t(i)][std::size_t(k)] = node.transform(i, k);
      nodes.append(py::make_tuple(numberOf("nodes", scene_.nodes[n]), arrayOf(rows), node.meshes,
                                  node.is_skinned));
    }
    return nodes;
  }

  /// Of each mesh of the scene: its number in the document, its positions and triangles, and of
  /// each of its parts the first vertex and the number of the primitive.
  py::list meshes() const {
    py::list meshes;
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      std::vector<std::pair<std::size_t, std::size_t>> parts;
      for (const GltfScene::Part& part : scene_.parts[m])
        parts.emplace_back(part.first_vertex, part.primitive);
      meshes.append(py::make_tuple(numberOf("meshes", scene_.meshes[m]), placed_.meshes[m], parts));
    }
    return meshes;
  }

  /// (count, width): the numbers of an accessor of the type `form`.
  py::array numbers(std::size_t accessor, const std::string& form) {
    std::vector<double> numbers = readFrom(path_, [&] {
      return document_->accessors.numbers(at(at(document_->json, "accessors"), accessor), form);
    });
    const py::ssize_t count = static_cast<py::ssize_t>(numbers.size());
    const py::ssize_t width = form == "SCALAR" ? 1 : form == "MAT4" ? 16 : form[3] - '0';
    return adopt(std::move(numbers)).reshape({count / width, width});
  }

 private:
  /// The number of an element in a list of the document; -1 if it is not in a list.
  std::int64_t numberOf(const char* list, const Json* element) const {
    const Json& elements = at(document_->json, list);
    if (!elements.is_array() || element == &document_->json) return -1;
    return element - elements.get_ref<const Json::array_t&>().data();
  }

  std::string path_;
  std::unique_ptr<GltfDocument> document_;
  GltfScene scene_;
  PlacedMeshes placed_;
};

std::unique_ptr<GltfFile> openGltfOf(const py::object& path) {
  const std::string name = pathFrom(path);
  const py::gil_scoped_release nogil;
  return readFrom(name, [&] {
    std::unique_ptr<GltfDocument> document = openGltf(name);
    return document ? std::make_unique<GltfFile>(name, std::move(document)) : nullptr;
  });
}

}  // namespace

void bindFiles(py::module_& module) {
  module.def(
      "_printable", [](const py::object& name) { return printable(pathFrom(name)); }, "name"_a,
      "A file name in UTF-8: other bytes and control characters become a code such as \"\\xE9\".");
  module.def("_declares_unit", &declaresUnitOf, "path"_a, "Whether a mesh file declares its unit.");
  module.def("_open_gltf", &openGltfOf, "path"_a, "A glTF file; None for other formats.");
  py::class_<GltfFile>(module, "_GltfFile")
      .def_property_readonly("json", &GltfFile::json)
      .def_property_readonly("placements", &GltfFile::placements)
      .def_property_readonly("nodes", &GltfFile::nodes)
      .def_property_readonly("meshes", &GltfFile::meshes)
      .def("numbers", &GltfFile::numbers, "accessor"_a, "form"_a);
}

}  // namespace adaptive_bvh::python
