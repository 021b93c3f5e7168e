// Reads arrays of numbers by glTF's accessors. The functions at, countAt and textAt return parts of
// the document that may be missing (gltf_json.h).
#include "gltf_accessors.h"

#include <numeric>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

BinaryType typeOf(std::size_t component_type) {
  switch (component_type) {
    case 5120: return {'i', 1};
    case 5121: return {'u', 1};
    case 5122: return {'i', 2};
    case 5123: return {'u', 2};
    case 5125: return {'u', 4};
    case 5126: return {'f', 4};
    default:
      throw std::runtime_error("an accessor has the unknown component type " +
                               std::to_string(component_type));
  }
}

/// Maps an integer of a type to [-1, 1] if signed, or [0, 1] if unsigned.
double normalized(double number, BinaryType type) {
  const int digits = 8 * static_cast<int>(type.bytes) - (type.kind == 'i' ? 1 : 0);
  return type.kind == 'f' ? number : std::max(number / (std::ldexp(1., digits) - 1), -1.);
}

/// The count of numbers in an element of an accessor.
std::size_t widthOf(const std::string& form) {
  return form == "SCALAR" ? 1 : form == "VEC3" ? 3 : form == "VEC4" ? 4 : 16;
}

/// An index as an integer. Throws unless it is below `count`.
std::size_t indexOf(double index, std::size_t count) {
  if (index >= 0 && index < static_cast<double>(count)) return static_cast<std::size_t>(index);
  throw std::runtime_error("a triangle names vertex " + textOf(index) + " of " +
                           std::to_string(count));
}

BinaryType indexTypeOf(const Json& source) {
  const BinaryType type = typeOf(countAt(source, "componentType"));
  if (type.kind == 'f') throw std::runtime_error("a list of indices is not of integers");
  return type;
}

}  // namespace

std::vector<double> GltfAccessors::numbers(const Json& accessor, const std::string& form) {
  const BinaryType type = typeOf(countAt(accessor, "componentType"));
  std::vector<double> numbers = read(accessor, type, form);
  if (at(accessor, "normalized") == Json(true))
    for (double& number : numbers) number = normalized(number, type);
  return numbers;
}

std::vector<std::size_t> GltfAccessors::indices(const Json* accessor, std::size_t vertices) {
  std::vector<std::size_t> indices;
  if (!accessor) {
    limit_.take(vertices);
    indices.resize(vertices);
    std::iota(indices.begin(), indices.end(), 0);
    return indices;
  }
  const std::vector<double> numbers = read(*accessor, indexTypeOf(*accessor), "SCALAR");
  indices.reserve(numbers.size());
  for (const double number : numbers) indices.push_back(indexOf(number, vertices));
  return indices;
}

/// The numbers of an accessor. All are 0 if the accessor has no view.
std::vector<double> GltfAccessors::read(const Json& accessor, BinaryType type,
                                        const std::string& form) {
  if (textAt(accessor, "type") != form)
    throw std::runtime_error("an accessor is not of type " + form);
  const std::size_t width = widthOf(form);
  const std::size_t count = countAt(accessor, "count");
  const bool has_view = !at(accessor, "bufferView").is_null();
  const GltfView* const view = has_view ? &viewOf(accessor, type, count, width) : nullptr;
  limit_.take(std::max(count, count / 3 * width));  // `count` is below the limit: no overflow
  std::vector<double> numbers(count * width);
  for (std::size_t i = 0; view && i < numbers.size(); ++i)
    numbers[i] = view->number(i / width, i % width);
  applySparse(at(accessor, "sparse"), type, width, numbers);
  return numbers;
}

/// Replaces the elements that a sparse accessor lists.
void GltfAccessors::applySparse(const Json& sparse, BinaryType type, std::size_t width,
                                std::vector<double>& numbers) {
  const std::size_t changes = countAt(sparse, "count"), count = numbers.size() / width;
  if (sparse.is_null()) return;
  if (changes > count)
    throw std::runtime_error("a sparse accessor changes " + std::to_string(changes) +
                             " elements of " + std::to_string(count));
  const Json& list = at(sparse, "indices");
  const GltfView& indices = viewOf(list, indexTypeOf(list), changes, 1);
  const GltfView& values = viewOf(at(sparse, "values"), type, changes, width);
  limit_.take(changes);
  for (std::size_t i = 0; i < changes; ++i) {
    const std::size_t changed = indexOf(indices.number(i, 0), count);
    for (std::size_t k = 0; k < width; ++k) numbers[width * changed + k] = values.number(i, k);
  }
}

/// The view of an accessor, cached because names in glTF 1 may be long.
const GltfView& GltfAccessors::viewOf(const Json& source, BinaryType type, std::size_t count,
                                      std::size_t width) {
  const auto found = views_.find(&source);
  if (found != views_.end()) return found->second;
  return views_.emplace(&source, findView(source, type, count, width)).first->second;
}

/// Reads the view of an accessor, and checks that it is within its buffer.
GltfView GltfAccessors::findView(const Json& source, BinaryType type, std::size_t count,
                                 std::size_t width) {
  const Json& view = at(at(gltf_, "bufferViews"), at(source, "bufferView"));
  const std::size_t bytes_before = buffers_.fileBytes();
  const std::string_view buffer = buffers_.bytesOf(at(at(gltf_, "buffers"), at(view, "buffer")));
  limit_.allow(buffers_.fileBytes() - bytes_before);
  const std::size_t begin = countAt(view, "byteOffset"), length = countAt(view, "byteLength"),
                    offset = countAt(source, "byteOffset"), size = type.bytes * width;
  std::size_t stride = countAt(view, "byteStride", countAt(source, "byteStride"));
  if (stride == 0) stride = size;
  // In this order, nothing overflows.
  if (begin > buffer.size() || length > buffer.size() - begin)
    throw std::runtime_error("a part of a buffer reaches past the buffer's end");
  if (count > 0 &&
      (offset > length || size > length - offset || count - 1 > (length - offset - size) / stride))
    throw std::runtime_error("an accessor reaches past its part of a buffer");
  return {buffer.substr(count > 0 ? begin + offset : 0), type, count, width, stride};
}

}  // namespace adaptive_bvh
