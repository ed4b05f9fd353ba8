// Catch2 v2 (one header) and v3 (many), and what tests use of other libraries, behind one include.
#pragma once

#include "support/standard.hpp"

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
#include <catch2/catch.hpp>
inline auto ContainsSubstring(const std::string& part) { return Catch::Contains(part); }
#endif
using Catch::Matchers::StartsWith;
