# Every command and snippet of README.md is a test; blocks.sh says how it is marked. To be included by tests/CMakeLists.txt after
# package_tests.cmake, whose installed package the cmake blocks use.
set(penalty_readme ${PROJECT_SOURCE_DIR}/README.md)
set(penalty_blocks bash ${PROJECT_SOURCE_DIR}/tests/readme/blocks.sh ${penalty_readme})
set(penalty_readme_work ${CMAKE_CURRENT_BINARY_DIR}/readme)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${penalty_readme} ${PROJECT_SOURCE_DIR}/tests/readme/blocks.sh)

add_test(NAME readme.every_block_is_marked COMMAND ${penalty_blocks} check)

# The commands name the programs of both precisions.
function(readme_bash_test name)
  if(TARGET penalty-demo AND TARGET penalty-demo-float64)
    add_test(NAME readme.${name} COMMAND ${CMAKE_COMMAND} -E env
      "PATH=$<TARGET_FILE_DIR:penalty-demo>:$<TARGET_FILE_DIR:penalty-study>:$ENV{PATH}"
      ${penalty_blocks} run ${name} ${penalty_readme_work}/${name})
    set_tests_properties(readme.${name} PROPERTIES TIMEOUT 900)
  endif()
endfunction()

function(readme_cpp_test name line code)
  if(NOT code MATCHES "int main *\\(")
    string(APPEND code "\nint main() {}\n")
  endif()
  file(WRITE ${penalty_readme_work}/${name}.in "#line ${line} \"README.md\"\n${code}")
  configure_file(${penalty_readme_work}/${name}.in ${penalty_readme_work}/${name}.cpp COPYONLY)  # only if it changed
  foreach(suffix "" "-float64")
    if(TARGET bullet_penalty${suffix})
      add_executable(readme_${name}${suffix} ${penalty_readme_work}/${name}.cpp)
      target_link_libraries(readme_${name}${suffix} PRIVATE BulletPenalty::bullet_penalty${suffix})
      target_compile_options(readme_${name}${suffix} PRIVATE $<$<CONFIG:Release>:-O1>)  # as the tests: half the time
      if(TARGET BulletPenalty::surface)
        target_link_libraries(readme_${name}${suffix} PRIVATE BulletPenalty::surface)
      endif()
      add_test(NAME readme.${name}${suffix} COMMAND readme_${name}${suffix})
      set_tests_properties(readme.${name}${suffix} PROPERTIES TIMEOUT 300)
    endif()
  endforeach()
endfunction()

function(readme_cmake_test name code)
  if(TARGET bullet_penalty)  # what find_package asks for by default
    file(WRITE ${penalty_readme_work}/${name}/CMakeLists.txt
      "cmake_minimum_required(VERSION 3.22)\nproject(app LANGUAGES CXX)\n"
      "add_executable(app ${PROJECT_SOURCE_DIR}/tests/package/jelly_box.cpp)\n${code}")
    package_test(readme.${name} project -D PROJECT=${penalty_readme_work}/${name})
  endif()
endfunction()

execute_process(COMMAND ${penalty_blocks} list OUTPUT_VARIABLE blocks COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" blocks "${blocks}")
foreach(block IN LISTS blocks)
  string(REPLACE " " ";" block ${block})
  list(GET block 0 language)
  list(GET block 1 name)
  list(GET block 2 line)
  execute_process(COMMAND ${penalty_blocks} show ${name} OUTPUT_VARIABLE code COMMAND_ERROR_IS_FATAL ANY)
  if(language STREQUAL "bash")
    readme_bash_test(${name})
  elseif(language STREQUAL "cpp")
    readme_cpp_test(${name} ${line} "${code}")
  else()
    readme_cmake_test(${name} "${code}")
  endif()
endforeach()
