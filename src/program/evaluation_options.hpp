// The options that every evaluating command shares.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dynains/evaluation/evaluate.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::program {

/// Flags of an evaluating command, and the settings that they give after parsing.
class EvaluationOptions {
 public:
  /// `unlabeled`: the command's default for points without a class, "ignore" or "static".
  /// `prefix` starts the name of every flag, so that it differs from those of the remover.
  EvaluationOptions(CLI::App& command, std::string unlabeled, const std::string& prefix = "");

  evaluation::EvaluationConfig config() const;

 private:
  evaluation::EvaluationConfig config_;
  double max_range_ = 0;
  CLI::Option* max_range_option_;
  std::string classes_ = evaluation::TruthClasses().dynamic_classes();
  std::string unlabeled_;
};

/// A file for text that takes long to compute. Opening it shows beforehand whether it can be
/// written.
class TextFile {
 public:
  /// Opens it unless `path` is empty: then there is none. Throws IoError.
  TextFile(const std::string& path, bool force, const run::InputFiles& inputs) {
    if (!path.empty()) file_.emplace(path, run::existing_by(force), inputs);
  }

  /// Puts the file in place, whole or not at all. Throws IoError.
  void write(const std::string& text) {
    if (file_) file_->write([&](std::ostream& out) { out << text; });
  }

 private:
  std::optional<run::OutputFile> file_;
};

}  // namespace dynains::program
