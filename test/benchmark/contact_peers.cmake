# Rows of contact_bench that need other libraries: built where these are found.

# bench_peer(bench name define library source...): apart from the rest, for the library's own options.
function(bench_peer bench name define library)
  add_library(${name} STATIC EXCLUDE_FROM_ALL ${ARGN})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${name} PRIVATE scenarios adaptive_bvh_warnings ${library})
  target_link_libraries(${bench} PRIVATE ${name})
  target_compile_definitions(${bench} PRIVATE ${define})
endfunction()

find_package(embree 3 QUIET)
if(embree_FOUND AND embree_VERSION VERSION_LESS 4)
  bench_peer(contact_bench contact_embree ADAPTIVE_BVH_HAS_EMBREE embree contact_embree.cpp
    contact_embree_continuous.cpp proximity_embree.cpp)
else()
  message(STATUS "adaptive_bvh: Embree 3 not found, the benchmarks have no rows for it")
endif()

set(CGAL_DATA_DIR "${CMAKE_CURRENT_SOURCE_DIR}")  # not used; without it CGAL warns
set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
find_package(CGAL QUIET)
if(CGAL_FOUND)
  bench_peer(contact_bench contact_cgal ADAPTIVE_BVH_HAS_CGAL CGAL::CGAL contact_cgal.cpp)
else()
  message(STATUS "adaptive_bvh: CGAL not found, contact_bench has no row for it")
endif()
