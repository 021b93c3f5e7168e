#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "adaptive_bvh/recording.h"

namespace adaptive_bvh_test {

/// A waving sheet of 2 n^2 triangles at time t, far from the origin.
inline adaptive_bvh::TriangleMesh wavingSheet(int n, double t, double far = 100) {
  adaptive_bvh::TriangleMesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = double(i) / n, y = double(j) / n;
      mesh.vertices.push_back(
          fcl::Vector3d(far + x, y + 0.2 * t * x * x, 0.3 * std::sin(4 * x + t)).cast<double>());
    }
  const auto row = static_cast<std::size_t>(n) + 1;
  for (std::size_t j = 0; j + 1 < row; ++j)
    for (std::size_t i = 0; i + 1 < row; ++i) {
      const std::size_t v = row * j + i;
      mesh.triangles.emplace_back(v, v + 1, v + row + 1);
      mesh.triangles.emplace_back(v, v + row + 1, v + row);
    }
  return mesh;
}

inline std::vector<std::uint8_t> decodeBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) break;  // "="
    bits = bits << 6 | static_cast<unsigned>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count));
  }
  return bytes;
}

/// A page of a Recording, read as a browser does.
struct RecordedPage {
  using json = nlohmann::json;

  std::string text;
  json run;
  std::vector<std::uint8_t> data;

  explicit RecordedPage(const adaptive_bvh::Recording& recording) {
    std::ostringstream out;
    recording.write(out);
    text = out.str();
    run = json::parse(element("<script id=\"run\" type=\"application/json\">"));
    data = decodeBase64(element("<script id=\"data\" type=\"text/plain\">"));
  }

  std::string element(const std::string& tag) const {
    const std::size_t begin = text.find(tag) + tag.size();
    return text.substr(begin, text.find("</script>", begin) - begin);
  }
  template <typename T>
  std::vector<T> numbers(std::size_t at, std::size_t count) const {
    std::vector<T> out(count);
    EXPECT_LE(at + count * sizeof(T), data.size());
    EXPECT_EQ(at % 4, 0u);
    std::memcpy(out.data(), data.data() + at, count * sizeof(T));
    return out;
  }
  /// What a body has in a frame; what is left out is as in the frame before.
  json bodyIn(std::size_t frame, std::size_t body, const char* name) const {
    for (std::size_t f = frame + 1; f-- > 0;)
      if (run["frames"][f]["bodies"][body].contains(name))
        return run["frames"][f]["bodies"][body][name];
    return {};
  }
  std::vector<fcl::Vector3d> points(const json& block) const {
    const auto steps = numbers<std::uint16_t>(block["at"], 3 * block["count"].get<std::size_t>());
    std::vector<fcl::Vector3d> out;
    for (std::size_t i = 0; i < steps.size(); i += 3) {
      fcl::Vector3d point;
      for (std::size_t k = 0; k < 3; ++k)
        point[static_cast<int>(k)] =
            block["low"][k].get<double>() + steps[i + k] * block["size"][k].get<double>() / 65535;
      out.push_back(point);
    }
    return out;
  }
};

}  // namespace adaptive_bvh_test
