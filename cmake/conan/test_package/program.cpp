#include <cstdio>

#include <adaptive_bvh/point_query.h>

int main() {
  const adaptive_bvh::DeformableMesh triangle({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const double distance = adaptive_bvh::closestPoint(triangle, {0, 0, 2}).distance;
  std::printf("distance %g\n", distance);
  return distance == 2 ? 0 : 1;
}
