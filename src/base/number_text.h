#pragma once

#include <cstdio>
#include <string>

namespace adaptive_bvh {

/// A number in a message: six digits, with an exponent where it is large or tiny.
inline std::string textOf(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", number);
  return text;
}

}  // namespace adaptive_bvh
