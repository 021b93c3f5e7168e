// The assembler reads the files: that takes no time, whatever their size. CMake says where they
// are.
#include "page_parts.h"

#define ADAPTIVE_BVH_BEGIN(name) \
  ".global adaptive_bvh_" name   \
  "_begin\n"                     \
  ".hidden adaptive_bvh_" name   \
  "_begin\n"                     \
  "adaptive_bvh_" name "_begin:\n"
#define ADAPTIVE_BVH_FILE(name) ".incbin \"" name "\"\n"
#define ADAPTIVE_BVH_END(name) \
  ".global adaptive_bvh_" name \
  "_end\n"                     \
  ".hidden adaptive_bvh_" name \
  "_end\n"                     \
  "adaptive_bvh_" name "_end:\n"

// clang-format off
asm(".pushsection .rodata\n"
    ADAPTIVE_BVH_BEGIN("template")
    ADAPTIVE_BVH_FILE("page.html")
    ADAPTIVE_BVH_END("template")

    ADAPTIVE_BVH_BEGIN("style")
    ADAPTIVE_BVH_FILE("page.css")
    ADAPTIVE_BVH_END("style")

    ADAPTIVE_BVH_BEGIN("script")  // in one scope, in this order
    ADAPTIVE_BVH_FILE("data.js")
    ADAPTIVE_BVH_FILE("colours.js")
    ADAPTIVE_BVH_FILE("scene.js")
    ADAPTIVE_BVH_FILE("bodies.js")
    ADAPTIVE_BVH_FILE("volumes.js")
    ADAPTIVE_BVH_FILE("markers.js")
    ADAPTIVE_BVH_FILE("orbit.js")
    ADAPTIVE_BVH_FILE("chart.js")
    ADAPTIVE_BVH_FILE("panel.js")
    ADAPTIVE_BVH_FILE("player.js")
    ADAPTIVE_BVH_END("script")

    ADAPTIVE_BVH_BEGIN("three")
    ADAPTIVE_BVH_FILE("three.min.js")
    ADAPTIVE_BVH_END("three")
    ".popsection\n");
// clang-format on

#define ADAPTIVE_BVH_PART(function, name)                                           \
  extern "C" const char adaptive_bvh_##name##_begin[], adaptive_bvh_##name##_end[]; \
  std::string_view adaptive_bvh::function() {                                       \
    const auto size = adaptive_bvh_##name##_end - adaptive_bvh_##name##_begin;      \
    return {adaptive_bvh_##name##_begin, static_cast<std::size_t>(size)};           \
  }

ADAPTIVE_BVH_PART(pageTemplate, template)
ADAPTIVE_BVH_PART(pageStyle, style)
ADAPTIVE_BVH_PART(pageScript, script)
ADAPTIVE_BVH_PART(threeScript, three)
