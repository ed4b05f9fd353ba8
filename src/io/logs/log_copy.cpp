#include "log_copy.hpp"

#include <cstdint>
#include <limits>
#include <vector>

#include "../failure.hpp"
#include "log_scans.hpp"
#include "mcap_writer.hpp"

namespace dynains {

void copy_log(LogFile& log, const std::filesystem::path& target, const EditMessage& edit) {
  if (log.topics().size() > std::numeric_limits<std::uint16_t>::max()) {
    fail(log.path(), "expected at most 65535 topics, for MCAP has no more");
  }
  McapWriter writer(target, log.profile(), McapWriter::Compression::kZstd);
  std::vector<std::uint16_t> channels;
  for (const LogTopic& topic : log.topics()) channels.push_back(writer.add_channel(topic));
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint8_t> spare;
  for (const LogMessage& message : log.messages()) {
    const MessageStamp stamp = log.read(message, bytes);
    const SerialisedMessage serialised =
        unpacked(log, log.topics()[message.topic], message.time, bytes, spare);
    const std::optional<std::string> edited = edit(message, serialised);
    const auto* const data = reinterpret_cast<const char*>(serialised.data);
    writer.write(channels[message.topic], message.time, stamp,
                 edited ? Span<const char>(edited->data(), edited->size())
                        : Span<const char>(data, serialised.size));
  }
  log.copy_others(writer);
  writer.commit();
}

}  // namespace dynains
