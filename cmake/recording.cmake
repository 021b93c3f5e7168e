# The component recording: three.js and the page's own files become part of the library.
find_file(ADAPTIVE_BVH_THREE_JS three.min.js DOC "three.js, revision 111 or near it, as one script"
  PATHS /usr/share/javascript/three /usr/share/nodejs/three/build)
if(NOT ADAPTIVE_BVH_THREE_JS)
  message(STATUS "adaptive_bvh: three.js not found (Debian: libjs-three), building without the "
    "component recording")
  return()
endif()
if(NOT nlohmann_json_FOUND)
  message(STATUS "adaptive_bvh: nlohmann-json not found, building without the component recording")
  return()
endif()

add_library(adaptive_bvh_recording
  src/recording/body.cpp
  src/recording/page.cpp
  src/recording/frame_json.cpp src/recording/recording.cpp)
add_library(adaptive_bvh::recording ALIAS adaptive_bvh_recording)
set_target_properties(adaptive_bvh_recording PROPERTIES EXPORT_NAME recording)
target_link_libraries(adaptive_bvh_recording
  PUBLIC adaptive_bvh
  PRIVATE $<BUILD_INTERFACE:nlohmann_json::nlohmann_json>
          $<BUILD_INTERFACE:adaptive_bvh_warnings>)
list(APPEND components adaptive_bvh_recording)

# page.cpp has the assembler read these.
set(page ${PROJECT_SOURCE_DIR}/src/recording/page)
file(GLOB page_files CONFIGURE_DEPENDS ${page}/*)
set(three ${PROJECT_BINARY_DIR}/recording/three.min.js)
configure_file(${ADAPTIVE_BVH_THREE_JS} ${three} COPYONLY)
set_source_files_properties(src/recording/page.cpp PROPERTIES
  OBJECT_DEPENDS "${page_files};${three}"
  COMPILE_OPTIONS "-Wa,-I${page},-I${PROJECT_BINARY_DIR}/recording")
