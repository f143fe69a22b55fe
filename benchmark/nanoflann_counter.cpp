#include "nanoflann_counter.hpp"

#include <nanoflann.hpp>

namespace smoke_ground_reconstruction {

namespace {

/// The valid points as nanoflann asks for them.
struct Points {
  const Scan& scan;
  std::vector<std::uint32_t> valid;

  explicit Points(const Scan& of) : scan(of) {
    for (std::uint32_t i = 0; i < scan.size(); ++i) {
      if (scan.valid[i] != 0) valid.push_back(i);
    }
  }
  std::size_t kdtree_get_point_count() const { return valid.size(); }
  float kdtree_get_pt(std::size_t entry, std::size_t axis) const {
    return scan.point(valid[entry])[axis];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>, Points, 3>;

/// Keeps nothing but the number, and asks for no more than the limit.
struct CountOnly {
  float squared_radius;
  std::size_t limit;
  std::size_t found = 0;

  std::size_t size() const { return found; }
  bool full() const { return found >= limit; }
  float worstDist() const { return squared_radius; }
  bool addPoint(float squared_distance, std::uint32_t /*index*/) {
    if (squared_distance < squared_radius) ++found;
    return found < limit;
  }
};

class NanoflannCounter : public NeighborCounter {
 public:
  explicit NanoflannCounter(const Scan& scan)
      : NeighborCounter(scan),
        points_(scan),
        tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}

  std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const override {
    const auto query = scan_.point(index);
    CountOnly result{static_cast<float>(squared_radius), limit + 1 == 0 ? limit : limit + 1};
    tree_.findNeighbors(result, query.data(), nanoflann::SearchParams());
    return result.found == 0 ? 0 : result.found - 1;  // the point finds itself
  }

 private:
  Points points_;
  Tree tree_;
};

}  // namespace

std::unique_ptr<NeighborCounter> makeNanoflannCounter(const Scan& scan) {
  return std::make_unique<NanoflannCounter>(scan);
}

}  // namespace smoke_ground_reconstruction
