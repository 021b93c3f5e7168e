# An overlay port: vcpkg install adaptive-bvh --overlay-ports=<this project>/cmake/vcpkg
# It builds the sources that it lies in. A port in a registry gets them by vcpkg_from_git instead.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS options
  FEATURES
    mesh-io ADAPTIVE_BVH_MESH_IO
    policy-json ADAPTIVE_BVH_POLICY_JSON)

vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${options}
    -DADAPTIVE_BVH_RECORDING=OFF
    -DADAPTIVE_BVH_TUNING=OFF
    -DADAPTIVE_BVH_PYTHON=OFF
    -DADAPTIVE_BVH_TESTS=OFF
    -DADAPTIVE_BVH_EXAMPLES=OFF
    -DADAPTIVE_BVH_BENCHMARKS=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/adaptive_bvh)
vcpkg_fixup_pkgconfig()

file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
