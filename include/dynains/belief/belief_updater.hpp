// Belief that a cluster is dynamic, by the occupancy discrepancies of its observations (Eq. 13-19).
#pragma once

#include <algorithm>
#include <cstddef>

#include "dynains/belief/log_odds.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Binary Bayes filter over the observations of one cluster (Thrun, Burgard and Fox, Probabilistic
/// Robotics, 2005, Sec. 4.2). The heights of OccupancyDescriptor are its only input.
class BeliefUpdater {
 public:
  struct Config {
    double p_inc = 0.7;            ///< update probability of a cell that differs (Eq. 18)
    double p_dec = 0.4;            ///< update probability of a cell that agrees (Eq. 18)
    double tau_rho = 0.8;          ///< discrepancy ratio from which a cell agrees (Eq. 18)
    double tau_p = 0.5;            ///< posterior above which a cluster is dynamic (Eq. 19)
    double prior = 0.5;            ///< p(m) (Eq. 14)
    double vanished_weight = 2.0;  ///< weight of a cell with rho = 0 (Eq. 18)

    /// The public implementation of the paper.
    static Config published() {
      Config config;
      config.vanished_weight = 1.0;
      return config;
    }

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"p_inc", self.p_inc, open(0.5, 1), "",
                        "update probability of a cell that differs (Eq. 18)"});
      visitor(Parameter{"p_dec", self.p_dec, open(0, 0.5), "",
                        "update probability of a cell that agrees (Eq. 18)"});
      visitor(Parameter{"tau_rho", self.tau_rho, half_open_below(0, 1), "",
                        "height ratio from which a cell agrees (Eq. 18)"});
      visitor(Parameter{"tau_p", self.tau_p, open(0, 1), "",
                        "posterior above which a cluster is dynamic (Eq. 19)"});
      visitor(Parameter{"prior", self.prior, open(0, 1), "",
                        "probability of being dynamic before any observation (Eq. 14)"});
      visitor(Parameter{
          "vanished_weight", self.vanished_weight, closed(1, 10), "",
          "weight of a cell that is empty in the observation or in the cluster (Eq. 18)"});
    }

    /// Throws ConfigError.
    void validate() const { validate_parameters("BeliefUpdater", *this); }
  };

  BeliefUpdater() : BeliefUpdater(Config()) {}

  /// Throws ConfigError.
  explicit BeliefUpdater(const Config& config)
      : config_(config),
        increment_((config_.validate(), log_odds(config_.p_inc))),
        decrement_(log_odds(config_.p_dec)),
        log_odds_(log_odds(config_.prior)) {}

  const Config& config() const { return config_; }

  /// Resets the belief to the prior, for a new cluster.
  void reset() { log_odds_ = log_odds(config_.prior); }

  /// One step of Eq. 15 with the update term of Eq. 16-18, which compares the heights of one
  /// observation with the heights of the cluster. Both spans have one value per cell, m, not
  /// negative, and equal lengths. Cells that are empty in both are not in R (Eq. 17). If R is
  /// empty, the belief does not change.
  void update(Span<const float> observation, Span<const float> cluster) {
    // The sum of Eq. 17 follows from three counts, which do not depend on the order of cells.
    std::size_t vanished = 0;
    std::size_t changed = 0;
    std::size_t alike = 0;
    const auto tau = static_cast<float>(config_.tau_rho);
    for (std::size_t i = 0; i < observation.size(); ++i) {
      const float low = std::min(observation[i], cluster[i]);
      const float high = std::max(observation[i], cluster[i]);
      if (high == 0.0F) continue;
      if (low == 0.0F) {
        ++vanished;
      } else if (low < tau * high) {
        ++changed;
      } else {
        ++alike;
      }
    }
    const std::size_t cells = vanished + changed + alike;
    if (cells == 0) return;
    log_odds_ +=
        ((config_.vanished_weight * static_cast<double>(vanished) + static_cast<double>(changed)) *
             increment_ +
         static_cast<double>(alike) * decrement_) /
        static_cast<double>(cells);
  }

  /// Log-odds that the cluster is dynamic.
  double log_odds_value() const { return log_odds_; }

  /// p(m | z) (Eq. 13) from the log-odds of Eq. 15, in (0, 1).
  double posterior() const { return probability(log_odds_); }

  /// Verdict of Eq. 19: whether posterior() exceeds tau_p.
  bool is_dynamic() const { return posterior() > config_.tau_p; }

 private:
  Config config_;
  double increment_;
  double decrement_;
  double log_odds_;
};

}  // namespace dynains
