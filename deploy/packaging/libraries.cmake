# The libraries that others may use, as CMake packages: `cmake --install BUILD --component development --prefix PREFIX`,
# then find_package(Fulcrum COMPONENTS tissue thermal servo recording scene). No middleware, no scene graph.
#
# fulcrum_component(NAME TARGETS main [parts ...] HEADERS folder ...): Fulcrum::NAME is the first target; the others are
# what it is made of. Headers keep their places below include/fulcrum. Bodies of kernels are none of them.
include(CMakePackageConfigHelpers)
set(package_folder lib/cmake/Fulcrum)

function(fulcrum_component name)
  cmake_parse_arguments(ARG "" "" "TARGETS;HEADERS" ${ARGN})
  list(GET ARG_TARGETS 0 main)
  foreach(target ${ARG_TARGETS})
    string(REPLACE fulcrum_ "" part ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${part})
  endforeach()
  set_target_properties(${main} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${ARG_TARGETS} EXPORT Fulcrum_${name} ARCHIVE DESTINATION lib/fulcrum COMPONENT development)
  install(EXPORT Fulcrum_${name} NAMESPACE Fulcrum:: DESTINATION ${package_folder} COMPONENT development)
  foreach(folder ${ARG_HEADERS})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION include/fulcrum/${folder} COMPONENT development
            FILES_MATCHING PATTERN "*.h" PATTERN "*_impl.h" EXCLUDE)
  endforeach()
endfunction()

fulcrum_component(core TARGETS fulcrum_core fulcrum_flags HEADERS services/base/core)
fulcrum_component(scene TARGETS fulcrum_scene HEADERS services/scene/format services/scene/builder)
fulcrum_component(tissue
  TARGETS fulcrum_physics_simulation fulcrum_physics_implicit fulcrum_physics_xpbd fulcrum_physics_pbd
    fulcrum_physics_energy fulcrum_physics_collision fulcrum_physics_clips fulcrum_physics_grasp fulcrum_physics_contact_model
    fulcrum_physics_tear fulcrum_physics_tissue
  HEADERS physics_node/clips physics_node/collision physics_node/contact_model physics_node/energy physics_node/grasp physics_node/implicit
    physics_node/pbd physics_node/simd physics_node/simulation physics_node/tear physics_node/tissue physics_node/xpbd)
fulcrum_component(thermal
  TARGETS fulcrum_thermal_coupling fulcrum_thermal_potential fulcrum_thermal_damage fulcrum_thermal_volume
    fulcrum_thermal_arrhenius fulcrum_thermal_heat fulcrum_thermal_topology fulcrum_thermal_paper
  HEADERS thermal_node/coupling thermal_node/damage thermal_node/heat thermal_node/paper thermal_node/potential
    thermal_node/protected thermal_node/topology thermal_node/volume)
fulcrum_component(servo
  TARGETS fulcrum_haptics_servo
  HEADERS haptics_node/device haptics_node/kinematics haptics_node/servo)
fulcrum_component(recording TARGETS fulcrum_recording HEADERS services/records/recording)

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/FulcrumConfig.cmake.in FulcrumConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(FulcrumConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/FulcrumConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/FulcrumConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT development)
