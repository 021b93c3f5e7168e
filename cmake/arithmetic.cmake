# How our own code is compiled in any project: the same results on every processor, and optimised.

# No product and sum become one operation, and arithmetic is that of IEEE 754, also where a parent
# project asks for -ffast-math. (Clang's -fno-fast-math changes contraction: it comes first.)
add_library(adaptive_bvh_arithmetic INTERFACE)
target_compile_options(adaptive_bvh_arithmetic INTERFACE -fno-fast-math -ffp-contract=off)

# A parent project that chose neither a build type nor a level of optimisation would get the library
# unoptimised, about 70 times as slow.
get_directory_property(directory_options COMPILE_OPTIONS)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES
    AND NOT "${CMAKE_CXX_FLAGS};${directory_options}" MATCHES "(^|[ ;])-O")
  message(STATUS "adaptive_bvh: CMAKE_BUILD_TYPE is not set, compiling adaptive_bvh with -O3 -DNDEBUG")
  target_compile_options(adaptive_bvh_arithmetic INTERFACE -O3 -DNDEBUG)
endif()
