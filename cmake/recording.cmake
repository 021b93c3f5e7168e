# The component recording: three.js and the page's own files become part of the library.
find_file(ADAPTIVE_BVH_THREE_JS three.min.js DOC "three.js, revision 111 or near it, as one script"
  PATHS /usr/share/javascript/three /usr/share/nodejs/three/build)
if(NOT ADAPTIVE_BVH_THREE_JS)
  message(STATUS "adaptive_bvh: three.js not found (Debian: libjs-three), building without the "
    "component recording")
  return()
endif()

add_library(adaptive_bvh_recording
  src/recording/blob.cpp
  src/recording/body.cpp
  src/recording/page.cpp
  src/recording/page_parts.cpp
  src/recording/recording.cpp
  src/recording/run_json.cpp)
add_library(adaptive_bvh::recording ALIAS adaptive_bvh_recording)
set_target_properties(adaptive_bvh_recording PROPERTIES EXPORT_NAME recording)
target_link_libraries(adaptive_bvh_recording
  PUBLIC adaptive_bvh PRIVATE $<BUILD_INTERFACE:adaptive_bvh_warnings>)
list(APPEND components adaptive_bvh_recording)

# What page_parts.cpp hands to the assembler.
set(page ${PROJECT_SOURCE_DIR}/src/recording/page)
set(page_template page.html)
set(page_style page.css)
set(page_script data.js colours.js scene.js bodies.js volumes.js markers.js orbit.js chart.js
  panel.js player.js)
set(page_parts)
set(page_files ${ADAPTIVE_BVH_THREE_JS})
foreach(part template style script three)
  string(APPEND page_parts "ADAPTIVE_BVH_BEGIN(\"${part}\")\n")
  if(part STREQUAL "three")
    string(APPEND page_parts "\".incbin \\\"${ADAPTIVE_BVH_THREE_JS}\\\"\\n\"\n")
  endif()
  foreach(file IN LISTS page_${part})
    string(APPEND page_parts "\".incbin \\\"${page}/${file}\\\"\\n\"\n")
    list(APPEND page_files ${page}/${file})
  endforeach()
  string(APPEND page_parts "ADAPTIVE_BVH_END(\"${part}\")\n")
endforeach()
set(page_folder ${PROJECT_BINARY_DIR}/recording)
file(GENERATE OUTPUT ${page_folder}/page_parts.inc CONTENT "${page_parts}")
target_include_directories(adaptive_bvh_recording PRIVATE ${page_folder})
set_source_files_properties(src/recording/page_parts.cpp PROPERTIES OBJECT_DEPENDS "${page_files}")
