# What add_subdirectory does in a parent project: how our sources are compiled, and what is installed.
# Configures only.
#   cmake -DWORK=FOLDER -P embedding.cmake
cmake_minimum_required(VERSION 3.16)

# embed(settings...): configures the parent, and reads the commands for a source of ours and its own.
macro(embed)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/add_subdirectory -B ${WORK}
      -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DADAPTIVE_BVH_MESH_IO=OFF -DADAPTIVE_BVH_TUNING=OFF
      -DCMAKE_BUILD_TYPE= -DEXPECT_CMAKE_BUILD_TYPE= -DCMAKE_CXX_FLAGS= -DEXPECT_CMAKE_CXX_FLAGS=
      -DPARENT_COMPILE_OPTIONS= -DADAPTIVE_BVH_INSTALL=OFF
      -DADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES=16 ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "configuring with '${ARGN}' fails:\n${text}")
  endif()
  file(STRINGS ${WORK}/compile_commands.json ours REGEX "\"command\".*wide_tree.cpp")
  file(STRINGS ${WORK}/compile_commands.json parents REGEX "\"command\".*consumers/main.cpp")
endmacro()

# expect(text [NOT] REGEX)
function(expect what text)
  cmake_parse_arguments(arg "" "NOT" "" ${ARGN})
  if(arg_NOT AND text MATCHES "${arg_NOT}" OR NOT arg_NOT AND NOT text MATCHES "${ARGN}")
    message(FATAL_ERROR "${what}: not as expected (${ARGN}):\n${text}")
  endif()
endfunction()

embed()
expect("no build type" "${ours}" " -O3 -DNDEBUG ")
expect("no build type: the parent's own sources" "${parents}" NOT " -O")
expect("no build type" "${text}" "CMAKE_BUILD_TYPE is not set")
execute_process(COMMAND ${CMAKE_COMMAND} --install ${WORK} --prefix ${WORK}/prefix
  RESULT_VARIABLE result OUTPUT_QUIET)
if(NOT result EQUAL 0 OR EXISTS ${WORK}/prefix/include)
  message(FATAL_ERROR "an installation of the parent project installs ours")
endif()

embed(-DCMAKE_BUILD_TYPE=Debug -DEXPECT_CMAKE_BUILD_TYPE=Debug
  -DADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES=32)
expect("the parent's build type" "${ours}" NOT " -O")
expect("FCL with another alignment" "${parents}"
  "-DADAPTIVE_BVH_EIGEN_MAX_ALIGN_BYTES=32 -DEIGEN_MAX_ALIGN_BYTES=32 ")
embed(-DPARENT_COMPILE_OPTIONS=-O1)
expect("the parent's options" "${ours}" NOT " -O3")
embed(-DCMAKE_CXX_FLAGS=-Ofast -DEXPECT_CMAKE_CXX_FLAGS=-Ofast -DADAPTIVE_BVH_INSTALL=ON)
expect("the parent's flags" "${ours}" NOT " -O3")
expect("IEEE arithmetic" "${ours}" " -Ofast .* -fno-fast-math -ffp-contract=off ")
expect("alignment in the parent's sources" "${parents}" "-DEIGEN_MAX_ALIGN_BYTES=16 ")
file(READ ${WORK}/adaptive_bvh/cmake_install.cmake rules)
expect("ADAPTIVE_BVH_INSTALL" "${rules}" "adaptive_bvh-config.cmake")
message(STATUS "add_subdirectory(adaptive_bvh): all as expected")
