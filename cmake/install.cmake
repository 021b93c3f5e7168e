# Headers, libraries, find_package(adaptive_bvh [COMPONENTS mesh_io policy_json recording tuning]),
# pkg-config (adaptive_bvh, adaptive_bvh_<component>), and what ROS 2 looks for.
set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/adaptive_bvh)

install(DIRECTORY include/adaptive_bvh DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS adaptive_bvh EXPORT adaptive_bvh_targets)
install(EXPORT adaptive_bvh_targets NAMESPACE adaptive_bvh:: DESTINATION ${cmake_dir}
  FILE adaptive_bvh-targets.cmake)
# A component has its own file, so that finding the core never asks for what a component needs.
foreach(component mesh_io policy_json recording tuning)
  if(TARGET adaptive_bvh_${component})
    install(TARGETS adaptive_bvh_${component} EXPORT adaptive_bvh_${component}_targets)
    install(EXPORT adaptive_bvh_${component}_targets NAMESPACE adaptive_bvh::
      DESTINATION ${cmake_dir} FILE adaptive_bvh-${component}-targets.cmake)
  endif()
endforeach()

# Whoever links the static library links what it uses.
get_target_property(type adaptive_bvh TYPE)
if(TBB_FOUND AND ADAPTIVE_BVH_TBB AND type STREQUAL "STATIC_LIBRARY")
  set(find_tbb "find_dependency(TBB)")
  set(pc_tbb " tbb")
endif()

configure_package_config_file(cmake/adaptive_bvh-config.cmake.in
  ${PROJECT_BINARY_DIR}/adaptive_bvh-config.cmake INSTALL_DESTINATION ${cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/adaptive_bvh-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/adaptive_bvh-config.cmake
              ${PROJECT_BINARY_DIR}/adaptive_bvh-config-version.cmake
        DESTINATION ${cmake_dir})

# Relocatable: the prefix is found from where the .pc file lies.
file(RELATIVE_PATH pc_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
list(TRANSFORM alignment_definitions PREPEND " -D" OUTPUT_VARIABLE pc_definitions)
list(JOIN pc_definitions "" pc_definitions)
configure_file(cmake/adaptive_bvh.pc.in ${PROJECT_BINARY_DIR}/adaptive_bvh.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/adaptive_bvh.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
# A component has a file of its own, adaptive_bvh_<component>.pc. A static library names what it uses.
set(pc_libs_mesh_io " -lassimp -lz")
set(pc_libs_tuning " -lpagmo -lboost_serialization -ltbb")
set(pc_requires_tuning " adaptive_bvh_policy_json")
foreach(component mesh_io policy_json recording tuning)
  if(TARGET adaptive_bvh_${component})
    set(pc_requires "adaptive_bvh${pc_requires_${component}}")
    set(pc_libs)
    get_target_property(type adaptive_bvh_${component} TYPE)
    if(type STREQUAL "STATIC_LIBRARY")
      set(pc_libs "${pc_libs_${component}}")
    endif()
    configure_file(cmake/component.pc.in ${PROJECT_BINARY_DIR}/adaptive_bvh_${component}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/adaptive_bvh_${component}.pc
      DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  endif()
endforeach()
install(FILES package.xml LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/adaptive_bvh)
# By this file ROS 2 finds the package in a workspace (ament's index of resources).
file(WRITE ${PROJECT_BINARY_DIR}/ament/adaptive_bvh "")
install(FILES ${PROJECT_BINARY_DIR}/ament/adaptive_bvh
  DESTINATION ${CMAKE_INSTALL_DATADIR}/ament_index/resource_index/packages)
