// Compile-time checks of the interfaces of stages, for one readable error message per stage.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/config.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

// Required members of stages, for Offers.
template <class Stage>
using ConfigInterface =
    std::void_t<typename Stage::Config, decltype(Stage(std::declval<typename Stage::Config>())),
                decltype(std::declval<typename Stage::Config>().validate())>;
template <class Stage>
using GroundInterface = decltype(std::declval<Stage&>().segment(
    PointsView(), Span<const std::uint32_t>(), std::declval<GroundSplit&>()));
template <class Stage>
using ClustererInterface = std::enable_if_t<
    std::is_convertible_v<decltype(std::declval<Stage&>().cluster(PolarView())),
                          Span<const std::uint32_t>> &&
    std::is_convertible_v<decltype(std::declval<Stage&>().cluster_count()), std::size_t>>;
template <class Stage>
using DescriptorInterface =
    std::void_t<decltype(std::declval<Stage&>().describe(std::declval<const ClusterView&>())),
                decltype(std::declval<Stage&>().describe_rest()),
                decltype(std::declval<Stage&>().heights(std::size_t{})),
                decltype(std::declval<Stage&>().cluster_heights(std::size_t{})),
                std::enable_if_t<std::is_convertible_v<
                    decltype(std::declval<Stage&>().proposes_dynamic()), bool>>>;
template <class Stage>
using BeliefInterface = std::void_t<
    decltype(std::declval<Stage&>().reset()),
    decltype(std::declval<Stage&>().update(Span<const float>(), Span<const float>())),
    std::enable_if_t<std::is_convertible_v<decltype(std::declval<Stage&>().posterior()), double> &&
                     std::is_convertible_v<decltype(std::declval<Stage&>().is_dynamic()), bool>>>;
template <class Stage>
using MapInterface =
    std::void_t<decltype(std::declval<Stage&>().insert(PointsView(), Span<const std::uint8_t>(),
                                                       std::declval<const Pose&>())),
                decltype(std::declval<Stage&>().clear())>;
/// Whether a class is a stage with the members of `Interface`.
template <class Stage, template <class> class Interface>
inline constexpr bool kIsStage =
    std::conjunction_v<Offers<ConfigInterface, Stage>, Offers<Interface, Stage>>;

// Optional members of stages, for Offers.
template <class Stage>
using NeedsSensor = decltype(std::declval<const Stage&>().needs_sensor());
template <class Stage>
using Adapt = decltype(std::declval<Stage&>().adapt(SensorModel()));

/// Whether a stage wants adapt(sensor).
template <class Stage>
bool needs_sensor(const Stage& stage) {
  if constexpr (Offers<NeedsSensor, Stage>::value) {
    return stage.needs_sensor();
  } else {
    return false;
  }
}
template <class Stage>
void adapt_stage(Stage& stage, const SensorModel& sensor) {
  if constexpr (Offers<Adapt, Stage>::value) stage.adapt(sensor);
}

}  // namespace dynains::detail
