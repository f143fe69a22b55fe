#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

/// Name, datatype and offset of each field of a cloud on one line, for error messages.
std::string describeFields(const sensor_msgs::PointCloud2& cloud);

/// A PointCloud2 that was checked before it is read, and the scan that lies in it.
///
/// Fields are found by name and datatype: x, y, z as FLOAT32 or FLOAT64, `intensity` as any
/// number, `ring` as any integer. Fields may be unaligned, points may be organised in rows with
/// padding. Float coordinates and 16-bit rings are read where they lie; other types, and rows with
/// padding, are converted once, in memory kept from view to view. The message must outlive the
/// view.
class CloudView {
 public:
  /// \throws std::invalid_argument on a size that contradicts row_step, point_step or the data, on
  ///         a field outside its point, on big-endian data, on a ring number outside 0..65535, and
  ///         on a missing or unreadable x, y, z or intensity (the message lists the fields found).
  ///         An empty cloud is valid whatever its fields.
  explicit CloudView(const sensor_msgs::PointCloud2& cloud);
  CloudView(const CloudView&) = delete;  // its scan points into the vectors it owns
  CloudView& operator=(const CloudView&) = delete;

  /// The points in message order, row by row.
  const ScanView& scan() const { return scan_; }
  std::size_t size() const { return scan_.size; }
  const sensor_msgs::PointCloud2& message() const { return cloud_; }

  /// Nothing had to be converted, packed or derived.
  bool isReadInPlace() const;

  /// False: the driver sends no `ring`, and scan().ring was derived from elevation.
  bool hasRing() const { return has_ring_; }
  /// Derived rings, one per point; empty where the message has them.
  const std::vector<std::uint16_t>& derivedRings() const { return derived_rings_; }

  /// The bytes of a point, message().point_step of them.
  const std::uint8_t* point(std::size_t index) const { return points_ + index * cloud_.point_step; }

 private:
  void pack();
  void readCoordinates();
  void readIntensity();
  void readRing();

  const sensor_msgs::PointCloud2& cloud_;
  const std::uint8_t* points_ = nullptr;
  Recycled<std::uint8_t> packed_;  // rows without their padding
  std::array<Recycled<float>, 4> converted_;
  Recycled<std::uint16_t> converted_rings_;
  std::vector<std::uint16_t> derived_rings_;
  ScanView scan_;
  bool has_ring_ = true;
};

/// A field to append to the points of a cut cloud: one value per point of the *input* cloud.
struct AppendedField {
  std::string name;
  std::uint8_t datatype;  ///< of sensor_msgs::PointField
  std::size_t size;       ///< bytes of a value
  const void* values;

  static AppendedField of(const std::string& name, const std::vector<std::uint16_t>& values);
  static AppendedField of(const std::string& name, const std::vector<std::uint32_t>& values);
};

/// How many points bear a label.
std::size_t countPoints(const std::vector<Label>& labels, Label label);

/// Gives a cloud of the points of one label all but their bytes: same header, same fields,
/// height 1. \param labels  one per point of the cloud. \param appended  fields added after the
/// cloud's own. \param cut  all of it but `data` is overwritten. \throws std::invalid_argument
/// where the cloud has a field of an appended name already.
void frameCut(const sensor_msgs::PointCloud2& cloud, const std::vector<Label>& labels, Label label,
              const std::vector<AppendedField>& appended, sensor_msgs::PointCloud2* cut);

/// Writes the points of one label in their order, each with its appended values: row_step bytes of
/// what frameCut() gives.
void writePoints(const CloudView& cloud, const std::vector<Label>& labels, Label label,
                 const std::vector<AppendedField>& appended, std::uint8_t* to);

/// Both: the points of one label as a cloud.
/// \param cut  overwritten; its memory is used.
void selectPoints(const CloudView& cloud, const std::vector<Label>& labels, Label label,
                  const std::vector<AppendedField>& appended, sensor_msgs::PointCloud2* cut);

/// The field `ring` to append where the driver sends none, so that all stages number alike.
std::vector<AppendedField> missingRing(const CloudView& cloud);

}  // namespace smoke_ground_reconstruction
