# Installation: headers, libraries, the CMake package BulletPenalty and the pkg-config modules bullet-penalty and
# bullet-penalty-float64. Everything may be moved after installation: all paths are relative to the files that hold them.
# The build directory is a package, too: find_package finds BulletPenalty there without installation.
option(BULLET_PENALTY_INSTALL "Install the libraries, headers and package files" ${PROJECT_IS_TOP_LEVEL})
if(NOT BULLET_PENALTY_INSTALL)
  return()
endif()

include(CMakePackageConfigHelpers)
set(penalty_package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/BulletPenalty)

# Each component is an export set of its own, so that find_package looks only for what the asked-for ones depend on.
set(penalty_components "")
foreach(pair core:penalty_core mesh:penalty_mesh surface:penalty_surface float:bullet_penalty float64:bullet_penalty-float64)
  string(REPLACE ":" ";" pair ${pair})
  list(GET pair 0 component)
  list(GET pair 1 target)
  if(TARGET ${target})
    list(APPEND penalty_components ${component})
    install(TARGETS ${target} EXPORT BulletPenalty_${component}
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  endif()
endforeach()
foreach(component IN LISTS penalty_components)
  install(EXPORT BulletPenalty_${component} FILE BulletPenalty_${component}.cmake NAMESPACE BulletPenalty::
          DESTINATION ${penalty_package_directory})
  export(EXPORT BulletPenalty_${component} FILE ${PROJECT_BINARY_DIR}/BulletPenalty_${component}.cmake
         NAMESPACE BulletPenalty::)
endforeach()

get_directory_property(penalty_assimp DIRECTORY ${PROJECT_SOURCE_DIR}/plugin/src/mesh DEFINITION penalty_assimp)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/BulletPenaltyConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/BulletPenaltyConfig.cmake
                              INSTALL_DESTINATION ${penalty_package_directory} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/BulletPenaltyConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/BulletPenaltyConfig.cmake ${PROJECT_BINARY_DIR}/BulletPenaltyConfigVersion.cmake
        DESTINATION ${penalty_package_directory})

install(DIRECTORY ${PROJECT_SOURCE_DIR}/plugin/include/penalty DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

# The way from the .pc file to the prefix; an absolute libdir or includedir has none and stays what it is.
if(IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR})
  set(penalty_pc_prefix ${CMAKE_INSTALL_PREFIX})
  set(penalty_pc_libdir ${CMAKE_INSTALL_LIBDIR})
else()
  file(RELATIVE_PATH penalty_pc_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
  string(REGEX REPLACE "/$" "" penalty_pc_prefix "\${pcfiledir}/${penalty_pc_prefix}")
  set(penalty_pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
endif()
if(IS_ABSOLUTE ${CMAKE_INSTALL_INCLUDEDIR})
  set(penalty_pc_includedir ${CMAKE_INSTALL_INCLUDEDIR})
else()
  set(penalty_pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
foreach(suffix "" "-float64")
  if(TARGET bullet_penalty${suffix})
    set(penalty_pc_suffix "${suffix}")
    configure_file(${CMAKE_CURRENT_LIST_DIR}/bullet-penalty.pc.in bullet-penalty${suffix}.pc @ONLY)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/bullet-penalty${suffix}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  endif()
endforeach()
