// Points side by side with their numbers: what is moved one by one, by one load and one store.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/shuffle.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

struct alignas(16) PointRecord {
  float x, y, z;
  std::uint32_t input;
};

/// In a vector of sixteen numbers.
inline constexpr std::size_t kRecordsInSixteen = 4;

/// The columns of four rows of four values.
inline std::array<Float4, 4> transposed(const std::array<Float4, 4>& row) {
  Float4 a, b, c, d;
  shuffle<0, 4, 1, 5>(row[0], row[1], a);
  shuffle<0, 4, 1, 5>(row[2], row[3], b);
  shuffle<2, 6, 3, 7>(row[0], row[1], c);
  shuffle<2, 6, 3, 7>(row[2], row[3], d);
  std::array<Float4, 4> columns;
  shuffle<0, 1, 4, 5>(a, b, columns[0]);
  shuffle<2, 3, 6, 7>(a, b, columns[1]);
  shuffle<0, 1, 4, 5>(c, d, columns[2]);
  shuffle<2, 3, 6, 7>(c, d, columns[3]);
  return columns;
}

/// The same for two times four rows side by side.
inline std::array<WideFloat8, 4> transposed(const std::array<WideFloat8, 4>& row) {
  WideFloat8::Vector a, b, c, d;
  shuffle<0, 8, 1, 9, 4, 12, 5, 13>(row[0].v, row[1].v, a);
  shuffle<0, 8, 1, 9, 4, 12, 5, 13>(row[2].v, row[3].v, b);
  shuffle<2, 10, 3, 11, 6, 14, 7, 15>(row[0].v, row[1].v, c);
  shuffle<2, 10, 3, 11, 6, 14, 7, 15>(row[2].v, row[3].v, d);
  std::array<WideFloat8, 4> columns;
  shuffle<0, 1, 8, 9, 4, 5, 12, 13>(a, b, columns[0].v);
  shuffle<2, 3, 10, 11, 6, 7, 14, 15>(a, b, columns[1].v);
  shuffle<0, 1, 8, 9, 4, 5, 12, 13>(c, d, columns[2].v);
  shuffle<2, 3, 10, 11, 6, 7, 14, 15>(c, d, columns[3].v);
  return columns;
}

inline Float4 load_four(const void* from) {
  Float4 result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}

inline void store_four(const Float4& four, void* to) { std::memcpy(to, &four, sizeof(four)); }

inline void copy_record(const PointRecord* from, PointRecord* to) {
  store_four(load_four(from), to);
}

/// `to` is not behind `from`, but may be less than `count` before it.
inline void move_to_front(const PointRecord* from, std::size_t count, PointRecord* to) {
  if (to == from) return;
  for (std::size_t k = 0; k < count; ++k) copy_record(from + k, to + k);
}

/// Four points from the i-th on, as records.
inline std::array<Float4, 4> load_records(PointsView points, const std::uint32_t* input,
                                          std::size_t i) {
  return transposed({load_four(points.x.data() + i), load_four(points.y.data() + i),
                     load_four(points.z.data() + i), load_four(input + i)});
}

/// The same for four times four rows, one behind the other.
inline std::array<WideFloat<16>, 4> transposed(const std::array<WideFloat<16>, 4>& row) {
  Floats16 a, b, c, d;
  shuffle<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(row[0].v, row[1].v, a);
  shuffle<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(row[2].v, row[3].v, b);
  shuffle<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(row[0].v, row[1].v, c);
  shuffle<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(row[2].v, row[3].v, d);
  std::array<WideFloat<16>, 4> columns;
  shuffle<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(a, b, columns[0].v);
  shuffle<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(a, b, columns[1].v);
  shuffle<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(c, d, columns[2].v);
  shuffle<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(c, d, columns[3].v);
  return columns;
}

/// Records as lanes of x, y, z and, bit by bit, numbers.
template <class Packs>
std::array<typename Packs::Float, 4> load_columns(const PointRecord* from) {
  std::array<typename Packs::Float, 4> result;
  if constexpr (std::is_same_v<Packs, WidestPacks>) {
    for (std::size_t k = 0; k < 4; ++k) {
      load_vector(from + kRecordsInSixteen * k, result[k].v);
    }
    return transposed(result);
  } else if constexpr (std::is_same_v<Packs, WidePacks>) {
    for (std::size_t k = 0; k < 4; ++k) {
      shuffle<0, 1, 2, 3, 4, 5, 6, 7>(load_four(from + k), load_four(from + k + 4), result[k].v);
    }
    return transposed(result);
  } else {
    const auto four = [](const PointRecord* rows) {
      return transposed(
          {load_four(rows), load_four(rows + 1), load_four(rows + 2), load_four(rows + 3)});
    };
    const std::array<Float4, 4> lo = four(from);
    const std::array<Float4, 4> hi = four(from + 4);
    for (std::size_t k = 0; k < 4; ++k) result[k] = {lo[k], hi[k]};
    return result;
  }
}

/// Of up to as many records as there are lanes, those whose bits are set; as move_to_front, and
/// without a branch on single ones. Returns how many there are.
template <class Packs>
std::size_t move_some_to_front(const PointRecord* from, std::size_t count, unsigned bits,
                               PointRecord* to) {
  std::size_t moved = 0;
  if constexpr (std::is_same_v<Packs, WidestPacks>) {
    // By the bits of four records: those of their numbers.
    static constexpr std::array<std::uint16_t, 16> kNumbers = {
        0x0000, 0x000F, 0x00F0, 0x00FF, 0x0F00, 0x0F0F, 0x0FF0, 0x0FFF,
        0xF000, 0xF00F, 0xF0F0, 0xF0FF, 0xFF00, 0xFF0F, 0xFFF0, 0xFFFF};
    if (count == Packs::kCount) {
      for (std::size_t k = 0; k < count; k += kRecordsInSixteen) {
        const unsigned which = bits >> k & 0xFU;
        Floats16 four;
        load_vector(from + k, four);
        compress(kNumbers[which], four);
        store_vector(four, to + moved);
        moved += count_ones(which);
      }
      return moved;
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    copy_record(from + k, to + moved);
    moved += bits >> k & 1U;
  }
  return moved;
}

/// Columns of the records whose bits are set, of as many as there are lanes; behind them is
/// anything. `columns` are those of all.
template <class Packs>
std::array<typename Packs::Float, 4> pick(const PointRecord* from, unsigned bits,
                                          const std::array<typename Packs::Float, 4>& columns) {
  if constexpr (std::is_same_v<Packs, WidestPacks>) {
    std::array<typename Packs::Float, 4> result = columns;
    for (auto& column : result) compress(bits, column.v);
    return result;
  } else {
    PointRecord picked[Packs::kCount] = {};
    move_some_to_front<Packs>(from, Packs::kCount, bits, picked);
    return load_columns<Packs>(picked);
  }
}

}  // namespace dynains::detail
