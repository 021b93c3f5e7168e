// CGAL: self-intersections by exact predicates, from scratch in every frame. Other than the other
// rows it also reports neighbours that overlap beyond what they share, and its verdict on
// triangles that barely touch is exact.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <stdexcept>

#include "contact_method.h"

namespace adaptive_bvh_bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Face = SurfaceMesh::Face_index;

class CgalContact : public ContactMethod {
 public:
  explicit CgalContact(const ContactCase& contact_case) {
    const scenarios::Mesh mesh = contact_case.scenario.first.mesh();
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh_.add_vertex();
    const auto vertex = [](std::size_t v) { return SurfaceMesh::Vertex_index(unsigned(v)); };
    for (const fcl::Triangle& t : mesh.triangles)
      if (mesh_.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2])) == SurfaceMesh::null_face())
        throw std::runtime_error("CGAL: " + contact_case.scenario.name + " is not manifold");
  }

  void update(const Frame& frame) override {
    for (const auto v : mesh_.vertices()) {
      const Point& p = frame.first[std::size_t(v)];
      mesh_.point(v) = Kernel::Point_3(p[0], p[1], p[2]);
    }
  }

  void query() override {
    pairs_.clear();
    CGAL::Polygon_mesh_processing::self_intersections(mesh_, std::back_inserter(pairs_));
  }

  ContactAnswer answer() override {
    ContactAnswer answer;
    answer.counts.contacts = long(pairs_.size());
    return answer;
  }

 private:
  SurfaceMesh mesh_;
  std::vector<std::pair<Face, Face>> pairs_;
};

}  // namespace

std::vector<ContactKind> cgalContactMethods() {
  return {
      {"cgal", "CGAL", ContactKind::Peer, false, {Job::SelfCollision}, [](const ContactCase& c) {
         return std::make_unique<CgalContact>(c);
       }}};
}

}  // namespace adaptive_bvh_bench
