// DynaInsRemover with custom stages. This header requires the library dynains::remover, which
// contains the decision by free space. dyna_ins_remover.hpp requires no library.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/pipeline/pipeline.hpp"
#include "dynains/pose.hpp"

namespace dynains {

// Members are defined outside of the class, so that `extern template class` prevents the
// instantiation of the pipeline.

template <class Stages>
BasicDynaInsRemover<Stages>::BasicDynaInsRemover() : BasicDynaInsRemover(Config()) {}

template <class Stages>
BasicDynaInsRemover<Stages>::BasicDynaInsRemover(const Config& config)
    : pipeline_(std::make_unique<Pipeline>(config)) {}

template <class Stages>
BasicDynaInsRemover<Stages>::BasicDynaInsRemover(BasicDynaInsRemover&&) noexcept = default;

template <class Stages>
BasicDynaInsRemover<Stages>& BasicDynaInsRemover<Stages>::operator=(
    BasicDynaInsRemover&&) noexcept = default;

template <class Stages>
BasicDynaInsRemover<Stages>::~BasicDynaInsRemover() = default;

template <class Stages>
detail::Pipeline<Stages>& BasicDynaInsRemover<Stages>::pipeline() const {
  if (pipeline_ == nullptr) throw UsageError("this remover was moved from");
  return *pipeline_;
}

template <class Stages>
const PipelineConfig<Stages>& BasicDynaInsRemover<Stages>::config() const {
  return pipeline().config();
}

template <class Stages>
const typename Stages::Map& BasicDynaInsRemover<Stages>::map() const {
  return pipeline().map();
}

template <class Stages>
std::size_t BasicDynaInsRemover<Stages>::latency() const {
  return pipeline().latency();
}

template <class Stages>
const SensorModel& BasicDynaInsRemover<Stages>::sensor() const {
  return pipeline().sensor();
}

template <class Stages>
void BasicDynaInsRemover<Stages>::reserve_view(const detail::CloudView& example,
                                               std::size_t scans) {
  const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
  pipeline().reserve_like(example, scans);
}

template <class Stages>
FrameResult BasicDynaInsRemover<Stages>::push_view(const detail::CloudView& cloud,
                                                   const Pose& T_world_sensor,
                                                   std::optional<double> time) {
  const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
  return pipeline().push(cloud, T_world_sensor, time.value_or(pipeline().next_time()));
}

template <class Stages>
std::optional<ScanVerdict> BasicDynaInsRemover<Stages>::finish_oldest() {
  return pipeline().finish_oldest();
}

template <class Stages>
void BasicDynaInsRemover<Stages>::begin_epoch() {
  pipeline().start_epoch();
}

template <class Stages>
void BasicDynaInsRemover<Stages>::reset() {
  const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
  pipeline().reset();
}

}  // namespace dynains
