# Refuses includes that contradict the table of folders in docs/design.md. The headers on one line
# of the list below form a layer. A header may include headers of its own folder and of the layers
# that precede its own in the list.
set(layers
  "^((simd|threads)/.*|errors|median|points|pose|parameters|verdict|point_cloud_traits|version)\\.hpp$"
  "^voxels/"
  "^sensor/"
  "^(ground|clusters|belief)/"
  "^registration/"
  "^(descriptors|evidence)/"
  "^(map|recording)/"
  "^config\\.hpp$"
  "^pipeline/"
  "^(compiled_remover|dyna_ins_remover|own_stages)\\.hpp$"
  "^(adapters|io|evaluation|surfaces)/"
  "^(poses|odometry)/"
  "^city/")
# Classes of stages. They meet in the pipeline alone: a stage includes no other stage.
set(stages
  "/(ground_segmenter|curved_voxel_clusterer|occupancy_descriptor|belief_updater)\\.hpp$|/(free_space_evidence|static_map_accumulator)\\.hpp$")

# Number of the layer of a header, from 0.
function(find_layer header result)
  set(number 0)
  foreach(layer IN LISTS layers)
    if(header MATCHES "${layer}")
      set(${result} ${number} PARENT_SCOPE)
      return()
    endif()
    math(EXPR number "${number} + 1")
  endforeach()
  message(FATAL_ERROR "${header} belongs to no layer; add it to ${CMAKE_CURRENT_LIST_FILE} and "
                      "docs/design.md")
endfunction()

set(basic_layer 0)
set(stage_layers_end 7)
set(facade_layer 9)
set(upward "")
file(GLOB_RECURSE headers RELATIVE ${SOURCE_DIR}/include/dynains ${SOURCE_DIR}/include/dynains/*.hpp)
foreach(header IN LISTS headers)
  find_layer(${header} layer)
  get_filename_component(folder ${header} DIRECTORY)
  file(STRINGS ${SOURCE_DIR}/include/dynains/${header} includes REGEX "^#include \"dynains/")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"dynains/(.*)\"" "\\1" included ${include})
    find_layer(${included} included_layer)
    get_filename_component(included_folder ${included} DIRECTORY)
    if(layer LESS stage_layers_end AND included MATCHES "${stages}")
      list(APPEND upward "${header} includes the stage ${included}")
    elseif(included_layer LESS layer OR
       (included_layer EQUAL layer AND
        (layer EQUAL basic_layer OR layer EQUAL facade_layer OR
         (folder AND folder STREQUAL included_folder))))
      continue()
    else()
      list(APPEND upward "${header} includes ${included}")
    endif()
  endforeach()
endforeach()

list(LENGTH headers count)
if(count EQUAL 0)
  message(FATAL_ERROR "no headers found")
elseif(upward)
  string(REPLACE ";" "\n  " upward "${upward}")
  message(FATAL_ERROR "upward includes:\n  ${upward}")
endif()
message("${count} headers include no header of a higher layer")
