// Clouds of logs with fewer points or one more field, all other bytes as they are.
#pragma once

#include <cstdint>
#include <string>

#include "dynains/points.hpp"
#include "ros_messages.hpp"

namespace dynains {

/// Whether with_labels() has a place for labels: in a PointCloud2.
bool can_have_labels(const std::string& type);

/// The cloud without the points whose `keep` is 0, in their order, with all their fields. A
/// PointCloud2 gets one row. Throws IoError that begins with the place of the message, also if
/// `keep` has not one value for each point.
std::string without_points(const std::string& type, const SerialisedMessage& cloud,
                           Span<const std::uint8_t> keep);

/// A PointCloud2 with `labels` as its last field, `label` of type uint8. A point takes four more
/// bytes, so that aligned fields stay aligned. Throws IoError as above, also if the cloud has a
/// field of that name.
std::string with_labels(const std::string& type, const SerialisedMessage& message,
                        Span<const std::uint8_t> labels);

}  // namespace dynains
