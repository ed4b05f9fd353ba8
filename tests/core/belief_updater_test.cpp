#include "dynains/belief/belief_updater.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using Heights = std::vector<float>;

double posterior_after(const BeliefUpdater::Config& config,
                       const std::vector<Heights>& observations, const Heights& cluster) {
  BeliefUpdater belief(config);
  for (const Heights& observation : observations) belief.update(observation, cluster);
  return belief.posterior();
}

// Eq. 13 and 14 in probabilities, without a sum of log-odds: p(m | z) of each observation is the
// geometric mean of the odds in Eq. 17 and 18.
double bayes_in_probabilities(const BeliefUpdater::Config& config,
                              const std::vector<Heights>& observations, const Heights& cluster) {
  double previous = config.prior;
  for (const Heights& observation : observations) {
    double odds = 1.0;
    int cells = 0;
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      const double low = std::min(observation[i], cluster[i]);
      const double high = std::max(observation[i], cluster[i]);
      if (high == 0.0) continue;  // empty in both: not in R
      ++cells;
      const double rho = low / high;  // Eq. 16
      const double inc = config.p_inc / (1.0 - config.p_inc);
      const double dec = config.p_dec / (1.0 - config.p_dec);
      odds *= rho == 0.0 ? inc * inc : rho < config.tau_rho ? inc : dec;
    }
    odds = cells == 0 ? 1.0 : std::pow(odds, 1.0 / cells);
    const double measured = odds / (1.0 + odds);
    const double p =
        (1.0 - measured) / measured * (1.0 - previous) / previous;  // Eq. 14, p(m) = 0.5
    previous = 1.0 / (1.0 + p);                                     // Eq. 13
  }
  return previous;
}

TEST_CASE("Eq. 13-19 of two observations worked by hand") {
  // logit(0.7) = ln(7/3) = 0.847298, logit(0.4) = ln(2/3) = -0.405465.
  // Cluster heights (1, 0, 0, 2).
  //   Oldest (0, 0, 0, 1.5): rho = 0/1 = 0 and 1.5/2 = 0.75 < 0.8; the two empty cells are not in R
  //     l(m|z_1) = (2 * 0.847298 + 0.847298) / 2 = 1.270947                          (Eq. 17, 18)
  //   Newest (1, 0, 0, 2): rho = 1 twice
  //     l(m|z_2) = (-0.405465 - 0.405465) / 2 = -0.405465
  //   l = 0 + 1.270947 - 0.405465 = 0.865482                                         (Eq. 15)
  //   p = 1 / (1 + exp(-0.865482)) = 1 / (1 + 0.420849) = 0.703805                   (Eq. 13)
  const Heights cluster = {1.0F, 0.0F, 0.0F, 2.0F};
  const Heights oldest = {0.0F, 0.0F, 0.0F, 1.5F};
  BeliefUpdater belief;
  CHECK(belief.posterior() == 0.5);
  belief.update(oldest, cluster);
  CHECK(belief.log_odds_value() == Approx(1.270947).epsilon(1e-6));
  belief.update(cluster, cluster);
  CHECK(belief.log_odds_value() == Approx(0.865482).epsilon(1e-6));
  CHECK(belief.posterior() == Approx(0.703805).epsilon(1e-6));
  CHECK(belief.is_dynamic());
  belief.reset();
  CHECK(belief.posterior() == 0.5);
}

TEST_CASE("belief in log-odds is Bayes in probabilities, with any prior") {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    BeliefUpdater::Config config;
    config.p_inc = random.uniform(0.51, 0.95);
    config.p_dec = random.uniform(0.05, 0.49);
    config.tau_rho = random.uniform(0.1, 1.0);
    config.prior = random.uniform(0.05, 0.95);
    const std::size_t cells = 1 + random.index(20);
    std::vector<Heights> observations(1 + random.index(5), Heights(cells));
    Heights cluster(cells, 0.0F);
    for (Heights& observation : observations) {
      for (std::size_t i = 0; i < cells; ++i) {
        observation[i] = random.index(3) == 0 ? 0.0F : random.uniform_float(0.0, 2.0);
        cluster[i] = std::max(cluster[i], observation[i]);
      }
    }
    INFO("seed " << seed);
    BeliefUpdater belief(config);
    for (const Heights& observation : observations) belief.update(observation, cluster);
    REQUIRE(belief.posterior() ==
            Approx(bayes_in_probabilities(config, observations, cluster)).epsilon(1e-9));
    belief.reset();
    REQUIRE(belief.posterior() == Approx(config.prior).epsilon(1e-12));
  }
}

TEST_CASE("a cell of exactly tau_rho agrees, one just below differs") {
  BeliefUpdater::Config config;
  config.tau_rho = 0.75;  // exact in binary
  CHECK(posterior_after(config, {{1.5F}}, {2.0F}) == Approx(0.4));
  CHECK(posterior_after(config, {{std::nextafter(1.5F, 0.0F)}}, {2.0F}) == Approx(0.7));
}

TEST_CASE("a cell that vanished weighs twice, one that nearly vanished once") {
  // 2 logit(0.7): odds (7/3)^2 = 49/9, p = 49/58.
  CHECK(posterior_after({}, {{0.0F}}, {2.0F}) == Approx(49.0 / 58.0));
  CHECK(posterior_after({}, {{1e-30F}}, {2.0F}) == Approx(0.7));
  BeliefUpdater::Config config;
  config.vanished_weight = 1.0;  // as the public implementation
  CHECK(posterior_after(config, {{0.0F}}, {2.0F}) == Approx(0.7));
}

TEST_CASE("a posterior of exactly tau_p is static, more is dynamic") {
  const Heights half = {1.0F}, whole = {2.0F};
  BeliefUpdater belief;
  CHECK(belief.posterior() == belief.config().tau_p);
  CHECK_FALSE(belief.is_dynamic());
  for (const double tau_p : {0.5, 0.699, 0.701}) {
    BeliefUpdater::Config config;
    config.tau_p = tau_p;
    BeliefUpdater updated(config);
    updated.update(half, whole);  // 0.7
    CHECK(updated.is_dynamic() == (tau_p < 0.7));
  }
}

TEST_CASE("observations without any occupied cell leave the belief as it is") {
  CHECK(posterior_after({}, {{0.0F, 0.0F}}, {0.0F, 0.0F}) == 0.5);
  CHECK(posterior_after({}, {{}}, {}) == 0.5);
}

}  // namespace
}  // namespace dynains::test
