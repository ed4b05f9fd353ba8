// Points as records of 16 bytes, which one load and one store move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

struct alignas(16) PointRecord {
  float x, y, z;        // m
  std::uint32_t input;  // index of the point in the input of the remover
};

/// Four rows or columns of a matrix.
template <int kWidth>
using FourRegisters = std::array<Register<float, kWidth>, 4>;

/// The columns of a 4x4 matrix, given its rows.
inline FourRegisters<4> transposed(const FourRegisters<4>& row) {
  Register<float, 4> a, b, c, d;
  shuffle<0, 4, 1, 5>(row[0], row[1], a);
  shuffle<0, 4, 1, 5>(row[2], row[3], b);
  shuffle<2, 6, 3, 7>(row[0], row[1], c);
  shuffle<2, 6, 3, 7>(row[2], row[3], d);
  FourRegisters<4> column;
  shuffle<0, 1, 4, 5>(a, b, column[0]);
  shuffle<2, 3, 6, 7>(a, b, column[1]);
  shuffle<0, 1, 4, 5>(c, d, column[2]);
  shuffle<2, 3, 6, 7>(c, d, column[3]);
  return column;
}

/// Transposes the two 4x4 matrices that lie side by side in four rows.
inline void transpose(std::array<Pack<float, 8, 1>, 4>& m) {
  Register<float, 8> a, b, c, d;
  shuffle<0, 8, 1, 9, 4, 12, 5, 13>(m[0].part[0], m[1].part[0], a);
  shuffle<0, 8, 1, 9, 4, 12, 5, 13>(m[2].part[0], m[3].part[0], b);
  shuffle<2, 10, 3, 11, 6, 14, 7, 15>(m[0].part[0], m[1].part[0], c);
  shuffle<2, 10, 3, 11, 6, 14, 7, 15>(m[2].part[0], m[3].part[0], d);
  shuffle<0, 1, 8, 9, 4, 5, 12, 13>(a, b, m[0].part[0]);
  shuffle<2, 3, 10, 11, 6, 7, 14, 15>(a, b, m[1].part[0]);
  shuffle<0, 1, 8, 9, 4, 5, 12, 13>(c, d, m[2].part[0]);
  shuffle<2, 3, 10, 11, 6, 7, 14, 15>(c, d, m[3].part[0]);
}
/// Replaces the rows of a 16x4 matrix, four in each pack, by its columns.
inline void transpose(std::array<Pack<float, 16, 1>, 4>& m) {
  Register<float, 16> a, b, c, d;
  shuffle<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(m[0].part[0], m[1].part[0], a);
  shuffle<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(m[2].part[0], m[3].part[0], b);
  shuffle<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(m[0].part[0], m[1].part[0],
                                                                      c);
  shuffle<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(m[2].part[0], m[3].part[0],
                                                                      d);
  shuffle<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(a, b, m[0].part[0]);
  shuffle<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(a, b, m[1].part[0]);
  shuffle<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(c, d, m[2].part[0]);
  shuffle<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(c, d, m[3].part[0]);
}

inline Register<float, 4> load_four(const void* from) {
  Register<float, 4> result;
  load(from, result);
  return result;
}

inline void copy_record(const PointRecord* from, PointRecord* to) { store(load_four(from), to); }

/// Copies records to a place before or at `from`. The two ranges may overlap.
inline void move_to_front(const PointRecord* from, std::size_t count, PointRecord* to) {
  if (to == from) return;
  for (std::size_t k = 0; k < count; ++k) copy_record(from + k, to + k);
}

/// The points with the indices i to i + 3, as records.
inline FourRegisters<4> load_records(PointsView points, const std::uint32_t* input, std::size_t i) {
  return transposed({load_four(points.x.data() + i), load_four(points.y.data() + i),
                     load_four(points.z.data() + i), load_four(input + i)});
}

/// Packs of x, y, z and the bits of `input` of consecutive records.
template <class Packs>
std::array<typename Packs::Float, 4> load_columns(const PointRecord* from) {
  std::array<typename Packs::Float, 4> result;
  if constexpr (Packs::Float::kPartWidth == 4) {
    for (std::size_t part = 0; part < 2; ++part) {
      const PointRecord* const rows = from + 4 * part;
      const FourRegisters<4> columns = transposed(
          {load_four(rows), load_four(rows + 1), load_four(rows + 2), load_four(rows + 3)});
      for (std::size_t k = 0; k < 4; ++k) result[k].part[part] = columns[k];
    }
  } else {
    for (std::size_t k = 0; k < 4; ++k) {
      if constexpr (Packs::kCount == 16) {
        load(from + 4 * k, result[k].part[0]);
      } else {
        shuffle<0, 1, 2, 3, 4, 5, 6, 7>(load_four(from + k), load_four(from + k + 4),
                                        result[k].part[0]);
      }
    }
    transpose(result);
  }
  return result;
}

/// Copies those of `count` records whose bits are set, at most a pack, to a place before or at
/// `from`; returns their number. It avoids branches on single bits, which are unpredictable.
template <class Packs>
std::size_t move_some_to_front(const PointRecord* from, std::size_t count, unsigned bits,
                               PointRecord* to) {
  std::size_t moved = 0;
  if constexpr (Packs::kCount == 16) {
    // From a bit for each of four records to a bit for each of their 16 numbers.
    static constexpr std::array<std::uint16_t, 16> kNumbers = {
        0x0000, 0x000F, 0x00F0, 0x00FF, 0x0F00, 0x0F0F, 0x0FF0, 0x0FFF,
        0xF000, 0xF00F, 0xF0F0, 0xF0FF, 0xFF00, 0xFF0F, 0xFFF0, 0xFFFF};
    if (count == Packs::kCount) {
      for (std::size_t k = 0; k < count; k += 4) {
        const unsigned which = bits >> k & 0xFU;
        Register<float, 16> four;
        load(from + k, four);
        compress(kNumbers[which], four);
        store(four, to + moved);
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

/// Columns of those records of a pack whose bits are set; the numbers after them are undefined.
/// `columns`: those of all records.
template <class Packs>
std::array<typename Packs::Float, 4> pick(const PointRecord* from, unsigned bits,
                                          const std::array<typename Packs::Float, 4>& columns) {
  if constexpr (Packs::kCount == 16) {
    std::array<typename Packs::Float, 4> result = columns;
    for (auto& column : result) compress(bits, column.part[0]);
    return result;
  } else {
    PointRecord picked[Packs::kCount] = {};
    move_some_to_front<Packs>(from, Packs::kCount, bits, picked);
    return load_columns<Packs>(picked);
  }
}

}  // namespace dynains::detail
