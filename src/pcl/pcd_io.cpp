#include "smoke_ground_reconstruction/pcl/pcd_io.hpp"

#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

namespace smoke_ground_reconstruction {
namespace {

// PCL says what it thinks of a file on the console; our callers want one error.
class QuietPcl {
 public:
  QuietPcl() : level_(pcl::console::getVerbosityLevel()) {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~QuietPcl() { pcl::console::setVerbosityLevel(level_); }
  QuietPcl(const QuietPcl&) = delete;
  QuietPcl& operator=(const QuietPcl&) = delete;

 private:
  pcl::console::VERBOSITY_LEVEL level_;
};

// The entries of a .pcd header in the order the format asks for. PCL's reader trusts them, and
// walks into memory that is not its own where one is missing, out of place or no number.
const char* const kHeaderOrder[] = {"VERSION", "FIELDS", "SIZE",      "TYPE",   "COUNT",
                                    "WIDTH",   "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};
using Header = std::map<std::string, std::vector<std::string>>;

std::size_t placeOf(const std::string& key) {
  const auto place = std::find(std::begin(kHeaderOrder), std::end(kHeaderOrder), key);
  if (place == std::end(kHeaderOrder)) throw std::runtime_error("its header is invalid");
  return static_cast<std::size_t>(place - std::begin(kHeaderOrder));
}

Header readHeader(std::istream& file) {
  Header header;
  std::string line;
  for (std::size_t next = 0; !header.count("DATA") && std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    if (!(words >> key) || key[0] == '#') continue;
    const std::size_t place = placeOf(key);
    if (place < next) throw std::runtime_error(key + " is out of place in its header");
    next = place + 1;
    for (std::string word; words >> word;) header[key].push_back(word);
  }
  return header;
}

std::size_t numberOf(const std::string& word) {
  const bool is_number = !word.empty() && word.size() < 10 &&
                         word.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number) throw std::runtime_error("'" + word + "' in its header is no number");
  return std::stoul(word);
}

std::size_t bytesOf(const std::string& type, std::size_t size, std::size_t count) {
  const bool is_known = type == "F"
                            ? size == 4 || size == 8
                            : (type == "I" || type == "U") && (size == 1 || size == 2 || size == 4);
  if (!is_known || count == 0 || count > 65536) {
    throw std::runtime_error("a field is of type " + type + " and size " + std::to_string(size) +
                             ", count " + std::to_string(count));
  }
  return size * count;
}

std::size_t pointStep(Header& header) {
  const std::size_t fields = header["FIELDS"].size();
  if (header["COUNT"].empty()) header["COUNT"].assign(fields, "1");
  if (header["SIZE"].size() != fields || header["TYPE"].size() != fields ||
      header["COUNT"].size() != fields) {
    throw std::runtime_error("FIELDS, SIZE, TYPE and COUNT differ in number");
  }
  std::size_t step = 0;
  for (std::size_t i = 0; i < fields; ++i) {
    step += bytesOf(header["TYPE"][i], numberOf(header["SIZE"][i]), numberOf(header["COUNT"][i]));
  }
  return step;
}

std::size_t pointCount(Header& header) {
  const std::size_t points = numberOf(header["WIDTH"][0]) * numberOf(header["HEIGHT"][0]);
  if (!header["POINTS"].empty() && numberOf(header["POINTS"][0]) != points) {
    throw std::runtime_error("POINTS is not WIDTH times HEIGHT");
  }
  return points;
}

std::size_t bytesLeft(std::istream& file) {
  const auto here = file.tellg();
  file.seekg(0, std::ios::end);
  return static_cast<std::size_t>(file.tellg() - here);
}

void checkFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot be opened");
  Header header = readHeader(file);
  for (const char* key : {"FIELDS", "SIZE", "TYPE", "WIDTH", "HEIGHT", "DATA"}) {
    if (header[key].empty()) throw std::runtime_error(std::string("no ") + key + " in its header");
  }
  const std::size_t bytes = pointStep(header) * pointCount(header);
  const std::string& data = header["DATA"][0];
  if (data != "ascii" && data != "binary" && data != "binary_compressed") {
    throw std::runtime_error("DATA is '" + data + "'");
  }
  if (data == "binary" && bytesLeft(file) < bytes) throw std::runtime_error("it is cut off");
  constexpr std::size_t kMaxBytes = std::size_t{1} << 31U;
  if (bytes > kMaxBytes) throw std::runtime_error("it claims more than 2 GiB of points");
}

bool isKnown(std::uint8_t datatype) {
  return datatype >= static_cast<std::uint8_t>(PcdType::kInt8) &&
         datatype <= static_cast<std::uint8_t>(PcdType::kFloat64);
}

PcdColumn columnOf(const pcl::PCLPointCloud2& cloud, const pcl::PCLPointField& field) {
  PcdColumn column{field.name, static_cast<PcdType>(field.datatype), field.count, {}};
  const std::size_t width = sizeOf(column.type) * column.count;
  const std::size_t points = static_cast<std::size_t>(cloud.width) * cloud.height;
  column.bytes.resize(points * width);
  for (std::size_t i = 0; i < points; ++i) {
    std::memcpy(column.bytes.data() + i * width,
                cloud.data.data() + i * cloud.point_step + field.offset, width);
  }
  return column;
}

bool fits(const pcl::PCLPointCloud2& cloud, const pcl::PCLPointField& field) {
  return isKnown(field.datatype) &&
         field.offset + sizeOf(static_cast<PcdType>(field.datatype)) * field.count <=
             cloud.point_step;
}

pcl::PCLPointCloud2 emptyCloud(const PcdTable& table) {
  pcl::PCLPointCloud2 cloud;
  for (const PcdColumn& column : table.columns) {
    const std::size_t width = sizeOf(column.type) * column.count;
    if (column.bytes.size() != table.points * width) {
      throw std::invalid_argument("field '" + column.name + "' has " +
                                  std::to_string(column.bytes.size()) + " bytes, not " +
                                  std::to_string(table.points * width));
    }
    pcl::PCLPointField field;
    field.name = column.name;
    field.offset = cloud.point_step;
    field.datatype = static_cast<std::uint8_t>(column.type);
    field.count = static_cast<std::uint32_t>(column.count);
    cloud.fields.push_back(field);
    cloud.point_step += static_cast<std::uint32_t>(width);
  }
  cloud.width = static_cast<std::uint32_t>(table.points);
  cloud.height = 1;
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.resize(table.points * cloud.point_step);
  return cloud;
}

}  // namespace

std::size_t sizeOf(PcdType type) {
  switch (type) {
    case PcdType::kInt8:
    case PcdType::kUint8:
      return 1;
    case PcdType::kInt16:
    case PcdType::kUint16:
      return 2;
    case PcdType::kInt32:
    case PcdType::kUint32:
    case PcdType::kFloat32:
      return 4;
    case PcdType::kFloat64:
      return 8;
  }
  throw std::invalid_argument("unknown type of a .pcd field");
}

PcdTable readPcd(const std::string& path) {
  const QuietPcl quiet;
  pcl::PCLPointCloud2 cloud;
  try {
    checkFile(path);
    if (pcl::PCDReader().read(path, cloud) < 0) throw std::runtime_error("its header is invalid");
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": not a readable .pcd file (" + error.what() + ")");
  }
  PcdTable table;
  table.points = static_cast<std::size_t>(cloud.width) * cloud.height;
  if (cloud.data.size() < table.points * cloud.point_step) {
    throw std::runtime_error(path + ": the .pcd file is cut off");
  }
  for (const pcl::PCLPointField& field : cloud.fields) {
    if (field.name == "_") continue;  // padding
    if (!fits(cloud, field)) {
      throw std::runtime_error(path + ": field '" + field.name + "' is of an unknown type");
    }
    table.columns.push_back(columnOf(cloud, field));
  }
  return table;
}

void writePcd(const std::string& path, const PcdTable& table) {
  const QuietPcl quiet;
  pcl::PCLPointCloud2 cloud = emptyCloud(table);
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const PcdColumn& column = table.columns[c];
    const std::size_t width = sizeOf(column.type) * column.count;
    for (std::size_t i = 0; i < table.points; ++i) {
      std::memcpy(cloud.data.data() + i * cloud.point_step + cloud.fields[c].offset,
                  column.bytes.data() + i * width, width);
    }
  }
  try {
    if (pcl::PCDWriter().writeBinary(path, cloud) < 0)
      throw std::runtime_error("no such place, or no room");
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": could not be written (" + error.what() + ")");
  }
}

}  // namespace smoke_ground_reconstruction
