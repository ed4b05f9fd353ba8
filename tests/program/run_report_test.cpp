#include "run/run_report.hpp"

#include "program/program.hpp"
#include "run/verdict_files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::run;

TEST_CASE("Quantiles are measured values") {
  std::vector<double> hundred;
  for (int i = 100; i >= 1; --i) hundred.push_back(i);
  const nlohmann::ordered_json s = statistics(hundred);
  CHECK(s["median"] == 50.0);
  CHECK(s["p95"] == 95.0);
  CHECK(s["p99"] == 99.0);
  CHECK(s["max"] == 100.0);

  const nlohmann::ordered_json one = statistics({7.0});
  CHECK(one["median"] == 7.0);
  CHECK(one["p99"] == 7.0);
  const nlohmann::ordered_json two = statistics({9.0, 3.0});
  CHECK(two["median"] == 3.0);
  CHECK(two["p95"] == 9.0);
  CHECK(statistics({})["max"] == 0.0);
}

TEST_CASE("Progress tells the rate and the time that is left") {
  CHECK(describe_rate(0, 100, 3.0, "scans").empty());
  CHECK(describe_rate(50, 100, 20.0, "scans") == " (2.5 scans/s, 0:20 left)");
  CHECK(describe_rate(250, 100000, 1.0, "scans") == " (250 scans/s, 6:39 left)");
  CHECK(describe_rate(1, 7300, 1.0, "scans") == " (1.0 scans/s, 2:01:39 left)");
  CHECK(describe_rate(100, 100, 20.0, "scans") == " (5.0 scans/s)");
}

TEST_CASE("Labels are 251 if moving, 9 if static, else 0, and instances wrap but never to 0") {
  CHECK(mos_label(PointLabel::kDynamic, 0) == 251);
  CHECK(mos_label(PointLabel::kGround, 0) == 9);
  CHECK(mos_label(PointLabel::kStatic, 3) == (9 | 3U << 16));
  CHECK(mos_label(PointLabel::kInvalid, 0) == 0);
  CHECK(mos_label(PointLabel::kOutOfRange, 0) == 0);
  CHECK(mos_label(PointLabel::kDynamic, 65535) == (251 | 65535U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 65536) == (251 | 1U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 70000) == (251 | 4465U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 2 * 65535) == (251 | 65535U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 0xFFFFFFFF) == (251 | 65535U << 16));
}
