// Several configurations of the remover over the same scans, in one process.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "run/labelled_sequence.hpp"

namespace dynains::program {

struct Variant {
  std::string name;
  DynaInsRemover::Config config;
};

/// Which answer of the remover is judged.
enum class Answer { kFinal, kNewest };

/// Verdicts of all variants, per scan of the window and point: bit v is set if variant v keeps the
/// point.
using VariantVerdicts = std::vector<std::vector<std::uint8_t>>;

/// Runs every variant over the window. `done(scans)` is called after each scan. Memory: 1 byte per
/// point. Throws ConfigError for more than evaluation::kMaxEstimates variants.
VariantVerdicts run_variants(run::LabelledSequence& sequence, const std::vector<Variant>& variants,
                             Answer answer, const std::function<void(std::size_t)>& done);

/// Both: the rows are identity, oracle, then the variants.
evaluation::Evaluation evaluate_variants(run::LabelledSequence& sequence,
                                         const std::vector<Variant>& variants, Answer answer,
                                         const evaluation::EvaluationConfig& config,
                                         const std::function<void(std::size_t)>& done);

}  // namespace dynains::program
