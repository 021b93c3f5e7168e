# Our own code is compiled with these; users of the library are not.
add_library(adaptive_bvh_warnings INTERFACE)
if(is_top_level)
  target_compile_options(adaptive_bvh_warnings INTERFACE
    $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-Wall;-Wextra;-Wpedantic>
    # FCL's own code, inlined into ours, trips this one: contacts and points that it fills later.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    # GoogleTest's TYPED_TEST_SUITE, whose last argument may be left out.
    $<$<CXX_COMPILER_ID:Clang,AppleClang>:-Wno-gnu-zero-variadic-macro-arguments>
    $<$<BOOL:${ADAPTIVE_BVH_WARNINGS_AS_ERRORS}>:-Werror>)
endif()
# In a unity build GCC takes the unnamed namespaces of all sources but one for those of headers.
if(CMAKE_UNITY_BUILD)
  target_compile_options(adaptive_bvh_warnings INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
