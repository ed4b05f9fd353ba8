#include "variants.hpp"

#include <optional>

#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/recording/second_pass.hpp"
#include "run/naming_scan.hpp"

namespace dynains::program {
namespace {

/// Both passes over the window for one variant.
class RevisedVerdicts {
 public:
  RevisedVerdicts(std::size_t scans, const FreeSpaceConfig& evidence)
      : evidence_(evidence), verdicts_(scans) {}

  void compare(const FrameResult& frame) { compared_.add(frame); }
  void take(const ScanVerdict& verdict) { verdicts_[verdict.scan].take(verdict, false); }

  /// Calls `visit(verdict)` with the verdicts of the second pass.
  template <class Visitor>
  void revise(LabelledSequence& sequence, Visitor&& visit) {
    MemoryStore store;
    SecondPassConfig config;
    config.evidence = evidence_;
    SecondPass pass(store, config);
    for_each_scan(sequence, [&](const ScanVerdict& verdict) {
      pass.add(points_, verdict, compared_[verdict.scan]);
    });
    pass.test();
    for_each_scan(sequence, [&](const ScanVerdict& verdict) {
      pass.revise(points_, static_cast<std::uint32_t>(verdict.scan), verdicts_[verdict.scan]);
      visit(verdict);
    });
  }

 private:
  // Calls `visit(verdict)`, which refers to the arrays, with the points of the scan in points_.
  template <class Visitor>
  void for_each_scan(LabelledSequence& sequence, Visitor&& visit) {
    evaluation::LabelledScan scan;
    for (std::size_t i = 0; sequence.read(i, scan); ++i) {
      points_.clear();
      for (std::size_t p = 0; p < scan.size(); ++p) {
        const float* const at = scan.xyz + p * scan.stride;
        points_.push_back(at[0], at[1], at[2]);
      }
      ScanVerdict verdict;
      verdict.scan = i;
      verdict.time = scan.time;
      verdict.T_world_sensor = orthonormalized(scan.T_world_sensor);
      verdict.labels = verdicts_[i].labels;
      verdict.causes = verdicts_[i].causes;
      verdict.instances = verdicts_[i].instances;
      visit(verdict);
    }
  }

  FreeSpaceConfig evidence_;
  std::vector<VerdictArrays> verdicts_;
  ComparedPoses compared_;
  PointBuffer points_;
};

}  // namespace

VariantVerdicts run_variants(LabelledSequence& sequence, const std::vector<Variant>& variants,
                             Answer answer, const std::function<void(std::size_t)>& done) {
  if (variants.size() > evaluation::kMaxEstimates) {
    throw ConfigError("at most " + std::to_string(evaluation::kMaxEstimates) +
                      " variants can be evaluated at once");
  }
  if (sequence.missing_truths() > 0) {
    throw IoError(sequence.sequence().folder().string() + ": " +
                  std::to_string(sequence.missing_truths()) +
                  " scans have no ground truth; an experiment needs that of all");
  }
  VariantVerdicts in_map(sequence.size());
  const auto take = [&](std::size_t variant, const ScanVerdict& verdict) {
    auto& kept = in_map[verdict.scan];
    for (std::size_t p = 0; p < verdict.labels.size(); ++p) {
      if (is_static(verdict.labels[p]))
        kept[p] = static_cast<std::uint8_t>(kept[p] | (1U << variant));
    }
  };

  std::vector<DynaInsRemover> removers;
  std::vector<std::optional<RevisedVerdicts>> revised(variants.size());
  const auto take_first = [&](std::size_t variant, const ScanVerdict& verdict) {
    if (revised[variant]) {
      revised[variant]->take(verdict);
    } else {
      take(variant, verdict);
    }
  };
  for (const Variant& variant : variants) {
    DynaInsRemover::Config config = variant.config;
    config.build_map = false;
    if (variant.passes > 1) revised[removers.size()].emplace(sequence.size(), config.evidence);
    removers.emplace_back(config);
  }
  evaluation::LabelledScan scan;
  for (std::size_t i = 0; sequence.read(i, scan); ++i) {
    in_map[i].assign(scan.size(), 0);
    for (std::size_t v = 0; v < removers.size(); ++v) {
      const FrameResult frame = naming_scan(sequence.sequence(), sequence.index(i), [&] {
        return removers[v].push(RawPoints<float>{scan.xyz, scan.size(), scan.stride},
                                scan.T_world_sensor, scan.time);
      });
      if (revised[v]) revised[v]->compare(frame);
      if (answer == Answer::kNewest) {
        take(v, frame.newest);
      } else if (frame.finished) {
        take_first(v, *frame.finished);
      }
    }
    if (done) done(i + 1);
  }
  if (answer == Answer::kFinal) {
    for (std::size_t v = 0; v < removers.size(); ++v) {
      removers[v].flush([&](const ScanVerdict& verdict) { take_first(v, verdict); });
      if (!revised[v]) continue;
      revised[v]->revise(sequence, [&](const ScanVerdict& verdict) { take(v, verdict); });
      revised[v].reset();
    }
  }
  return in_map;
}

evaluation::Evaluation evaluate_variants(LabelledSequence& sequence,
                                         const std::vector<Variant>& variants, Answer answer,
                                         const evaluation::EvaluationConfig& config,
                                         const std::function<void(std::size_t)>& done) {
  const VariantVerdicts verdicts = run_variants(sequence, variants, answer, done);
  std::vector<std::string> names;
  names.reserve(variants.size());
  for (const Variant& variant : variants) names.push_back(variant.name);
  const auto source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    if (!sequence.read(i, scan)) return false;
    scan.in_map = verdicts[i];
    return true;
  };
  return evaluation::evaluate(source, names, {}, config);
}

}  // namespace dynains::program
