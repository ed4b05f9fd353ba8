// Point files of LAS and NumPy for tests, byte by byte.
#pragma once

#include "files.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline std::string zeros(std::size_t count) { return std::string(count, '\0'); }

/// An array of NumPy. `shape` as in the header, for example "(2, 3)".
inline std::string npy_file(const std::string& descr, const std::string& shape,
                            const std::string& data, const std::string& order = "False") {
  std::string header =
      "{'descr': " + descr + ", 'fortran_order': " + order + ", 'shape': " + shape + ", }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  return packed(std::string("\x93NUMPY\1\0", 8), static_cast<std::uint16_t>(header.size()), header,
                data);
}

struct LasParts {
  std::uint8_t minor = 2;
  std::uint8_t format = 1;
  std::string extra_bytes;  ///< descriptions, 192 bytes each
  std::uint16_t point_size = 28;
  std::uint32_t count = 1;
};

inline std::string extra_bytes(const std::string& name, std::uint8_t type) {
  return packed(zeros(2), type, '\0', name, zeros(32 - name.size() + 156));
}

/// LAS with scale 0.01 and offset 100, 200, 300.
inline std::string las_file(const LasParts& parts, const std::string& points) {
  const std::uint16_t header_size = parts.minor < 4 ? 227 : 375;
  std::string vlr;
  if (!parts.extra_bytes.empty()) {
    const auto size = static_cast<std::uint16_t>(parts.extra_bytes.size());
    vlr = packed(zeros(2), "LASF_Spec", zeros(7), std::uint16_t{4}, size, zeros(32),
                 parts.extra_bytes);
  }
  std::string out = packed("LASF", zeros(20), std::uint8_t{1}, parts.minor, zeros(68), header_size);
  out += packed(static_cast<std::uint32_t>(header_size + vlr.size()), vlr.empty() ? 0U : 1U);
  out += packed(parts.format, parts.point_size, parts.minor < 4 ? parts.count : 0U, zeros(20));
  out += bytes_of<double>({0.01, 0.01, 0.01, 100.0, 200.0, 300.0}) + zeros(48);
  if (parts.minor == 4) out += packed(zeros(20), std::uint64_t{parts.count}, zeros(120));
  return out + vlr + points;
}

}  // namespace dynains::test
