// Where the time of one frame went.
#pragma once

namespace dynains {

/// Milliseconds per stage of one call.
struct StageTimes {
  double ingest = 0.0;      ///< copy of the cloud, labels of bad points
  double ground = 0.0;      ///< ground segmentation
  double window = 0.0;      ///< Eq. 3
  double cluster = 0.0;     ///< curved voxels and separation by scan, Eq. 4
  double descriptor = 0.0;  ///< Eq. 5-12 and, for proposals, the belief of Eq. 13-19
  double evidence = 0.0;    ///< free space seen by other scans
  double judge = 0.0;       ///< verdicts from that, also on ground; images of references
  double verdict = 0.0;     ///< from clusters and groups to points
  double map = 0.0;         ///< Eq. 1
  double revision = 0.0;    ///< revision of the map by the newest scan

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor("ingest", self.ingest);
    visitor("ground", self.ground);
    visitor("window", self.window);
    visitor("cluster", self.cluster);
    visitor("descriptor", self.descriptor);
    visitor("evidence", self.evidence);
    visitor("judge", self.judge);
    visitor("verdict", self.verdict);
    visitor("map", self.map);
    visitor("revision", self.revision);
  }

  double total() const {
    double result = 0.0;
    visit(*this, [&result](const char*, double milliseconds) { result += milliseconds; });
    return result;
  }
};

}  // namespace dynains
