// Identity and oracle on real recordings, if they exist.

#include "dynains/evaluation/evaluate.hpp"
#include "run/labelled_sequence.hpp"
#include "support/catch.hpp"
#include "support/recordings.hpp"

namespace dynains::run {

namespace {

void check_identity_and_oracle(const std::string& name) {
  const auto folder = test::recording_or_skip(name);
  if (!folder) return;
  for (const auto unlabeled : {evaluation::Unlabeled::kIgnore, evaluation::Unlabeled::kStatic}) {
    LabelledSequence sequence(Recording(*folder), {});
    evaluation::EvaluationConfig config;
    config.truth = evaluation::TruthClasses(unlabeled);
    const evaluation::Evaluation result = evaluation::evaluate(
        [&](std::size_t i, evaluation::LabelledScan& scan) { return sequence.read(i, scan); }, {},
        {}, config);
    const evaluation::EvaluationRow& identity = result.rows[0];
    CHECK(identity.voxels.kept() == 100.0);
    CHECK(identity.voxels.removed() == 0.0);
    CHECK(identity.voxels.dynamic_total > 1000);
    // If points of both classes share a voxel, the oracle moves the centroid of that voxel. By the
    // protocol, it can then lose a few static voxels.
    const evaluation::EvaluationRow& oracle = result.rows[1];
    CHECK(oracle.voxels.kept() > 99.99);
    CHECK(oracle.voxels.removed() == 100.0);
    CHECK(oracle.points.harmonic() == 100.0);
  }
}

}  // namespace

TEST_CASE("Identity and oracle are exact on a recorded van") {
  check_identity_and_oracle("kitti_van");
}

TEST_CASE("Identity and oracle are exact on a recorded busy street") {
  check_identity_and_oracle("pandaset_street");
}

}  // namespace dynains::run
