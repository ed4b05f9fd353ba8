// All parameters of a remover: the facade's own and those of its stages.
#pragma once

#include <string>
#include <type_traits>

#include "dynains/errors.hpp"
#include "dynains/free_space_evidence.hpp"
#include "dynains/map/map_revision.hpp"
#include "dynains/pipeline/remover_config.hpp"
#include "dynains/stage/contracts.hpp"

namespace dynains {

/// `BasicDynaInsRemover<Stages>::Config`.
template <class Stages>
struct PipelineConfig : RemoverConfig {
  using Evidence = typename detail::EvidenceOf<Stages, FreeSpaceEvidence>::type;

  typename Stages::Ground::Config ground;
  typename Stages::Clusterer::Config clusterer;
  typename Stages::Descriptor::Config descriptor;
  typename Stages::Belief::Config belief;
  typename Evidence::Config evidence;
  typename Stages::Map::Config map;
  MapRevision::Config revision;

  /// The paper to the letter, with its parameters; voxels, cells and ground, which it gives no
  /// numbers for, are those of its public implementation. Ranges differ, see docs/algorithm.md.
  static PipelineConfig paper() {
    PipelineConfig config;
    static_cast<RemoverConfig&>(config) = RemoverConfig::paper();
    config.ground = detail::paper_config<typename Stages::Ground::Config>();
    config.clusterer = detail::paper_config<typename Stages::Clusterer::Config>();
    config.descriptor = detail::paper_config<typename Stages::Descriptor::Config>();
    config.belief = detail::paper_config<typename Stages::Belief::Config>();
    config.map = detail::paper_config<typename Stages::Map::Config>();
    return config;
  }

  /// Calls `visitor(name, config)` for the facade's own fields and for those of each stage.
  template <class Self, class Visitor>
  static void visit_sections(Self& self, Visitor&& visitor) {
    using Own = std::conditional_t<std::is_const_v<Self>, const RemoverConfig, RemoverConfig>;
    visitor("DynaInsRemover", static_cast<Own&>(self));
    visitor("GroundSegmenter", self.ground);
    visitor("CurvedVoxelClusterer", self.clusterer);
    visitor("OccupancyDescriptor", self.descriptor);
    visitor("BeliefUpdater", self.belief);
    visitor("FreeSpaceEvidence", self.evidence);
    visitor("StaticMapAccumulator", self.map);
    visitor("MapRevision", self.revision);
  }

  /// Calls `visitor` with the Parameter of every field; names are unique over all stages.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visit_sections(self, [&visitor](const char*, auto& section) {
      std::remove_const_t<std::remove_reference_t<decltype(section)>>::visit(section, visitor);
    });
  }

  /// Throws ConfigError.
  void validate() const {
    visit_sections(*this, [](const char*, const auto& section) { section.validate(); });
    if (!revision.revise_map) return;
    if (!use_free_space) {
      throw ConfigError("MapRevision.revise_map = true needs use_free_space = true");
    }
    if (!build_map) throw ConfigError("MapRevision.revise_map = true needs build_map = true");
    if (!detail::IsRevisable<typename Stages::Map, Evidence>::value) {
      throw ConfigError("MapRevision.revise_map = true needs a map that is kept in memory");
    }
    // A reference must not count twice.
    const int step = detail::reference_step(evidence);
    if (revision.revision_period < step) {
      throw ConfigError(
          "MapRevision.revision_period = " + std::to_string(revision.revision_period) +
          " must not be below FreeSpaceEvidence.reference_step = " + std::to_string(step));
    }
  }
};

}  // namespace dynains
