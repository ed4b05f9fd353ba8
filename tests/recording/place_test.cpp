#include "dynains/recording/place.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// A place of which the first pass kept a point (k), removed one (r) or both (b) in one epoch each.
RecordingPlace judged(const std::string& epochs) {
  RecordingPlace place;
  std::uint16_t epoch = 1;
  for (const char verdict : epochs) {
    if (verdict != 'r') place.first.add(false, epoch, epoch);
    if (verdict != 'k') place.first.add(true, epoch, epoch);
    ++epoch;
  }
  return place;
}

}  // namespace

TEST_CASE("a place was entered or left if it was empty at the end where points were removed") {
  struct Case {
    std::string epochs;
    bool came, left;
  };
  for (const Case& one : {Case{"rk", true, false},
                          {"kr", false, true},
                          {"rr", false, false},
                          {"bkb", false, false},
                          {"rbr", true, true}}) {
    CAPTURE(one.epochs);
    for (const bool before : {false, true}) {
      for (const bool after : {false, true}) {
        RecordingPlace place = judged(one.epochs);
        place.free_before = before;
        place.free_after = after;
        CHECK(place.has_changed() == ((one.came && before) || (one.left && after)));
      }
    }
  }
}

TEST_CASE("presence is known by slices of time, which lie in a span as a whole or do not count") {
  Presence presence;
  presence.add(10);
  CHECK(presence.any_within({10, 10}));
  CHECK(presence.any_within({0, UINT32_MAX}));
  CHECK_FALSE(presence.any_within({0, 9}));
  CHECK_FALSE(presence.any_within({11, 63}));
  CHECK_FALSE(presence.any_within({11, UINT32_MAX}));
  presence.add(200);  // slices of four scans from now on
  CHECK(presence.any_within({8, 11}));
  CHECK_FALSE(presence.any_within({9, 11}));  // holds no slice
  CHECK_FALSE(presence.any_within({12, 199}));
  CHECK(presence.any_within({200, 203}));
  CHECK(presence.any_within({12, 203}));
  CHECK(presence.any_within({12, UINT32_MAX}));
  CHECK(presence.any_within({0, UINT32_MAX}));
}

TEST_CASE("a place knows the scans that measured it") {
  const RecordingPlace place = judged("krb");
  CHECK(place.first.first_scan == 1);
  CHECK(place.first.last_scan == 3);
}
