// Parameters of the free-space evidence.
#pragma once

#include "dynains/parameters.hpp"

namespace dynains {

/// Parameters of the free-space evidence, an extension of the paper (docs/algorithm.md). `visit`
/// describes the fields.
struct FreeSpaceConfig {
  int lookahead_scans = 30;
  int lookback_scans = 100;
  int reference_step = 2;        ///< scans
  double evidence_range = 80.0;  ///< m
  double supervoxel = 0.75;      ///< m
  int supervoxel_samples = 4;
  double ground_sample = 1.2;    ///< m
  double margin = 0.25;          ///< m
  double margin_slope = 0.0075;  ///< m per m of range
  double lateral_margin = 0.07;  ///< m
  double pose_tolerance = 0.02;  ///< m
  double p_free = 0.7;           ///< form of Eq. 18
  double p_hit = 0.155;          ///< form of Eq. 18
  double tau_free = 0.65;        ///< form of Eq. 19
  double tau_contested = 0.9;    ///< form of Eq. 19
  double removal_ratio = 0.22;
  double footprint = 0.4;         ///< m
  double footprint_rise = 0.025;  ///< m
  double track_cell = 1.2;        ///< m
  double track_overlap = 0.25;
  double track_length = 18.0;      ///< m
  double track_height = 4.5;       ///< m
  double dynamic_grid_cell = 0.6;  ///< m
  double dynamic_grid_ratio = 0.65;
  bool presume_dynamic = true;

  /// For recordings: a verdict waits for 100 later scans.
  static FreeSpaceConfig offline() {
    FreeSpaceConfig config;
    config.lookahead_scans = 100;
    return config;
  }

  /// For an odometry, whose map shows errors of millimetres.
  static FreeSpaceConfig odometry() {
    FreeSpaceConfig config;
    config.pose_tolerance = 0.003;
    return config;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visit_visibility(self, visitor);
    visit_verdicts(self, visitor);
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("FreeSpaceEvidence", *this); }

 private:
  template <class Self, class Visitor>
  static void visit_visibility(Self& self, Visitor& visitor) {
    visitor(Parameter{"lookahead_scans", self.lookahead_scans, closed(0, 100), "scans",
                      "later scans that are used before a verdict is final"});
    visitor(Parameter{"lookback_scans", self.lookback_scans, closed(0, 200), "scans",
                      "earlier scans that are used as evidence"});
    visitor(Parameter{"reference_step", self.reference_step, closed(1, 10), "scans",
                      "distance between references; about 10 for those more than 30 scans back"});
    visitor(Parameter{"evidence_range", self.evidence_range, closed(5, 300), "m",
                      "points at a larger horizontal range are not tested"});
    visitor(Parameter{"supervoxel", self.supervoxel, closed(0.1, 5), "m",
                      "edge of a supervoxel, whose samples share a belief"});
    visitor(Parameter{"supervoxel_samples", self.supervoxel_samples, closed(1, 56), "",
                      "maximum number of samples of a supervoxel"});
    visitor(Parameter{"ground_sample", self.ground_sample, closed(0.05, 2), "m",
                      "edge of the voxels with one ground sample each"});
    visitor(Parameter{"margin", self.margin, closed(0.02, 2), "m",
                      "a beam passes a sample if its range is larger by at least this much"});
    visitor(Parameter{"margin_slope", self.margin_slope, closed(0, 0.1), "m/m",
                      "growth of the margin with range"});
    visitor(Parameter{
        "lateral_margin", self.lateral_margin, closed(0, 1), "m",
        "no sample at a smaller lateral distance from a return, or in its 3x3 cells, is free"});
    visitor(Parameter{"pose_tolerance", self.pose_tolerance, closed(0, 1), "m",
                      "poses that place static surfaces farther than this (rms) from earlier scans "
                      "are corrected for comparisons; 0: never"});
    visitor(Parameter{"p_free", self.p_free, open(0.5, 1), "",
                      "update probability of a reference whose beams pass (as Eq. 18)"});
    visitor(Parameter{"p_hit", self.p_hit, open(0, 0.5), "",
                      "update probability of a reference whose beams hit (as Eq. 18)"});
  }

  template <class Self, class Visitor>
  static void visit_verdicts(Self& self, Visitor& visitor) {
    visitor(Parameter{"tau_free", self.tau_free, open(0.5, 1), "",
                      "belief from which a supervoxel without hits was free (as Eq. 19)"});
    visitor(Parameter{"tau_contested", self.tau_contested, open(0.5, 1), "",
                      "belief from which a supervoxel with hits was free (as Eq. 19)"});
    visitor(Parameter{
        "removal_ratio", self.removal_ratio, half_open_below(0, 1), "",
        "ratio of free to decided samples of its track from which the whole instance is removed"});
    visitor(Parameter{"footprint", self.footprint, closed(0, 2), "m",
                      "ground nearer than this to removed points is removed"});
    visitor(Parameter{
        "footprint_rise", self.footprint_rise, closed(0, 1), "m",
        "ground in the footprint is removed only if it lies this much above the ground around"});
    visitor(Parameter{"track_cell", self.track_cell, closed(0.2, 5), "m",
                      "cells whose overlap links instances of consecutive scans"});
    visitor(Parameter{"track_overlap", self.track_overlap, half_open_below(0, 1), "",
                      "ratio of common to all cells from which two instances are one object"});
    visitor(Parameter{"track_length", self.track_length, closed(0, 100), "m",
                      "longer instances are not tracked"});
    visitor(Parameter{"track_height", self.track_height, closed(0, 100), "m",
                      "higher instances are not tracked"});
    visitor(Parameter{"dynamic_grid_cell", self.dynamic_grid_cell, closed(0.1, 5), "m",
                      "cells that count dynamic and static samples"});
    visitor(Parameter{
        "dynamic_grid_ratio", self.dynamic_grid_ratio, half_open_below(0, 1), "",
        "ratio of dynamic to all samples of a cell above which the others are removed; 1: never"});
    visitor(
        Parameter{"presume_dynamic", self.presume_dynamic, Bounds(), "",
                  "without latency, compact instances in places without earlier evidence are "
                  "removed, from the third scan of an epoch on; no effect with lookahead_scans 0"});
  }
};

}  // namespace dynains
