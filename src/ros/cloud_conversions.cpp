#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"

#include <sensor_msgs/PointField.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

std::size_t sizeOf(std::uint8_t datatype) {
  switch (datatype) {
    case PointField::INT8:
    case PointField::UINT8:
      return 1;
    case PointField::INT16:
    case PointField::UINT16:
      return 2;
    case PointField::INT32:
    case PointField::UINT32:
    case PointField::FLOAT32:
      return 4;
    case PointField::FLOAT64:
      return 8;
    default:
      return 0;
  }
}

const char* nameOf(std::uint8_t datatype) {
  static const char* const kNames[] = {"type 0", "INT8",   "UINT8",   "INT16",  "UINT16",
                                       "INT32",  "UINT32", "FLOAT32", "FLOAT64"};
  return datatype < 9 ? kNames[datatype] : "unknown type";
}

// Some drivers leave count at 0 for a single value; PCL reads it so, too.
std::uint64_t countOf(const PointField& field) { return std::max(field.count, 1U); }

[[noreturn]] void refuse(const std::string& reason) { throw std::invalid_argument(reason); }

void checkSizes(const PointCloud2& cloud) {
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  if (cloud.point_step == 0) refuse("point_step is 0");
  if (cloud.row_step < row) {
    refuse("row_step " + std::to_string(cloud.row_step) +
           " is less than width * point_step = " + std::to_string(row));
  }
  const std::uint64_t bytes = std::uint64_t{cloud.height} * cloud.row_step;
  if (cloud.data.size() < bytes) {
    refuse("data holds " + std::to_string(cloud.data.size()) + " bytes, height * row_step asks " +
           std::to_string(bytes));
  }
}

void checkFields(const PointCloud2& cloud) {
  for (const PointField& field : cloud.fields) {
    if (sizeOf(field.datatype) == 0) {
      refuse("field '" + field.name + "' has unknown datatype " + std::to_string(field.datatype));
    }
    if (field.offset + sizeOf(field.datatype) * countOf(field) > cloud.point_step) {
      refuse("field '" + field.name + "' reaches beyond point_step " +
             std::to_string(cloud.point_step) + "; fields: " + describeFields(cloud));
    }
  }
}

const PointField* findField(const PointCloud2& cloud, const std::string& name) {
  const auto found = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                  [&](const PointField& field) { return field.name == name; });
  return found == cloud.fields.end() ? nullptr : &*found;
}

[[noreturn]] void refuseField(const PointCloud2& cloud, const std::string& name,
                              const std::string& types) {
  refuse("no single field '" + name + "' of " + types + "; fields: " + describeFields(cloud));
}

template <typename From, typename To>
void convert(const std::uint8_t* first, std::size_t step, std::vector<To>& values) {
  const StridedField<From> field(first, static_cast<std::ptrdiff_t>(step));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<To>(field[i]);
}

template <typename To>
void convertFrom(std::uint8_t datatype, const std::uint8_t* first, std::size_t step,
                 std::vector<To>& values) {
  switch (datatype) {
    case PointField::INT8:
      return convert<std::int8_t>(first, step, values);
    case PointField::UINT8:
      return convert<std::uint8_t>(first, step, values);
    case PointField::INT16:
      return convert<std::int16_t>(first, step, values);
    case PointField::UINT16:
      return convert<std::uint16_t>(first, step, values);
    case PointField::INT32:
      return convert<std::int32_t>(first, step, values);
    case PointField::UINT32:
      return convert<std::uint32_t>(first, step, values);
    case PointField::FLOAT32:
      return convert<float>(first, step, values);
    default:
      return convert<double>(first, step, values);
  }
}

bool isInteger(std::uint8_t datatype) { return datatype <= PointField::UINT32; }

void narrow(const std::vector<std::int64_t>& rings, std::vector<std::uint16_t>* narrowed) {
  narrowed->resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (rings[i] < 0 || rings[i] > std::numeric_limits<std::uint16_t>::max()) {
      refuse("ring " + std::to_string(rings[i]) + " of point " + std::to_string(i) +
             " is outside 0..65535");
    }
    (*narrowed)[i] = static_cast<std::uint16_t>(rings[i]);
  }
}

PointField appendedField(const PointCloud2& cloud, const AppendedField& appended,
                         std::uint32_t offset) {
  if (findField(cloud, appended.name) != nullptr) {
    refuse("the cloud has a field '" + appended.name + "' already");
  }
  PointField field;
  field.name = appended.name;
  field.offset = offset;
  field.datatype = appended.datatype;
  field.count = 1;
  return field;
}

// Copies one point or value. Of the sizes that drivers' points and our values have the compiler
// knows the moves, and calls no function.
void copyBytes(std::uint8_t* to, const std::uint8_t* from, std::size_t size) {
  switch (size) {
    case 2:
      return void(std::memcpy(to, from, 2));
    case 4:
      return void(std::memcpy(to, from, 4));
    case 22:
      return void(std::memcpy(to, from, 22));
    case 26:
      return void(std::memcpy(to, from, 26));
    case 32:
      return void(std::memcpy(to, from, 32));
    case 48:
      return void(std::memcpy(to, from, 48));
    default:
      std::memcpy(to, from, size);
  }
}

// Copies the points [begin, end); returns where the next one goes.
std::uint8_t* copyPoints(const CloudView& cloud, std::size_t begin, std::size_t end,
                         std::uint8_t* to) {
  const std::size_t bytes = (end - begin) * cloud.message().point_step;
  std::memcpy(to, cloud.point(begin), bytes);
  return to + bytes;
}

// Copies the points [begin, end), each with its appended values.
std::uint8_t* copyPoints(const CloudView& cloud, std::size_t begin, std::size_t end,
                         const std::vector<AppendedField>& appended, std::uint8_t* to) {
  for (std::size_t i = begin; i < end; ++i) {
    copyBytes(to, cloud.point(i), cloud.message().point_step);
    to += cloud.message().point_step;
    for (const AppendedField& field : appended) {
      copyBytes(to, static_cast<const std::uint8_t*>(field.values) + i * field.size, field.size);
      to += field.size;
    }
  }
  return to;
}

}  // namespace

std::string describeFields(const PointCloud2& cloud) {
  std::string text;
  for (const PointField& field : cloud.fields) {
    if (!text.empty()) text += ", ";
    text += field.name + " " + nameOf(field.datatype);
    if (countOf(field) > 1) text += "[" + std::to_string(field.count) + "]";
    text += " @" + std::to_string(field.offset);
  }
  return text.empty() ? "none" : text;
}

CloudView::CloudView(const PointCloud2& cloud) : cloud_(cloud) {
  scan_.size = static_cast<std::size_t>(std::uint64_t{cloud.width} * cloud.height);
  if (scan_.size == 0) {
    has_ring_ = findField(cloud, "ring") != nullptr;
    return;
  }
  if (cloud.is_bigendian) refuse("big-endian clouds are not read");
  checkSizes(cloud);
  checkFields(cloud);
  pack();
  readCoordinates();
  readIntensity();
  readRing();
}

void CloudView::pack() {
  points_ = cloud_.data.data();
  const std::size_t row = std::size_t{cloud_.width} * cloud_.point_step;
  if (cloud_.height == 1 || row == cloud_.row_step) return;
  packed_.reserve(row * cloud_.height);
  for (std::size_t i = 0; i < cloud_.height; ++i) {
    const auto begin = cloud_.data.begin() + static_cast<std::ptrdiff_t>(i * cloud_.row_step);
    packed_.insert(packed_.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
  }
  points_ = packed_.data();
}

void CloudView::readCoordinates() {
  const std::array<const char*, 3> names = {"x", "y", "z"};
  const std::array<StridedField<float>*, 3> targets = {&scan_.x, &scan_.y, &scan_.z};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const PointField* field = findField(cloud_, names[i]);
    if (field == nullptr || countOf(*field) != 1 || field->datatype < PointField::FLOAT32) {
      refuseField(cloud_, names[i], "FLOAT32 or FLOAT64");
    }
    if (field->datatype == PointField::FLOAT32) {
      *targets[i] = StridedField<float>(points_ + field->offset, cloud_.point_step);
      continue;
    }
    converted_[i].resize(scan_.size);
    convertFrom(field->datatype, points_ + field->offset, cloud_.point_step, converted_[i]);
    *targets[i] = StridedField<float>(converted_[i].data(), sizeof(float));
  }
}

void CloudView::readIntensity() {
  const PointField* field = findField(cloud_, "intensity");
  if (field == nullptr || countOf(*field) != 1) refuseField(cloud_, "intensity", "numbers");
  if (field->datatype == PointField::FLOAT32) {
    scan_.intensity = StridedField<float>(points_ + field->offset, cloud_.point_step);
    return;
  }
  converted_[3].resize(scan_.size);
  convertFrom(field->datatype, points_ + field->offset, cloud_.point_step, converted_[3]);
  scan_.intensity = StridedField<float>(converted_[3].data(), sizeof(float));
}

void CloudView::readRing() {
  const PointField* field = findField(cloud_, "ring");
  has_ring_ = field != nullptr;
  if (!has_ring_) {
    derived_rings_ = ringsFromElevation(scan_);
    scan_.ring = StridedField<std::uint16_t>(derived_rings_.data(), sizeof(std::uint16_t));
    return;
  }
  if (countOf(*field) != 1 || !isInteger(field->datatype)) {
    refuseField(cloud_, "ring", "integers");
  }
  const std::uint8_t* first = points_ + field->offset;
  if (field->datatype == PointField::UINT16) {
    scan_.ring = StridedField<std::uint16_t>(first, cloud_.point_step);
    return;
  }
  Recycled<std::int64_t> wide(scan_.size);
  convertFrom(field->datatype, first, cloud_.point_step, wide);
  narrow(wide, &converted_rings_);
  scan_.ring = StridedField<std::uint16_t>(converted_rings_.data(), sizeof(std::uint16_t));
}

bool CloudView::isReadInPlace() const {
  const bool is_converted =
      std::any_of(converted_.begin(), converted_.end(),
                  [](const std::vector<float>& field) { return !field.empty(); });
  return has_ring_ && packed_.empty() && !is_converted && converted_rings_.empty();
}

AppendedField AppendedField::of(const std::string& name, const std::vector<std::uint16_t>& values) {
  return {name, PointField::UINT16, sizeof(std::uint16_t), values.data()};
}

AppendedField AppendedField::of(const std::string& name, const std::vector<std::uint32_t>& values) {
  return {name, PointField::UINT32, sizeof(std::uint32_t), values.data()};
}

// In bytes, which a vector holds most of, as far as they do not overflow.
std::size_t countPoints(const std::vector<Label>& labels, Label label) {
  constexpr std::size_t kBlock = 255;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < labels.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, labels.size());
    std::uint8_t here = 0;
    for (std::size_t i = begin; i < end; ++i) {
      here = static_cast<std::uint8_t>(here + (labels[i] == label ? 1 : 0));
    }
    count += here;
  }
  return count;
}

void frameCut(const PointCloud2& cloud, const std::vector<Label>& labels, Label label,
              const std::vector<AppendedField>& appended, PointCloud2* cut) {
  cut->header = cloud.header;
  cut->fields = cloud.fields;
  cut->point_step = cloud.point_step;
  for (const AppendedField& field : appended) {
    cut->fields.push_back(appendedField(cloud, field, cut->point_step));
    cut->point_step += static_cast<std::uint32_t>(field.size);
  }
  cut->height = 1;
  cut->width = static_cast<std::uint32_t>(countPoints(labels, label));
  cut->row_step = cut->width * cut->point_step;
  cut->is_bigendian = false;
  cut->is_dense = true;  // a label other than kInvalid is given to finite points alone
}

void writePoints(const CloudView& cloud, const std::vector<Label>& labels, Label label,
                 const std::vector<AppendedField>& appended, std::uint8_t* to) {
  for (std::size_t end = 0; end < labels.size();) {  // neighbours go together
    std::size_t begin = end;
    while (begin < labels.size() && labels[begin] != label) ++begin;
    end = begin;
    while (end < labels.size() && labels[end] == label) ++end;
    to = appended.empty() ? copyPoints(cloud, begin, end, to)
                          : copyPoints(cloud, begin, end, appended, to);
  }
}

void selectPoints(const CloudView& cloud, const std::vector<Label>& labels, Label label,
                  const std::vector<AppendedField>& appended, PointCloud2* cut) {
  frameCut(cloud.message(), labels, label, appended, cut);
  cut->data.resize(cut->row_step);
  writePoints(cloud, labels, label, appended, cut->data.data());
}

std::vector<AppendedField> missingRing(const CloudView& cloud) {
  if (cloud.hasRing()) return {};
  return {AppendedField::of("ring", cloud.derivedRings())};
}

}  // namespace smoke_ground_reconstruction
