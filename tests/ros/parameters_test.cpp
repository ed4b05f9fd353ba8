#include "ros_common/remover_parameters.hpp"
#include "support/catch.hpp"

namespace dynains_ros {
namespace {

/// Answers with the values that a user gave, and keeps what was declared.
struct User {
  std::map<std::string, double> numbers = {};
  std::map<std::string, std::string> names = {};
  std::map<std::string, ParameterText> declared = {};

  template <class Value>
  Value operator()(const ParameterText& text, Value value) {
    declared[text.name] = text;
    if constexpr (std::is_same_v<Value, std::string>) {
      const auto found = names.find(text.name);
      return found == names.end() ? value : found->second;
    } else {
      const auto found = numbers.find(text.name);
      return found == numbers.end() ? value : static_cast<Value>(found->second);
    }
  }
};

std::string refusal(User user) {
  RemoverConfig config;
  try {
    set_parameters(config, user);
  } catch (const dynains::ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST_CASE("a node declares every parameter of the remover") {
  User user;
  RemoverConfig config;
  set_parameters(config, user);
  std::size_t count = 0;
  RemoverConfig::visit(config, [&](const auto& parameter) {
    ++count;
    REQUIRE(user.declared.count(parameter.name) == 1);
    CHECK_THAT(user.declared[parameter.name].description, StartsWith(parameter.help));
  });
  CHECK(user.declared.size() == count);
}

TEST_CASE("defaults stay exactly as they are") {
  const RemoverConfig expected = RemoverConfig::preset("odometry");
  RemoverConfig config = expected;
  set_parameters(config, User());
  std::map<std::string, double> values;
  RemoverConfig::visit(expected, [&](const auto& parameter) {
    values[parameter.name] = static_cast<double>(parameter.value);
  });
  RemoverConfig::visit(config, [&](const auto& parameter) {
    CHECK(values[parameter.name] == static_cast<double>(parameter.value));
  });
  CHECK_FALSE(config.build_map);
}

TEST_CASE("values of the user are taken") {
  User user;
  user.numbers = {{"max_range", 80.0}, {"lookahead_scans", 20}, {"presume_dynamic", 0}};
  user.names = {{"decision", "window"}};
  RemoverConfig config;
  set_parameters(config, user);
  CHECK(config.max_range == 80.0);
  CHECK(config.evidence.lookahead_scans == 20);
  CHECK_FALSE(config.evidence.presume_dynamic);
  CHECK(config.decision == dynains::Decision::kWindow);
}

TEST_CASE("values that cannot be are refused with the reason") {
  const auto refusal_of = [](double window) { return refusal({{{"window", window}}}); };
  CHECK_THAT(refusal_of(65), StartsWith("window = 65: expected [2, 64]"));
  CHECK(refusal_of(64) == "accepted");
  CHECK_THAT(refusal_of(4294967300.0), StartsWith("window = 4294967300"));  // 4 in 32 bits
  CHECK_THAT(refusal({{}, {{"decision", "best"}}}),
             StartsWith("decision = best: expected window|free_space"));
}

TEST_CASE("the ends of a declared range are valid, also of open bounds") {
  User user;
  RemoverConfig config;
  set_parameters(config, user);
  std::size_t open_bounds = 0;
  RemoverConfig::visit(config, [&](const auto& parameter) {
    using Value = std::remove_reference_t<decltype(parameter.value)>;
    const ParameterText& text = user.declared[parameter.name];
    CHECK(text.is_bounded == dynains::kIsBounded<Value>);
    if constexpr (dynains::kIsBounded<Value>) {
      CHECK(parameter.bounds.contain(text.min));
      CHECK(parameter.bounds.contain(text.max));
      if (parameter.bounds.min_open || parameter.bounds.max_open) ++open_bounds;
    }
  });
  CHECK(open_bounds > 0);
  CHECK(user.declared["p_free"].min > 0.5);
  CHECK(user.declared["p_free"].min < 0.5001);
}

TEST_CASE("floats are declared as they are written") {
  CHECK(detail::decimal_value(0.1F) == 0.1);
  CHECK(detail::decimal_value(0.1) == 0.1);
  CHECK(static_cast<float>(detail::decimal_value(1.0F / 3.0F)) == 1.0F / 3.0F);
}

}  // namespace
}  // namespace dynains_ros
