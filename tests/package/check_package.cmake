# One step of the package tests, run by CTest as `cmake -D STEP=... -P check_package.cmake`; package_tests.cmake gives the
# other variables.
cmake_minimum_required(VERSION 3.22)
string(REPLACE "," ";" PRECISIONS "${PRECISIONS}")
string(REPLACE "," ";" COMPONENTS "${COMPONENTS}")
set(prefix ${WORK}/prefix)
set(scratch ${WORK}/${NAME})
set(toolchain -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=${BUILD_TYPE} -D CMAKE_CXX_FLAGS=${FLAGS})

function(run)
  list(JOIN ARGN " " line)
  message(STATUS "${line}")
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "status ${status} from: ${line}")
  endif()
endfunction()

function(run_programs directory)
  foreach(precision IN LISTS PRECISIONS)
    if(precision STREQUAL "float")
      run(${directory}/jelly_box)
    else()
      run(${directory}/jelly_box-${precision})
    endif()
  endforeach()
endfunction()

# Configures, builds and runs tests/package against the package at `place`, a prefix or a build directory.
function(use_package place)
  set(only "")
  list(LENGTH PRECISIONS count)
  if(count EQUAL 1)  # else the project's own default: both
    set(only -D PRECISIONS=${PRECISIONS})
  endif()
  run(${CMAKE_COMMAND} ${toolchain} -D CMAKE_PREFIX_PATH=${place} ${only} -S ${SOURCE}/tests/package -B ${scratch})
  run(${CMAKE_COMMAND} --build ${scratch})
  run_programs(${scratch})
endfunction()

# A project that asks for COMPONENTS and links them all.
function(configure_with_components)
  list(JOIN COMPONENTS " " components)
  list(TRANSFORM COMPONENTS PREPEND "BulletPenalty::" OUTPUT_VARIABLE targets)
  list(JOIN targets " " targets)
  file(WRITE ${scratch}/CMakeLists.txt
    "cmake_minimum_required(VERSION 3.22)\nproject(stretched_box LANGUAGES CXX)\n"
    "find_package(BulletPenalty 0.2 REQUIRED COMPONENTS ${components})\n"
    "add_executable(stretched_box ${SOURCE}/tests/package/stretched_box.cpp)\n"
    "target_link_libraries(stretched_box PRIVATE ${targets})\n")
  execute_process(COMMAND ${CMAKE_COMMAND} ${toolchain} -D CMAKE_PREFIX_PATH=${prefix} -S ${scratch} -B ${scratch}/build
                  RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  set(status ${status} PARENT_SCOPE)
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${scratch})
if(STEP STREQUAL "install")
  file(REMOVE_RECURSE ${prefix})
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${scratch})
  file(RENAME ${scratch} ${prefix})
elseif(STEP STREQUAL "find_package")
  use_package(${prefix})
elseif(STEP STREQUAL "build_tree")
  use_package(${BUILD})
elseif(STEP STREQUAL "subproject")
  # Part of a project of other habits, which fetches us, wants shared libraries and compiles each from a single source, perhaps by
  # another compiler; and the installation of those.
  list(GET PRECISIONS 0 PRECISIONS)  # the whole library is compiled again: one precision, and not optimised
  set(module bullet)
  set(target bullet_penalty)
  if(PRECISIONS STREQUAL "float64")
    set(module bullet-float64)
    set(target bullet_penalty-float64)
  endif()
  # Bullet as on systems where it names two include directories.
  find_program(pkg_config NAMES pkg-config pkgconf REQUIRED)
  foreach(part cflags libs modversion)
    execute_process(COMMAND ${pkg_config} --${part} ${module} OUTPUT_VARIABLE ${part} OUTPUT_STRIP_TRAILING_WHITESPACE
                    COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  file(MAKE_DIRECTORY ${scratch}/second)
  file(WRITE ${scratch}/${module}.pc
    "Name: Bullet\nDescription: with a second include directory\nVersion: ${modversion}\n"
    "Cflags: -I${scratch}/second ${cflags}\nLibs: ${libs}\n")
  set(ENV{PKG_CONFIG_PATH} ${scratch}:$ENV{PKG_CONFIG_PATH})
  set(name jelly_box)
  if(NOT PRECISIONS STREQUAL "float")
    set(name jelly_box-${PRECISIONS})
  endif()
  file(WRITE ${scratch}/CMakeLists.txt
    "cmake_minimum_required(VERSION 3.22)\nproject(jelly_box LANGUAGES CXX)\n"
    "set(CMAKE_CXX_STANDARD 17)\nset(CMAKE_CXX_VISIBILITY_PRESET hidden)\n"
    "set(CMAKE_UNITY_BUILD ON)\nset(CMAKE_UNITY_BUILD_BATCH_SIZE 0)\n"
    "include(FetchContent)\nFetchContent_Declare(BulletPenalty SOURCE_DIR ${SOURCE})\n"
    "FetchContent_MakeAvailable(BulletPenalty)\n"
    "if(CMAKE_BUILD_TYPE)\n  message(FATAL_ERROR \"BulletPenalty has chosen a build type for us\")\nendif()\n"
    "add_executable(${name} ${SOURCE}/tests/package/jelly_box.cpp)\n"
    "target_link_libraries(${name} PRIVATE BulletPenalty::${target})\n")
  run(${CMAKE_COMMAND} -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER} -D "CMAKE_CXX_FLAGS=${FLAGS} -O0"
      -D CMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -D CMAKE_INSTALL_LIBDIR=${LIBDIR} -D BUILD_SHARED_LIBS=ON
      -D BULLET_PENALTY_INSTALL=ON -D BULLET_PENALTY_PRECISIONS=${PRECISIONS} -S ${scratch} -B ${scratch}/build)
  if(EXISTS ${scratch}/build/compile_commands.json)
    message(FATAL_ERROR "BulletPenalty has asked for compile commands on behalf of the project around it")
  endif()
  run(${CMAKE_COMMAND} --build ${scratch}/build)
  run_programs(${scratch}/build)
  run(${CMAKE_COMMAND} --install ${scratch}/build --prefix ${scratch}/first)
  file(RENAME ${scratch}/first ${scratch}/prefix)
  file(REMOVE_RECURSE ${scratch}/build)
  file(GLOB archives ${scratch}/prefix/${LIBDIR}/*.a)
  if(archives)
    message(FATAL_ERROR "BUILD_SHARED_LIBS left static libraries: ${archives}")
  endif()
  set(place ${scratch}/prefix)
  set(scratch ${scratch}/stranger)
  use_package(${place})
elseif(STEP STREQUAL "pkg_config")
  find_program(pkg_config NAMES pkg-config pkgconf REQUIRED)
  set(module bullet-penalty)
  if(PRECISION STREQUAL "float64")
    set(module bullet-penalty-float64)
  endif()
  set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
  execute_process(COMMAND ${pkg_config} --cflags --libs ${module} OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags NATIVE_COMMAND "${flags}")
  separate_arguments(build_flags NATIVE_COMMAND "${FLAGS}")
  file(MAKE_DIRECTORY ${scratch})
  run(${COMPILER} -std=c++20 -O1 ${build_flags} ${SOURCE}/tests/package/jelly_box.cpp -o ${scratch}/jelly_box ${flags})
  run(${scratch}/jelly_box)
elseif(STEP STREQUAL "project")
  run(${CMAKE_COMMAND} ${toolchain} -D CMAKE_PREFIX_PATH=${prefix} -S ${PROJECT} -B ${scratch})
  run(${CMAKE_COMMAND} --build ${scratch})
elseif(STEP STREQUAL "accepted")
  configure_with_components()
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "components ${COMPONENTS} were refused:\n${output}")
  endif()
  run(${CMAKE_COMMAND} --build ${scratch}/build)
  run(${scratch}/build/stretched_box)
elseif(STEP STREQUAL "refused")
  configure_with_components()
  string(REGEX REPLACE "[ \n]+" " " words "${output}")  # CMake breaks the message into lines
  if(status EQUAL 0)
    message(FATAL_ERROR "components ${COMPONENTS} were accepted:\n${output}")
  endif()
  string(FIND "${words}" "${MESSAGE}" place)
  if(place EQUAL -1)
    message(FATAL_ERROR "refused, but not with \"${MESSAGE}\":\n${output}")
  endif()
else()
  message(FATAL_ERROR "unknown STEP '${STEP}'")
endif()
