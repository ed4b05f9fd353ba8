#include "bag_writer.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "compress.hpp"

namespace dynains {
namespace {

constexpr std::size_t kBagChunkSize = std::size_t{1} << 22U;  // bytes, about
constexpr std::size_t kBagHeaderSize = 4096;                  // bytes, of its record
constexpr const char* kBagMagic = "#ROSBAG V2.0\n";

enum class BagOpcode : std::uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

template <class Number>
std::string raw(Number value) {
  std::string bytes(sizeof(value), '\0');
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}

std::string sized(const std::string& bytes) {
  return raw(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

std::string field(const char* name, const std::string& value) {
  return sized(std::string(name) + '=' + value);
}

std::string bag_record(BagOpcode opcode, const std::string& fields, const std::string& data) {
  return sized(field("op", raw(opcode)) + fields) + sized(data);
}

std::string bag_time(std::uint64_t time) {
  constexpr std::uint64_t kSecond = 1000000000;
  return raw(static_cast<std::uint32_t>(time / kSecond)) +
         raw(static_cast<std::uint32_t>(time % kSecond));
}

}  // namespace

BagWriter::BagWriter(const std::filesystem::path& path) : file_(path) {
  append(kBagMagic + file_header());
}

/// Has the same length for all values.
std::string BagWriter::file_header() const {
  const std::string fields =
      field("index_pos", raw(index_position_)) +
      field("conn_count", raw(static_cast<std::uint32_t>(connections_.size()))) +
      field("chunk_count", raw(chunk_count_));
  const std::size_t used = bag_record(BagOpcode::kFileHeader, fields, "").size();
  return bag_record(BagOpcode::kFileHeader, fields, std::string(kBagHeaderSize - used, ' '));
}

std::uint16_t BagWriter::add_channel(const std::string& topic, const MessageType& type) {
  const auto channel = static_cast<std::uint16_t>(connections_.size());
  define(channel,
         bag_record(BagOpcode::kConnection,
                    field("conn", raw(std::uint32_t{channel})) + field("topic", topic),
                    field("topic", topic) + field("type", type.name) + field("md5sum", type.md5) +
                        field("message_definition", type.definition(MessageEncoding::kRos1))));
  return channel;
}

void BagWriter::define(std::uint32_t connection, const std::string& record) {
  connections_[connection] = record;
  records_ += record;
}

void BagWriter::write(std::uint16_t channel, std::uint64_t time, const std::string& message) {
  write(channel, time, message.data(), message.size());
  if (records_.size() >= kBagChunkSize) finish_chunk("");
}

void BagWriter::write(std::uint32_t connection, std::uint64_t time, const char* data,
                      std::size_t size) {
  index_[connection].push_back({time, static_cast<std::uint32_t>(records_.size())});
  records_ += sized(field("op", raw(BagOpcode::kMessage)) + field("conn", raw(connection)) +
                    field("time", bag_time(time)));
  records_ += raw(static_cast<std::uint32_t>(size));
  records_.append(data, size);
}

void BagWriter::finish_chunk(const std::string& compression) {
  if (index_.empty()) return;
  const std::size_t size = records_.size();
  const std::uint64_t chunk = position_;
  append(bag_record(BagOpcode::kChunk,
                    field("compression", compression.empty() ? "none" : compression) +
                        field("size", raw(static_cast<std::uint32_t>(size))),
                    compress(compression, std::move(records_))));
  std::uint64_t first = index_.begin()->second.front().time;
  std::uint64_t last = first;
  std::string counts;
  for (const auto& [connection, entries] : index_) {
    const auto count = static_cast<std::uint32_t>(entries.size());
    std::string places;
    for (const Entry& entry : entries) {
      places += bag_time(entry.time) + raw(entry.offset);
      first = std::min(first, entry.time);
      last = std::max(last, entry.time);
    }
    append(bag_record(BagOpcode::kIndex,
                      field("ver", raw(std::uint32_t{1})) + field("conn", raw(connection)) +
                          field("count", raw(count)),
                      places));
    counts += raw(connection) + raw(count);
  }
  chunk_infos_ +=
      bag_record(BagOpcode::kChunkInfo,
                 field("ver", raw(std::uint32_t{1})) + field("chunk_pos", raw(chunk)) +
                     field("start_time", bag_time(first)) + field("end_time", bag_time(last)) +
                     field("count", raw(static_cast<std::uint32_t>(index_.size()))),
                 counts);
  ++chunk_count_;
  records_.clear();
  index_.clear();
}

void BagWriter::commit() {
  finish_chunk("");
  index_position_ = position_;
  for (const auto& [id, connection] : connections_) append(connection);
  append(chunk_infos_);
  file_.stream().seekp(static_cast<std::streamoff>(std::strlen(kBagMagic)));
  const std::string header = file_header();
  file_.stream().write(header.data(), static_cast<std::streamsize>(header.size()));
  file_.commit();
}

void BagWriter::append(const std::string& bytes) {
  file_.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

}  // namespace dynains
