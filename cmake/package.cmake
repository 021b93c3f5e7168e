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
  list(APPEND depends libassimp-dev zlib1g-dev)
endif()
if(TARGET adaptive_bvh_tuning)
  list(APPEND depends libpagmo-dev)
endif()
list(JOIN depends ", " CPACK_DEBIAN_PACKAGE_DEPENDS)

# A second package of the Python module, where there is one; the first stays as it is.
if(TARGET adaptive_bvh_python)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENTS_ALL Unspecified python)
  set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_NAME ${CPACK_PACKAGE_NAME})
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-adaptive-bvh)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_UNSPECIFIED_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Exact distance and collision queries on deforming triangle meshes in NumPy
arrays. The module adaptive_bvh for Python 3.")
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}), \
python3 (<< 3.${next_minor}), python3-numpy")
  find_program(dpkg_shlibdeps NAMES dpkg-shlibdeps)
  if(dpkg_shlibdeps)  # from dpkg-dev: names the libraries that the module is linked with
    set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  endif()
endif()

# What only a Debian package needs is made by cpack, not by an installation.
set(CPACK_STRIP_FILES OFF)
set(CPACK_INSTALL_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/debian_package.cmake)
set(CPACK_ADAPTIVE_BVH_SOURCE ${PROJECT_SOURCE_DIR})
set(CPACK_ADAPTIVE_BVH_PREFIX ${CMAKE_INSTALL_PREFIX})
if(TARGET adaptive_bvh_recording)
  set(CPACK_ADAPTIVE_BVH_HAS_THREE ON)  # in libadaptive_bvh_recording.a
endif()
include(CPack)
