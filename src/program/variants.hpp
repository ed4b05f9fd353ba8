// Several configurations of the remover over the same scans, in one process.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/verdict.hpp"
#include "run/labelled_sequence.hpp"

namespace dynains::program {

struct Variant {
  std::string name;
  DynaInsRemover::Config config;
  int passes = 1;  ///< 2: final verdicts are those of the second pass over the window
};

/// Verdicts of all variants, in memory: one byte per point.
struct VariantVerdicts {
  /// Per scan of the window and point: bit v is set if variant v keeps the point.
  std::vector<std::vector<std::uint8_t>> in_map;
  /// Instance ids of variant 0, per scan and point.
  std::vector<std::vector<std::uint32_t>> instances;
};

/// Which answer of the remover is judged.
enum class Answer { kFinal, kNewest };

/// Runs every variant over the window. `done(scans)` is called after each scan of the first pass.
/// The second pass takes another 6 bytes per point.
/// Throws ConfigError for more than evaluation::kMaxEstimates variants.
VariantVerdicts run_variants(LabelledSequence& sequence, const std::vector<Variant>& variants,
                             Answer answer, const std::function<void(std::size_t)>& done);

/// Scans of the window with the verdicts as estimates.
evaluation::ScanSource judged_source(LabelledSequence& sequence, const VariantVerdicts& verdicts);

/// Both: the rows are identity, oracle, then the variants.
evaluation::Evaluation evaluate_variants(LabelledSequence& sequence,
                                         const std::vector<Variant>& variants, Answer answer,
                                         const evaluation::EvaluationConfig& config,
                                         const std::function<void(std::size_t)>& done);

}  // namespace dynains::program
