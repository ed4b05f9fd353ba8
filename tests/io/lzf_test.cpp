#include "io/points/lzf.hpp"

#include "support/catch.hpp"

using dynains::decode_lzf;

namespace {

/// The decoded text, or "refused".
std::string decode(const std::vector<int>& bytes, std::size_t size) {
  std::vector<char> source;
  for (const int byte : bytes) source.push_back(static_cast<char>(byte));
  std::vector<char> target(size, '?');
  return decode_lzf(source, target) ? std::string(target.begin(), target.end()) : "refused";
}

}  // namespace

TEST_CASE("LZF: copies of earlier output") {
  // 0x20: length 1 + 2 = 3, distance 0 + 2 + 1 = 3.
  CHECK(decode({2, 'a', 'b', 'c', 0x20, 2}, 6) == "abcabc");
  // Distance 1 repeats the byte just written.
  CHECK(decode({0, 'a', 0x20, 0}, 4) == "aaaa");
  // 0xE0: length 7 + 5 + 2 = 14 with the extra length byte before the distance.
  CHECK(decode({0, 'a', 0xE0, 5, 0}, 15) == std::string(15, 'a'));
  // Longest copy: 7 + 255 + 2 = 264 from 3 bytes, which is kLzfMaxExpansion.
  CHECK(decode({0, 'a', 0xE0, 255, 0}, 265) == std::string(265, 'a'));
  // 0x21: distance (1 << 8) + 0 + 1 = 257: the first byte of 257.
  std::vector<int> far;
  std::string expected;
  for (int i = 0; i < 257; ++i) {
    far.push_back(0);
    far.push_back('A' + i % 50);
    expected.push_back(static_cast<char>('A' + i % 50));
  }
  far.insert(far.end(), {0x21, 0});
  CHECK(decode(far, 260) == expected + expected.substr(0, 3));
}
