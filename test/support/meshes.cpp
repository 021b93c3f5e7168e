#include "support/meshes.h"

#include <utility>

namespace adaptive_bvh_test {

TriangleMesh plate(int columns, int rows, double width, double height) {
  TriangleMesh mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices.emplace_back(width * double(i) / double(columns),
                                 height * double(j) / double(rows), 0.);
  const auto id = [columns](int i, int j) { return std::size_t(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.emplace_back(id(i, j), id(i + 1, j), id(i + 1, j + 1));
      mesh.triangles.emplace_back(id(i, j), id(i + 1, j + 1), id(i, j + 1));
    }
  return mesh;
}

TriangleMesh tube(int around, int along) {
  return bent(around, along, [](double u, double v) -> fcl::Vector3d {
    const double angle = double(2 * M_PI) * u;
    return {2 * v, 0.15 * std::cos(angle), 0.15 * std::sin(angle)};
  });
}

TriangleMesh dome(int around, int rings) {
  return bent(around, rings, [](double u, double v) -> fcl::Vector3d {
    const double angle = double(2 * M_PI) * u;
    const double polar = 0.2 + 1.5 * v;
    return 0.5 * fcl::Vector3d(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                               std::cos(polar));
  });
}

TriangleMesh soup(int triangles, std::mt19937& random) {
  std::uniform_real_distribution<double> place(0, 1), offset(0.05, 0.2);
  TriangleMesh mesh;
  for (int t = 0; t < triangles; ++t) {
    const fcl::Vector3d p(place(random), place(random), place(random));
    mesh.vertices.push_back(p);
    mesh.vertices.push_back(p + fcl::Vector3d(offset(random), offset(random), -offset(random)));
    mesh.vertices.push_back(p + fcl::Vector3d(-offset(random), offset(random), offset(random)));
    const auto v = std::size_t(3 * t);
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  }
  return mesh;
}

fcl::Transform3d randomPose(std::mt19937& random, double reach) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> shift(-reach, reach);
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  fcl::Quaternion<double> turn(normal(random), normal(random), normal(random), normal(random));
  pose.linear() = turn.normalized().toRotationMatrix();
  pose.translation() = fcl::Vector3d(shift(random), shift(random), shift(random));
  return pose;
}

Deformation::Deformation(TriangleMesh rest, Kind kind, unsigned seed)
    : kind_(kind), rest_(std::move(rest.vertices)), now_(rest_), random_(seed) {
  std::normal_distribution<double> normal;
  for (Wave& wave : waves_) {
    wave.direction = fcl::Vector3d(normal(random_), normal(random_), normal(random_)) * 0.1;
    wave.number = fcl::Vector3d(normal(random_), normal(random_), normal(random_)) * 2.;
    wave.speed = 0.2 * normal(random_);
  }
}

const std::vector<fcl::Vector3d>& Deformation::next() {
  ++frame_;
  if (kind_ == Kind::Smooth) flow();
  if (kind_ == Kind::Jerky) jump();
  return now_;
}

void Deformation::flow() {
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    now_[v] = rest_[v];
    for (const Wave& wave : waves_)
      now_[v] +=
          wave.direction * (std::sin(wave.number.dot(rest_[v]) + wave.speed * double(frame_)) -
                            std::sin(wave.number.dot(rest_[v])));
  }
}

void Deformation::jump() {
  std::uniform_real_distribution<double> one(-1, 1);
  std::uniform_int_distribution<std::size_t> vertex(0, now_.size() - 1);
  const int moving = frame_ % 3 == 0 ? 6 : frame_ % 7 == 0 ? int(now_.size()) : 1;
  for (int k = 0; k < moving; ++k) {
    const std::size_t v = vertex(random_);
    now_[v] = rest_[v] + fcl::Vector3d(one(random_), one(random_), one(random_)) * 0.3;
  }
}

}  // namespace adaptive_bvh_test
