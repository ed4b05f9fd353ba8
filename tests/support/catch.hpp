// Catch2 v2 (one header) and v3 (many) behind one include.
#pragma once

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
#include <catch2/catch.hpp>
#include <string>
inline auto ContainsSubstring(const std::string& part) { return Catch::Contains(part); }
#endif
using Catch::Matchers::StartsWith;
