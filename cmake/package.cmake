# `cpack -G DEB` in the build folder: a Debian package of headers, libraries and CMake files.
set(CPACK_PACKAGE_NAME libadaptive-bvh-dev)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The adaptive_bvh authors <adaptive-bvh@example.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGE_DESCRIPTION
  "Exact distance and collision queries on deforming meshes with FCL: a model that is updated in a
 fraction of the time of FCL's refit, and stays sound. Headers and static libraries.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES OFF)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
set(depends "libfcl-dev (>= 0.7)" libeigen3-dev)
if(TARGET adaptive_bvh_mesh_io)
  list(APPEND depends libassimp-dev)
endif()
if(TARGET adaptive_bvh_tuning)
  list(APPEND depends libpagmo-dev)
endif()
list(JOIN depends ", " CPACK_DEBIAN_PACKAGE_DEPENDS)
include(CPack)
