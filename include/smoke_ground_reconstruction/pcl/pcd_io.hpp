#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace smoke_ground_reconstruction {

/// Type of a number in a .pcd file; the values are those of pcl::PCLPointField.
enum class PcdType : std::uint8_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kFloat32 = 7,
  kFloat64 = 8,
};

/// Bytes of one number.
std::size_t sizeOf(PcdType type);

/// One field of all points, packed: point after point, `count` numbers each.
struct PcdColumn {
  std::string name;
  PcdType type = PcdType::kFloat32;
  std::size_t count = 1;
  std::vector<std::uint8_t> bytes;
};

/// The points of a .pcd file, field by field.
struct PcdTable {
  std::size_t points = 0;
  std::vector<PcdColumn> columns;
};

/// Reads any .pcd file (ASCII, binary or compressed) with whatever fields it has.
/// \throws std::runtime_error naming the file where it cannot be read.
PcdTable readPcd(const std::string& path);

/// Writes a binary .pcd file, unorganised.
/// \throws std::runtime_error naming the file where it cannot be written.
/// \throws std::invalid_argument where a column's bytes are not `points` times its size.
void writePcd(const std::string& path, const PcdTable& table);

}  // namespace smoke_ground_reconstruction
