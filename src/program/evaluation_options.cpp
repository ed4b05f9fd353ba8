#include "evaluation_options.hpp"

#include <algorithm>
#include <utility>

namespace dynains::program {

EvaluationOptions::EvaluationOptions(CLI::App& command, std::string unlabeled,
                                     const std::string& prefix)
    : unlabeled_(std::move(unlabeled)) {
  using evaluation::EvaluationConfig;
  EvaluationConfig::visit(config_, [&](const auto& parameter) {
    std::string name = parameter.name;
    if (name == "max_range" || name == "point_max_range") return;
    std::replace(name.begin(), name.end(), '_', '-');
    command.add_option("--" + prefix + name, parameter.value, std::string(parameter.help) + " [m]")
        ->capture_default_str();
  });
  max_range_option_ = command.add_option(
      "--" + prefix + "max-range", max_range_,
      "points at a larger planar range are not judged, 0 = no limit [m] (PR and RR: 0; SA, DA and "
      "error analysis: 50)");
  command
      .add_option("--" + prefix + "classes", classes_,
                  "dynamic class ids of the ground truth, for example 252-257,259")
      ->capture_default_str();
  command
      .add_option("--" + prefix + "unlabeled", unlabeled_,
                  "points of class 0 and 1: ignore them, or count them as static as the published "
                  "tables do")
      ->check(CLI::IsMember({"ignore", "static"}))
      ->capture_default_str();
}

evaluation::EvaluationConfig EvaluationOptions::config() const {
  evaluation::EvaluationConfig config = config_;
  if (max_range_option_->count() > 0) config.max_range = config.point_max_range = max_range_;
  config.truth =
      evaluation::TruthClasses(classes_, value_of_name<evaluation::Unlabeled>(unlabeled_).value());
  config.validate();
  return config;
}

}  // namespace dynains::program
