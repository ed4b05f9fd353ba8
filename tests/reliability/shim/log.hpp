// Format of the log that the shim writes, and a reader for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace dynains::shim {

enum class Event : std::uint8_t {
  kOpen,        ///< path is now descriptor; number: flags of open(2)
  kWrite,       ///< bytes at offset `number` of descriptor
  kRename,      ///< path to second
  kExchange,    ///< path and second
  kMakeFolder,  ///< path
  kRemove,      ///< path, a file or an empty folder
  kSync,        ///< descriptor
  kSyncAll,     ///< file system of descriptor
  kFault,       ///< a call on path was made to fail
};

/// One event; paths are absolute.
struct Entry {
  Event event;
  int descriptor = -1;
  std::int64_t number = 0;
  std::string path;
  std::string second;  ///< path, or the bytes written
};

/// Fixed part of an entry in the log; path and second follow.
struct EntryHeader {
  Event event;
  std::int32_t descriptor;
  std::int64_t number;
  std::uint32_t path_size;
  std::uint32_t second_size;
};

inline std::string to_bytes(const Entry& entry) {
  EntryHeader header = {};
  header.event = entry.event;
  header.descriptor = entry.descriptor;
  header.number = entry.number;
  header.path_size = static_cast<std::uint32_t>(entry.path.size());
  header.second_size = static_cast<std::uint32_t>(entry.second.size());
  return std::string(reinterpret_cast<const char*>(&header), sizeof(header)) + entry.path +
         entry.second;
}

inline std::vector<Entry> parse_log(const std::string& bytes) {
  std::vector<Entry> entries;
  for (std::size_t at = 0; at < bytes.size();) {
    EntryHeader header = {};
    if (bytes.size() - at < sizeof(header)) throw std::runtime_error("the log ends in an entry");
    std::memcpy(&header, bytes.data() + at, sizeof(header));
    at += sizeof(header);
    if (bytes.size() - at < std::size_t{header.path_size} + header.second_size) {
      throw std::runtime_error("the log ends in an entry");
    }
    entries.push_back({header.event, header.descriptor, header.number,
                       bytes.substr(at, header.path_size),
                       bytes.substr(at + header.path_size, header.second_size)});
    at += std::size_t{header.path_size} + header.second_size;
  }
  return entries;
}

}  // namespace dynains::shim
