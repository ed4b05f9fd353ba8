#include "dynains/io/point_records.hpp"

namespace dynains {
namespace {

template <class T>
char* put(const T& value, char* to) {
  std::memcpy(to, &value, sizeof(T));
  return to + sizeof(T);
}

}  // namespace

PointRecords::PointRecords(const PointColumns& columns, bool is_pcd)
    : columns_(columns), is_pcd_(is_pcd) {
  const auto bytes_of = [](bool has_column, std::size_t bytes) { return has_column ? bytes : 0; };
  record_size_ = 3 * (columns.double_xyz ? sizeof(double) : sizeof(float)) +
                 bytes_of(columns.intensity, sizeof(float)) +
                 bytes_of(columns.rgb, is_pcd ? sizeof(std::uint32_t) : 3) +
                 bytes_of(columns.label, sizeof(std::uint32_t)) +
                 bytes_of(columns.ring, sizeof(std::uint16_t)) +
                 bytes_of(columns.time, sizeof(double)) +
                 bytes_of(columns.session, sizeof(std::uint16_t));
}

void PointRecords::add(const FilePoint& point) {
  bytes_.resize(bytes_.size() + record_size_);
  char* to = bytes_.data() + bytes_.size() - record_size_;
  for (Eigen::Index i = 0; i < 3; ++i) {
    to = columns_.double_xyz ? put(point.position[i], to)
                             : put(static_cast<float>(point.position[i]), to);
  }
  if (columns_.intensity) to = put(point.intensity, to);
  if (columns_.rgb) {
    to =
        is_pcd_
            ? put(static_cast<std::uint32_t>(point.rgb[0] << 16 | point.rgb[1] << 8 | point.rgb[2]),
                  to)
            : put(point.rgb, to);
  }
  if (columns_.label) to = put(point.label, to);
  if (columns_.ring) to = put(point.ring, to);
  if (columns_.time) to = put(point.time, to);
  if (columns_.session) put(point.session, to);
}

}  // namespace dynains
