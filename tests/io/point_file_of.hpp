// What the reader of point files says about some content.
#pragma once

#include "dynains/io/point_file.hpp"
#include "files.hpp"
#include "support/catch.hpp"

namespace dynains::test {

/// The points of a file with this content; its header must announce them.
inline PointFile read_file_of(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  write_text(folder / name, content);
  PointFile points = read_points(folder / name);
  const PointFileHeader header = read_point_file_header(folder / name);
  CHECK(header.point_count == points.positions.size());
  if (points.positions.empty()) return points;
  CHECK(header.columns.intensity == !points.intensity.empty());
  CHECK(header.columns.ring == !points.ring.empty());
  CHECK(header.columns.time == !points.time.empty());
  CHECK(header.columns.label == !points.label.empty());
  return points;
}

/// The message, which begins with the path, that refuses a file with this content.
inline std::string refusal_of(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  write_text(folder / name, content);
  const std::string text = message_of<IoError>([&] { read_points(folder / name); });
  CHECK_THAT(text, StartsWith((folder / name).string()));
  return text;
}

}  // namespace dynains::test
