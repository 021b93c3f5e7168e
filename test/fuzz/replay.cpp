// Runs the fuzz target without libFuzzer: on every file of a corpus, with all types, and on as many
// random inputs as requested. replay CORPUS_DIR [RANDOM_INPUTS [SEED]]
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: replay CORPUS_DIR [RANDOM_INPUTS [SEED]]\n");
    return 2;
  }
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    std::vector<std::uint8_t> input(bytes.begin(), bytes.end());
    LLVMFuzzerTestOneInput(input.data(), input.size());
    for (const int bits : {64, 128, 64}) {  // as calls of the other types
      if (!input.empty()) input[0] = std::uint8_t(input[0] ^ bits);
      LLVMFuzzerTestOneInput(input.data(), input.size());
    }
    ++files;
  }
  const int inputs = argc > 2 ? std::atoi(argv[2]) : 0;
  const unsigned seed = argc > 3 ? unsigned(std::atoi(argv[3])) : 1;
  for (int i = 0; i < inputs; ++i) {
    std::printf("seed %u\n", seed + unsigned(i));
    std::mt19937 random(seed + unsigned(i));
    std::uniform_int_distribution<int> byte(0, 255), size(1, 4000);
    std::vector<std::uint8_t> bytes(std::size_t(size(random)));
    // Mostly a body is built first; pure noise hardly ever gets that far.
    for (std::uint8_t& b : bytes) b = std::uint8_t(byte(random));
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%d files and %d random inputs held\n", files, inputs);
  return files > 0 ? 0 : 1;
}
