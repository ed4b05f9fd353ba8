// Parameters of the free-space evidence.
#pragma once

#include "dynains/parameters.hpp"

namespace dynains {

/// Goes beyond the paper: a place where an object stood and through which a beam of another scan
/// passed was not static. Tested ranges and reasons stand in docs/accuracy.md.
struct FreeSpaceConfig {
  int horizon = 30;              ///< scans until the final verdict
  int memory = 100;              ///< scans back that still give evidence
  int reference_step = 2;        ///< scans from one that gives evidence to the next
  double evidence_range = 80.0;  ///< m, horizontal; points beyond are not tested
  double supervoxel = 0.75;      ///< m, samples that share a belief
  int supervoxel_samples = 4;    ///< samples of a supervoxel at most
  double ground_sample = 1.2;    ///< m, one sample per voxel of ground beside removed instances
  double ground_reach = 2.0;     ///< m, ground this near to removed points is tested
  double margin = 0.25;          ///< m, a beam passes if it goes this much farther ...
  double margin_slope = 0.0075;  ///< ... plus this share of the range
  double lateral_margin = 0.07;  ///< m, returns protect what is this near beside them
  double p_free = 0.7;           ///< update probability of a reference that sees through
  double p_hit = 0.155;          ///< update probability of a reference that hits
  double tau_free = 0.65;        ///< belief above which a place that no reference hit was free
  double tau_contested = 0.9;    ///< the same if some reference hit it
  double tau_whole = 0.84;       ///< the same for a whole instance at once
  double remove_share = 0.2;     ///< share of free supervoxels that removes the whole instance
  double see_share = 0.6;        ///< share of an instance that one reference must see through
  double footprint = 0.3;        ///< m, ground this near to removed points goes with them ...
  double footprint_rise = 0.03;  ///< ... if it rises so much (m) over the ground around; 0: all
  bool use_tracks = true;        ///< carry beliefs along instances that overlap from scan to scan
  double tau_track = 0.87;       ///< belief along its track from which an instance moved
  double still_weight = 0.1;     ///< of an increment, for a scan in which an instance stood still
  double track_cell = 1.2;       ///< m, cells whose overlap links instances
  double track_overlap = 0.25;   ///< shared cells over all cells from which two are the same
  double track_length = 18.0;    ///< m, longer instances are not carried
  double track_height = 4.5;     ///< m, higher instances are not carried
  double passage_cell = 0.6;     ///< m, cells in which is counted how much of what is met moves
  double passage_share = 0.65;   ///< share of that from which the rest moves, too; 1: never
  bool see_past_movers = true;   ///< returns of what moves protect nothing about them
  bool presume_dynamic = true;   ///< zero latency: compact instances nobody has confirmed yet

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"horizon", self.horizon, closed(0, 100), "scans",
                      "scans until a verdict is final"});
    visitor(Parameter{"memory", self.memory, closed(0, 200), "scans",
                      "scans back that still give evidence"});
    visitor(Parameter{"reference_step", self.reference_step, closed(1, 10), "scans",
                      "one of so many scans is kept as a reference that gives evidence on others"});
    visitor(Parameter{"evidence_range", self.evidence_range, closed(5, 300), "m",
                      "points farther away (horizontally) are not tested for free space"});
    visitor(Parameter{"supervoxel", self.supervoxel, closed(0.1, 5), "m",
                      "samples in one voxel of this size share a belief"});
    visitor(Parameter{"supervoxel_samples", self.supervoxel_samples, closed(1, 64), "",
                      "samples of a supervoxel at most; beyond, they say little that is new"});
    visitor(Parameter{"ground_sample", self.ground_sample, closed(0.05, 2), "m",
                      "one ground sample per voxel of this size"});
    visitor(Parameter{"ground_reach", self.ground_reach, closed(0, 10), "m",
                      "ground this near to removed points is tested for free space, and tells how "
                      "high that under them rises (footprint_rise); 0: none, all of that goes"});
    visitor(Parameter{"margin", self.margin, closed(0.02, 2), "m",
                      "a beam passes a sample if it returns from this much farther away"});
    visitor(Parameter{"margin_slope", self.margin_slope, closed(0, 0.1), "m/m",
                      "growth of the margin with range"});
    visitor(Parameter{"lateral_margin", self.lateral_margin, closed(0, 1), "m",
                      "a return protects what is this near beside it, and at least its 3x3 cells"});
    visitor(Parameter{"p_free", self.p_free, open(0.5, 1), "",
                      "update probability of a reference that sees through (form of Eq. 18)"});
    visitor(Parameter{"p_hit", self.p_hit, open(0, 0.5), "",
                      "update probability of a reference that hits (form of Eq. 18)"});
    visitor(Parameter{"tau_free", self.tau_free, open(0.5, 1), "",
                      "belief from which a place that no reference hit was free (form of Eq. 19)"});
    visitor(Parameter{"tau_contested", self.tau_contested, open(0.5, 1), "",
                      "the same for a place that some reference hit"});
    visitor(Parameter{"tau_whole", self.tau_whole, open(0.5, 1), "",
                      "the same for all of an instance taken together"});
    visitor(Parameter{"remove_share", self.remove_share, half_open_below(0, 1), "",
                      "share of free supervoxels from which the whole instance goes"});
    visitor(Parameter{"see_share", self.see_share, half_open_below(0, 1), "",
                      "share of an instance that one reference must see through to remove it"});
    visitor(Parameter{"footprint", self.footprint, closed(0, 2), "m",
                      "ground this near to removed points goes with them; 0: none"});
    visitor(Parameter{"footprint_rise", self.footprint_rise, closed(0, 1), "m",
                      "only what rises so much over the ground around goes, with what shares its "
                      "cell of the footprint; 0: all of it"});
    visitor(Parameter{"use_tracks", self.use_tracks, Bounds(), "",
                      "carry beliefs along instances that overlap from scan to scan"});
    visitor(Parameter{"tau_track", self.tau_track, open(0.5, 1), "",
                      "belief along its track from which an instance moved (form of Eq. 19)"});
    visitor(Parameter{"still_weight", self.still_weight, closed(0, 10), "",
                      "share of an increment that a scan in which an instance stood still takes "
                      "from the belief along its track"});
    visitor(Parameter{"track_cell", self.track_cell, closed(0.2, 5), "m",
                      "cells whose overlap links instances of consecutive scans"});
    visitor(Parameter{"track_overlap", self.track_overlap, half_open_below(0, 1), "",
                      "shared cells over all cells from which two instances are the same object"});
    visitor(Parameter{"track_length", self.track_length, closed(0, 100), "m",
                      "longer instances are not carried through time"});
    visitor(Parameter{"track_height", self.track_height, closed(0, 100), "m",
                      "higher instances are not carried through time"});
    visitor(Parameter{"passage_cell", self.passage_cell, closed(0.1, 5), "m",
                      "cells in which is counted how much of what is met there moves"});
    visitor(Parameter{"passage_share", self.passage_share, half_open_below(0, 1), "",
                      "share of what is met in a place that moves, from which the rest goes, too; "
                      "1: never"});
    visitor(Parameter{"see_past_movers", self.see_past_movers, Bounds(), "",
                      "returns of what surely moves neither show that its place is occupied nor "
                      "protect what is beside them"});
    visitor(Parameter{"presume_dynamic", self.presume_dynamic, Bounds(), "",
                      "the zero-latency verdict calls compact instances dynamic whose place no "
                      "earlier scan has seen; without effect where that is final (horizon 0)"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("FreeSpaceEvidence", *this); }
};

}  // namespace dynains
