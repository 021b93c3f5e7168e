#pragma once

#include <map>
#include <vector>

#include "gltf_buffers.h"
#include "scene.h"
#include "tokens.h"

namespace adaptive_bvh {

/// A part of a buffer with `count` elements, of `width` numbers each.
struct GltfView {
  std::string_view bytes;  ///< from the first number on
  BinaryType type;
  std::size_t count, width, stride;  ///< stride: bytes from one element to the next

  /// Number k of an element.
  double number(std::size_t element, std::size_t k) const {
    return numberAt(bytes, stride * element + type.bytes * k, type);
  }
};

/// Reads the accessors of a glTF document. All functions throw std::runtime_error if the referenced
/// elements do not exist, or if they would take more bytes than there are.
class GltfAccessors {
 public:
  /// `bytes` is the size of the document itself.
  GltfAccessors(const Json& gltf, GltfBuffers buffers, std::size_t bytes)
      : gltf_(gltf), buffers_(std::move(buffers)), bytes_(bytes), limit_(kReadsTooOften, bytes) {}

  /// The numbers of an accessor whose type is `form` ("SCALAR", "VEC3", "VEC4" or "MAT4"), one
  /// element after the other. Normalized integers are from 0 to 1, signed ones from -1 to 1.
  std::vector<double> numbers(const Json& accessor, const std::string& form);

  /// The indices of an accessor, each below `vertices`; if it is null, all vertices in order.
  std::vector<std::size_t> indices(const Json* accessor, std::size_t vertices);

  /// The total bytes of the document and of the buffers that were read.
  std::size_t bytes() const { return bytes_ + buffers_.fileBytes(); }

 private:
  std::vector<double> read(const Json& accessor, BinaryType type, const std::string& form);
  void applySparse(const Json& sparse, BinaryType type, std::size_t width,
                   std::vector<double>& numbers);
  const GltfView& viewOf(const Json& source, BinaryType type, std::size_t count, std::size_t width);
  GltfView findView(const Json& source, BinaryType type, std::size_t count, std::size_t width);

  const Json& gltf_;
  GltfBuffers buffers_;
  std::size_t bytes_;
  ElementLimit limit_;
  std::map<const Json*, GltfView> views_;  ///< of accessors, and of the lists of sparse accessors
};

}  // namespace adaptive_bvh
