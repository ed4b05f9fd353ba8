// Log files for tests, with a choice of optional parts.
#pragma once

#include "io/logs/log_file.hpp"
#include "ros_writer.hpp"
#include "support/standard.hpp"

namespace dynains::test {

struct McapParts {
  bool chunks = true;
  bool message_index = true;
  bool summary = true;  ///< repeats schemas and channels at the end
  std::uint32_t checksum = 0;
  std::string compression;  ///< a name; "lz4" and "zstd" are written
};

struct LogChannel {
  std::string topic;
  std::string type;
  std::string encoding = "cdr";
};

inline const LogChannel kClouds = {"/points", "sensor_msgs/msg/PointCloud2"};
inline const LogChannel kTf = {"/tf", "tf2_msgs/msg/TFMessage"};
inline const LogChannel kStaticTf = {"/tf_static", "tf2_msgs/msg/TFMessage"};
inline const LogChannel kOdometry = {"/odom", "nav_msgs/msg/Odometry"};

struct WrittenMessage {
  std::uint16_t channel;
  std::uint64_t time;  ///< ns
  std::string data;
};

/// tf2_msgs/TFMessage with one transform, at its time (s).
inline WrittenMessage transform_at(std::uint16_t channel, double time, const std::string& parent,
                                   const std::string& child, const Eigen::Isometry3d& T,
                                   MessageEncoding encoding = MessageEncoding::kCdr) {
  return {channel, nanoseconds(time), transform(time, parent, child, T, encoding)};
}

/// nav_msgs/Odometry at its time (s).
inline WrittenMessage odometry_at(std::uint16_t channel, double time, const std::string& child,
                                  const Eigen::Isometry3d& T) {
  return {channel, nanoseconds(time), odometry(time, child, T)};
}

/// small_cloud() at its time (s).
inline WrittenMessage cloud_at(std::uint16_t channel, double time, const std::string& frame) {
  return {channel, nanoseconds(time), small_cloud(time, frame)};
}

/// Frames of lz4 and zstd can contain uncompressed bytes.
inline std::string compressed(const std::string& method, const std::string& bytes) {
  const auto size = static_cast<std::uint32_t>(bytes.size());
  if (method == "lz4") {
    return packed(std::string("\x04\x22\x4D\x18\x60\x40\x82", 7), size | 1U << 31U, bytes, 0U);
  }
  if (method == "zstd") {
    const std::uint32_t block = size << 3U | 1U;  // the last block, raw
    return packed(std::string("\x28\xB5\x2F\xFD\xA0", 5), size, packed(block).substr(0, 3), bytes);
  }
  return bytes;
}

inline std::string mcap_record(std::uint8_t opcode, const std::string& content) {
  return packed(opcode, std::uint64_t{content.size()}, content);
}

/// Schemas and channels; the id of a schema is that of its channel and 1.
inline std::string mcap_definitions(const std::vector<LogChannel>& channels) {
  std::string records;
  for (std::uint16_t i = 0; i < channels.size(); ++i) {
    const auto schema = static_cast<std::uint16_t>(i + 1);
    const auto& [topic, type, encoding] = channels[i];
    records += mcap_record(3, packed(schema, counted(type), counted("ros2msg"), counted("")));
    records += mcap_record(4, packed(i, schema, counted(topic), counted(encoding), counted("")));
  }
  return records;
}

inline std::string mcap_message(const WrittenMessage& message) {
  return mcap_record(5, packed(message.channel, 0U, message.time, message.time, message.data));
}

/// A chunk of `records` from `first` to `last` (ns); `content`: as compressed by the method.
inline std::string mcap_chunk_record(const std::string& records, const std::string& compression,
                                     const std::string& content, std::uint64_t first = 0,
                                     std::uint64_t last = 0, std::uint32_t checksum = 0) {
  return mcap_record(6, packed(first, last, std::uint64_t{records.size()}, checksum,
                               counted(compression), std::uint64_t{content.size()}, content));
}

/// A file of these records, with the header and the footer of a log of ROS 2.
inline std::string mcap_of(const std::string& records) {
  const std::string magic("\x89MCAP0\r\n", 8);
  return magic + mcap_record(1, counted("ros2") + counted("test")) + records +
         mcap_record(2, std::string(20, '\0')) + magic;
}

/// A chunk of `definitions` and `messages`, and its index.
inline std::string mcap_chunk(const std::string& definitions,
                              const std::vector<WrittenMessage>& messages, const McapParts& parts) {
  std::string records = definitions;
  std::string index;
  for (const WrittenMessage& message : messages) {
    index +=
        mcap_record(7, packed(message.channel, 16U, message.time, std::uint64_t{records.size()}));
    records += mcap_message(message);
  }
  const std::string chunk =
      mcap_chunk_record(records, parts.compression, compressed(parts.compression, records),
                        messages.front().time, messages.back().time, parts.checksum);
  return parts.message_index ? chunk + index : chunk;
}

/// An MCAP file with a chunk for every two messages.
inline std::string mcap_file(const std::vector<LogChannel>& channels,
                             const std::vector<WrittenMessage>& messages, const McapParts& parts) {
  const std::string definitions = mcap_definitions(channels);
  std::string file = parts.chunks ? "" : definitions;
  for (auto begin = messages.begin(); begin != messages.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(2, messages.end() - begin);
    if (parts.chunks) {
      file +=
          mcap_chunk(begin == messages.begin() ? definitions : std::string(), {begin, end}, parts);
    } else {
      for (auto message = begin; message != end; ++message) file += mcap_message(*message);
    }
    begin = end;
  }
  file += mcap_record(15, packed(0U));
  return mcap_of(parts.summary ? file + definitions : file);
}

struct BagParts {
  bool index = true;
  bool is_closed = true;  ///< place of the index in the header, and the index section
  std::string compression = "none";
};

/// A bag of ROS 1 with a chunk for every two messages.
inline std::string bag_file(const std::vector<LogChannel>& channels,
                            const std::vector<WrittenMessage>& messages, const BagParts& parts) {
  const auto field = [](const std::string& name, const std::string& value) {
    return counted(name + '=' + value);
  };
  const auto record = [&](std::uint8_t opcode, const std::string& fields, const std::string& data) {
    return counted(field("op", packed(opcode)) + fields) + counted(data);
  };
  const auto stamp = [&](std::uint64_t time) {
    return packed(static_cast<std::uint32_t>(time / 1000000000),
                  static_cast<std::uint32_t>(time % 1000000000));
  };
  std::string definitions;
  for (std::uint32_t i = 0; i < channels.size(); ++i) {
    definitions += record(7, field("conn", packed(i)) + field("topic", channels[i].topic),
                          field("topic", channels[i].topic) + field("type", channels[i].type) +
                              field("latching", "1") +
                              field("message_definition", "std_msgs/Header header\n"));
  }
  std::string chunks;
  std::string infos;
  std::uint32_t chunk_count = 0;
  for (std::size_t begin = 0; begin < messages.size(); begin += 2, ++chunk_count) {
    std::string records = begin == 0 ? definitions : std::string();
    std::string index;
    for (std::size_t i = begin; i < std::min(begin + 2, messages.size()); ++i) {
      const std::string connection = field("conn", packed(std::uint32_t{messages[i].channel}));
      const std::string time = stamp(messages[i].time);
      index += record(4, field("ver", packed(1U)) + connection + field("count", packed(1U)),
                      time + packed(static_cast<std::uint32_t>(records.size())));
      records += record(2, connection + field("time", time), messages[i].data);
    }
    chunks += record(5,
                     field("compression", parts.compression) +
                         field("size", packed(static_cast<std::uint32_t>(records.size()))),
                     compressed(parts.compression, records));
    if (parts.index) chunks += index;
    infos += record(6, field("ver", packed(1U)), "");
  }
  const std::uint64_t index_position = parts.is_closed ? 4096 : 0;
  std::string file =
      "#ROSBAG V2.0\n" +
      record(3,
             field("index_pos", packed(index_position)) + field("conn_count", packed(2U)) +
                 field("chunk_count", packed(parts.is_closed ? chunk_count : 0U)),
             std::string(200, ' '));
  file += chunks;
  return parts.is_closed ? file + definitions + infos : file;
}

using Message = std::pair<std::string, std::string>;  // topic, type and time; bytes

/// All messages of a whole log.
inline std::vector<Message> messages_of(const std::filesystem::path& path) {
  const auto log = open_log(path);
  if (log->early_end()) throw std::runtime_error(*log->early_end());
  std::vector<Message> messages;
  std::vector<std::uint8_t> bytes;
  for (const LogMessage& message : log->messages()) {
    log->read(message, bytes);
    const LogTopic& topic = log->topics()[message.topic];
    messages.emplace_back(topic.name + ' ' + topic.type + ' ' + std::to_string(message.time),
                          std::string(bytes.begin(), bytes.end()));
  }
  return messages;
}

}  // namespace dynains::test
