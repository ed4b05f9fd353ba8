// A log written again as MCAP, with clouds that have fewer points or one more field.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "dynains/points.hpp"
#include "log_file.hpp"
#include "ros_messages.hpp"

namespace dynains {

/// Gives the message that replaces one of the log, nothing to keep it. May throw to end the copy.
using EditMessage =
    std::function<std::optional<std::string>(const LogMessage&, const SerialisedMessage&)>;

/// Writes all messages of a log in the order of their times, with their topics, definitions,
/// metadata and times, and the attachments and metadata of MCAP. A message that is compressed by
/// itself is written as it was before. A log that ends early is copied up to its end. `target`
/// (MCAP) appears whole or not at all. Memory does not grow with the messages. Throws IoError.
void copy_log(LogFile& log, const std::filesystem::path& target, const EditMessage& edit);

/// Whether with_labels() has a place for labels: in a PointCloud2.
bool can_have_labels(const std::string& type);

/// The cloud without the points whose `keep` is 0, in their order, with all their fields. A
/// PointCloud2 gets one row. Throws IoError that begins with the place of the message, also if
/// `keep` has not one value for each point.
std::string without_points(const std::string& type, const SerialisedMessage& message,
                           Span<const std::uint8_t> keep);

/// A PointCloud2 with `labels` as its last field, `label` of type uint8. A point takes four more
/// bytes, so that aligned fields stay aligned. Throws IoError as above, also if the cloud has a
/// field of that name.
std::string with_labels(const std::string& type, const SerialisedMessage& message,
                        Span<const std::uint8_t> labels);

}  // namespace dynains
