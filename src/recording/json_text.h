#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// JSON that may stand inside of an HTML page's script element, written from left to right. Commas
/// are set where they are needed.
class JsonText {
 public:
  JsonText& open(char bracket) {
    comma();
    text_ += bracket;
    fresh_ = true;
    return *this;
  }
  JsonText& close(char bracket) {
    text_ += bracket;
    fresh_ = false;
    return *this;
  }
  JsonText& key(const char* name) {
    comma();
    text_ += '"';
    text_ += name;
    text_ += "\":";
    fresh_ = true;
    return *this;
  }
  JsonText& value(const std::string& text) {
    comma();
    text_ += '"';
    for (const char c : text) escape(c);
    text_ += '"';
    return *this;
  }
  /// The shortest text that reads as the same number; null where it is not finite.
  JsonText& value(double number) {
    comma();
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), number).ptr;
    if (std::isfinite(number))
      text_.append(digits, end);
    else
      text_ += "null";
    return *this;
  }
  JsonText& values(const fcl::Vector3d& v) {
    for (int k = 0; k < 3; ++k) value(v[k]);
    return *this;
  }
  template <typename Value>
  JsonText& member(const char* name, const Value& what) {
    return key(name).value(what);
  }

  const std::string& text() const { return text_; }

 private:
  void comma() {
    if (!fresh_) text_ += ',';
    fresh_ = false;
  }
  /// "<" would end the script element in "</script>".
  void escape(char c) {
    if (c == '"' || c == '\\' || c == '<' || static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof(code), "\\u%04x", static_cast<unsigned>(c));
      text_ += code;
    } else {
      text_ += c;
    }
  }

  std::string text_;
  bool fresh_ = true;
};

}  // namespace adaptive_bvh
