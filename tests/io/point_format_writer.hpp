// Point files of LAS and NumPy for tests, byte by byte.
#pragma once

#include "ros_writer.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// An array of NumPy. `shape` as in the header, for example "(2, 3)".
inline std::string npy_file(const std::string& descr, const std::string& shape,
                            const std::string& data, const std::string& order = "False") {
  std::string header =
      "{'descr': " + descr + ", 'fortran_order': " + order + ", 'shape': " + shape + ", }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  return ByteWriter()
      .raw(std::string("\x93NUMPY\1\0", 8))
      .number(static_cast<std::uint16_t>(header.size()))
      .raw(header + data)
      .bytes();
}

struct LasParts {
  std::uint8_t minor = 2;
  std::uint8_t format = 1;
  std::string extra_bytes;  ///< descriptions, 192 bytes each
  std::uint16_t point_size = 28;
  std::uint32_t count = 1;
};

inline std::string extra_bytes(const std::string& name, std::uint8_t type) {
  return ByteWriter()
      .raw(std::string(2, '\0'))
      .number(type)
      .raw(std::string(1, '\0') + name + std::string(32 - name.size(), '\0'))
      .raw(std::string(156, '\0'))
      .bytes();
}

/// LAS with scale 0.01 and offset 100, 200, 300.
inline std::string las_file(const LasParts& parts, const std::string& points) {
  const std::uint16_t header_size = parts.minor < 4 ? 227 : 375;
  ByteWriter vlr;
  if (!parts.extra_bytes.empty()) {
    vlr.raw(std::string(2, '\0') + "LASF_Spec" + std::string(7, '\0'));
    vlr.number(std::uint16_t{4}).number(static_cast<std::uint16_t>(parts.extra_bytes.size()));
    vlr.raw(std::string(32, '\0') + parts.extra_bytes);
  }
  ByteWriter out;
  out.raw("LASF" + std::string(20, '\0')).number(std::uint8_t{1}).number(parts.minor);
  out.raw(std::string(68, '\0')).number(header_size);
  out.number(static_cast<std::uint32_t>(header_size + vlr.bytes().size()));
  out.number(parts.extra_bytes.empty() ? 0U : 1U).number(parts.format).number(parts.point_size);
  out.number(parts.minor < 4 ? parts.count : 0U).raw(std::string(20, '\0'));
  for (const double value : {0.01, 0.01, 0.01, 100.0, 200.0, 300.0}) out.number(value);
  out.raw(std::string(48, '\0'));
  if (parts.minor == 4) {
    out.raw(std::string(20, '\0')).number(std::uint64_t{parts.count}).raw(std::string(120, '\0'));
  }
  return out.raw(vlr.bytes() + points).bytes();
}

}  // namespace dynains::test
