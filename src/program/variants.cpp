#include "variants.hpp"

#include <optional>

#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/recording/second_pass.hpp"
#include "run/naming_scan.hpp"

namespace dynains::program {
namespace {

/// The verdicts of the first pass by scan, and the poses under which it compared the scans.
struct FirstPass {
  explicit FirstPass(std::size_t scans) : verdicts(scans) {}

  std::vector<VerdictArrays> verdicts;
  ComparedPoses compared;
};

/// Revises the verdicts. Calls `visit(verdict)` with the revised ones.
template <class Visitor>
void revise(LabelledSequence& sequence, const FreeSpaceConfig& evidence, FirstPass& first,
            Visitor&& visit) {
  MemoryStore store;
  SecondPassConfig config;
  config.evidence = evidence;
  SecondPass pass(store, config);
  evaluation::LabelledScan scan;
  PointBuffer points;
  for (const bool is_tested : {false, true}) {
    if (is_tested) pass.test();
    for (std::size_t i = 0; sequence.read(i, scan); ++i) {
      points.clear();
      for (std::size_t p = 0; p < scan.size(); ++p) {
        const float* const at = scan.xyz + p * scan.stride;
        points.push_back(at[0], at[1], at[2]);
      }
      VerdictArrays& arrays = first.verdicts[i];
      const ScanVerdict verdict =
          arrays.verdict(i, scan.time, orthonormalized(scan.T_world_sensor));
      if (is_tested) {
        pass.revise(points, static_cast<std::uint32_t>(i), arrays);
        visit(verdict);
      } else {
        pass.add(points, verdict, first.compared[i]);
      }
    }
  }
}

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
  std::vector<std::optional<FirstPass>> first(variants.size());
  const auto take_first = [&](std::size_t variant, const ScanVerdict& verdict) {
    if (first[variant]) {
      first[variant]->verdicts[verdict.scan].take(verdict, false);
    } else {
      take(variant, verdict);
    }
  };
  for (const Variant& variant : variants) {
    DynaInsRemover::Config config = variant.config;
    config.build_map = false;
    if (variant.passes > 1) first[removers.size()].emplace(sequence.size());
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
      if (first[v]) first[v]->compared.add(frame);
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
      if (!first[v]) continue;
      revise(sequence, variants[v].config.evidence, *first[v],
             [&](const ScanVerdict& verdict) { take(v, verdict); });
      first[v].reset();
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
