// A remover for drives whose map is larger than the memory.
#pragma once

#include <filesystem>

#include "dynains/dyna_ins_remover.hpp"
#include "dynains/io/tiled_map.hpp"

namespace dynains::program {

struct StagesWithMapOnDisk : DefaultStages {
  using Map = TiledStaticMap;
};
using RemoverWithMapOnDisk = BasicDynaInsRemover<StagesWithMapOnDisk>;

/// The same configuration with the map in `folder` and no more than `megabytes` of it in memory.
/// Throws ConfigError.
inline RemoverWithMapOnDisk::Config with_map_on_disk(const DynaInsRemover::Config& config,
                                                     const std::filesystem::path& folder,
                                                     double megabytes) {
  RemoverWithMapOnDisk::Config result;
  static_cast<RemoverConfig&>(result) = static_cast<const RemoverConfig&>(config);
  result.ground = config.ground;
  result.clusterer = config.clusterer;
  result.descriptor = config.descriptor;
  result.belief = config.belief;
  result.evidence = config.evidence;
  result.revision = config.revision;
  result.map.map_voxel = config.map.map_voxel;
  result.map.map_memory = megabytes;
  result.map.map_folder = folder;
  result.validate();
  return result;
}

}  // namespace dynains::program
