#include "variants.hpp"

#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "run/recorded_scans.hpp"

namespace dynains::program {

using namespace run;

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
  for (const Variant& variant : variants) {
    DynaInsRemover::Config config = variant.config;
    config.build_map = false;
    take_sensors(sequence.sequence(), config);
    removers.emplace_back(config);
  }
  evaluation::LabelledScan scan;
  for (std::size_t i = 0; sequence.read(i, scan); ++i) {
    in_map[i].assign(scan.size(), 0);
    for (std::size_t v = 0; v < removers.size(); ++v) {
      const FrameResult frame = naming_scan(sequence.sequence(), sequence.index(i), [&] {
        return removers[v].push(RawPoints<float>{scan.xyz, scan.size(), scan.stride, scan.sensors},
                                scan.T_world_sensor, sequence.sequence().time(sequence.index(i)));
      });
      if (answer == Answer::kNewest) {
        take(v, frame.newest());
      } else if (frame.finished) {
        take(v, *frame.finished);
      }
    }
    if (done) done(i + 1);
  }
  if (answer == Answer::kFinal) {
    for (std::size_t v = 0; v < removers.size(); ++v) {
      removers[v].flush([&](const ScanVerdict& verdict) { take(v, verdict); });
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
