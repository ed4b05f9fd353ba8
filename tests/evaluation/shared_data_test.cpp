// Identity and oracle on real recordings, where they are at hand.
#include <filesystem>
#include <string>

#include "dynains/evaluation/evaluate.hpp"
#include "labelled_sequence.hpp"
#include "support/catch.hpp"

namespace dynains::program {

TEST_CASE("Identity and oracle are exact on real recordings", "[shared]") {
  for (const char* name : {"kitti_van", "pandaset_street"}) {
    const std::filesystem::path folder = std::filesystem::path(DYNAINS_SHARED_DATA) / name;
    if (!std::filesystem::exists(folder)) {
      WARN("skipped: no recording at " << folder.string());
      continue;
    }
    for (const auto unlabeled : {evaluation::Unlabeled::kIgnore, evaluation::Unlabeled::kStatic}) {
      LabelledSequence sequence(Recording(folder), {});
      evaluation::EvaluationConfig config;
      config.truth = evaluation::TruthClasses(unlabeled);
      const evaluation::Evaluation result = evaluation::evaluate(
          [&](std::size_t i, evaluation::LabelledScan& scan) { return sequence.read(i, scan); }, {},
          {}, config);
      const evaluation::EvaluationRow& identity = result.rows[0];
      CHECK(identity.voxels.preservation_rate() == 100.0);
      CHECK(identity.voxels.rejection_rate() == 0.0);
      CHECK(identity.voxels.dynamic_total > 1000);
      // Where truths share a voxel, the oracle moves its centroid: by the protocol it can lose a
      // few static voxels.
      const evaluation::EvaluationRow& oracle = result.rows[1];
      CHECK(oracle.voxels.preservation_rate() > 99.99);
      CHECK(oracle.voxels.rejection_rate() == 100.0);
      CHECK(oracle.points.harmonic_accuracy() == 100.0);
    }
  }
}

}  // namespace dynains::program
