// A log written again as MCAP, with other messages.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

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

}  // namespace dynains
