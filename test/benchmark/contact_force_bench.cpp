// Contacts of vertices, signed distances and winding numbers on one thread: medians of times, in
// turns in one process. Answers must be those of all triangles in long double.
#include <cmath>
#include <cstdio>
#include <map>
#include <random>

#include <fcl/geometry/shape/sphere.h>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "median.h"
#include "stopwatch.h"
#include "support/closed_bodies.h"

namespace {

using adaptive_bvh::ClosestPoint;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::VertexContacts;
using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using adaptive_bvh_test::TriangleMesh;
using Point = fcl::Vector3d;
using Points = std::vector<Point>;
using Pose = fcl::Transform3d;
namespace exact = adaptive_bvh_test::exact;

/// An icosahedron whose triangles are divided into 4^levels, on the ball of radius 1.
TriangleMesh icosphere(int levels) {
  TriangleMesh mesh;
  const double g = (1 + std::sqrt(5.)) / 2;
  for (const double s : {-1., 1.})
    for (const double t : {-g, g}) {
      mesh.vertices.emplace_back(0, s, t);
      mesh.vertices.emplace_back(s, t, 0);
      mesh.vertices.emplace_back(t, 0, s);
    }
  // Corners at distance 2 are neighbours.
  const auto isEdge = [&](std::size_t a, std::size_t b) {
    return std::abs((mesh.vertices[a] - mesh.vertices[b]).norm() - 2) < 1e-9;
  };
  for (std::size_t a = 0; a < 12; ++a)
    for (std::size_t b = a + 1; b < 12; ++b)
      for (std::size_t c = b + 1; c < 12; ++c) {
        if (!isEdge(a, b) || !isEdge(b, c) || !isEdge(a, c)) continue;
        const Point &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        const bool is_outward = p.dot(q.cross(r)) > 0;
        mesh.triangles.emplace_back(a, is_outward ? b : c, is_outward ? c : b);
      }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> middles;
    const auto middle = [&](std::size_t a, std::size_t b) {
      const auto found = middles.emplace(std::minmax(a, b), mesh.vertices.size());
      if (found.second) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
      return found.first->second;
    };
    std::vector<fcl::Triangle> finer;
    for (const fcl::Triangle& t : mesh.triangles) {
      const std::size_t a = middle(t[1], t[2]), b = middle(t[2], t[0]), c = middle(t[0], t[1]);
      finer.insert(finer.end(), {{t[0], c, b}, {t[1], a, c}, {t[2], b, a}, {a, b, c}});
    }
    mesh.triangles = finer;
  }
  for (Point& p : mesh.vertices) p.normalize();
  return mesh;
}

/// By all triangles.
class Judge {
 public:
  explicit Judge(const DeformableMesh& mesh) : mesh_(mesh) {}

  double signedDistance(const Point& x) const {
    const exact::Point p = exact::of(x);
    exact::Real least = std::numeric_limits<exact::Real>::infinity();
    for (const fcl::Triangle& t : mesh_.triangles())
      least = std::min(least, exact::distance({corner(t, 0), corner(t, 1), corner(t, 2)}, p));
    return static_cast<double>(windingNumber(x) > 0.5 ? -least : least);
  }
  double windingNumber(const Point& x) const {
    return static_cast<double>(adaptive_bvh_test::windingNumberOf(mesh_, exact::of(x)));
  }

 private:
  exact::Point corner(const fcl::Triangle& t, int k) const {
    return exact::of(mesh_.vertices()[t[k]]);
  }
  const DeformableMesh& mesh_;
};

int wrong_answers = 0;

void expectNear(double expected, double found, double tolerance) {
  if (!(std::abs(expected - found) <= tolerance)) ++wrong_answers;
}

/// Median time of each of several works, in turns.
template <typename... Work>
std::vector<double> times(int repeats, Work&&... works) {
  std::vector<std::vector<double>> all(sizeof...(works));
  for (int i = 0; i <= repeats; ++i) {
    std::size_t k = 0;
    const auto add = [&](double time) {
      if (i > 0) all[k].push_back(time);
      ++k;
    };
    (add(milliseconds(works)), ...);
  }
  std::vector<double> medians;
  for (const auto& of_one : all) medians.push_back(median(of_one));
  return medians;
}

Pose poseAt(double x, double angle) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, Point(1, -2, 0.6).normalized()).toRotationMatrix();
  pose.translation() = Point(x, 0.1 * angle, 0);
  return pose;
}

void judge(const DeformableMesh& mesh, const Pose& pose, const DeformableMesh& other,
           const Pose& other_pose, double margin, const VertexContacts& found) {
  const Judge exactly(other);
  std::size_t next = 0;
  for (unsigned v = 0; v < mesh.vertices().size(); ++v) {
    const double d = exactly.signedDistance(other_pose.inverse() * (pose * mesh.vertices()[v]));
    if (d <= margin) {
      const bool is_there = next < found.size() && found.vertices[next] == v;
      expectNear(d, is_there ? found.distances[next] : 1e30, 1e-13);
      next += is_there;
    }
  }
  expectNear(double(found.size()), double(next), 0);
}

/// Two balls that overlap: beside their poles, or with the poles, where their vertices are densest,
/// foremost.
void measureContacts(bool by_poles, int repeats) {
  const DeformableMesh first(adaptive_bvh_test::gridBall(32, 32)),
      second(adaptive_bvh_test::gridBall(62, 32));
  const fcl::Sphered ball(1);
  const fcl::CollisionGeometryd& sphere = ball;
  const double margin = 0.02;
  std::printf("\nvertexContacts of %zu triangles, margin %g, balls %s\n", first.triangles().size(),
              margin, by_poles ? "by their poles" : "beside their poles");
  std::printf("| overlap | contacts | inside | ms with %zu triangles | ms with a sphere |\n",
              second.triangles().size());
  std::printf("| ---: | ---: | ---: | ---: | ---: |\n");
  for (const double overlap : {0.02, 0.1, 0.3, 0.5}) {
    Pose pose = poseAt(0, 0.4), other = poseAt(2 - overlap, 1.1);
    if (by_poles) {
      pose.setIdentity();
      other = pose;
      other.translation()[2] = 2 - overlap;
    }
    VertexContacts of_mesh, of_sphere;
    const auto ms = times(
        repeats, [&] { vertexContacts(first, pose, second, other, margin, of_mesh); },
        [&] { vertexContacts(first, pose, sphere, other, margin, of_sphere); });
    judge(first, pose, second, other, margin, of_mesh);
    const auto isInside = [](double d) { return d < 0; };
    std::printf(
        "| %.2f | %zu | %zu | %.3f | %.3f |\n", overlap, of_mesh.size(),
        std::size_t(std::count_if(of_mesh.distances.begin(), of_mesh.distances.end(), isInside)),
        ms[0], ms[1]);
  }
}

Points inBox(std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.2, 1.2);
  Points points(count);
  for (Point& p : points) p = Point(any(random), any(random), any(random));
  return points;
}
/// At most 0.02 from the ball of radius 1.
Points nearSurface(std::size_t count) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> any(-0.02, 0.02);
  Points points = inBox(count);
  for (Point& p : points) p *= (1 + any(random)) / p.norm();
  return points;
}

/// A ball without one triangle in `one_in`; 1: without one, 0: closed.
TriangleMesh ballThatLacks(std::size_t one_in) {
  TriangleMesh body = icosphere(5);
  if (one_in == 1) body.triangles.pop_back();
  if (one_in < 2) return body;
  std::vector<fcl::Triangle> kept;
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (t % one_in != 0) kept.push_back(body.triangles[t]);
  body.triangles = kept;
  return body;
}

void measurePoints(const char* name, const Points& points, int repeats) {
  struct Case {
    const char* name;
    DeformableMesh mesh;
  };
  const Case cases[] = {{"the closed mesh", DeformableMesh(ballThatLacks(0))},
                        {"it without one triangle", DeformableMesh(ballThatLacks(1))},
                        {"it without one triangle in 600", DeformableMesh(ballThatLacks(600))},
                        {"it without one triangle in 200", DeformableMesh(ballThatLacks(200))}};
  const DeformableMesh& mesh = cases[0].mesh;
  std::vector<double> distances, numbers;
  std::vector<ClosestPoint> closest;
  std::printf("\n%zu points %s, %zu triangles, ms\n", points.size(), name, mesh.triangles().size());
  const auto numbersOf = [&](std::size_t k) {
    return [&, k] { windingNumbers(cases[k].mesh, points, numbers); };
  };
  const auto ms = times(
      repeats, [&] { closestPoints(mesh, points, closest); },
      [&] { signedDistances(mesh, points, distances); }, numbersOf(0), numbersOf(1), numbersOf(2),
      numbersOf(3));
  std::printf("closestPoints %.0f, signedDistances %.0f\n", ms[0], ms[1]);
  const Judge closed_judge(mesh);
  constexpr std::size_t kStep = 97;  // one of so many is judged
  for (std::size_t i = 0; i < points.size(); i += kStep) {
    const double d = closed_judge.signedDistance(points[i]);
    expectNear(d, distances[i], 1e-13);
    expectNear(std::abs(d), closest[i].distance, 1e-13);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    numbersOf(k)();
    const Judge judge(cases[k].mesh);
    std::vector<adaptive_bvh::OpenEdge> open;
    isWatertight(cases[k].mesh, &open);
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); i += kStep) {
      const double number = judge.windingNumber(points[i]);
      worst = std::max(worst, std::abs(numbers[i] - number));
      expectNear(number, numbers[i], 1e-12);
    }
    std::printf(
        "windingNumbers of %s, boundary edges %zu: %.0f, %.2f of closestPoints, worst error %.0e\n",
        cases[k].name, open.size(), ms[2 + k], ms[2 + k] / ms[0], worst);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Contacts for forces, signed distances and winding numbers on one thread.");
  int repeats = 5;
  std::size_t points = 100000;
  app.add_option("--repeats", repeats, "Tables show medians")->check(CLI::Range(1, 1000));
  app.add_option("--points", points, "How many")->check(CLI::Range(1, 10000000));
  CLI11_PARSE(app, argc, argv);
  for (const bool by_poles : {false, true}) measureContacts(by_poles, 20 * repeats);
  measurePoints("in a box", inBox(points), repeats);
  measurePoints("near the surface", nearSurface(points), repeats);
  std::printf("\n%d wrong answers\n", wrong_answers);
  return wrong_answers == 0 ? 0 : 1;
}
