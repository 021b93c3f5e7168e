#include <algorithm>
#include <array>
#include <cstring>
#include <istream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "deformable/mesh_state.h"
#include "deformable/mesh_step.h"
#include "hierarchy/bottom_up.h"

// DeformableMesh::save and load. The format is a magic number and a header, then arrays in memory
// layout (positions, previous positions, triangles, order and shape of the binary tree), then a
// checksum of all.
namespace adaptive_bvh {
namespace {

/// The first eight bytes. Versions before 0.3 also saved meshes in single precision.
constexpr std::array<char, 8> kMeshMagic = {'A', 'B', 'V', 'H', 'M', 'S', 'H', 'd'},
                              kSingleMagic = {'A', 'B', 'V', 'H', 'M', 'S', 'H', 'f'};
constexpr std::uint32_t kMeshVersion = 1, kMeshByteOrder = 0x01020304;

/// The header, which follows the magic number.
struct SavedHeader {
  std::uint32_t version, byte_order;
  std::uint64_t vertices, previous, triangles;  ///< numbers of elements
  double axes[9];                               ///< of the boxes, column by column
};
static_assert(sizeof(SavedHeader) == 104, "without gaps");

/// The size in bytes of the pieces in which arrays are read, so that memory is allocated in
/// proportion to the data a file contains, whatever length it claims. A multiple of all element
/// sizes, and of a word of the checksum, which adds up piece by piece.
constexpr std::size_t kMeshPiece = std::size_t(3) << 20;

/// A checksum by FNV-1a (Fowler, Noll, Vo) on words of eight bytes.
class MeshChecksum {
 public:
  void add(const void* data, std::size_t bytes) {
    const char* from = static_cast<const char*>(data);
    for (; bytes > 0; from += kWord, bytes -= std::min(bytes, kWord)) {
      std::uint64_t word = 0;
      std::memcpy(&word, from, std::min(bytes, kWord));
      sum_ = (sum_ ^ word) * 0x100000001b3;
      sum_ ^= sum_ >> 32;  // because a product never carries high bits to lower ones
    }
  }
  std::uint64_t sum() const { return sum_; }

 private:
  static constexpr std::size_t kWord = sizeof(std::uint64_t);
  std::uint64_t sum_ = 0xcbf29ce484222325;
};

[[noreturn]] void failToLoad(const std::string& why) {
  throw std::runtime_error("DeformableMesh::load: " + why);
}

/// Writes arrays to a stream; `finish` writes their checksum, and throws if the stream has failed.
class MeshWriter {
 public:
  explicit MeshWriter(std::ostream& out) : out_(out) {}

  template <typename T>
  void write(const T* elements, std::size_t count) {
    const char* const data = reinterpret_cast<const char*>(elements);
    const std::size_t bytes = count * sizeof(T);
    for (std::size_t begin = 0; begin < bytes; begin += kMeshPiece) {
      const std::size_t size = std::min(kMeshPiece, bytes - begin);
      checksum_.add(data + begin, size);
      out_.write(data + begin, static_cast<std::streamsize>(size));
    }
  }
  void finish() {
    const std::uint64_t sum = checksum_.sum();
    out_.write(reinterpret_cast<const char*>(&sum), sizeof sum);
    if (!out_) throw std::runtime_error("DeformableMesh::save: the stream failed");
  }

 private:
  std::ostream& out_;
  MeshChecksum checksum_;
};

/// Reads arrays from a stream; `finish` reads their checksum. All throw if the data are not right.
class MeshReader {
 public:
  explicit MeshReader(std::istream& in) : in_(in) {}

  template <typename T>
  void read(T* elements, std::size_t count) {
    readBytes(elements, count * sizeof(T));
    checksum_.add(elements, count * sizeof(T));
  }
  template <typename Vector>
  void read(Vector& elements, std::uint64_t count) {
    using T = typename Vector::value_type;
    static_assert(kMeshPiece % sizeof(T) == 0, "pieces are of whole elements");
    for (std::uint64_t begin = 0; begin < count;) {
      const std::uint64_t size = std::min<std::uint64_t>(kMeshPiece / sizeof(T), count - begin);
      elements.resize(static_cast<std::size_t>(begin + size));
      read(elements.data() + begin, static_cast<std::size_t>(size));
      begin += size;
    }
  }
  void finish() {
    std::uint64_t sum = 0;
    readBytes(&sum, sizeof sum);
    if (sum != checksum_.sum()) failToLoad("the data are damaged: the checksum differs");
  }

 private:
  void readBytes(void* to, std::size_t bytes) {
    if (!in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes)))
      failToLoad("the data end too early");
  }

  std::istream& in_;
  MeshChecksum checksum_;
};

/// Eight bits to a byte, the first one lowest.
std::vector<unsigned char> packedBits(const std::vector<bool>& bits) {
  std::vector<unsigned char> bytes((bits.size() + 7) / 8, 0);
  for (std::size_t i = 0; i < bits.size(); ++i)
    bytes[i / 8] = static_cast<unsigned char>(bytes[i / 8] | bits[i] << i % 8);
  return bytes;
}
std::vector<bool> unpackedBits(const std::vector<unsigned char>& bytes, std::size_t count) {
  std::vector<bool> bits(count);
  for (std::size_t i = 0; i < count; ++i) bits[i] = bytes[i / 8] >> i % 8 & 1;
  return bits;
}

/// Reads the magic number and the header. Throws unless this library can read such a mesh.
SavedHeader readHeader(MeshReader& reader) {
  std::array<char, 8> magic;
  reader.read(magic.data(), magic.size());
  if (magic == kSingleMagic)
    failToLoad(
        "the mesh was saved in single precision, which no version from 0.3 on reads; build "
        "and save it anew");
  if (magic != kMeshMagic) failToLoad("the data are not those of a saved mesh");
  SavedHeader header;
  reader.read(&header, 1);
  if (header.byte_order != kMeshByteOrder) failToLoad("the data have another byte order");
  if (header.version != kMeshVersion)
    failToLoad("the data have the version " + std::to_string(header.version) +
               "; this library reads version " + std::to_string(kMeshVersion));
  // WideNode::first has 29 bits, including the sign.
  constexpr std::uint64_t kMost = std::uint64_t(1) << 28;
  if (header.vertices > 4 * kMost || header.triangles >= kMost || header.triangles == 0 ||
      (header.previous != 0 && header.previous != header.vertices))
    failToLoad("the data are damaged: " + std::to_string(header.vertices) + " vertices, " +
               std::to_string(header.triangles) + " triangles");
  return header;
}

/// The matrix with these numbers. Throws unless it is a rotation.
fcl::Matrix3d axesFrom(const double* numbers) {
  const fcl::Matrix3d axes = Eigen::Map<const fcl::Matrix3d>(numbers);
  const double error = (axes.transpose() * axes - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!axes.allFinite() || !(error <= 1e-9) || !(axes.determinant() > 0))
    failToLoad("the data are damaged: the axes of the boxes are no rotation");
  return axes;
}

}  // namespace

void DeformableMesh::save(std::ostream& out) const {
  const MeshState& state = *state_;
  const MeshTopology& topology = *state.topology;
  SavedHeader header{kMeshVersion,
                     kMeshByteOrder,
                     state.vertices.size(),
                     state.previous.size(),
                     topology.triangles.size(),
                     {}};
  Eigen::Map<fcl::Matrix3d>(header.axes) = state.axes.axes();
  std::vector<std::uint32_t> corners, order;  // order: the triangle of each leaf
  corners.reserve(3 * topology.triangles.size());
  order.reserve(topology.triangles.size());
  for (const fcl::Triangle& t : topology.triangles)
    for (int k = 0; k < 3; ++k) corners.push_back(static_cast<std::uint32_t>(t[k]));
  for (const Int4& leaf : topology.leaves.corners)
    order.push_back(static_cast<std::uint32_t>(leaf[3]));
  const std::vector<unsigned char> shape = packedBits(topology.shape);

  MeshWriter writer(out);
  writer.write(kMeshMagic.data(), kMeshMagic.size());
  writer.write(&header, 1);
  writer.write(state.vertices.data(), state.vertices.size());
  writer.write(state.previous.data(), state.previous.size());
  writer.write(corners.data(), corners.size());
  writer.write(order.data(), order.size());
  writer.write(shape.data(), shape.size());
  writer.finish();
}

DeformableMesh::DeformableMesh(std::istream& in) : state_(std::make_unique<MeshState>()) {
  MeshReader reader(in);
  const SavedHeader header = readHeader(reader);
  const fcl::Matrix3d axes = axesFrom(header.axes);
  std::vector<Point> vertices, previous;
  std::vector<std::array<std::uint32_t, 3>> corners;
  Scratch<unsigned> order;
  std::vector<unsigned char> shape;
  const std::uint64_t nodes = 2 * header.triangles - 1;
  reader.read(vertices, header.vertices);
  reader.read(previous, header.previous);
  reader.read(corners, header.triangles);
  reader.read(order, header.triangles);
  reader.read(shape, (nodes + 7) / 8);
  reader.finish();

  std::vector<fcl::Triangle> triangles;
  triangles.reserve(corners.size());
  for (const auto& c : corners) triangles.emplace_back(c[0], c[1], c[2]);
  OrderedTree tree;
  if (!treeOf(unpackedBits(shape, static_cast<std::size_t>(nodes)), std::move(order), tree))
    failToLoad("the data are damaged: the tree is not one of all triangles");
  try {
    requireBuildable(vertices, triangles);
    requireUsable(previous);
  } catch (const std::invalid_argument& error) {
    failToLoad(std::string("the data are damaged: ") + error.what());
  }
  buildFromTree(std::move(vertices), std::move(triangles), tree, &axes, *state_, *this);
  setPrevious(std::move(previous));
}

DeformableMesh DeformableMesh::load(std::istream& in) { return DeformableMesh(in); }

}  // namespace adaptive_bvh
