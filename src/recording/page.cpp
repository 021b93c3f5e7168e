#include <algorithm>
#include <array>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "page_parts.h"
#include "run.h"

namespace adaptive_bvh {
namespace {

constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Two base64 digits for every 12 bits.
std::array<std::array<char, 2>, 4096> digitPairs() {
  std::array<std::array<char, 2>, 4096> pairs{};
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {kDigits[i >> 6], kDigits[i & 63]};
  return pairs;
}

std::size_t base64Size(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

/// At most three bytes: the last ones. Missing digits are "=".
void writeTail(const std::uint8_t* bytes, std::size_t count, std::ostream& out) {
  if (count == 0) return;
  const unsigned bits = unsigned(bytes[0]) << 16 | (count > 1 ? unsigned(bytes[1]) << 8 : 0u) |
                        (count > 2 ? unsigned(bytes[2]) : 0u);
  for (unsigned digit = 0; digit < 4; ++digit)
    out.put(digit <= count ? kDigits[bits >> (18 - 6 * digit) & 63] : '=');
}

/// Bytes to base64, in any number of pieces.
class Base64Writer {
 public:
  explicit Base64Writer(std::ostream& out) : out_(out) {}

  void write(const std::uint8_t* bytes, std::size_t count) {
    for (; waiting_ > 0 && count > 0; --count) add(*bytes++);
    while (count >= 3) {
      const std::size_t groups = std::min(count / 3, text_.size() / 4);
      writeGroups(bytes, groups);
      bytes += 3 * groups;
      count -= 3 * groups;
    }
    for (; count > 0; --count) add(*bytes++);
  }
  void finish() { writeTail(group_, waiting_, out_); }

 private:
  /// To a group of three.
  void add(std::uint8_t byte) {
    group_[waiting_++] = byte;
    if (waiting_ < 3) return;
    waiting_ = 0;
    writeGroups(group_, 1);
  }
  void writeGroups(const std::uint8_t* bytes, std::size_t groups) {
    char* text = text_.data();
    for (std::size_t i = 0; i < groups; ++i, bytes += 3, text += 4) {
      const unsigned bits = unsigned(bytes[0]) << 16 | unsigned(bytes[1]) << 8 | bytes[2];
      std::copy_n(pairs_[bits >> 12].data(), 2, text);
      std::copy_n(pairs_[bits & 4095].data(), 2, text + 2);
    }
    out_.write(text_.data(), static_cast<std::streamsize>(4 * groups));
  }

  std::ostream& out_;
  const std::array<std::array<char, 2>, 4096> pairs_ = digitPairs();
  std::array<char, 4 * 4096> text_;
  std::uint8_t group_[3];
  std::size_t waiting_ = 0;
};

void writeBase64(const Blob& blob, std::ostream& out) {
  Base64Writer writer(out);
  for (const Blob::Part& part : blob.parts()) writer.write(part.bytes.get(), part.size);
  writer.finish();
}

std::string escaped(const std::string& text) {
  std::string html;
  for (const char c : text) {
    if (c == '<')
      html += "&lt;";
    else if (c == '&')
      html += "&amp;";
    else
      html += c;
  }
  return html;
}

/// Padded, so that a page's size does not depend on the number of its digits.
std::string padded(std::size_t number) {
  std::string text = std::to_string(number);
  return text + std::string(text.size() < 20 ? 20 - text.size() : 0, ' ');
}

/// The template, cut at its {{names}}; what these stand for is filled in.
class Page {
 public:
  explicit Page(const Run& run)
      : run_(run), title_(escaped(run.options.title)), json_(toJson(run)), size_(padded(0)) {
    std::string_view rest = pageTemplate();
    for (std::size_t begin; (begin = rest.find("{{")) != std::string_view::npos;) {
      const std::size_t end = rest.find("}}", begin);
      pieces_.push_back(rest.substr(0, begin));
      pieces_.push_back(part(rest.substr(begin + 2, end - begin - 2)));
      rest.remove_prefix(end + 2);
    }
    pieces_.push_back(rest);
    std::size_t bytes = base64Size(run.blob.size());
    for (const std::string_view piece : pieces_) bytes += piece.size();
    const std::string size = padded(bytes);
    std::copy(size.begin(), size.end(), size_.begin());
  }

  void write(std::ostream& out) const {
    for (const std::string_view piece : pieces_) {
      if (piece.data() == kData.data()) writeBase64(run_.blob, out);
      out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
    }
  }

 private:
  /// Empty; known by its address.
  static constexpr std::string_view kData = std::string_view("data").substr(0, 0);

  std::string_view part(std::string_view name) const {
    if (name == "title") return title_;
    if (name == "bytes") return size_;
    if (name == "style") return pageStyle();
    if (name == "three") return threeScript();
    if (name == "run") return json_;
    if (name == "data") return kData;
    return pageScript();
  }

  const Run& run_;
  std::string title_, json_, size_;
  std::vector<std::string_view> pieces_;  // into those, and into the library's own files
};

}  // namespace

void writePage(const Run& run, std::ostream& out) { Page(run).write(out); }

}  // namespace adaptive_bvh
