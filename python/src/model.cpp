#include "model.h"

#include <array>
#include <cmath>
#include <cstring>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "docs.h"

namespace adaptive_bvh::python {
namespace {

/// True for float64. Throws py::type_error for what is neither.
bool isDouble(const py::object& dtype) {
  const py::dtype type = dtype.is_none() ? py::dtype::of<double>() : py::dtype::from_args(dtype);
  if (type.kind() == 'f' && type.itemsize() == 8) return true;
  if (type.kind() == 'f' && type.itemsize() == 4) return false;
  throw py::type_error("dtype is " + std::string(py::str(py::handle(type))) +
                       "; float64 or float32 is needed");
}

std::size_t typeIndex(const std::string& volume, const py::object& dtype) {
  if (volume != "rss" && volume != "obbrss")
    throw py::value_error("volume is '" + volume + "'; 'rss' or 'obbrss' is needed");
  return (volume == "rss" ? 0 : 2) + (isDouble(dtype) ? 0 : 1);
}

HierarchyStrategy strategyOf(const std::string& name) {
  for (const auto strategy : {HierarchyStrategy::BottomUp, HierarchyStrategy::TopDown})
    if (name == toString(strategy)) return strategy;
  throw py::value_error("hierarchy is '" + name + "'; 'bottom-up' or 'top-down' is needed");
}

/// The model of a variant with this index.
Model::Variant makeModel(std::size_t index, const RefitPolicy& policy, HierarchyStrategy strategy) {
  Model::Variant models;
  switch (index) {
    case 0: models.emplace<0>(policy, strategy); break;
    case 1: models.emplace<1>(policy, strategy); break;
    case 2: models.emplace<2>(policy, strategy); break;
    default: models.emplace<3>(policy, strategy);
  }
  return models;
}

/// What the build would refuse without a word: coordinates beyond what the library computes with.
template <typename S>
void requireUsable(const Rows<S>& rows) {
  const S limit = static_cast<S>(std::ldexp(1, sizeof(S) == 4 ? 28 : 252));
  const S* numbers = rows.data();
  for (py::ssize_t i = 0; i < rows.size(); ++i)
    if (!(std::abs(numbers[i]) <= limit))
      throw py::value_error("coordinate " + std::string(1, "xyz"[i % 3]) + " of vertex " +
                            std::to_string(i / 3) + " is " + std::to_string(numbers[i]) +
                            (std::isfinite(numbers[i]) ? ", too large" : ""));
}

template <typename M>
void build(M& model, const Rows<ScalarOf<M>>& rows, const std::vector<fcl::Triangle>& triangles) {
  using Point = typename M::Point;
  const Point* points = pointsOf<ScalarOf<M>>(rows);
  const auto count = static_cast<std::size_t>(rows.shape(0));
  const py::gil_scoped_release nogil;
  int code = model.beginModel(static_cast<int>(triangles.size()), static_cast<int>(count));
  if (code == fcl::BVH_OK)
    code = model.addSubModel(std::vector<Point>(points, points + count), triangles);
  if (code == fcl::BVH_OK) code = model.endModel();
  if (code != fcl::BVH_OK)
    throw std::invalid_argument("the model cannot be built: FCL's code is " + std::to_string(code));
}

/// The vertices and faces of a mesh object, or as they were passed.
std::pair<py::object, py::object> meshOf(const py::object& vertices, const py::object& faces) {
  if (!faces.is_none()) return {vertices, faces};
  if (!py::hasattr(vertices, "vertices") || !py::hasattr(vertices, "faces"))
    throw py::type_error(
        "faces are missing: pass vertices and faces, or an object that has both "
        "as attributes");
  return {vertices.attr("vertices"), vertices.attr("faces")};
}

void requireCount(std::size_t count, const char* things) {
  if (count > static_cast<std::size_t>(1) << 30)
    throw py::value_error(std::string("too many ") + things + ": at most 2^30 are possible");
}

}  // namespace

Model::Model(const Arguments& arguments)
    : models_(makeModel(typeIndex(arguments.volume, arguments.dtype),
                        arguments.policy.value_or(RefitPolicy()),
                        strategyOf(arguments.hierarchy))) {
  const auto [vertices, faces] = meshOf(arguments.vertices, arguments.faces);
  std::visit(
      [&, &vertices = vertices, &faces = faces](auto& model) {
        using S = ScalarOf<decltype(model)>;
        const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
        num_vertices_ = static_cast<std::size_t>(rows.shape(0));
        requireCount(num_vertices_, "vertices");
        requireUsable(rows);
        const std::vector<fcl::Triangle> triangles = trianglesFrom(faces, num_vertices_);
        num_faces_ = triangles.size();
        requireCount(num_faces_, "faces");
        build(model, rows, triangles);
      },
      models_);
}

UpdateReport Model::update(const py::object& vertices) {
  const auto run = [&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
    requireRows(rows, num_vertices_, "vertices");
    const Eigen::Map<const Eigen::Matrix<S, 3, Eigen::Dynamic>> map(rows.data(), 3, rows.shape(0));
    return change([&](auto& model) {
      if constexpr (std::is_same_v<ScalarOf<decltype(model)>, S>) return model.update(map);
      return UpdateReport();  // not reached
    });
  };
  return isDouble() ? run(double()) : run(float());
}

UpdateReport Model::update(const py::object& indices, const py::object& vertices) {
  const std::vector<unsigned> names = indicesFrom(indices, num_vertices_, "indices", "vertices");
  const auto run = [&](auto scalar) {
    using S = decltype(scalar);
    const Rows<S> rows = rowsFrom<S>(vertices, "vertices");
    if (static_cast<std::size_t>(rows.shape(0)) != names.size())
      throw py::value_error("vertices has the shape " + shapeOf(rows) + "; there are " +
                            std::to_string(names.size()) + " indices");
    const auto* points = pointsOf<S>(rows);
    return change([&](auto& model) {
      if constexpr (std::is_same_v<ScalarOf<decltype(model)>, S>)
        return model.update(names.data(), points, names.size());
      return UpdateReport();  // not reached
    });
  };
  return isDouble() ? run(double()) : run(float());
}

py::array Model::vertices() const {
  const auto run = [&](auto scalar) -> py::array {
    using S = decltype(scalar);
    py::array_t<S> copy({num_vertices_, std::size_t{3}});
    S* numbers = copy.mutable_data();
    query([&](const auto& model) {
      std::memcpy(static_cast<void*>(numbers), model.vertices, 3 * num_vertices_ * sizeof(S));
    });
    return copy;
  };
  return isDouble() ? run(double()) : run(float());
}

py::array Model::faces() const {
  py::array_t<std::int64_t> copy({num_faces_, std::size_t{3}});
  std::int64_t* numbers = copy.mutable_data();
  query([&](const auto& model) {
    for (std::size_t t = 0; t < num_faces_; ++t)
      for (int k = 0; k < 3; ++k) *numbers++ = static_cast<std::int64_t>(model.tri_indices[t][k]);
  });
  return copy;
}

void Model::requireSameType(const Model& first, const Model& second) {
  if (first.models_.index() == second.models_.index()) return;
  const auto nameOf = [](const Model& model) {
    return std::string(model.isRSS() ? "rss" : "obbrss") + " of " +
           (model.isDouble() ? "float64" : "float32");
  };
  throw py::type_error("the models have different types, " + nameOf(first) + " and " +
                       nameOf(second) + "; give both the same volume and dtype");
}

void bindModel(py::module_& module) {
  py::class_<Model, std::shared_ptr<Model>>(module, "Model", docs::kModel)
      .def(py::init([](py::object vertices, py::object faces, const std::string& volume,
                       py::object dtype, const std::optional<RefitPolicy>& policy,
                       const std::string& hierarchy) {
             return std::make_shared<Model>(Model::Arguments{std::move(vertices), std::move(faces),
                                                             volume, std::move(dtype), policy,
                                                             hierarchy});
           }),
           py::arg("vertices"), py::arg("faces") = py::none(), py::arg("volume") = "rss",
           py::arg("dtype") = "float64", py::arg("policy") = py::none(),
           py::arg("hierarchy") = "bottom-up", docs::kModelInit)
      .def("update", py::overload_cast<const py::object&>(&Model::update), py::arg("vertices"),
           docs::kUpdate)
      .def("update", py::overload_cast<const py::object&, const py::object&>(&Model::update),
           py::arg("indices"), py::arg("vertices"), docs::kUpdateSome)
      .def(
          "validate",
          [](const Model& self) { return self.query([](const auto& m) { return m.validate(); }); },
          docs::kValidate)
      .def(
          "set_update_threads",
          [](Model& self, int threads) {
            self.change([&](auto& model) { model.setUpdateThreads(threads); });
          },
          py::arg("threads"), docs::kUpdateThreads)
      .def(
          "set_query_threads",
          [](Model& self, int threads) {
            self.change([&](auto& model) { model.setQueryThreads(threads); });
          },
          py::arg("threads"), docs::kQueryThreads)
      .def_property_readonly(
          "last_update",
          [](const Model& self) {
            return self.query([](const auto& m) { return UpdateReport(m.lastUpdate()); });
          },
          "What the last build or update did: an UpdateReport.")
      .def_property(
          "policy",
          [](const Model& self) {
            return self.query([](const auto& m) { return RefitPolicy(m.refitPolicy()); });
          },
          [](Model& self, const RefitPolicy& policy) {
            self.change([&](auto& model) { model.setRefitPolicy(policy); });
          },
          "Which volumes an update refits: a RefitPolicy. Set it between two updates; answers stay "
          "the same.")
      .def_property_readonly("vertices", &Model::vertices,
                             "A copy of the present positions, (N, 3), of the model's dtype.")
      .def_property_readonly("faces", &Model::faces,
                             "A copy of the vertices of each triangle, (M, 3), int64.")
      .def_property_readonly("num_vertices", &Model::numVertices, "N: how many vertices.")
      .def_property_readonly("num_faces", &Model::numFaces, "M: how many triangles.")
      .def_property_readonly(
          "volume", [](const Model& self) { return self.isRSS() ? "rss" : "obbrss"; },
          "The bounding volume: 'rss' or 'obbrss'.")
      .def_property_readonly(
          "dtype",
          [](const Model& self) {
            return self.isDouble() ? py::dtype::of<double>() : py::dtype::of<float>();
          },
          "The type of the model's numbers: float64 or float32.")
      .def("__repr__", [](const Model& self) {
        return "<adaptive_bvh.Model: " + std::to_string(self.numVertices()) + " vertices, " +
               std::to_string(self.numFaces()) + " faces, " + (self.isRSS() ? "rss" : "obbrss") +
               " of " + (self.isDouble() ? "float64" : "float32") + ">";
      });
}

}  // namespace adaptive_bvh::python
