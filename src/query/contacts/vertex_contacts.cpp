// Vertices of a mesh in contact with a closed mesh: VertexSearch finds candidates, MeshContactTest
// tests each, ContactWriter writes the result.
#include "query/contacts/vertex_contacts.h"

#include <array>
#include <cmath>
#include <limits>

#include "base/rigid.h"
#include "base/rounding.h"
#include "query/closed_surface.h"
#include "query/points/surface_normals.h"
#include "query/points/winding_number.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {
namespace {

/// Decides on which side of a surface points lie, for a sequence of points near each other. A ball
/// around a point, with the distance to the surface as radius, contains no point of the surface. So
/// two points whose balls overlap are on the same side.
class KnownSides {
 public:
  /// `error`: of the sum of two radii and the distance of their centres.
  explicit KnownSides(double error) : error_(error) {}

  /// Returns whether the side of x follows from earlier points; then sets is_inside. `radius`: a
  /// lower bound of the distance from x to the surface.
  bool find(const fcl::Vector3d& x, double radius, bool& is_inside) const {
    for (const Ball& ball : balls_) {
      const double radii = ball.radius + radius - error_;
      if (!(radii > kLeast && (x - ball.center).squaredNorm() < radii * radii)) continue;
      is_inside = ball.is_inside;
      return true;
    }
    return false;
  }
  /// Records a point whose side is known, in place of the oldest one.
  void add(const fcl::Vector3d& x, double radius, bool is_inside) {
    balls_[next_] = {x, radius, is_inside};
    next_ = (next_ + 1) % kBalls;
  }

 private:
  static constexpr std::size_t kBalls = 8;
  static constexpr double kLeast = rounding::shortLength<double>();  // its square keeps all digits
  struct Ball {
    fcl::Vector3d center = fcl::Vector3d::Zero();
    double radius = -std::numeric_limits<double>::infinity();  ///< no ball yet
    bool is_inside = false;
  };

  std::array<Ball, kBalls> balls_;
  std::size_t next_ = 0;
  const double error_;
};

/// Tests whether a vertex is at most `margin` from the surface of a closed mesh, or inside it.
class MeshContactTest {
 public:
  MeshContactTest(const MeshState& mesh, const MeshState& other, const RelativePlacement& to_other,
                  double margin)
      : mesh_(mesh),
        to_other_(to_other),
        margin_(margin),
        search_(other),
        winding_(other),
        normals_(other),
        offset_(to_other.T.lpNorm<Eigen::Infinity>()),
        sides_(kRounding * (offset_ + sizeOf(mesh) + sizeOf(other))) {}

  /// Returns whether a candidate is a contact, and sets the contact.
  bool operator()(const VertexCandidate& candidate, VertexContact& contact) {
    const fcl::Vector3d x = to_other_(mesh_.vertices[candidate.vertex]);
    PointSearch::Nearest nearest;
    bool is_inside = candidate.is_inside;
    const bool is_known = is_inside || sides_.find(x, 0, is_inside);
    if (!is_known || !is_inside) {
      nearest = search_(x, margin_);
      if (!is_known) is_inside = isInside(x, nearest.distance, nearest.triangle >= 0);
    }
    if (nearest.triangle < 0 && is_inside) nearest = search_(x);
    sides_.add(x, nearest.distance, is_inside);
    if (nearest.triangle < 0) return false;
    set(x, nearest, is_inside && nearest.distance > 0, contact);
    return true;
  }

 private:
  /// Whether x is inside. `distance`: to the nearest triangle; if none was found, a lower bound.
  bool isInside(const fcl::Vector3d& x, double distance, bool is_found) {
    if (is_found && distance == 0) return false;
    bool is_inside;
    if (!sides_.find(x, distance, is_inside)) is_inside = winding_.of(x) != 0;
    return is_inside;
  }

  /// Sets the contact of x with its nearest triangle.
  void set(const fcl::Vector3d& x, const PointSearch::Nearest& nearest, bool is_inside,
           VertexContact& contact) const {
    const SurfacePlace place =
        SurfaceNormals::placeOf(nearest.place, static_cast<unsigned>(nearest.triangle));
    contact.distance = is_inside ? -nearest.distance : nearest.distance;
    contact.nearest = nearest.point;
    contact.triangle = nearest.triangle;
    contact.barycentric = place.barycentric;
    const fcl::Vector3d into = is_inside ? x - nearest.point : nearest.point - x;
    contact.normal = normal(place, into, x);
  }
  /// The contact's normal, into the other body: that of the nearest face, or the direction of
  /// `into`; if that is too short, the opposite of the pseudo-normal. `into`: vector between x and
  /// the nearest point, toward the surface or, if x is inside, away from it.
  fcl::Vector3d normal(const SurfacePlace& place, const fcl::Vector3d& into,
                       const fcl::Vector3d& x) const {
    constexpr double kShort = 1e-8;
    const double size = std::max(x.lpNorm<Eigen::Infinity>(), offset_);
    if (into.stableNorm() > kShort * size) {
      if (place.feature != SurfaceFeature::Face) return into.stableNormalized();
      const fcl::Vector3d face_normal = normals_.ofFace(place.triangle);
      if (face_normal.isZero(0)) return into.stableNormalized();
      return face_normal.dot(into) < 0 ? fcl::Vector3d(-face_normal) : face_normal;
    }
    const fcl::Vector3d outward = normals_.at(place);
    if (!outward.isZero(0)) return -outward;
    const fcl::Vector3d direction = into.stableNormalized();
    return direction.isZero(0) ? fcl::Vector3d(fcl::Vector3d::UnitZ()) : direction;
  }

  /// Upper bound of the rounding error of a distance, as a share of the size.
  static constexpr double kRounding = 0x1p-40;
  /// Upper bound of a mesh's coordinates.
  static double sizeOf(const MeshState& mesh) {
    return mesh.tree.origin().lpNorm<Eigen::Infinity>() + 4 / mesh.tree.scale();
  }

  const MeshState& mesh_;
  const RelativePlacement& to_other_;
  const double margin_;
  NearestInTurn search_;
  WindingNumber winding_;
  const SurfaceNormals normals_;
  const double offset_;  ///< largest component of the translation between both frames
  KnownSides sides_;
};

/// Throws std::invalid_argument if an argument is not valid.
void requirePlaced(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2, double distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
}

}  // namespace

void findVertexContacts(const PlacedMesh& mesh, const PlacedMesh& other, double margin,
                        VertexContacts& result) {
  const RelativePlacement to_other(other.tf, mesh.tf);
  ContactWriter writer(mesh, other.tf);
  TreePair trees(mesh, other);
  alignIfNear(trees, margin);
  if (trees.frame().isPrecise()) {
    const auto search = [&](const auto& frame) {
      WindingNumber winding(other.mesh);
      const auto isInside = [&](unsigned vertex) {
        return winding.of(to_other(mesh.mesh.vertices[vertex])) != 0;
      };
      const BoxFrame boxes(frame.change(), margin * trees.first().scale());
      VertexSearch<decltype(isInside)>(mesh.mesh, trees.first(), trees.second(), boxes, isInside,
                                       writer.candidates())
          .run();
    };
    searchInFrame(trees, search, [] {});
  } else {
    writer.addAll();
  }
  const auto makeTest = [&] { return MeshContactTest(mesh.mesh, other.mesh, to_other, margin); };
  const int threads = queryThreads(mesh.mesh, other.mesh);
  writer.write(threads, makeTest, result);
}

std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& result) {
  requirePlaced(tf1, tf2, distance);
  requireClosed(stateOf(second), "vertexContacts");
  findVertexContacts({first, tf1}, {second, tf2}, distance, result);
  return result.size();
}

std::size_t vertexContacts(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           double distance, VertexContacts& of_first, VertexContacts& of_second) {
  requirePlaced(tf1, tf2, distance);
  requireClosed(stateOf(first), "vertexContacts");
  requireClosed(stateOf(second), "vertexContacts");
  const PlacedMesh one(first, tf1), two(second, tf2);
  findVertexContacts(one, two, distance, of_first);
  findVertexContacts(two, one, distance, of_second);
  return of_first.size() + of_second.size();
}

}  // namespace adaptive_bvh
