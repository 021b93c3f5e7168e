# Protection of what is installed and packaged, against damaged data that reach a fault of ours.
# docs/performance.md, "Hardening", says what it costs. Not with sanitizers, which look at more.
option(ADAPTIVE_BVH_HARDENING "Stack protector, _FORTIFY_SOURCE=2, relocations before the start"
  ${is_top_level})

add_library(adaptive_bvh_hardening INTERFACE)
if(ADAPTIVE_BVH_HARDENING AND NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  target_compile_options(adaptive_bvh_hardening INTERFACE
    # For every array in what reads files; in the core, whose arrays of numbers are in hot loops, for
    # those of characters only: there the strong one costs up to 5 % of a distance.
    "$<IF:$<STREQUAL:$<TARGET_PROPERTY:NAME>,adaptive_bvh>,-fstack-protector,-fstack-protector-strong>"
    # It needs optimised code.
    "$<$<CONFIG:Release,RelWithDebInfo,MinSizeRel>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
  if(NOT APPLE)
    target_link_options(adaptive_bvh_hardening INTERFACE -Wl,-z,relro,-z,now)
  endif()
endif()
