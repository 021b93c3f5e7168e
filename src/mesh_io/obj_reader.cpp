// Reads OBJ: statements with vertices and polygonal faces.
#include <stdexcept>
#include <string>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

/// The next statement: a line, and the lines that follow a backslash at a line's end. It may begin
/// with a byte order mark, also in the middle of a file that was concatenated from several.
std::string readStatement(Words& lines) {
  std::string statement(withoutByteOrderMark(lines.restOfLine()));
  while (!statement.empty() && statement.back() == '\\' && !lines.isAtEnd()) {
    statement.back() = ' ';
    statement += lines.restOfLine();
  }
  return statement.substr(0, statement.find('#'));
}

/// The vertex (from 0) that a corner "7", "7/1", "7//3" or "7/1/3" names: its number counts from 1,
/// or backwards from the last of the `vertices` so far if it is negative.
std::size_t vertexOf(std::string_view corner, std::size_t vertices, const Words& lines) {
  const auto index = integerOf(corner.substr(0, corner.find('/')));
  if (!index || *index == 0) lines.fail(quote(corner) + " is no corner of a face");
  const auto vertex = *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(vertices);
  if (vertex < 0) lines.fail("a face names a vertex before the first");
  return static_cast<std::size_t>(vertex);
}

/// Throws if a corner names no vertex. The message counts from 1, as the file does.
void requireCornersOfObj(const PolygonMesh& mesh) {
  const std::size_t *corner = mesh.corners.data(), count = mesh.vertices.size();
  for (std::size_t face = 0; face < mesh.sizes.size(); corner += mesh.sizes[face++])
    for (std::size_t k = 0; k < mesh.sizes[face]; ++k)
      if (corner[k] >= count)
        throw std::runtime_error("face " + std::to_string(face + 1) + " names vertex " +
                                 std::to_string(corner[k] + 1) + " of " + std::to_string(count));
}

}  // namespace

PolygonMesh readObj(std::string_view text) {
  PolygonMesh mesh;
  Words lines(text);
  while (!lines.isAtEnd()) {
    const std::string statement = readStatement(lines);
    Words words(statement);
    const std::string_view keyword = words.next();
    if (keyword == "v") {
      fcl::Vector3d p;
      for (double& x : p) {
        const auto number = numberOf(words.next());
        if (!number) lines.fail("a vertex has not three numbers");
        x = *number;
      }
      mesh.vertices.push_back(p);
    } else if (keyword == "f") {
      for (std::string_view corner; !(corner = words.next()).empty();)
        mesh.corners.push_back(vertexOf(corner, mesh.vertices.size(), lines));
      mesh.endFace();
    }
  }
  requireCornersOfObj(mesh);
  return mesh;
}

}  // namespace adaptive_bvh
