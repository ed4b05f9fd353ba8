#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <locale>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "dynains/evaluation/evaluate.hpp"
#include "dynains/evaluation/scores.hpp"

namespace dynains::evaluation {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

/// A line per row with aligned columns, the first one to the left, the others to the right. The
/// first row has all columns.
std::string aligned(const Rows& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::ostringstream text;
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      text << (c == 0 ? "" : "  ") << (c == 0 ? std::left : std::right)
           << std::setw(static_cast<int>(widths[c])) << row[c];
    }
    text << '\n';
  }
  return text.str();
}

/// With a number of decimals; `missing` if it is not finite.
std::string format_number(double value, int decimals, const char* missing = "-") {
  if (!std::isfinite(value)) return missing;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(decimals) << value;
  return text.str();
}

const char* name(Truth truth) { return truth == Truth::kDynamic ? "dynamic" : "static"; }

std::string range_text(double min, double max) {
  std::string text = format_number(min, 1) + " m ";
  return max > 0 ? text + "to " + format_number(max, 1) + " m" : text + "and farther";
}

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// A rate of a row, of its voxels or its points.
struct Rate {
  const char* name;
  const char* title;
  Score EvaluationRow::*score;
  double (Score::*value)() const;
  int decimals = 3;

  double of(const EvaluationRow& row) const { return (row.*score.*value)(); }
};
constexpr Rate kRates[] = {{"pr", "PR %", &EvaluationRow::voxels, &Score::kept},
                           {"rr", "RR %", &EvaluationRow::voxels, &Score::removed},
                           {"f1", "F1", &EvaluationRow::voxels, &Score::f1, 4},
                           {"sa", "SA %", &EvaluationRow::points, &Score::kept},
                           {"da", "DA %", &EvaluationRow::points, &Score::removed},
                           {"aa", "AA %", &EvaluationRow::points, &Score::associated},
                           {"ha", "HA %", &EvaluationRow::points, &Score::harmonic}};

/// The counts of voxels, of which those that are preserved count, or of points or objects.
std::array<std::pair<const char*, std::uint64_t>, 4> counts_of(const Score& score,
                                                               bool are_voxels = false) {
  const std::uint64_t preserved = score.dynamic_total - score.dynamic_removed;
  return {{{"static_total", score.static_total},
           {are_voxels ? "static_preserved" : "static_kept", score.static_kept},
           {"dynamic_total", score.dynamic_total},
           {are_voxels ? "dynamic_preserved" : "dynamic_removed",
            are_voxels ? preserved : score.dynamic_removed}}};
}

/// The rates and the counts of the voxels or the points of a row.
Json to_json(const EvaluationRow& row, Score EvaluationRow::*score) {
  Json json;
  for (const Rate& rate : kRates) {
    if (rate.score == score) json[rate.name] = json_number(rate.of(row));
  }
  for (const auto& [name, count] : counts_of(row.*score, score == &EvaluationRow::voxels)) {
    json[name] = count;
  }
  return json;
}

Json to_json(const Score& objects) {
  Json json = {{"static_kept_percent", json_number(objects.kept())},
               {"dynamic_removed_percent", json_number(objects.removed())}};
  for (const auto& [name, count] : counts_of(objects)) json[name] = count;
  return json;
}

/// Without ground, which has no objects.
std::vector<ClassScore> classes_of_objects(const EvaluationRow& row) {
  std::vector<ClassScore> classes;
  for (const ClassScore& one : row.classes) {
    if (!is_ground_class(one.id)) classes.push_back(one);
  }
  return classes;
}

Json to_json(const std::vector<ClassScore>& classes) {
  Json json = Json::array();
  for (const ClassScore& one : classes) {
    json.push_back({{"class", one.id},
                    {"name", semantic_class_name(one.id)},
                    {"truth", name(one.truth)},
                    {"objects", one.objects},
                    {"objects_right", one.right},
                    {"points", one.points},
                    {"points_kept", one.points_kept},
                    {"kept_percent", json_number(percent(one.points_kept, one.points))}});
  }
  return json;
}

/// Objects of one estimate by class.
std::string objects_to_table(const EvaluationRow& row) {
  Rows table = {{"class", "truth", "objects", "right", "right %", "points", "points kept %"}};
  for (const ClassScore& one : classes_of_objects(row)) {
    table.push_back({semantic_class_name(one.id), name(one.truth), std::to_string(one.objects),
                     std::to_string(one.right), format_number(percent(one.right, one.objects), 1),
                     std::to_string(one.points),
                     format_number(percent(one.points_kept, one.points), 2)});
  }
  return "\nobjects, " + row.name + '\n' + aligned(table);
}

Json errors_to_json(const Evaluation& evaluation) {
  if (evaluation.first_estimate() == nullptr) return nullptr;
  Json json = {{"by_class", Json::array()}, {"by_cause", nullptr}};
  for (const ClassScore& one : evaluation.first_estimate()->classes) {
    json["by_class"].push_back(
        {{"class", one.id},
         {"name", semantic_class_name(one.id)},
         {"truth", name(one.truth)},
         {"points", one.points},
         {"removed", one.removed()},
         {"removed_percent", json_number(percent(one.removed(), one.points))}});
  }
  for (std::size_t c = 0; c < evaluation.causes.size(); ++c) {
    const CauseErrors& cause = evaluation.causes[c];
    json["by_cause"].push_back({{"cause", kCauseNames[c]},
                                {"missed_dynamic", cause.missed_dynamic},
                                {"lost_static", cause.lost_static},
                                {"right", cause.right}});
  }
  return json;
}

}  // namespace

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string to_table(const Evaluation& evaluation) {
  const EvaluationConfig& config = evaluation.config;
  std::ostringstream text;
  text << evaluation.scans << " scans, " << evaluation.points << " points; dynamic: classes "
       << config.truth.dynamic_classes() << "; unlabeled: " << plain_value(config.truth.unlabeled())
       << '\n'
       << "PR RR F1: voxels of " << format_number(config.voxel, 3) << " m, "
       << range_text(config.min_range, config.max_range)
       << "; SA DA AA HA, objects: " << range_text(config.min_range, config.point_max_range)
       << "\nkept, left: instances of " << ObjectLimits::kMinPoints
       << " and more points; static ones that keep 90 % (people left out), moving ones that lose "
          "95 %\n";
  Rows table = {{""}};
  for (const Rate& rate : kRates) table.front().emplace_back(rate.title);
  table.front().insert(table.front().end(), {"kept %", "left %"});
  for (const EvaluationRow& row : evaluation.rows) {
    std::vector<std::string> cells = {row.name};
    for (const Rate& rate : kRates) cells.push_back(format_number(rate.of(row), rate.decimals));
    cells.push_back(row.objects ? format_number(row.objects->kept(), 1) : "-");
    cells.push_back(row.objects ? format_number(row.objects->removed(), 1) : "-");
    table.push_back(cells);
  }
  text << aligned(table);
  for (const EvaluationRow& row : evaluation.rows) {
    if (!classes_of_objects(row).empty()) text << objects_to_table(row);
  }
  for (const EvaluationRow& row : evaluation.rows) {
    if (!row.foreign_points || *row.foreign_points == 0) continue;
    text << row.name << ": " << *row.foreign_points << " of " << *row.map_points
         << " map points lie near no judged point of the scans and were left out";
    if (2 * *row.foreign_points > *row.map_points) {
      text << "; is the map in the world frame of the poses?";
    }
    text << '\n';
  }
  return text.str();
}

std::string errors_to_table(const Evaluation& evaluation) {
  if (evaluation.first_estimate() == nullptr) return {};
  Rows classes = {{"class", "id", "truth", "points", "removed", "removed %"}};
  for (const ClassScore& one : evaluation.first_estimate()->classes) {
    classes.push_back({semantic_class_name(one.id), std::to_string(one.id), name(one.truth),
                       std::to_string(one.points), std::to_string(one.removed()),
                       format_number(percent(one.removed(), one.points), 2)});
  }
  if (evaluation.causes.empty()) return aligned(classes);
  Rows causes = {{"cause", "missed dynamic", "lost static", "right"}};
  for (std::size_t c = 0; c < evaluation.causes.size(); ++c) {
    const CauseErrors& cause = evaluation.causes[c];
    if (cause.missed_dynamic + cause.lost_static + cause.right == 0) continue;
    causes.push_back({kCauseNames[c], std::to_string(cause.missed_dynamic),
                      std::to_string(cause.lost_static), std::to_string(cause.right)});
  }
  return aligned(classes) + '\n' + aligned(causes);
}

std::string to_json(const Evaluation& evaluation) {
  Json settings;
  EvaluationConfig::visit(evaluation.config, [&](const auto& parameter) {
    settings[parameter.name] = parameter.value;
  });
  settings["classes"] = evaluation.config.truth.dynamic_classes();
  settings["unlabeled"] = plain_value(evaluation.config.truth.unlabeled());

  Json rows = Json::array();
  for (const EvaluationRow& row : evaluation.rows) {
    Json json = {{"name", row.name},
                 {"voxels", to_json(row, &EvaluationRow::voxels)},
                 {"points", to_json(row, &EvaluationRow::points)}};
    if (row.objects) json["objects"] = to_json(*row.objects);
    const std::vector<ClassScore> classes = classes_of_objects(row);
    if (!classes.empty()) json["object_classes"] = to_json(classes);
    if (row.map_points) json["map_points"] = *row.map_points;
    if (row.foreign_points) json["foreign_points"] = *row.foreign_points;
    rows.push_back(json);
  }
  const Json json = {{"settings", settings},
                     {"scans", evaluation.scans},
                     {"points", evaluation.points},
                     {"rows", rows},
                     {"errors", errors_to_json(evaluation)}};
  // Names of files need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string to_csv(const Evaluation& evaluation) {
  std::ostringstream text;
  text << "name,pr,rr,f1,sa,da,aa,ha,static_voxels,static_voxels_preserved,dynamic_voxels,"
          "dynamic_voxels_preserved,static_points,static_points_kept,dynamic_points,"
          "dynamic_points_removed,static_objects,static_objects_kept,dynamic_objects,"
          "dynamic_objects_removed\n";
  for (const EvaluationRow& row : evaluation.rows) {
    text << csv_field(row.name);
    for (const Rate& rate : kRates) text << ',' << format_number(rate.of(row), 6, "");
    for (const auto& [name, count] : counts_of(row.voxels, true)) text << ',' << count;
    for (const auto& [name, count] : counts_of(row.points)) text << ',' << count;
    for (const auto& [name, count] : counts_of(row.objects.value_or(Score()))) {
      text << ',' << (row.objects ? std::to_string(count) : "");
    }
    text << '\n';
  }
  return text.str();
}

}  // namespace dynains::evaluation
