// The assembler reads the files: it takes no time, whatever their size. CMake names them.
#include "page_parts.h"

#define ADAPTIVE_BVH_BEGIN(name) \
  ".global adaptive_bvh_" name   \
  "_begin\n"                     \
  ".hidden adaptive_bvh_" name   \
  "_begin\n"                     \
  "adaptive_bvh_" name "_begin:\n"
#define ADAPTIVE_BVH_END(name) \
  ".global adaptive_bvh_" name \
  "_end\n"                     \
  ".hidden adaptive_bvh_" name \
  "_end\n"                     \
  "adaptive_bvh_" name "_end:\n"

asm(".pushsection .rodata\n"
#include "page_parts.inc"  // written by CMake
    ".popsection\n");

#define ADAPTIVE_BVH_PART(function, name)                                                       \
  extern "C" const char adaptive_bvh_##name##_begin[], adaptive_bvh_##name##_end[];             \
  std::string_view adaptive_bvh::function() {                                                   \
    return {adaptive_bvh_##name##_begin,                                                        \
            static_cast<std::size_t>(adaptive_bvh_##name##_end - adaptive_bvh_##name##_begin)}; \
  }

ADAPTIVE_BVH_PART(pageTemplate, template)
ADAPTIVE_BVH_PART(pageStyle, style)
ADAPTIVE_BVH_PART(pageScript, script)
ADAPTIVE_BVH_PART(threeScript, three)
