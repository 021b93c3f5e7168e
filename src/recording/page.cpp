#include "page.h"

#include <ostream>
#include <string_view>

// The files that every page contains (page/), embedded in the library by the assembler, which takes
// no time whatever their size. CMake sets their paths. Each file begins at a symbol
// adaptive_bvh_page_<name> and ends at the next symbol.
#define ADAPTIVE_BVH_BEGIN(name)                                        \
  ".global adaptive_bvh_page_" name "\n.hidden adaptive_bvh_page_" name \
  "\nadaptive_bvh_page_" name ":\n"
#define ADAPTIVE_BVH_FILE(name) ".incbin \"" name "\"\n"

// clang-format off
asm(".pushsection .rodata\n"
    ADAPTIVE_BVH_BEGIN("template")
    ADAPTIVE_BVH_FILE("page.html")
    ADAPTIVE_BVH_BEGIN("style")
    ADAPTIVE_BVH_FILE("page.css")
    ADAPTIVE_BVH_BEGIN("script")  // in one scope, in this order
    ADAPTIVE_BVH_FILE("faults.js")
    ADAPTIVE_BVH_FILE("data.js")
    ADAPTIVE_BVH_FILE("scene.js")
    ADAPTIVE_BVH_FILE("bodies.js")
    ADAPTIVE_BVH_FILE("volumes.js")
    ADAPTIVE_BVH_FILE("markers.js")
    ADAPTIVE_BVH_FILE("arrows.js")
    ADAPTIVE_BVH_FILE("chart.js")
    ADAPTIVE_BVH_FILE("panel.js")
    ADAPTIVE_BVH_FILE("export.js")
    ADAPTIVE_BVH_FILE("player.js")
    ADAPTIVE_BVH_BEGIN("three")
    ADAPTIVE_BVH_FILE("three.min.js")
    ADAPTIVE_BVH_BEGIN("end")
    ".popsection\n");
// clang-format on

extern "C" const char adaptive_bvh_page_template[], adaptive_bvh_page_style[],
    adaptive_bvh_page_script[], adaptive_bvh_page_three[], adaptive_bvh_page_end[];

namespace adaptive_bvh {
namespace {

std::string_view between(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

/// A text with the characters < and & escaped for HTML.
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

void writeBase64(const Blob& blob, std::ostream& out) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  static_assert(Blob::kUnit % 3 == 0, "base64 takes three bytes at a time");
  for (const std::vector<std::uint8_t>& part : blob.parts()) {
    std::string text(part.size() / 3 * 4, '=');
    auto digit = text.begin();
    for (std::size_t i = 0; i < part.size(); i += 3) {
      const unsigned bits = unsigned(part[i]) << 16 | unsigned(part[i + 1]) << 8 | part[i + 2];
      for (int shift = 18; shift >= 0; shift -= 6) *digit++ = kDigits[bits >> shift & 63];
    }
    out << text;
  }
}

}  // namespace

void writePage(const std::string& title, const std::string& run, const Blob& arrays,
               std::ostream& out) {
  // Copies page.html and replaces {{name}} by the part of this name.
  std::string_view rest = between(adaptive_bvh_page_template, adaptive_bvh_page_style);
  for (std::size_t begin; (begin = rest.find("{{")) != std::string_view::npos;) {
    const std::size_t end = rest.find("}}", begin);
    const std::string_view name = rest.substr(begin + 2, end - begin - 2);
    out << rest.substr(0, begin);
    if (name == "title") out << escaped(title);
    if (name == "style") out << between(adaptive_bvh_page_style, adaptive_bvh_page_script);
    if (name == "three") out << between(adaptive_bvh_page_three, adaptive_bvh_page_end);
    if (name == "run") out << run;
    if (name == "data") writeBase64(arrays, out);
    if (name == "script") out << between(adaptive_bvh_page_script, adaptive_bvh_page_three);
    rest.remove_prefix(end + 2);
  }
  out << rest;
}

}  // namespace adaptive_bvh
