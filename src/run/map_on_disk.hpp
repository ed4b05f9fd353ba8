// A remover for drives whose map is larger than the memory.
#pragma once

#include <filesystem>

#include "dynains/compiled_remover.hpp"
#include "dynains/io/tiled_map.hpp"

namespace dynains::program {

struct StagesWithMapOnDisk : DefaultStages {
  using Map = TiledStaticMap;
};
using RemoverWithMapOnDisk = BasicDynaInsRemover<StagesWithMapOnDisk>;

/// The configuration with the map in `folder` and no more than `megabytes` of it in memory.
/// Throws ConfigError.
RemoverWithMapOnDisk::Config with_map_on_disk(const DynaInsRemover::Config& config,
                                              const std::filesystem::path& folder,
                                              double megabytes);

}  // namespace dynains::program

extern template class dynains::BasicDynaInsRemover<dynains::program::StagesWithMapOnDisk>;
