# What find_package says of components that are there, are not, or cannot be.
#   cmake -DPREFIX=INSTALLATION -DWORK=FOLDER -P components.cmake
cmake_minimum_required(VERSION 3.16)

# expect(SUCCEEDS|FAILS "arguments of find_package" "settings" SAYS regexes ... NOT regexes ...)
function(expect outcome arguments settings)
  cmake_parse_arguments(arg "" "" "SAYS;NOT" ${ARGN})
  execute_process(
    COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/components -B ${WORK}/build
            -U*_DIR -UCMAKE_DISABLE_FIND_PACKAGE_* -DCMAKE_PREFIX_PATH=${PREFIX}
            "-DARGUMENTS=${arguments}" ${settings}
    RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE errors)
  string(APPEND text "${errors}")
  string(REGEX REPLACE "[ \n]+" " " line "${text}")  # CMake breaks lines
  set(what "find_package(adaptive_bvh ${arguments}) with '${settings}'")
  if((result EQUAL 0 AND outcome STREQUAL FAILS) OR
     (NOT result EQUAL 0 AND outcome STREQUAL SUCCEEDS))
    message(FATAL_ERROR "${what} ended with ${result}:\n${text}")
  endif()
  foreach(regex IN LISTS arg_SAYS)
    if(NOT line MATCHES "${regex}")
      message(FATAL_ERROR "${what} does not say '${regex}':\n${text}")
    endif()
  endforeach()
  foreach(regex IN LISTS arg_NOT)
    if(line MATCHES "${regex}")
      message(FATAL_ERROR "${what} says '${regex}':\n${text}")
    endif()
  endforeach()
endfunction()

set(no_assimp -DCMAKE_DISABLE_FIND_PACKAGE_assimp=ON)
set(no_pagmo -DCMAKE_DISABLE_FIND_PACKAGE_pagmo=ON)

expect(SUCCEEDS "REQUIRED" "${no_assimp};${no_pagmo}" SAYS "target adaptive_bvh" NOT "target tuning")
expect(SUCCEEDS "REQUIRED;COMPONENTS;policy_json" "${no_assimp};${no_pagmo}"
  SAYS "found adaptive_bvh_policy_json" "target policy_json" NOT "target tuning")
expect(SUCCEEDS "REQUIRED;COMPONENTS;recording" "${no_assimp};${no_pagmo}"
  SAYS "found adaptive_bvh_recording" "target recording" NOT "target tuning")
expect(SUCCEEDS "REQUIRED;COMPONENTS;tuning" "${no_assimp}"
  SAYS "found adaptive_bvh_tuning" "target tuning" "target policy_json" NOT "target mesh_io")

expect(FAILS "REQUIRED;COMPONENTS;mesh_oi" ""
  SAYS "no component 'mesh_oi': it has mesh_io, policy_json, recording and tuning")
expect(FAILS "REQUIRED;COMPONENTS;mesh_io" "${no_assimp}"
  SAYS "'mesh_io' needs assimp, which was not found .*libassimp-dev")
expect(FAILS "REQUIRED;COMPONENTS;mesh_io" -DCMAKE_DISABLE_FIND_PACKAGE_ZLIB=ON
  SAYS "'mesh_io' needs ZLIB, which was not found .*zlib1g-dev")
expect(FAILS "REQUIRED;COMPONENTS;tuning;typo" "${no_pagmo}"
  SAYS "'tuning' needs pagmo, which was not found .*libpagmo-dev" "no component 'typo'")

# Without REQUIRED the project goes on; QUIET is silent.
expect(SUCCEEDS "COMPONENTS;typo" "" SAYS "no component 'typo'" NOT "found adaptive_bvh")
expect(SUCCEEDS "QUIET;COMPONENTS;typo" "" NOT "no component" "found adaptive_bvh")
expect(SUCCEEDS "REQUIRED;COMPONENTS;mesh_io;OPTIONAL_COMPONENTS;tuning;typo" "${no_pagmo}"
  SAYS "found adaptive_bvh " "target mesh_io" NOT "found adaptive_bvh_tuning" "needs pagmo" "typo'")

# An installation without two of the components.
file(REMOVE_RECURSE ${WORK}/without)
file(COPY ${PREFIX}/ DESTINATION ${WORK}/without)
file(GLOB_RECURSE removed ${WORK}/without/adaptive_bvh-policy_json-targets*.cmake)
file(REMOVE ${removed})
set(PREFIX ${WORK}/without)
expect(FAILS "REQUIRED;COMPONENTS;policy_json" ""
  SAYS "this installation was built without the component 'policy_json'")
expect(FAILS "REQUIRED;COMPONENTS;tuning" ""
  SAYS "this installation was built without the component 'tuning'")
expect(SUCCEEDS "REQUIRED;COMPONENTS;mesh_io" "" SAYS "target mesh_io")
message(STATUS "find_package(adaptive_bvh): all as expected")
