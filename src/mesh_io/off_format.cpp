#include <algorithm>

#include "formats.h"
#include "tokens.h"

namespace adaptive_bvh {
namespace {

const std::string kLineEnds = "\r\n\f";

/// Walks through the text as assimp does.
class OffText {
 public:
  /// Up to the first zero: there assimp stops.
  explicit OffText(const std::string& text) : text_(text, 0, text.find('\0')) {}

  /// The format's name, with what it says of the vertices.
  std::string keyword() {
    skipSpacesAndComments();
    const std::size_t begin = at_;
    at_ = std::min(text_.find("OFF", at_), text_.size());
    const std::string prefix = text_.substr(begin, at_ - begin);
    at_ = std::min(at_ + 3, text_.size());
    return prefix + "OFF";
  }

  /// The next number of the header, as written; empty where there is none.
  std::string number() {
    skipSpacesAndComments();
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') ++at_;
    return text_.substr(begin, at_ - begin);
  }

  void skipSpacesAndComments() {
    for (;;) {
      while (at_ < text_.size() && isSpace(text_[at_])) ++at_;
      if (at_ >= text_.size() || text_[at_] != '#') return;
      at_ = std::min(text_.find_first_of(kLineEnds, at_), text_.size());
    }
  }

  /// The next line of the body; false at the end. Empty lines are skipped.
  bool readLine(std::string& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find_first_of(kLineEnds, at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = std::min(text_.find_first_not_of(kLineEnds, end), text_.size());
    return true;
  }

 private:
  const std::string text_;
  std::size_t at_ = 0;
};

/// How many corners a face announces; 0 when assimp passes over it.
int cornersOf(const std::string& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  const std::size_t end = std::min(line.find_first_not_of("0123456789", begin), line.size());
  const std::uintmax_t corners = countOf(line.substr(begin, end - begin));
  return corners <= 9 ? static_cast<int>(corners) : 0;
}

/// assimp subtracts each line that is no face from the number of faces, also below zero; and it has
/// room for lines of 4095 characters.
std::string findBodyError(OffText& text, std::uintmax_t vertices, std::uintmax_t faces) {
  std::string line;
  std::uintmax_t others = 0;
  for (std::uintmax_t left = vertices + faces; left > 0 && text.readLine(line);) {
    if (line.size() > 4095) return "a line of it is too long";
    if (left > faces || cornersOf(line) > 0)
      --left;
    else if (++others > faces)
      return "it has more lines that are no faces than it announces faces";
  }
  return "";
}

}  // namespace

std::string findOffError(const std::string& text) {
  OffText off(text);
  if (off.keyword().find('n') != std::string::npos) off.number();  // of dimensions
  const std::string vertices = off.number(), faces = off.number();
  off.number();  // of edges
  off.skipSpacesAndComments();
  for (const std::string& error : {findCountError("vertices", vertices, text.size()),
                                   findCountError("faces", faces, text.size())})
    if (!error.empty()) return error;
  return findBodyError(off, countOf(vertices), countOf(faces));
}

}  // namespace adaptive_bvh
