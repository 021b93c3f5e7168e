# `cpack -G DEB` in a build folder with CMAKE_INSTALL_PREFIX=/usr: a Debian package of headers,
# libraries and CMake files. (With that prefix libraries go to /usr/lib/<architecture>.)
set(CPACK_PACKAGE_NAME libadaptive-bvh-dev)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The adaptive_bvh authors <adaptive-bvh@example.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "bounding volume hierarchies that follow deforming meshes")
set(CPACK_PACKAGE_DESCRIPTION
  "Exact distance and collision queries on deforming meshes with FCL: a model
that is updated in a fraction of the time of FCL's refit, and stays sound.
Headers and static libraries.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SOURCE adaptive-bvh)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(depends "libfcl-dev (>= 0.7)" libeigen3-dev)
if(find_tbb)
  list(APPEND depends libtbb-dev)
endif()
if(TARGET adaptive_bvh_mesh_io)
  list(APPEND depends libassimp-dev)
endif()
if(TARGET adaptive_bvh_tuning)
  list(APPEND depends libpagmo-dev)
endif()
list(JOIN depends ", " CPACK_DEBIAN_PACKAGE_DEPENDS)

# What only a Debian package needs is made by cpack, not by an installation.
set(CPACK_STRIP_FILES OFF)
set(CPACK_INSTALL_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/debian_package.cmake)
set(CPACK_ADAPTIVE_BVH_SOURCE ${PROJECT_SOURCE_DIR})
set(CPACK_ADAPTIVE_BVH_PREFIX ${CMAKE_INSTALL_PREFIX})
if(TARGET adaptive_bvh_recording)
  set(CPACK_ADAPTIVE_BVH_HAS_THREE ON)  # in libadaptive_bvh_recording.a
endif()
include(CPack)
