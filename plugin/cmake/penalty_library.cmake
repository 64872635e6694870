# penalty_library(TARGET EXPORT_NAME SOURCE...): a library of ours, static unless BUILD_SHARED_LIBS says otherwise.
# It is BulletPenalty::EXPORT_NAME to those who link it, here as well as from an installation.
function(penalty_library target export_name)
  add_library(${target} ${ARGN})
  add_library(BulletPenalty::${export_name} ALIAS ${target})
  # C++20 and every symbol visible, whatever the project around us has chosen for its own targets. Interfaces change with
  # the minor version.
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${export_name}
    CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET default
    VISIBILITY_INLINES_HIDDEN OFF
    POSITION_INDEPENDENT_CODE ON
    INSTALL_RPATH "$ORIGIN"  # our libraries find each other
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  # Most of the time that a source takes is Eigen's. No source may rely on it: builds with ccache go without.
  target_precompile_headers(${target} PRIVATE <Eigen/Eigenvalues> <Eigen/Geometry> <Eigen/LU> <algorithm> <array> <map>
                            <memory> <span> <stdexcept> <string> <vector>)
  # By value, not by linking: who uses the library need not know of them.
  target_compile_options(${target} PRIVATE $<TARGET_PROPERTY:penalty_warnings,INTERFACE_COMPILE_OPTIONS>)
endfunction()
