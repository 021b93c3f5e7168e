// Random glTF and Collada files with their numbers, elements and bytes changed: refused, or read
// as a sound mesh, within the limits of time and memory.
#include <gtest/gtest.h>

#include "support/load_limits.h"
#include "support/long_mode.h"
#include "support/random_scenes.h"

namespace adaptive_bvh_test {
namespace damaged_scenes_test {

/// Changes a text at random places.
class Damage {
 public:
  Damage(unsigned seed, const char* opening, const char* closing)
      : random_(seed), opening_(opening), closing_(closing) {}

  std::string of(std::string text) {
    for (std::size_t k = 1 + below(4); k > 0; --k) {
      const std::size_t kind = below(16), where = below(std::max<std::size_t>(1, text.size()));
      if (kind < 6)
        changeNumber(text, where);
      else if (kind < 9)
        swapNumbers(text, where);
      else if (kind < 14)
        repeatElement(text, where);
      else if (kind == 14)
        text.erase(where, below(40));
      else if (!text.empty())
        text[where] = below(2) == 0 ? char(random_()) : "0123456789 -.e\"{}[],:<>/#"[below(25)];
    }
    return text;
  }

  std::size_t below(std::size_t count) { return std::size_t(random_() % count); }

 private:
  /// Place and length of the next number.
  static std::pair<std::size_t, std::size_t> numberFrom(const std::string& text, std::size_t at) {
    const std::size_t begin = std::min(text.find_first_of("-0123456789", at), text.size());
    const std::size_t end = text.find_first_not_of("-+.e0123456789", begin);
    return {begin, std::min(end, text.size()) - begin};
  }

  void changeNumber(std::string& text, std::size_t where) {
    static const char* const kNumbers[] = {"0",
                                           "1",
                                           "2",
                                           "3",
                                           "7",
                                           "-1",
                                           "5120",
                                           "5121",
                                           "5125",
                                           "5126",
                                           "255",
                                           "256",
                                           "1000",
                                           "65535",
                                           "100000",
                                           "249999",
                                           "1000000",
                                           "1000001",
                                           "10000000",
                                           "2147483648",
                                           "4294967295",
                                           "4294967296",
                                           "9223372036854775807",
                                           "9223372036854775808",
                                           "18446744073709551615",
                                           "18446744073709551616",
                                           "1e308",
                                           "1e-320",
                                           "1e400",
                                           "0.5",
                                           "nan",
                                           "-0"};
    const auto [begin, length] = numberFrom(text, where);
    text.replace(begin, length, kNumbers[below(std::size(kNumbers))]);
  }

  void swapNumbers(std::string& text, std::size_t where) {
    const auto [begin, length] = numberFrom(text, where);
    const auto [other, other_length] = numberFrom(text, below(text.size() + 1));
    const std::string number = text.substr(other, other_length);
    text.replace(begin, length, number);
  }

  /// Writes an element once, often, or not at all; sometimes only to the next closing bracket.
  void repeatElement(std::string& text, std::size_t where) {
    const std::size_t begin = text.find_first_of(opening_, where);
    const std::size_t end =
        below(8) == 0 ? text.find_first_of(closing_, begin) : endOf(text, begin);
    if (end == text.npos) return;
    const std::string element = text.substr(begin, end + 1 - begin);
    const std::string between = opening_[0] == '{' ? "," : "";
    std::string all;
    const std::size_t times = below(10) == 0 ? below(3000) : below(4);
    for (std::size_t k = 0; k < times && all.size() < 200000; ++k)
      all += (k > 0 ? between : "") + element;
    text.replace(begin, element.size(), all);
  }

  /// Where an object, a list or an XML element ends.
  std::size_t endOf(const std::string& text, std::size_t begin) const {
    if (begin == text.npos) return begin;
    if (opening_ == "<") {
      const std::size_t end_of_tag = text.find('>', begin);
      if (end_of_tag == text.npos || text[end_of_tag - 1] == '/') return end_of_tag;
      const std::size_t end_of_name = text.find_first_of(" />", begin + 1);
      const std::string name = text.substr(begin + 1, end_of_name - begin - 1);
      return text.find('>', text.find("</" + name, begin));
    }
    int levels = 0;
    for (std::size_t at = begin; at < text.size(); ++at) {
      if (opening_.find(text[at]) != opening_.npos) ++levels;
      if (closing_.find(text[at]) != closing_.npos && --levels == 0) return at;
    }
    return text.npos;
  }

  std::mt19937 random_;
  const std::string opening_, closing_;
};

/// Files in all: of each format 10^5 in the long mode.
int files() { return isLongMode() ? 100000 : 1500; }

void expectMostAreDamaged(int refused) {
  EXPECT_GT(refused, files() / 5);
  EXPECT_LT(refused, files());
}

/// A random glTF file and the file of its buffer, as long as they are needed.
struct GltfFiles {
  GltfFiles(unsigned seed, bool is_binary)
      : gltf(seed, nameOf(external.path()), is_binary), scene(gltf.write()) {
    std::ofstream(external.path(), std::ios::binary) << gltf.external();
  }
  static std::string nameOf(const std::string& path) {
    return path.substr(path.find_last_of('/') + 1);
  }

  const TemporaryFile external{"damaged.bin"};
  RandomGltf gltf;
  const SceneFile scene;
};

TEST(DamagedScenes, OfGltfAsText) {
  int refused = 0;
  for (int step = 0; step < files() && !HasFailure(); ++step) {
    const unsigned seed = testSeed(unsigned(step));
    SCOPED_TRACE("seed " + std::to_string(seed));
    const GltfFiles files(seed, false);
    const std::string text = Damage(seed, "{[", "}]").of(files.scene.text);
    const TemporaryFile file("damaged.gltf", text);
    const std::size_t bytes = text.size() + files.gltf.external().size();
    refused += !loadWithinLimits(file.path(), bytes).empty();
  }
  expectMostAreDamaged(refused);
}

TEST(DamagedScenes, OfGltfAsBinary) {
  int refused = 0;
  for (int step = 0; step < files() && !HasFailure(); ++step) {
    const unsigned seed = testSeed(unsigned(step));
    SCOPED_TRACE("seed " + std::to_string(seed));
    const GltfFiles files(seed, true);
    Damage damage(seed, "{[", "}]");
    std::string all = glbOf(damage.of(files.scene.text), files.scene.chunk);
    for (std::size_t k = damage.below(4); k > 1; --k)
      all[damage.below(all.size())] = char(damage.below(256));
    if (damage.below(10) == 0) all.resize(damage.below(all.size()));
    const TemporaryFile file("damaged.glb", all);
    const std::size_t bytes = all.size() + files.gltf.external().size();
    refused += !loadWithinLimits(file.path(), bytes).empty();
  }
  expectMostAreDamaged(refused);
}

TEST(DamagedScenes, OfCollada) {
  int refused = 0;
  for (int step = 0; step < files() && !HasFailure(); ++step) {
    const unsigned seed = testSeed(unsigned(step));
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::string text = Damage(seed, "<", ">").of(RandomCollada(seed).write().text);
    const TemporaryFile file("damaged.dae", text);
    refused += !loadWithinLimits(file.path(), text.size()).empty();
  }
  expectMostAreDamaged(refused);
}

}  // namespace damaged_scenes_test
}  // namespace adaptive_bvh_test
