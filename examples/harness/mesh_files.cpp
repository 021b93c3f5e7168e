#include "mesh_files.h"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace harness {
namespace {

/// Bytes of numbers, the lowest first.
class Bytes {
 public:
  void append(const std::string& text) { bytes_ += text; }
  void append(std::uint32_t number, int count = 4) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<char>(number >> 8 * i));
  }
  void append(const Point& p) {
    for (int k = 0; k < 3; ++k) {
      const auto value = static_cast<float>(p[k]);
      std::uint32_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      append(bits);
    }
  }
  void write(const std::string& path) const {
    std::ofstream out(path, std::ios::binary);
    out.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
    out.close();
    if (!out) throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno));
  }

 private:
  std::string bytes_;
};

}  // namespace

void writePly(const Surface& surface, const std::string& path) {
  Bytes bytes;
  bytes.append("ply\nformat binary_little_endian 1.0\ncomment millimetres\nelement vertex " +
               std::to_string(surface.vertices.size()) +
               "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
               std::to_string(surface.triangles.size()) +
               "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Point& p : surface.vertices) bytes.append(p);
  for (const auto& triangle : surface.triangles) {
    bytes.append(3, 1);
    for (const unsigned vertex : triangle) bytes.append(vertex);
  }
  bytes.write(path);
}

void writeStl(const Surface& surface, const std::string& path) {
  Bytes bytes;
  std::string title = "part of an engine bay, millimetres";
  title.resize(80, ' ');
  bytes.append(title);
  bytes.append(static_cast<std::uint32_t>(surface.triangles.size()));
  for (const auto& [a, b, c] : surface.triangles) {
    const Point &p = surface.vertices[a], &q = surface.vertices[b], &r = surface.vertices[c];
    bytes.append(Point((q - p).cross(r - p).stableNormalized()));
    for (const Point& corner : {p, q, r}) bytes.append(corner);
    bytes.append(0, 2);
  }
  bytes.write(path);
}

}  // namespace harness
