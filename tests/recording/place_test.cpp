#include "dynains/recording/place.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// A place of which the first pass kept a point (k), removed one (r) or both (b) in one epoch each,
/// or kept two and removed one (m).
RecordingPlace judged(const std::string& epochs) {
  RecordingPlace place;
  std::uint16_t epoch = 1;
  for (const char verdict : epochs) {
    if (verdict != 'r') place.first.add(false, epoch, epoch);
    if (verdict != 'k') place.first.add(true, epoch, epoch);
    if (verdict == 'm') place.first.add(false, epoch, epoch);
    ++epoch;
  }
  place.first.end_epoch();
  return place;
}

bool stands(const std::string& epochs, std::uint8_t hits = 2, std::uint8_t free_in_row = 0) {
  RecordingPlace place = judged(epochs);
  place.hits = hits;
  place.longest = free_in_row;
  return place.stands();
}

}  // namespace

TEST_CASE("a place stands if most points were kept at both ends and in all") {
  for (const char* const epochs : {"krk", "m", "mk", "km", "kbk", "mrkk", "mrbkkk"}) {
    CAPTURE(epochs);
    CHECK(stands(epochs));
  }
  for (const char* const epochs :
       {"rkk", "kkr", "krrrk", "bkkk", "kkkb", "r", "b", "kkk", "mrk", "krm"}) {
    CAPTURE(epochs);
    CHECK_FALSE(stands(epochs));
  }
}

TEST_CASE("what most points of an epoch tell does not end at 255 points") {
  for (const int removed : {200, 201}) {
    RecordingPlace place;
    place.hits = 2;
    for (int i = 0; i < 400; ++i) place.first.add(false, 1, 1);
    for (int i = 0; i < removed; ++i) place.first.add(true, 1, 1);
    place.first.end_epoch();
    CHECK(place.stands() == (removed == 200));
  }
}

TEST_CASE("two looks hit a place that stands, and none passed it") {
  CHECK_FALSE(stands("krk", 1));
  CHECK(stands("krk", 2));
  CHECK_FALSE(stands("krk", 200, 1));
}

TEST_CASE("a place was entered or left if it was empty at the end where points were removed") {
  struct Case {
    std::string epochs;
    bool came, left;
  };
  for (const Case& one : {Case{"rk", true, false}, {"kr", false, true}, {"rr", false, false}}) {
    CAPTURE(one.epochs);
    for (const bool before : {false, true}) {
      for (const bool after : {false, true}) {
        RecordingPlace place = judged(one.epochs);
        place.free_before = before;
        place.free_after = after;
        CHECK(place.came() == (one.came && before));
        CHECK(place.left() == (one.left && after));
      }
    }
  }
}

TEST_CASE("what a scan measured stands since the last look that passed its place") {
  RecordingPlace place = judged("rrkk");
  place.last_free = 5;
  CHECK(place.stands_since(6));
  CHECK_FALSE(place.stands_since(5));
  RecordingPlace left = judged("kkr");
  CHECK_FALSE(left.stands_since(6));
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
