// LAS 1.0 to 1.4 (ASPRS), uncompressed, point formats 0 to 10: coordinates and, where the format has them,
// colours.
#include <array>
#include <bit>
#include <cmath>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::size_t kHeader = 227;  ///< bytes, of the shortest: 1.0 to 1.2
constexpr std::size_t kHeader14 = 375;
constexpr std::array<std::size_t, 11> kRecord{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr std::array<std::size_t, 11> kColour{0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};  ///< 0: none
constexpr double kFar = 10'000;  ///< m: floats of larger coordinates are coarser than a millimetre

struct LasHeader {
  std::uint64_t points = 0, data = 0;  ///< data: byte of the first record
  std::size_t format = 0, stride = 0;
  std::array<double, 3> scale{}, offset{};
};

class LasFile {
 public:
  LasFile(std::string_view bytes, CloudBuilder builder) : bytes_(bytes), builder_(std::move(builder)) {}

  Result<ScanFile> read() {
    if (Status status = read_header(); !status) return status.error();
    if (Status status = builder_.reserve(header_.points); !status) return status.error();
    declare();
    recentre();
    Record record{};
    for (std::uint64_t i = 0; i < header_.points; ++i) {
      const std::size_t at = header_.data + i * header_.stride;
      for (std::size_t axis = 0; axis < 3; ++axis) record[axis] = coordinate(at, axis) - centre_[axis];
      for (std::size_t c = 0; c < 3 && colour_ > 0; ++c)
        record[static_cast<std::size_t>(Column::red) + c] = number(at + colour_ + 2 * c, Scalar::u16);
      builder_.add(record);
    }
    return builder_.finish();
  }

 private:
  double number(std::size_t at, Scalar scalar) const {
    return load(bytes_.data() + at, scalar, std::endian::native != std::endian::little);
  }
  std::uint64_t whole(std::size_t at, Scalar scalar) const {
    return static_cast<std::uint64_t>(number(at, scalar));
  }
  double coordinate(std::size_t at, std::size_t axis) const {
    return number(at + 4 * axis, Scalar::i32) * header_.scale[axis] + header_.offset[axis];
  }
  Error wrong(std::size_t byte, const std::string& what) const {
    return error_at_byte(builder_.name(), byte, what);
  }

  Status read_header() {
    if (bytes_.size() < kHeader || !bytes_.starts_with("LASF"))
      return wrong(
          0, "expected a LAS header of at least " + std::to_string(kHeader) + " bytes that begins with LASF");
    const std::uint64_t major = whole(24, Scalar::u8), minor = whole(25, Scalar::u8);
    if (major != 1 || minor > 4)
      return wrong(24, "expected LAS 1.0 to 1.4, not " + std::to_string(major) + "." + std::to_string(minor));
    const std::uint64_t format = whole(104, Scalar::u8);
    if (format >= 64) {
      return wrong(104, "the points are compressed (LAZ): convert them: pdal translate " + builder_.name() +
                            " cloud.ply");
    }
    if (format >= kRecord.size())
      return wrong(104, "expected point format 0 to 10, not " + std::to_string(format));
    header_.format = static_cast<std::size_t>(format);
    header_.stride = whole(105, Scalar::u16);
    if (header_.stride < kRecord[header_.format]) {
      return wrong(105, "expected records of at least " + std::to_string(kRecord[header_.format]) +
                            " bytes for point format " + std::to_string(format) + ", not " +
                            std::to_string(header_.stride));
    }
    header_.data = whole(96, Scalar::u32);
    header_.points = whole(107, Scalar::u32);
    if (minor == 4 && header_.points == 0 && bytes_.size() >= kHeader14) {
      const double many = number(247, Scalar::u64);
      if (!(many < 1e15)) return wrong(247, "expected fewer points");
      header_.points = static_cast<std::uint64_t>(many);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      header_.scale[axis] = number(131 + 8 * axis, Scalar::f64);
      header_.offset[axis] = number(155 + 8 * axis, Scalar::f64);
      if (!std::isfinite(header_.scale[axis]) || header_.scale[axis] == 0 ||
          !std::isfinite(header_.offset[axis]))
        return wrong(131 + 8 * axis, "expected a finite scale other than 0, and a finite offset");
    }
    if (header_.data < kHeader || header_.data > bytes_.size() ||
        header_.points > (bytes_.size() - header_.data) / header_.stride) {
      return wrong(bytes_.size(), "the file ends; its header declares " + std::to_string(header_.points) +
                                      " points of " + std::to_string(header_.stride) + " bytes from byte " +
                                      std::to_string(header_.data));
    }
    return {};
  }

  void declare() {
    for (const Column column : {Column::x, Column::y, Column::z}) builder_.declare(column);
    const std::size_t first = kColour[header_.format];
    if (first == 0) return;
    double largest = 0;
    for (std::uint64_t i = 0; i < header_.points; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        largest = std::max(largest, number(header_.data + i * header_.stride + first + 2 * c, Scalar::u16));
    }
    if (largest <= 0) return;  // the format has colours, the file has none
    colour_ = first;
    // Many programs write bytes where the standard has 16 bits.
    for (const Column column : {Column::red, Column::green, Column::blue})
      builder_.declare(column, largest > 255 ? Scalar::u16 : Scalar::u8);
  }

  /// Coordinates of a national grid do not fit into floats: whole metres of the first point are taken off.
  void recentre() {
    if (header_.points == 0) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double first = coordinate(header_.data, axis);
      if (std::isfinite(first) && std::abs(first) > kFar) centre_[axis] = std::round(first);
    }
    if (centre_[0] == 0 && centre_[1] == 0 && centre_[2] == 0) return;
    std::string words;
    for (const double c : centre_)
      words += (words.empty() ? "" : ", ") + std::to_string(static_cast<long long>(c));
    builder_.note("large coordinates: " + words + " subtracted from x, y, z");
  }

  std::string_view bytes_;
  CloudBuilder builder_;
  LasHeader header_;
  std::size_t colour_ = 0;  ///< byte of a record; 0: no colours
  std::array<double, 3> centre_{};
};

}  // namespace

Result<ScanFile> parse_las(std::string_view bytes, CloudBuilder builder) {
  return LasFile(bytes, std::move(builder)).read();
}

}  // namespace parhelion::cloud
