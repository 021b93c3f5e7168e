#include "support/meshes.h"

#include <utility>

namespace adaptive_bvh_test {

template <typename S>
TriangleMesh<S> plate(int columns, int rows, S width, S height) {
  TriangleMesh<S> mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices.emplace_back(width * S(i) / S(columns), height * S(j) / S(rows), S(0));
  const auto id = [columns](int i, int j) { return std::size_t(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.emplace_back(id(i, j), id(i + 1, j), id(i + 1, j + 1));
      mesh.triangles.emplace_back(id(i, j), id(i + 1, j + 1), id(i, j + 1));
    }
  return mesh;
}

template <typename S>
TriangleMesh<S> tube(int around, int along) {
  return bent<S>(around, along, [](S u, S v) -> Vector3<S> {
    const S angle = S(2 * M_PI) * u;
    return {2 * v, S(0.15) * std::cos(angle), S(0.15) * std::sin(angle)};
  });
}

template <typename S>
TriangleMesh<S> dome(int around, int rings) {
  return bent<S>(around, rings, [](S u, S v) -> Vector3<S> {
    const S angle = S(2 * M_PI) * u;
    const S polar = S(0.2) + S(1.5) * v;
    return S(0.5) * Vector3<S>(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                               std::cos(polar));
  });
}

template <typename S>
TriangleMesh<S> soup(int triangles, std::mt19937& random) {
  std::uniform_real_distribution<S> place(0, 1), offset(S(0.05), S(0.2));
  TriangleMesh<S> mesh;
  for (int t = 0; t < triangles; ++t) {
    const Vector3<S> p(place(random), place(random), place(random));
    mesh.vertices.push_back(p);
    mesh.vertices.push_back(p + Vector3<S>(offset(random), offset(random), -offset(random)));
    mesh.vertices.push_back(p + Vector3<S>(-offset(random), offset(random), offset(random)));
    const auto v = std::size_t(3 * t);
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  }
  return mesh;
}

template <typename S>
fcl::Transform3<S> randomPose(std::mt19937& random, S reach) {
  std::normal_distribution<S> normal;
  std::uniform_real_distribution<S> shift(-reach, reach);
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  fcl::Quaternion<S> turn(normal(random), normal(random), normal(random), normal(random));
  pose.linear() = turn.normalized().toRotationMatrix();
  pose.translation() = Vector3<S>(shift(random), shift(random), shift(random));
  return pose;
}

template <typename S>
Deformation<S>::Deformation(TriangleMesh<S> rest, Kind kind, unsigned seed)
    : kind_(kind), rest_(std::move(rest.vertices)), now_(rest_), random_(seed) {
  std::normal_distribution<S> normal;
  for (Wave& wave : waves_) {
    wave.direction = Vector3<S>(normal(random_), normal(random_), normal(random_)) * S(0.1);
    wave.number = Vector3<S>(normal(random_), normal(random_), normal(random_)) * S(2);
    wave.speed = S(0.2) * normal(random_);
  }
}

template <typename S>
const std::vector<Vector3<S>>& Deformation<S>::next() {
  ++frame_;
  if (kind_ == Kind::Smooth) flow();
  if (kind_ == Kind::Jerky) jump();
  return now_;
}

template <typename S>
void Deformation<S>::flow() {
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    now_[v] = rest_[v];
    for (const Wave& wave : waves_)
      now_[v] += wave.direction * (std::sin(wave.number.dot(rest_[v]) + wave.speed * S(frame_)) -
                                   std::sin(wave.number.dot(rest_[v])));
  }
}

template <typename S>
void Deformation<S>::jump() {
  std::uniform_real_distribution<S> one(-1, 1);
  std::uniform_int_distribution<std::size_t> vertex(0, now_.size() - 1);
  const int moving = frame_ % 3 == 0 ? 6 : frame_ % 7 == 0 ? int(now_.size()) : 1;
  for (int k = 0; k < moving; ++k) {
    const std::size_t v = vertex(random_);
    now_[v] = rest_[v] + Vector3<S>(one(random_), one(random_), one(random_)) * S(0.3);
  }
}

template TriangleMesh<float> plate(int, int, float, float);
template TriangleMesh<double> plate(int, int, double, double);
template TriangleMesh<float> tube(int, int);
template TriangleMesh<double> tube(int, int);
template TriangleMesh<float> dome(int, int);
template TriangleMesh<double> dome(int, int);
template TriangleMesh<float> soup(int, std::mt19937&);
template TriangleMesh<double> soup(int, std::mt19937&);
template fcl::Transform3<float> randomPose(std::mt19937&, float);
template fcl::Transform3<double> randomPose(std::mt19937&, double);
template class Deformation<float>;
template class Deformation<double>;

}  // namespace adaptive_bvh_test
