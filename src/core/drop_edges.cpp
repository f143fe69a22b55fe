#include <algorithm>
#include <cmath>

#include "smoke_ground_reconstruction/drop_offs.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr int kAngles = 180;  // of an edge's normal, coarse search
constexpr double kStepDeg = 2.0;
constexpr int kFineAngles = 10;  // to either side of the best one
constexpr double kFineStepDeg = 0.2;
constexpr double kSlot = 0.01;  // of an edge's distance from the sensor [m]
constexpr int kSlots = 1200;
constexpr double kMarginWorth = 2.0;  // columns that a metre between floor and drop is worth
constexpr double kMostMargin = 0.5;   // ... and no more room than this [m]
constexpr double kAlignedShare = 0.6;
constexpr double kAcross = 0.15;  // least cosine between a column and the normal of an edge
constexpr std::size_t kEdgeColumns = 6;
constexpr std::size_t kMostEdges = 6;
constexpr double kLikeNormals = 0.9;  // cosine between normals of what is one line
constexpr double kDoubtShare = 0.8;   // of the columns of an edge make another one as likely
constexpr double kPassed = 0.1;       // floor so far beyond an edge: it does not go on there [m]
constexpr std::size_t kPassedColumns = 2;
constexpr double kWidestSpan = 90.0;  // between two columns of one edge [deg]

int slotOf(double distance) {
  return static_cast<int>(std::min<double>(kSlots, std::max(0.0, distance / kSlot)));
}

}  // namespace

DropEdgeFinder::DropEdgeFinder() : change_(kSlots + 2, 0) {
  for (int k = 0; k < kAngles; ++k) normals_.push_back(Direction::fromDegrees(kStepDeg * k));
}

void DropEdgeFinder::find(const DropColumns& columns, const std::vector<Direction>& middle,
                          const std::vector<std::array<double, 2>>& walls, double place,
                          std::vector<DropEdge>* edges) {
  edges->clear();
  place_ = place;
  left_ = columns.sees;
  for (std::size_t round = 0; round < kMostEdges; ++round) {
    use_.clear();
    for (std::size_t c = 0; c < left_.size(); ++c) {
      if (left_[c] != 0) use_.push_back({columns.before[c], columns.after[c], middle[c]});
    }
    findLikely(walls);
    if (likely_.empty()) break;
    still_ = left_;
    for (DropEdge& edge : likely_) {
      markExplained(columns, middle, &edge);
      if (longestRun(&edge)) edges->push_back(edge);
    }
  }
}

/// The line that lies between floor and drop in most columns, with most room; in doubt the others
/// that are as likely come after it.
void DropEdgeFinder::findLikely(const std::vector<std::array<double, 2>>& walls) {
  likely_.clear();
  if (use_.size() < kEdgeColumns) return;
  const Candidate free = freelyTurned();
  aligned_.clear();
  Candidate best;
  for (const auto& [x, y] : walls) {
    for (const auto& [nx, ny] : {std::array<double, 2>{x, y}, {-y, x}, {-x, -y}, {y, -x}}) {
      aligned_.push_back(candidate(nx, ny));
      if (aligned_.back().score > best.score) best = aligned_.back();
    }
  }
  if (best.columns >= std::max<double>(kEdgeColumns, kAlignedShare * free.columns)) {
    addLikely(best, true);
    for (const Candidate& one : aligned_) {
      const bool is_other = one.nx * best.nx + one.ny * best.ny < kLikeNormals;
      if (is_other && one.columns > kDoubtShare * best.columns) addLikely(one, true);
    }
    likely_.front().is_sure = likely_.size() == 1;
  } else if (free.columns >= static_cast<int>(kEdgeColumns)) {
    addLikely(free, false);
  }
}

void DropEdgeFinder::addLikely(const Candidate& line, bool is_aligned) {
  likely_.emplace_back();
  likely_.back().nx = line.nx;
  likely_.back().ny = line.ny;
  likely_.back().rho = line.rho;
  likely_.back().is_aligned = is_aligned;
}

/// The best line of any normal: a coarse search, then a fine one about its best.
DropEdgeFinder::Candidate DropEdgeFinder::freelyTurned() {
  Candidate best;
  double angle = 0.0;
  for (int k = 0; k < kAngles; ++k) {
    const Direction& normal = normals_[static_cast<std::size_t>(k)];
    const Candidate found = candidate(normal.cosine, normal.sine);
    if (found.score <= best.score) continue;
    best = found;
    angle = kStepDeg * k;
  }
  best = Candidate();
  for (int k = -kFineAngles; k <= kFineAngles; ++k) {
    const Direction normal = Direction::fromDegrees(angle + kFineStepDeg * k);
    const Candidate found = candidate(normal.cosine, normal.sine);
    if (found.score > best.score) best = found;
  }
  return best;
}

/// The line with a normal that most columns agree on, just before the drop begins.
DropEdgeFinder::Candidate DropEdgeFinder::candidate(double nx, double ny) {
  int first = kSlots, last = -1;
  for (const Column& column : use_) {
    const double across = nx * column.middle.cosine + ny * column.middle.sine;
    if (!(across > kAcross)) continue;
    const int low = slotOf(column.before * across - place_);
    const int high = slotOf(column.after * across + place_) + 1;
    ++change_[static_cast<std::size_t>(low)];
    --change_[static_cast<std::size_t>(high)];
    first = std::min(first, low);
    last = std::max(last, high);
  }
  return mostAgreed(nx, ny, first, last);
}

/// Counts the columns that agree on each distance, and clears the counts.
DropEdgeFinder::Candidate DropEdgeFinder::mostAgreed(double nx, double ny, int first, int last) {
  int agree = 0, most = 0, room = kSlots, at = 0;
  for (int slot = first; slot <= last; ++slot) {
    agree += change_[static_cast<std::size_t>(slot)];
    change_[static_cast<std::size_t>(slot)] = 0;
    if (slot >= kSlots || agree < most || agree == 0) continue;
    room = agree > most ? 1 : room + 1;
    most = agree;
    at = slot;
  }
  const double margin = std::min(kSlot * room, kMostMargin);
  return {nx, ny, at * kSlot - place_, most, most + kMarginWorth * margin};
}

/// Marks the columns that see floor before an edge and the drop behind it, and counts those that
/// speak against it; takes the former out of what is left.
void DropEdgeFinder::markExplained(const DropColumns& columns, const std::vector<Direction>& middle,
                                   DropEdge* edge) {
  explained_.clear();
  against_.assign(1, 0);
  edge->drop = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < left_.size(); ++c) {
    const double across = edge->across(middle[c]);
    const bool is_facing = across > kAcross;
    const double before = columns.before[c] * across;
    const bool agrees = is_facing && before <= edge->rho + place_ &&
                        columns.after[c] * across >= edge->rho - place_;
    if (agrees && still_[c] != 0) {
      explained_.push_back(c);
      left_[c] = 0;
      edge->drop = std::min(edge->drop, columns.after[c] * across);
    }
    const bool is_against =
        !is_facing || (!agrees && (columns.sees[c] != 0 || before > edge->rho + kPassed));
    against_.push_back(against_.back() + (is_against ? 1 : 0));
  }
}

/// The longest run of explained columns; false if it is too short. A run breaks where floor is
/// measured beyond the edge, where columns that see a drop do not agree, and where the edge is not
/// seen for too long.
bool DropEdgeFinder::longestRun(DropEdge* edge) {
  const std::size_t n = explained_.size(), columns = left_.size();
  if (n < kEdgeColumns) return false;
  joins_.resize(n);
  std::size_t start = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = explained_[i], b = explained_[(i + 1) % n];
    const std::size_t step = b > a ? b - a : b + columns - a;
    const std::size_t passed =
        b > a ? against_[b] - against_[a + 1] : against_[columns] - against_[a + 1] + against_[b];
    const bool joins =
        static_cast<double>(step) <= kWidestSpan * static_cast<double>(columns) / 360.0 &&
        passed < kPassedColumns;
    joins_[i] = joins ? 1 : 0;
    if (!joins) start = i + 1;
  }
  std::size_t begin = 0, longest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const bool goes_on = joins_[(start + k) % n] != 0 && k + 1 < n;
    if (goes_on) continue;
    if (k - begin + 1 > longest) {
      longest = k - begin + 1;
      edge->first = explained_[(start + begin) % n];
      const std::size_t last = explained_[(start + k) % n];
      edge->count = (last + columns - edge->first) % columns + 1;
    }
    begin = k + 1;
  }
  return longest >= kEdgeColumns;
}

}  // namespace smoke_ground_reconstruction
