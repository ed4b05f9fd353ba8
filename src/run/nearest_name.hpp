// The name that a misspelt word is most like.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <vector>

namespace dynains::program {

/// Letters to insert, remove or replace to get from one word to the other (Levenshtein).
inline std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t replaced = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// The first of the names that `word` begins, or one that differs by at most two letters. Empty if
/// there is none.
inline std::string nearest_name(const std::string& word, const std::vector<std::string>& names) {
  constexpr std::size_t kAlike = 2;  // letters
  std::string best;
  std::size_t least = std::min(kAlike + 1, word.size());
  for (const std::string& name : names) {
    const bool is_begun = name.compare(0, word.size(), word) == 0;
    const std::size_t letters = is_begun ? 0 : edit_distance(word, name);
    if (letters >= least) continue;
    least = letters;
    best = name;
  }
  return best;
}

}  // namespace dynains::program
