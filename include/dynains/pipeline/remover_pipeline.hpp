// The interface by which the facade calls the pipeline.
#pragma once

#include <cstddef>
#include <optional>

#include "dynains/config.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Implementation of BasicDynaInsRemover, with the same calls and errors. An interface, so that
/// files that use a compiled remover include no stages.
template <class Stages>
class RemoverPipeline {
 public:
  virtual ~RemoverPipeline() = default;
  virtual const PipelineConfig<Stages>& config() const = 0;
  virtual const typename Stages::Map& map() const = 0;
  virtual std::size_t latency() const = 0;
  virtual const SensorModel& sensor() const = 0;
  virtual FrameResult push(const CloudView& cloud, const Pose& T_world_sensor,
                           std::optional<double> time) = 0;
  /// Makes the verdict on the oldest open scan final. Empty if no scan is open.
  virtual std::optional<ScanVerdict> finish_oldest() = 0;
  virtual void start_epoch() = 0;
  virtual void reserve_like(const CloudView& example, std::size_t scans) = 0;
  virtual void reset() = 0;
};

}  // namespace dynains::detail
