// Polygons of files: triangles of the same area and normal, judged by whole numbers, or an error.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "support/load_reason.h"
#include "support/long_mode.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace triangulate_test {

using adaptive_bvh::loadMesh;
using adaptive_bvh::MeshLoadOptions;
using Mesh = adaptive_bvh::TriangleMesh;
using Int = long long;

/// Lattice points of the plane and of space.
struct Cell {
  Int x, y;
  friend bool operator<(Cell a, Cell b) { return std::array{a.x, a.y} < std::array{b.x, b.y}; }
  friend bool operator==(Cell a, Cell b) { return a.x == b.x && a.y == b.y; }
};
using Outline = std::vector<Cell>;
using Space = std::array<Int, 3>;

Int cross(Cell a, Cell b, Cell c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }
Space cross(const Space& a, const Space& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Space operator-(const Space& a, const Space& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// Twice the area.
Int areaOf(const Outline& outline) {
  Int sum = 0;
  for (std::size_t k = 0; k < outline.size(); ++k)
    sum += cross({0, 0}, outline[k], outline[(k + 1) % outline.size()]);
  return sum;
}

/// Where the plane of the outlines lies in space: origin, and its two axes.
struct Plane {
  Space origin{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0};

  Space operator()(Cell p) const {
    Space q;
    for (std::size_t k = 0; k < 3; ++k) q[k] = origin[k] + p.x * x[k] + p.y * y[k];
    return q;
  }
};

std::string off(const Outline& outline, const Plane& plane) {
  std::string text = "OFF\n" + std::to_string(outline.size()) + " 1 0\n", face;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    for (const Int x : plane(outline[k])) text += std::to_string(x) + " ";
    text += "\n";
    face += " " + std::to_string(k);
  }
  return text + std::to_string(outline.size()) + face + "\n";
}

/// Vertices as they are in the file. Empty when it is refused; then `reason` says why.
std::vector<fcl::Triangle> load(const Outline& outline, const Plane& plane, std::string& reason) {
  MeshLoadOptions options;
  options.weld = false;
  const TemporaryFile file("polygon.off", off(outline, plane));
  try {
    const Mesh mesh = loadMesh(file.path(), options);
    EXPECT_EQ(outline.size(), mesh.vertices.size());
    return mesh.triangles;
  } catch (const adaptive_bvh::MeshLoadError& error) {
    reason = error.what();
    return {};
  }
}

/// A point that lies on no line through two lattice points of few digits.
struct Sample {
  Cell cell;
  /// Of a lattice point's differences, scaled by 100003.
  Int side(Cell a, Cell b) const {
    constexpr Int kScale = 100003, kX = 27183, kY = 31416;
    return (b.x - a.x) * ((cell.y - a.y) * kScale + kY) -
           (b.y - a.y) * ((cell.x - a.x) * kScale + kX);
  }
  /// How often an outline runs around it.
  int windings(const Outline& outline) const {
    int sum = 0;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Cell a = outline[k], b = outline[(k + 1) % outline.size()];
      if (a.y <= cell.y && b.y > cell.y) sum += side(a, b) > 0;
      if (a.y > cell.y && b.y <= cell.y) sum -= side(a, b) < 0;
    }
    return sum;
  }
};

/// Samples of a square around the origin.
constexpr Int kSide = 16;

/// All triangles are counter-clockwise, of the exact normal, of the exact area in sum, and each
/// sample is in as many triangles as the outline runs around it: one or none.
void expectExact(const Outline& outline, const Plane& plane,
                 const std::vector<fcl::Triangle>& triangles) {
  const bool is_turned = areaOf(outline) < 0;
  const Space normal = cross(plane.x, plane.y);
  Int area = 0;
  std::vector<Outline> planar;
  for (const fcl::Triangle& t : triangles) {
    const Outline corners = {outline[t[0]], outline[t[1]], outline[t[2]]};
    planar.push_back(corners);
    const Int twice = areaOf(corners);
    ASSERT_TRUE(is_turned ? twice < 0 : twice > 0);
    area += twice;
    const Space a = plane(corners[0]), n = cross(plane(corners[1]) - a, plane(corners[2]) - a);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(twice * normal[k], n[k]);
  }
  ASSERT_EQ(areaOf(outline), area);
  for (Int x = -kSide; x < kSide; ++x)
    for (Int y = -kSide; y < kSide; ++y) {
      const Sample sample{{x, y}};
      int inside = 0;
      for (const Outline& corners : planar) inside += sample.windings(corners);
      ASSERT_EQ(sample.windings(outline), inside) << x << ' ' << y;
      ASSERT_LE(std::abs(inside), 1);
    }
}

// ---- random right-angled outlines ---------------------------------------------------------------

using Random = std::mt19937;
Int below(Random& random, Int limit) { return Int(random() % std::uint32_t(limit)); }
bool isHeads(Random& random) { return random() % 2 == 0; }

/// The outline of cells, counter-clockwise, with a corner at every lattice point; empty when it is
/// not one loop without repeated points.
Outline outlineOf(const std::set<Cell>& cells) {
  std::set<std::pair<Cell, Cell>> edges;
  for (const Cell c : cells) {
    const Cell square[] = {c, {c.x + 1, c.y}, {c.x + 1, c.y + 1}, {c.x, c.y + 1}};
    for (int k = 0; k < 4; ++k)
      if (edges.erase({square[(k + 1) % 4], square[k]}) == 0)
        edges.insert({square[k], square[(k + 1) % 4]});
  }
  Outline outline = {edges.begin()->first};
  do {
    const auto next = edges.lower_bound({outline.back(), {-1000, -1000}});
    if (next == edges.end() || !(next->first == outline.back())) return {};
    outline.push_back(next->second);
    edges.erase(next);
  } while (!(outline.back() == outline.front()));
  outline.pop_back();
  return edges.empty() && std::set<Cell>(outline.begin(), outline.end()).size() == outline.size()
             ? outline
             : Outline();
}

/// Cells grown from one, so that their outline stays one loop. Notches arise by themselves.
std::set<Cell> growCells(Random& random) {
  std::set<Cell> cells = {{0, 0}};
  for (Int tries = 2 + below(random, 60); tries > 0; --tries) {
    auto from = cells.begin();
    std::advance(from, below(random, Int(cells.size())));
    Cell next = *from;
    (isHeads(random) ? next.x : next.y) += isHeads(random) ? 1 : -1;
    if (std::max(std::abs(next.x), std::abs(next.y)) >= 7 || !cells.insert(next).second) continue;
    if (outlineOf(cells).empty()) cells.erase(next);
  }
  return cells;
}

/// Cuts a cell out that has eight neighbours, with the way there and back, to the left.
void cutHole(const std::set<Cell>& cells, Outline& outline) {
  for (const Cell c : cells) {
    int neighbours = 0;
    for (Int x = -1; x <= 1; ++x)
      for (Int y = -1; y <= 1; ++y) neighbours += int(cells.count({c.x + x, c.y + y}));
    if (neighbours < 9) continue;
    Outline way = {c};
    auto door = outline.end();
    while ((door = std::find(outline.begin(), outline.end(), way.back())) == outline.end())
      way.push_back({way.back().x - 1, c.y});
    Outline hole(way.rbegin(), way.rend());
    hole.insert(hole.end(), {{c.x, c.y + 1}, {c.x + 1, c.y + 1}, {c.x + 1, c.y}});
    hole.insert(hole.end(), way.begin(), way.end());
    outline.insert(door, hole.begin(), hole.end() - 1);
    return;
  }
}

/// A way in or out and back, without width.
void addSlit(Random& random, Outline& outline) {
  const std::size_t at = random() % outline.size();
  const Cell from = outline[at];
  Cell tip = from;
  (isHeads(random) ? tip.x : tip.y) += (isHeads(random) ? 1 : -1) * (1 + below(random, 2));
  outline.insert(outline.begin() + std::ptrdiff_t(at) + 1, {tip, from});
}

/// Some corners on straight lines are left out, some corners repeated.
Outline withOtherCorners(Random& random, const Outline& outline) {
  Outline result;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Cell a = outline[(k + outline.size() - 1) % outline.size()], b = outline[k],
               c = outline[(k + 1) % outline.size()];
    const bool is_straight = cross(a, b, c) == 0 && !(a == b || b == c || c == a);
    if (is_straight && isHeads(random)) continue;
    result.push_back(b);
    if (random() % 16 == 0) result.push_back(b);
  }
  std::rotate(result.begin(), result.begin() + below(random, Int(result.size())), result.end());
  if (isHeads(random)) std::reverse(result.begin(), result.end());
  return result;
}

Plane randomPlane(Random& random) {
  for (;;) {
    Plane plane;
    const Int far = isHeads(random) ? 1 : 1000000;
    for (std::size_t k = 0; k < 3; ++k) {
      plane.origin[k] = far * (below(random, 7) - 3);
      plane.x[k] = below(random, 7) - 3;
      plane.y[k] = below(random, 7) - 3;
    }
    if (cross(plane.x, plane.y) != Space{0, 0, 0}) return plane;
  }
}

/// All at once: ADAPTIVE_BVH_LONG_TESTS=1.
TEST(Polygons, RightAngledOutlinesHaveTheirAreaAndNormal) {
  std::size_t corners = 0, most = 0;
  for (int round = 0; round < manySteps(1000); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    Random random(testSeed(unsigned(round) + 1));
    const std::set<Cell> cells = growCells(random);
    Outline outline = outlineOf(cells);
    if (isHeads(random)) cutHole(cells, outline);
    for (Int slits = below(random, 4); slits > 1; --slits) addSlit(random, outline);
    outline = withOtherCorners(random, outline);
    const Plane plane = randomPlane(random);

    std::string reason;
    const std::vector<fcl::Triangle> triangles = load(outline, plane, reason);
    ASSERT_EQ("", reason) << off(outline, plane);
    expectExact(outline, plane, triangles);
    if (testing::Test::HasFatalFailure()) {
      std::printf("%s", off(outline, plane).c_str());
      return;
    }
    corners += outline.size();
    most = std::max(most, outline.size());
  }
  RecordProperty("corners", std::to_string(corners));
  EXPECT_GT(most, 30u);
}

// ---- any closed lines ---------------------------------------------------------------------------

/// Whether two segments have a common point.
bool touch(Cell a, Cell b, Cell c, Cell d) {
  const auto isWithin = [](Cell from, Cell to, Cell p) {
    return cross(from, to, p) == 0 && std::min(from.x, to.x) <= p.x &&
           p.x <= std::max(from.x, to.x) && std::min(from.y, to.y) <= p.y &&
           p.y <= std::max(from.y, to.y);
  };
  const auto sign = [](Int x) { return (x > 0) - (x < 0); };
  return isWithin(a, b, c) || isWithin(a, b, d) || isWithin(c, d, a) || isWithin(c, d, b) ||
         (sign(cross(a, b, c)) * sign(cross(a, b, d)) < 0 &&
          sign(cross(c, d, a)) * sign(cross(c, d, b)) < 0);
}

/// Edges have no common points but the corners between neighbours.
bool isSimple(const Outline& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Cell a = outline[i], b = outline[(i + 1) % n], c = outline[(i + 2) % n];
    if (a == b ||
        (cross(a, b, c) == 0 && ((a.x - b.x) * (c.x - b.x) > 0 || (a.y - b.y) * (c.y - b.y) > 0)))
      return false;
    for (std::size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i && touch(a, b, outline[j], outline[(j + 1) % n])) return false;
  }
  return true;
}

TEST(Polygons, AnyOutlineIsExactOrRefusedAndSimpleOnesAreRead) {
  int simple = 0, touching = 0, refused = 0;
  for (int round = 0; round < manySteps(2000); ++round) {
    Random random(testSeed(unsigned(round) + 1));
    const Int size = 4 + below(random, 5), range = 2 + below(random, 5);
    Outline outline;
    for (Int k = 0; k < size; ++k) outline.push_back({below(random, range), below(random, range)});
    const Plane plane = randomPlane(random);
    std::string reason;
    const std::vector<fcl::Triangle> triangles = load(outline, plane, reason);
    if (isSimple(outline)) {
      ++simple;
      ASSERT_EQ("", reason) << off(outline, plane);
    } else if (reason.find("crosses itself") != std::string::npos) {
      ++refused;
      continue;
    } else if (triangles.empty()) {  // all area is gone
      ASSERT_NE(std::string::npos, reason.find("no triangles")) << off(outline, plane);
      for (Int x = 0; x < range; ++x)
        for (Int y = 0; y < range; ++y)
          ASSERT_EQ(0, (Sample{{x, y}}.windings(outline))) << off(outline, plane);
      continue;
    } else {
      ++touching;
    }
    expectExact(outline, plane, triangles);
    if (testing::Test::HasFatalFailure()) {
      std::printf("%s", off(outline, plane).c_str());
      return;
    }
  }
  EXPECT_GT(simple, 100);
  EXPECT_GT(touching, 50);
  EXPECT_GT(refused, 100);
}

// ---- single outlines ----------------------------------------------------------------------------

const Outline kL = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};

double area(const Mesh& mesh) {
  double sum = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    sum += (mesh.vertices[t[1]] - mesh.vertices[t[0]])
               .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
               .z() /
           2;
  return sum;
}

/// The L of area 3, in a text of each format that has polygons.
TEST(Polygons, AnLHasItsAreaInEveryFormat) {
  std::string obj, obj_face = "f", numbers, indices;
  for (std::size_t k = 0; k < kL.size(); ++k) {
    const std::string p = std::to_string(kL[k].x) + " " + std::to_string(kL[k].y) + " 0";
    obj += "v " + p + "\n";
    obj_face += " " + std::to_string(k + 1);
    numbers += p + "\n";
    indices += " " + std::to_string(k);
  }
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
      numbers + "6" + indices + "\n";
  const auto dae = [&](const std::string& face) {
    return "<COLLADA><library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' "
           "count='18'>" +
           numbers +
           "</float_array><technique_common><accessor source='#a' count='6' stride='3'/>"
           "</technique_common></source><vertices id='v'><input semantic='POSITION' source='#p'/>"
           "</vertices>" +
           face +
           "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'>"
           "<node><instance_geometry url='#g'/></node></visual_scene></library_visual_scenes>"
           "<scene><instance_visual_scene url='#s'/></scene></COLLADA>";
  };
  const std::string input = "<input semantic='VERTEX' source='#v' offset='0'/>";
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"l.obj", obj + obj_face},
           {"l.ply", ply},
           {"l.off", off(kL, Plane())},
           {"polylist.dae", dae("<polylist count='1'>" + input + "<vcount>6</vcount><p>" + indices +
                                "</p></polylist>")},
           {"polygons.dae",
            dae("<polygons count='1'>" + input + "<p>" + indices + "</p></polygons>")},
       }) {
    const TemporaryFile file(name, text);
    const Mesh mesh = loadMesh(file.path());
    EXPECT_EQ(3, area(mesh)) << name;
    EXPECT_EQ(4u, mesh.triangles.size()) << name;
  }
}

// The first face is a square.
TEST(Polygons, ThatCrossThemselvesAreRefusedByTheirNumber) {
  const auto refusal = [](const Outline& outline) {
    std::string text = "v 9 9 0\nv 8 9 0\nv 8 8 0\nv 9 8 0\nf 1 2 3 4\n", face = "f";
    for (std::size_t k = 0; k < outline.size(); ++k) {
      text += "v " + std::to_string(outline[k].x) + " " + std::to_string(outline[k].y) + " 0\n";
      face += " " + std::to_string(k + 5);
    }
    const TemporaryFile file("crossing.obj", text + face + "\n");
    return reasonOf(file.path());
  };
  EXPECT_EQ("", refusal(kL));
  for (const Outline& outline : {
           Outline{{0, 0}, {2, 2}, {2, 0}, {0, 2}},                  // a bow
           Outline{{0, 0}, {3, 2}, {3, 0}, {0, 3}},                  // of unequal parts
           Outline{{0, 3}, {-2, -3}, {3, 1}, {-3, 1}, {2, -3}},      // a star
           Outline{{0, 0}, {9, 0}, {9, 9}, {0, 0}, {4, 1}, {4, 3}},  // twice around
           Outline{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {4, 0}, {4, 4}, {0, 4}},
           Outline{{0, 0}, {1, 0}, {1, 1}, {1, 0}, {3, 0}, {3, 1}, {1, 0}, {0, 1}},
       }) {
    if (isSimple(outline)) FAIL();
    const std::string reason = refusal(outline);
    if (reason.empty()) continue;  // it touches itself only
    EXPECT_NE(std::string::npos, reason.find("face 2 of")) << reason;
    EXPECT_NE(std::string::npos, reason.find("crosses itself")) << reason;
  }
  EXPECT_NE("", refusal({{0, 0}, {2, 2}, {2, 0}, {0, 2}}));
  EXPECT_NE("", refusal({{0, 0}, {9, 0}, {9, 9}, {0, 0}, {4, 1}, {4, 3}}));
}

// The corners of a quad of a saddle are in no plane: seen along z it is convex, and its triangles
// keep the sum of normals.
TEST(Polygons, OutOfAPlaneKeepTheirNormal) {
  const TemporaryFile file(
      "saddle.off", "OFF\n5 1 0\n0 0 0\n2 0 0.125\n2 2 0\n1 0.5 0.25\n0 2 0.125\n5 0 1 2 3 4\n");
  const Mesh mesh = loadMesh(file.path());
  ASSERT_EQ(3u, mesh.triangles.size());
  fcl::Vector3d sum = fcl::Vector3d::Zero();
  for (const fcl::Triangle& t : mesh.triangles) {
    const fcl::Vector3d normal = (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                                     .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    EXPECT_GT(normal.z(), 0);
    sum += normal;
  }
  fcl::Vector3d newell = fcl::Vector3d::Zero();
  for (std::size_t k = 0; k < 5; ++k) newell += mesh.vertices[k].cross(mesh.vertices[(k + 1) % 5]);
  EXPECT_EQ(newell, sum);
}

// A corner one unit in the last place off the line is seen.
TEST(Polygons, AreDecidedWithoutRounding) {
  const double up = std::nextafter(1., 2), down = std::nextafter(1., 0);
  for (const double y : {up, down}) {
    char text[400];
    std::snprintf(text, sizeof(text),
                  "OFF\n5 1 0\n0 0 0\n4 0 0\n3 3 0\n1 %.17g 0\n%.17g 1 0\n5 0 1 2 3 4\n", y, y);
    const TemporaryFile file("fine.off", text);
    const Mesh mesh = loadMesh(file.path());
    EXPECT_EQ(3u, mesh.triangles.size());
  }
}

TEST(Polygons, WithTooManyCornersAreRefused) {
  const auto disc = [](int corners) {
    std::string text = "OFF\n" + std::to_string(corners) + " 1 0\n", face;
    for (int k = 0; k < corners; ++k) {
      text += std::to_string(std::cos(2 * M_PI * k / corners)) + " " +
              std::to_string(std::sin(2 * M_PI * k / corners)) + " 0\n";
      face += " " + std::to_string(k);
    }
    return text + std::to_string(corners) + face + "\n";
  };
  const TemporaryFile fine("disc.off", disc(2000));
  EXPECT_EQ(1998u, loadMesh(fine.path()).triangles.size());
  const TemporaryFile large("large.off", disc(10001));
  EXPECT_NE(std::string::npos, reasonOf(large.path()).find("corners"));
}

}  // namespace triangulate_test
}  // namespace adaptive_bvh_test
