# How this project builds its own targets. Nothing here reaches a consumer.

# Strict warnings, and no fused multiply-add: the same bits from every compiler.
function(dynains_own_target target)
  target_compile_features(${target} PRIVATE cxx_std_17)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -ffp-contract=off
    $<$<BOOL:${DYNAINS_WARNINGS_AS_ERRORS}>:-Werror>)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()

# A compiled component: library dynains_<name>, alias and export name dynains::<name>.
function(dynains_component name)
  add_library(dynains_${name} ${ARGN})
  add_library(dynains::${name} ALIAS dynains_${name})
  set_target_properties(dynains_${name} PROPERTIES
    EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(dynains_${name} PUBLIC dynains)
  dynains_own_target(dynains_${name})
  set_property(GLOBAL APPEND PROPERTY DYNAINS_COMPONENTS ${name})
endfunction()
