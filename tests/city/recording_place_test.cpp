#include "dynains/city/recording_place.hpp"

#include <cstdint>
#include <string>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// A place whose points the first pass kept (k), removed (r) or both (b) in one epoch each.
RecordingPlace judged(const std::string& epochs) {
  RecordingPlace place;
  std::uint16_t epoch = 1;
  for (const char verdict : epochs) {
    if (verdict != 'r') place.first.add(false, epoch, epoch);
    if (verdict != 'k') place.first.add(true, epoch, epoch);
    ++epoch;
  }
  place.first.end_epoch();
  return place;
}

bool stands(const std::string& epochs, std::uint8_t hits = 2, bool was_free = false) {
  RecordingPlace place = judged(epochs);
  place.hits = hits;
  place.was_free = was_free;
  return place.stands();
}

}  // namespace

TEST_CASE("a place stands if its points were kept before and after, and no look passed it") {
  CHECK(stands("krk"));
  CHECK(stands("kkrbrk"));
  CHECK_FALSE(stands("krk", 1));
  CHECK_FALSE(stands("krk", 2, true));
  for (const char* const epochs : {"rk", "kr", "bk", "kb", "r", "kkk", "krkr", "rkrk"}) {
    CAPTURE(epochs);
    CHECK_FALSE(stands(epochs));
  }
}

TEST_CASE("two epochs that removed all points at one end tell of motion") {
  for (const char* const epochs : {"rrk", "krr", "rrbk", "kbrr", "krkrr"}) {
    CAPTURE(epochs);
    CHECK(judged(epochs).first.moved());
  }
  for (const char* const epochs : {"rk", "kr", "rbrk", "krrk", "rrr", "k", "rkrkr"}) {
    CAPTURE(epochs);
    CHECK_FALSE(judged(epochs).first.moved());
  }
}

TEST_CASE("a place was entered or left if it was empty at the end where points were removed") {
  RecordingPlace came = judged("rk");
  CHECK_FALSE(came.came_or_left());
  came.free_after = true;
  CHECK_FALSE(came.came_or_left());
  came.free_before = true;
  CHECK(came.came_or_left());

  RecordingPlace left = judged("kr");
  left.free_before = true;
  CHECK_FALSE(left.came_or_left());
  left.free_after = true;
  CHECK(left.came_or_left());

  RecordingPlace never_kept = judged("rr");
  never_kept.free_before = never_kept.free_after = true;
  CHECK_FALSE(never_kept.came_or_left());
}

TEST_CASE("a place knows the scans that measured it") {
  const RecordingPlace place = judged("krb");
  CHECK(place.first.first_scan == 1);
  CHECK(place.first.last_scan == 3);
}
