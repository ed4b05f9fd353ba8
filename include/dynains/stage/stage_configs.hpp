// Configurations of stages by the type of the stage. Those of the two largest default stages are
// known without their headers.
#pragma once

#include <type_traits>
#include <utility>

#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/ground_config.hpp"

namespace dynains {

class FreeSpaceEvidence;
class GroundSegmenter;

namespace detail {

template <class Stage>
struct ConfigOfStage {
  using type = typename Stage::Config;
};
template <>
struct ConfigOfStage<GroundSegmenter> {
  using type = GroundConfig;
};
template <>
struct ConfigOfStage<FreeSpaceEvidence> {
  using type = FreeSpaceConfig;
};
template <class Stage>
using ConfigOf = typename ConfigOfStage<Stage>::type;

/// Stages::Evidence, or FreeSpaceEvidence for sets of stages that name the paper's five only.
template <class Stages, class = void>
struct EvidenceOf {
  using type = FreeSpaceEvidence;
};
template <class Stages>
struct EvidenceOf<Stages, std::void_t<typename Stages::Evidence>> {
  using type = typename Stages::Evidence;
};

/// Whether `Operation<T>` is well-formed, for optional members of T.
template <template <class> class Operation, class T, class = void>
struct Offers : std::false_type {};
template <template <class> class Operation, class T>
struct Offers<Operation, T, std::void_t<Operation<T>>> : std::true_type {};

/// Scans from one reference of the evidence to the next; 1 without the member `reference_step`.
template <class Config>
using ReferenceStep = decltype(std::declval<Config&>().reference_step);
template <class Config>
int reference_step(const Config& config) {
  if constexpr (Offers<ReferenceStep, Config>::value) {
    return config.reference_step;
  } else {
    return 1;
  }
}

/// The paper's parameters of a stage; a stage without `Config::paper()` keeps its defaults.
template <class Config>
using Paper = decltype(Config::paper());
template <class Config>
Config paper_config() {
  if constexpr (Offers<Paper, Config>::value) {
    return Config::paper();
  } else {
    return Config();
  }
}

}  // namespace detail

}  // namespace dynains
