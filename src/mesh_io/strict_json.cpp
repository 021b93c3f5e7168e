#include "strict_json.h"

#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "scene.h"

namespace adaptive_bvh {
namespace {

using Json = nlohmann::json;

/// Maps any bytes to valid UTF-8, different bytes to different text.
std::string toUtf8(std::string_view bytes) {
  std::string text;
  text.reserve(bytes.size());
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xC0 | byte >> 6);
      text += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return text;
}

/// A SAX handler that rejects text that is nested too deeply or ambiguous. (A callback of
/// nlohmann's parser could detect the same, but its time is quadratic in an array's length.)
class JsonCheck : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool string(string_t& text) override {
    if (text.find('\0') != text.npos)
      throw std::runtime_error("a string of its JSON text contains a zero character");
    return true;
  }
  bool key(string_t& text) override {
    if (!open_.back().insert(text).second)
      throw std::runtime_error("an object of its JSON text has two equal keys");
    return string(text);
  }
  bool start_object(std::size_t) override { return enter(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool end_array() override { return leave(); }
  bool parse_error(std::size_t, const std::string&, const Json::exception& error) override {
    error_ = error.what();
    return false;
  }
  const std::string& error() const { return error_; }

 private:
  bool enter() {
    open_.emplace_back();
    if (open_.size() > kMostLevels)
      throw std::runtime_error("its JSON text is nested in more than " +
                               std::to_string(kMostLevels) + " levels");
    return true;
  }
  bool leave() {
    open_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> open_;  ///< open arrays and objects, with their keys so far
  std::string error_;
};

}  // namespace

nlohmann::json parseStrictly(const std::string& bytes) {
  // Without zeros at the end, with which some programs pad the text.
  const std::string_view text(bytes.data(), bytes.find_last_not_of('\0') + 1);
  JsonCheck check;
  if (Json::sax_parse(text, &check)) return Json::parse(text);
  const std::string as_utf8 = toUtf8(text);
  JsonCheck utf8_check;
  if (Json::sax_parse(as_utf8, &utf8_check)) return Json::parse(as_utf8);
  throw std::runtime_error("it is no JSON text: " + check.error());
}

}  // namespace adaptive_bvh
