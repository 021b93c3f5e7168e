#include "adaptive_bvh/contact_set.h"

#include <limits>
#include <memory>
#include <mutex>
#include <optional>

#include <pybind11/stl.h>

#include "arrays.h"
#include "bind.h"
#include "ignored.h"
#include "locked_mesh.h"
#include "locked_scene.h"
#include "pose.h"
#include "query.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kContactSet =
    R"(Near pairs that are kept from step to step: those of one mesh with itself, of two meshes, or of a
Scene. After `update` they are the pairs that pairs_within or feature_pairs_within would find, of one
mesh self_pairs_within or self_feature_pairs_within.

Each pair has a number, which it keeps as long as it lives. Arrays of the caller are indexed by it:
impulses, states of friction. An update costs what has changed. Keeps meshes and scene alive.
ValueError where triangles are asked of a set of features, or features of a set of triangles.
Threads use one object one after the other.)";

constexpr const char* kInitSelf =
    R"(The pairs of one mesh with itself.

distance: largest distance of a pair, a length. ValueError when it is negative or NaN.
elements: 'triangles', or 'features': pairs of a vertex and a face, and of two edges.
ignored: what is left out, as of self_pairs_within and self_feature_pairs_within.)";

constexpr const char* kInitPair = "The pairs of two meshes, likewise.";

constexpr const char* kInitScene =
    R"(The pairs of all bodies of a scene that are meshes, and of meshes with themselves where they were
added with self_collision.)";

constexpr const char* kUpdateSet =
    R"(Brings the set up to date with the meshes or the scene. Returns the number of pairs.

tf1, tf2: poses that place two meshes in the world. Call update of a scene before.)";

constexpr const char* kNumbered =
    R"(The pairs of one kind in a ContactSet, by their numbers. len() counts the pairs.)";

constexpr const char* kCompact =
    R"(Gives the pairs of each kind the numbers from 0 on, in the order of their old numbers. Returns
Renumbering: for each kind the new number by the old one, -1 for a number that was free.)";

constexpr const char* kDetailsOfSet =
    R"(Distances, nearest points and normals of pairs of triangles: FeatureDetails without coordinates.

numbers: (K,) integers, or None: of all pairs, by increasing number. IndexError when no pair has a
    number.
kind: None of triangles; of features 'vertex_face', 'face_vertex' or 'edge_edge': as
    feature_pair_details.)";

constexpr const char* kContactsOfSet =
    R"(The contacts of the pairs of triangles that touch, in the order of their numbers: Contacts, as
collide and self_collide find them.

enable_contact: False leaves out points, normals and depths, which are then NaN.)";
}  // namespace docs

namespace {

/// Of a kind, as Python sees it: a copy.
struct Numbered : Bound {
  Numbered() = default;
  explicit Numbered(const NumberedPairs& pairs) : list(pairs) {
    for (const BodyPair& pair : pairs.bodies) bodies.push_back({pair.first, pair.second});
    pairs.list(numbers);
  }

  NumberedPairs list;
  std::vector<std::array<std::int64_t, 2>> bodies;
  std::vector<unsigned> numbers;
};

struct Renumbered : Bound {
  Renumbering to;
};

FeatureKind featureKind(const std::string& name) {
  return named<FeatureKind>(name, "kind",
                            {{"vertex_face", FeatureKind::VertexFace},
                             {"face_vertex", FeatureKind::FaceVertex},
                             {"edge_edge", FeatureKind::EdgeEdge}});
}

ContactElements contactElements(const std::string& name) {
  return named<ContactElements>(
      name, "elements",
      {{"triangles", ContactElements::Triangles}, {"features", ContactElements::Features}});
}

/// The library's request; and what it refers to while the set is made.
struct Request {
  Request(double distance, const std::string& elements, const py::object& given, bool is_self)
      : of(contactElements(elements)),
        ignored(given,
                of == ContactElements::Triangles ? IgnoredArgument::Triangles
                                                 : IgnoredArgument::Features,
                is_self),
        request{distance, of, ignored.get()} {}

  const ContactElements of;
  const IgnoredArgument ignored;
  const ContactSetRequest request;
};

/// Python's ContactSet: a set of the library, and what keeps alive what it refers to.
class PySet : public Bound {
 public:
  PySet(const LockedMesh& mesh, double distance, const std::string& elements,
        const py::object& ignored)
      : first_(mesh.shared_from_this()) {
    const Request asked(distance, elements, ignored, true);
    elements_ = asked.of;
    mesh.query([&](const Mesh& m) { set_.emplace(m, asked.request); });
  }
  PySet(const LockedMesh& first, const LockedMesh& second, double distance,
        const std::string& elements, const py::object& ignored)
      : first_(first.shared_from_this()), second_(second.shared_from_this()) {
    const Request asked(distance, elements, ignored, false);
    elements_ = asked.of;
    queryPair(first, second,
              [&](const Mesh& a, const Mesh& b) { set_.emplace(a, b, asked.request); });
  }
  PySet(const LockedScene& scene, double distance, const std::string& elements,
        const py::object& ignored)
      : scene_(&scene) {
    const Request asked(distance, elements, ignored, true);
    elements_ = asked.of;
    scene.query([&](const Scene& s) { set_.emplace(s, asked.request); });
  }

  /// Returns f(set), without the GIL, with the locks of a query.
  template <typename F>
  auto change(const F& f) {
    const py::gil_scoped_release nogil;
    const std::lock_guard alone(mutex_);
    if (scene_) {
      const LockedScene::Locks locks = scene_->share({});
      return f(*set_);
    }
    const LockedMesh::PairLock lock(*first_, second_ ? *second_ : *first_);
    return f(*set_);
  }

  /// Throws py::value_error unless the pairs are of these elements.
  void require(ContactElements elements) const {
    if (elements == elements_) return;
    throw py::value_error(elements == ContactElements::Features
                              ? "a ContactSet of triangles has no pairs of features; make one with "
                                "elements='features'"
                              : "a ContactSet of features has no pairs of triangles; make one with "
                                "elements='triangles'");
  }

  std::size_t update(const py::object& tf1, const py::object& tf2) {
    if (!second_ && !(tf1.is_none() && tf2.is_none()))
      throw py::value_error("only a ContactSet of two meshes takes poses");
    if (!second_) return change([](auto& set) { return set.update(); });
    const Poses poses(tf1, tf2, "tf1", "tf2");
    return change([&](auto& set) { return set.update(poses.tf1, poses.tf2); });
  }

 private:
  std::shared_ptr<const LockedMesh> first_, second_;
  const LockedScene* scene_ = nullptr;  ///< kept alive by pybind11
  ContactElements elements_ = ContactElements::Triangles;
  std::mutex mutex_;
  std::optional<ContactSet> set_;  ///< always there
};

Numbered numbered(PySet& self, const std::optional<FeatureKind>& kind) {
  self.require(kind ? ContactElements::Features : ContactElements::Triangles);
  return self.change([&](const ContactSet& set) {
    return Numbered(kind ? set.features(*kind) : set.triangles());
  });
}

FeatureDetails details(PySet& self, const py::object& numbers,
                       const std::optional<std::string>& kind) {
  constexpr std::size_t kLimit = std::size_t(1) << 31;
  std::optional<FeatureKind> of;
  if (kind) of = featureKind(*kind);
  self.require(kind ? ContactElements::Features : ContactElements::Triangles);
  std::vector<unsigned> given;
  const bool is_all = numbers.is_none();
  if (!is_all) given = indicesFrom(numbers, kLimit, "numbers", "numbers at most");
  FeatureDetails result;
  const bool exist = self.change([&](const ContactSet& set) {
    const NumberedPairs& list = of ? set.features(*of) : set.triangles();
    if (is_all) list.list(given);
    for (const unsigned number : given)
      if (!list.contains(number)) return false;
    of ? set.details(*of, given, result) : set.details(given, result);
    return true;
  });
  if (!exist) throw py::index_error("numbers has a number that no pair has");
  return result;
}

Contacts contacts(PySet& self, bool enable_contact) {
  self.require(ContactElements::Triangles);
  fcl::CollisionResultd result;
  self.change([&](const ContactSet& set) {
    return set.contacts(
        fcl::CollisionRequestd(std::numeric_limits<std::size_t>::max(), enable_contact), result);
  });
  Contacts found;
  for (std::size_t i = 0; i < result.numContacts(); ++i) found.add(result.getContact(i), false);
  return found;
}

Renumbered compact(PySet& self) {
  Renumbered result;
  self.change([&](ContactSet& set) { set.compact(result.to); });
  return result;
}

void bindNumbers(py::module_& module) {
  ResultClass<Numbered> pairs(module, "NumberedPairs", docs::kNumbered);
  const auto member = [](auto NumberedPairs::*of) {
    return [of](const Numbered& self) -> const auto& { return self.list.*of; };
  };
  pairs
      .attribute("pairs", member(&NumberedPairs::pairs),
                 "(N, 2) int32: the pair of each number; (-1, -1) of a free number.")
      .attribute("numbers", &Numbered::numbers,
                 "(K,) int32: the numbers of all pairs, in increasing order.")
      .attribute("bodies", &Numbered::bodies,
                 "(N, 2) int64: the bodies of each pair of a Scene; otherwise without rows.")
      .attribute("added", member(&NumberedPairs::added),
                 "(A,) int32: the numbers that the last update has added.")
      .attribute("removed", member(&NumberedPairs::removed),
                 "(R,) int32: the numbers that the last update has removed.")
      .attribute("removed_pairs", member(&NumberedPairs::removed_pairs),
                 "(R, 2) int32: the pairs of `removed`.")
      .length(&Numbered::numbers);
  const auto to = [](auto Renumbering::*of) {
    return [of](const Renumbered& self) -> const auto& { return self.to.*of; };
  };
  ResultClass<Renumbered>(module, "Renumbering",
                          "How compact has changed the numbers: for each kind the new number by "
                          "the old one, (N,) int32, -1 for a number that was free.")
      .attribute("triangles", to(&Renumbering::triangles), "Of pairs of triangles.")
      .attribute("vertex_face", to(&Renumbering::vertex_face), "Of a vertex and a face.")
      .attribute("face_vertex", to(&Renumbering::face_vertex), "Of a face and a vertex.")
      .attribute("edge_edge", to(&Renumbering::edge_edge), "Of two edges.");
}

}  // namespace

void bindContactSet(py::module_& module) {
  bindNumbers(module);
  py::class_<PySet> set(module, "ContactSet", docs::kContactSet);
  set.def(py::init<const LockedMesh&, double, const std::string&, const py::object&>(), "mesh"_a,
          "distance"_a, py::kw_only(), "elements"_a = "triangles", "ignored"_a = py::none(),
          docs::kInitSelf)
      .def(py::init<const LockedMesh&, const LockedMesh&, double, const std::string&,
                    const py::object&>(),
           "first"_a, "second"_a, "distance"_a, py::kw_only(), "elements"_a = "triangles",
           "ignored"_a = py::none(), docs::kInitPair)
      .def(py::init<const LockedScene&, double, const std::string&, const py::object&>(), "scene"_a,
           "distance"_a, py::kw_only(), "elements"_a = "triangles", "ignored"_a = py::none(),
           py::keep_alive<1, 2>(), docs::kInitScene)
      .def("update", &PySet::update, "tf1"_a = py::none(), "tf2"_a = py::none(), docs::kUpdateSet)
      .def("__len__",
           [](PySet& self) { return self.change([](const ContactSet& s) { return s.size(); }); })
      .def("compact", &compact, docs::kCompact)
      .def("details", &details, "numbers"_a = py::none(), "kind"_a = py::none(),
           docs::kDetailsOfSet)
      .def("contacts", &contacts, py::kw_only(), "enable_contact"_a = true, docs::kContactsOfSet);
  const auto defineWork = [&](const char* name, std::size_t ContactSetWork::*of, const char* doc) {
    set.def_property_readonly(
        name,
        [of](PySet& self) {
          return self.change([of](const ContactSet& s) { return s.work().*of; });
        },
        doc);
  };
  defineWork("candidates", &ContactSetWork::candidates,
             "Number of pairs of triangles that are kept, within the set's margin.");
  defineWork("tested", &ContactSetWork::tested, "How many of them the last update has tested.");
  defineWork("searches", &ContactSetWork::searches,
             "How many searches there were so far, of all meshes or of a part.");
  const auto define = [&](const char* name, const std::optional<FeatureKind>& kind,
                          const char* doc) {
    set.def_property_readonly(
        name, [kind](PySet& self) { return numbered(self, kind); }, doc);
  };
  define("triangles", std::nullopt, "NumberedPairs of triangles: a copy.");
  define("vertex_face", FeatureKind::VertexFace, "NumberedPairs of a vertex and a face: a copy.");
  define("face_vertex", FeatureKind::FaceVertex, "NumberedPairs of a face and a vertex: a copy.");
  define("edge_edge", FeatureKind::EdgeEdge, "NumberedPairs of two edges: a copy.");
}

}  // namespace adaptive_bvh::python
