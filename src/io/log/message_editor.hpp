// Changes of messages while a log is copied.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "log_file.hpp"

namespace dynains {

class MessageEditor {
 public:
  virtual ~MessageEditor() = default;

  /// Called now and then. May throw to end the copy.
  virtual void pause() = 0;
  /// Whether the message at `place` (time, part, block and offset) is replaced. Called for every
  /// message.
  virtual bool changes(const LogMessage& place) = 0;
  /// The message that replaces `message`, for which changes() is true.
  virtual std::string edited(const LogMessage& place, const std::vector<std::uint8_t>& message) = 0;
};

/// Calls `write(data, size)` with the message, or with the one that replaces it.
template <class Write>
void write_edited(MessageEditor& editor, const LogMessage& place, const std::uint8_t* data,
                  std::size_t size, Write&& write) {
  editor.pause();
  if (!editor.changes(place)) {
    write(reinterpret_cast<const char*>(data), size);
    return;
  }
  const std::string edited = editor.edited(place, std::vector<std::uint8_t>(data, data + size));
  write(edited.data(), edited.size());
}

}  // namespace dynains
