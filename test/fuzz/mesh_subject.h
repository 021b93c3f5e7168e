#pragma once

#include <memory>
#include <string>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "fuzz/mesh_queries.h"

namespace adaptive_bvh_test {

/// A DeformableMesh that random calls build, update, copy and query, and a snapshot of it, which
/// must stay as it was.
class MeshSubject {
 public:
  void step(Bytes& in) {
    const int byte = in.byte();  // the last eight values stand for calls that came later
    const int call = byte < 248 ? byte % 16 : byte - 248 + 16;
    if (std::getenv("FUZZ_TRACE"))
      std::fprintf(stderr, "%p: call %d, %zu vertices\n", static_cast<void*>(this), call,
                   mesh_ ? frame_.size() : 0);
    if (call == 0 || !mesh_) {
      build(in);
    } else {
      switch (call) {
        case 1:
        case 2: update(in); break;
        case 3: updateSome(in); break;
        case 4: updateTwoFrames(in); break;
        case 5: updateFromOwnArrays(in); break;
        case 6: snapshot(in); break;
        case 7: settings(in); break;
        case 8: translate(in); break;
        case 9: mixed(in); break;
        default: query(call, in);
      }
    }
    check();
  }

 private:
  using Triangles = std::vector<fcl::Triangle>;

  void build(Bytes& in) {
    const int count = in.below(12);
    const Points points = in.points(count);
    Triangles triangles;
    bool is_sound = isUsable(points);
    for (int t = in.below(16); t > 0; --t) {
      const auto corner = [&] { return std::size_t(in.oneIn(64) ? 1000 : in.below(count + 1)); };
      const std::size_t a = corner(), b = corner();
      triangles.emplace_back(a, b, corner());
      for (int k = 0; k < 3; ++k) is_sound = is_sound && triangles.back()[k] < std::size_t(count);
    }
    is_sound = is_sound && !triangles.empty();
    try {
      DeformableMesh built = made(in, points, triangles);
      REQUIRE(is_sound);
      if (mesh_)
        *mesh_ = std::move(built);  // the queries keep their reference
      else
        mesh_ = std::make_unique<DeformableMesh>(std::move(built));
      if (!queries_) queries_ = std::make_unique<MeshQueries>(*mesh_);
      frame_ = points;
      previous_.clear();
    } catch (const std::invalid_argument&) {
      REQUIRE(!is_sound);
    }
  }
  static DeformableMesh made(Bytes& in, const Points& points, const Triangles& triangles) {
    switch (in.below(3)) {
      case 0: return DeformableMesh(points, triangles);
      case 1: return DeformableMesh(TriangleMesh{points, triangles});
      default: break;
    }
    Eigen::MatrixX3d v(Eigen::Index(points.size()), 3);
    Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> f(Eigen::Index(triangles.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) v.row(Eigen::Index(i)) = points[i];
    for (std::size_t i = 0; i < triangles.size(); ++i)
      for (int k = 0; k < 3; ++k) f(Eigen::Index(i), k) = int(triangles[i][k]);
    return DeformableMesh(v, f);
  }

  /// The new positions must be there after it, or an error must have been thrown.
  template <typename Call>
  void updateTo(const Points& expected, const Points& previous, bool is_sound, const Call& call) {
    try {
      call();
      REQUIRE(is_sound);
      previous_ = previous;  // may be frame_
      frame_ = expected;
    } catch (const std::invalid_argument&) {
      REQUIRE(!is_sound);
    }
  }
  int some(Bytes& in) { return in.oneIn(8) ? in.below(20) : int(frame_.size()); }

  void update(Bytes& in) {
    Points points = in.points(some(in));
    if (in.oneIn(4) && points.size() == frame_.size())  // one vertex only
      for (std::size_t v = 1; v < points.size(); ++v) points[v] = frame_[v];
    const bool is_sound = points.size() == frame_.size() && isUsable(points);
    const auto n = Eigen::Index(points.size());
    Eigen::Matrix3Xd columns(3, n);
    for (Eigen::Index v = 0; v < n; ++v) columns.col(v) = points[std::size_t(v)];
    const int kind = in.below(5);
    updateTo(points, {}, is_sound, [&] {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
      switch (kind) {
        case 0: mesh_->update(points.data(), points.size()); break;
        case 1: mesh_->update(columns); break;
        case 2: mesh_->update(Eigen::MatrixX3d(columns.transpose())); break;
        case 3: mesh_->update(RowMajor(columns.transpose())); break;
        default: mesh_->update(points);
      }
    });
  }

  void updateSome(Bytes& in) {
    const int count = in.below(5);
    const Points points = in.points(count);
    std::vector<unsigned> indices;
    Points expected = frame_;
    bool is_sound = isUsable(points);
    for (int i = 0; i < count; ++i) {
      indices.push_back(unsigned(in.oneIn(32) ? 1000 : in.below(int(frame_.size()) + 1)));
      if (indices.back() < expected.size())
        expected[indices.back()] = points[std::size_t(i)];
      else
        is_sound = false;
    }
    updateTo(expected, {}, is_sound, [&] { mesh_->update(indices, points); });
  }

  void updateTwoFrames(Bytes& in) {
    const Points points = in.points(some(in));
    const bool is_sound = points.size() == frame_.size() && isUsable(points);
    updateTo(points, frame_, is_sound, [&] { mesh_->updateTwoFrames(points); });
  }

  /// Positions in the arrays that the update writes count as they were.
  void updateFromOwnArrays(Bytes& in) {
    const std::size_t n = frame_.size();
    const bool is_previous = !mesh_->previousVertices().empty() && in.oneIn(2);
    const Points& own = is_previous ? mesh_->previousVertices() : mesh_->vertices();
    const Points values = own;
    switch (in.below(3)) {
      case 0: updateTo(values, {}, true, [&] { mesh_->update(own); }); break;
      case 1: updateTo(values, frame_, true, [&] { mesh_->updateTwoFrames(own); }); break;
      default: {
        const std::size_t first = std::size_t(in.byte()) % n,
                          count = std::size_t(in.byte()) % (n - first);
        std::vector<unsigned> indices;
        Points expected = frame_;
        for (std::size_t i = 0; i < count; ++i) {
          indices.push_back(unsigned(std::size_t(in.byte()) % n));
          expected[indices.back()] = values[first + i];
        }
        updateTo(expected, {}, true,
                 [&] { mesh_->update(indices.data(), own.data() + first, count); });
      }
    }
  }

  void snapshot(Bytes& in) {
    switch (in.below(4)) {
      case 0: snapshot_ = std::make_unique<DeformableMesh>(*mesh_); break;
      case 1:
        if (!snapshot_) return;
        *snapshot_ = *mesh_;
        break;
      case 2: {  // there and back
        DeformableMesh other(std::move(*mesh_));
        *mesh_ = std::move(other);
        return;
      }
      default: {  // back to the snapshot
        if (!snapshot_) return;
        *mesh_ = *snapshot_;
        frame_ = of_snapshot_;
        previous_ = mesh_->previousVertices();
        return;
      }
    }
    of_snapshot_ = frame_;
  }

  void settings(Bytes& in) {
    const int threads = in.below(4);
    try {
      mesh_->setThreads(threads);
      mesh_->setThreads(threads);
      REQUIRE(threads >= 1);
    } catch (const std::invalid_argument&) {
      REQUIRE(threads < 1);
    }
    mesh_->computeLocalAABB();
    REQUIRE(mesh_->bytes() > frame_.size() * sizeof(Point));
    REQUIRE(mesh_->getObjectType() == fcl::OT_UNKNOWN);
  }

  void translate(Bytes& in) {
    const Point by(in.below(9) / 8. - 0.5, in.below(9) / 8. - 0.5, in.below(9) / 8. - 0.5);
    if (!arePlain(frame_)) return;
    Points next = frame_;
    for (Point& p : next) p += by;
    updateTo(next, {}, true, [&] { mesh_->update(next); });
  }

  /// A pair with a model is answered by the model's mesh; without one it is refused, as is a pair
  /// with a model of FCL's.
  void mixed(Bytes& in) {
    static const auto* const with_mesh = [] {
      auto* built = new adaptive_bvh::AdaptiveBVHModeld;
      fillModel(tube(3, 2), *built);
      built->mesh();
      return built;
    }();
    static const auto* const without = [] {
      auto* built = new adaptive_bvh::AdaptiveBVHModeld;
      fillModel(tube(3, 2), *built);
      return built;
    }();
    static const auto* const plain = [] {
      auto* built = new fcl::BVHModel<fcl::RSSd>;
      fillModel(tube(3, 2), *built);
      return built;
    }();
    const fcl::Transform3d tf = pose(in), still = fcl::Transform3d::Identity();
    const bool is_first = in.oneIn(2);
    const fcl::DistanceRequestd request;
    const fcl::CollisionRequestd all(100000);
    for (const fcl::CollisionGeometryd* other :
         {static_cast<const fcl::CollisionGeometryd*>(with_mesh),
          static_cast<const fcl::CollisionGeometryd*>(without),
          static_cast<const fcl::CollisionGeometryd*>(plain)}) {
      const fcl::CollisionGeometryd *a = mesh_.get(), *b = other;
      if (!is_first) std::swap(a, b);
      const fcl::Transform3d &tf1 = is_first ? still : tf, &tf2 = is_first ? tf : still;
      fcl::DistanceResultd distance;
      fcl::CollisionResultd contacts;
      try {
        adaptive_bvh::distance(a, tf1, b, tf2, request, distance);
        adaptive_bvh::collide(a, tf1, b, tf2, all, contacts);
        REQUIRE(other == with_mesh);
        REQUIRE((distance.min_distance <= 0) == (contacts.numContacts() > 0));
        if (!arePlain(frame_)) continue;
        const double expected = BruteForce(*mesh_, still, MeshQueries::obstacle(), tf).distance();
        REQUIRE(std::abs(distance.min_distance - expected) < 1e-9);
      } catch (const std::invalid_argument&) {
        REQUIRE(other != with_mesh);
      }
    }
  }

  void query(int call, Bytes& in) {
    switch (call) {
      case 10: queries_->distance(in, pose(in)); break;
      case 11: queries_->contacts(pose(in)); break;
      case 12: queries_->proximity(in); break;
      case 13: queries_->ray(in); break;
      case 14: queries_->continuous(in); break;
      case 16:
      case 17: queries_->regions(in); break;
      case 18:
      case 19:
      case 20: queries_->contactSets(in); break;
      case 21: queries_->vertexDistances(in); break;
      default: in.oneIn(4) ? queries_->scene(in) : queries_->excursion(in); break;
    }
  }

  /// What holds after every call.
  void check() const {
    if (!mesh_) return;
    std::string reason;
    if (!mesh_->validate(&reason)) {
      std::fprintf(stderr, "not valid: %s\n", reason.c_str());
      std::abort();
    }
    REQUIRE(mesh_->vertices() == frame_);  // but for the signs of zeros
    REQUIRE(mesh_->previousVertices() == previous_);
    for (const Point& p : frame_)
      REQUIRE((p.array() >= mesh_->aabb_local.min_.array()).all() &&
              (p.array() <= mesh_->aabb_local.max_.array()).all() &&
              (p - mesh_->aabb_center).norm() <= mesh_->aabb_radius * (1 + 1e-14));
    if (!snapshot_) return;
    REQUIRE(snapshot_->validate());
    REQUIRE(snapshot_->vertices() == of_snapshot_);
  }

  std::unique_ptr<DeformableMesh> mesh_, snapshot_;
  std::unique_ptr<MeshQueries> queries_;  ///< of mesh_
  Points frame_, previous_, of_snapshot_;
};

}  // namespace adaptive_bvh_test
