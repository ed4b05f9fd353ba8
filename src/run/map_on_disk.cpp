#include "map_on_disk.hpp"

#include "dynains/dyna_ins_remover.hpp"

namespace dynains {

template class BasicDynaInsRemover<program::StagesWithMapOnDisk>;

namespace program {

RemoverWithMapOnDisk::Config with_map_on_disk(const DynaInsRemover::Config& config,
                                              const std::filesystem::path& folder,
                                              double megabytes) {
  RemoverWithMapOnDisk::Config result;
  static_cast<RemoverConfig&>(result) = static_cast<const RemoverConfig&>(config);
  result.ground = config.ground;
  result.clusterer = config.clusterer;
  result.descriptor = config.descriptor;
  result.belief = config.belief;
  result.evidence = config.evidence;
  result.map.map_voxel = config.map.map_voxel;
  result.map.map_memory = megabytes;
  result.map.map_folder = folder;
  result.validate();
  return result;
}

}  // namespace program

}  // namespace dynains
