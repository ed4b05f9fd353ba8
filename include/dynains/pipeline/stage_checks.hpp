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
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

template <class Stage, class = void>
struct IsConfigurable : std::false_type {};
template <class Stage>
struct IsConfigurable<
    Stage,
    std::void_t<typename Stage::Config, decltype(Stage(std::declval<typename Stage::Config>())),
                decltype(std::declval<typename Stage::Config>().validate())>> : std::true_type {};

template <class Stage, class = void>
struct IsGround : std::false_type {};
template <class Stage>
struct IsGround<Stage,
                std::void_t<decltype(std::declval<Stage&>().segment(
                    PointsView(), Span<const std::uint32_t>(), std::declval<GroundSplit&>()))>>
    : std::true_type {};

template <class Stage, class = void>
struct IsClusterer : std::false_type {};
template <class Stage>
struct IsClusterer<
    Stage,
    std::enable_if_t<
        std::is_convertible_v<decltype(std::declval<Stage&>().cluster(PolarView())),
                              Span<const std::uint32_t>> &&
        std::is_convertible_v<decltype(std::declval<Stage&>().cluster_count()), std::size_t>>>
    : std::true_type {};

template <class Stage, class = void>
struct IsDescriptor : std::false_type {};
template <class Stage>
struct IsDescriptor<
    Stage,
    std::void_t<decltype(std::declval<Stage&>().describe(std::declval<const ClusterView&>())),
                decltype(std::declval<Stage&>().describe_rest()),
                decltype(std::declval<Stage&>().heights(std::size_t{})),
                decltype(std::declval<Stage&>().cluster_heights(std::size_t{})),
                std::enable_if_t<std::is_convertible_v<
                    decltype(std::declval<Stage&>().proposes_dynamic()), bool>>>> : std::true_type {
};

template <class Stage, class = void>
struct IsBelief : std::false_type {};
template <class Stage>
struct IsBelief<
    Stage,
    std::void_t<decltype(std::declval<Stage&>().reset()),
                decltype(std::declval<Stage&>().update(Span<const float>(), Span<const float>())),
                std::enable_if_t<
                    std::is_convertible_v<decltype(std::declval<Stage&>().posterior()), double> &&
                    std::is_convertible_v<decltype(std::declval<Stage&>().is_dynamic()), bool>>>>
    : std::true_type {};

/// Required: observe(scan, epoch, T_world_sensor, split, instance_of, instance_count), called in
/// the order of scans, of which only those of one epoch are compared; judge(scan, is_final);
/// verdict(is_final, split).
template <class Stage, class = void>
struct IsEvidence : std::false_type {};
template <class Stage>
struct IsEvidence<
    Stage, std::void_t<
               decltype(std::declval<Stage&>().adapt(SensorModel())),
               decltype(std::declval<Stage&>().observe(
                   std::uint64_t{}, std::uint64_t{}, std::declval<const Pose&>(),
                   std::declval<const GroundSplit&>(), Span<const std::uint32_t>(), std::size_t{})),
               decltype(std::declval<Stage&>().make_reference(std::declval<const GroundSplit&>())),
               decltype(std::declval<Stage&>().judge(std::uint64_t{}, bool{})),
               std::enable_if_t<
                   std::is_convertible_v<decltype(std::declval<Stage&>().verdict(
                                             bool{}, std::declval<const GroundSplit&>())),
                                         EvidenceVerdict> &&
                   std::is_convertible_v<decltype(std::declval<const Stage&>().lookahead_scans()),
                                         std::size_t> &&
                   std::is_convertible_v<decltype(std::declval<const Stage&>().predecessors()),
                                         Span<const std::uint32_t>>>>> : std::true_type {};

template <class Stage, class = void>
struct IsMap : std::false_type {};
template <class Stage>
struct IsMap<
    Stage, std::void_t<decltype(std::declval<Stage&>().insert(
                           PointsView(), Span<const std::uint8_t>(), std::declval<const Pose&>())),
                       decltype(std::declval<Stage&>().clear())>> : std::true_type {};

// Optional members of stages, for Offers.
template <class Stage>
using NeedsSensor = decltype(std::declval<const Stage&>().needs_sensor());
template <class Stage>
using Adapt = decltype(std::declval<Stage&>().adapt(SensorModel()));
template <class Stage>
using Reserve = decltype(std::declval<Stage&>().reserve(std::size_t{}));
template <class Stage>
using SetTime = decltype(std::declval<Stage&>().set_time(0.0));
template <class Stage>
using ShareWork = decltype(std::declval<Stage&>().share_work(std::declval<Background*>()));
template <class Stage>
using HasPoseResidual = decltype(std::declval<const Stage&>().pose_residual());
template <class Stage>
using HasMisfit = decltype(std::declval<const Stage&>().misfit());
template <class Stage>
using HasSurfaces = decltype(std::declval<const Stage&>().surfaces());

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
