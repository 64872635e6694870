# Tests of the installed package, to be included by tests/CMakeLists.txt. The tree is installed into a temporary prefix, which is
# then moved: whatever still points to the first place fails.
set(penalty_package_work ${CMAKE_CURRENT_BINARY_DIR}/package)
set(penalty_precisions "")
foreach(precision float float64)
  if(precision IN_LIST BULLET_PENALTY_PRECISIONS)
    list(APPEND penalty_precisions ${precision})
  endif()
endforeach()

# package_test(NAME STEP ARGUMENT...): runs one step of check_package.cmake.
function(package_test name step)
  if(NOT BULLET_PENALTY_INSTALL)
    return()
  endif()
  list(JOIN penalty_precisions "," precisions)
  add_test(NAME package.${name} COMMAND ${CMAKE_COMMAND}
    -D STEP=${step} -D BUILD=${PROJECT_BINARY_DIR} -D SOURCE=${PROJECT_SOURCE_DIR} -D WORK=${penalty_package_work}
    -D NAME=${name} -D PRECISIONS=${precisions} -D GENERATOR=${CMAKE_GENERATOR} -D COMPILER=${CMAKE_CXX_COMPILER}
    -D BUILD_TYPE=${CMAKE_BUILD_TYPE} -D FLAGS=${CMAKE_CXX_FLAGS} -D LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
    -D LIBDIR=${CMAKE_INSTALL_LIBDIR} ${ARGN}
    -P ${PROJECT_SOURCE_DIR}/tests/package/check_package.cmake)
  set_tests_properties(package.${name} PROPERTIES TIMEOUT 900)
  if(NOT step STREQUAL "install" AND NOT step MATCHES "^(subproject|build_tree)$")
    set_tests_properties(package.${name} PROPERTIES FIXTURES_REQUIRED installed_package)
  endif()
endfunction()

package_test(install install)
if(TEST package.install)
  set_tests_properties(package.install PROPERTIES FIXTURES_SETUP installed_package)
endif()
package_test(find_package find_package)
package_test(build_tree build_tree)
# Compiles the library once more: by clang, which takes a third of GCC's time for it, where it is there and understands the flags.
find_program(BULLET_PENALTY_CLANG clang++)
mark_as_advanced(BULLET_PENALTY_CLANG)
set(penalty_compiler "")
if(BULLET_PENALTY_CLANG AND NOT CMAKE_CXX_FLAGS)
  set(penalty_compiler -D COMPILER=${BULLET_PENALTY_CLANG})
endif()
package_test(subproject subproject ${penalty_compiler})
if(TEST package.subproject)
  set_tests_properties(package.subproject PROPERTIES TIMEOUT 2700 COST 1000)  # begins first
endif()
foreach(precision IN LISTS penalty_precisions)
  package_test(pkg_config_${precision} pkg_config -D PRECISION=${precision})
endforeach()

# What find_package says when it cannot deliver.
package_test(unknown_component refused -D "COMPONENTS=float32" -D "MESSAGE=no component 'float32'")
if(NOT TARGET penalty_surface)
  package_test(missing_surface refused -D "COMPONENTS=surface" -D "MESSAGE=built without the component 'surface'")
else()
  package_test(all_components accepted -D "COMPONENTS=core,mesh,surface")
endif()
foreach(precision float float64)
  if(NOT precision IN_LIST penalty_precisions)
    package_test(missing_${precision} refused -D "COMPONENTS=${precision}"
                 -D "MESSAGE=built without the component '${precision}'")
  endif()
endforeach()

# What applications include leaves the insides of the solver alone: they cost each of their sources time to compile.
if(TARGET bullet_penalty)
  add_test(NAME package.headers COMMAND ${CMAKE_COMMAND} -D COMPILER=${CMAKE_CXX_COMPILER}
    -D "INCLUDES=$<TARGET_PROPERTY:bullet_penalty,INCLUDE_DIRECTORIES>"
    -P ${PROJECT_SOURCE_DIR}/tests/package/check_headers.cmake)
endif()
