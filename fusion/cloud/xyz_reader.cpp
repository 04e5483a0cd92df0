// Points as lines of text: XYZ and 3DTK's .3d.
#include <algorithm>
#include <cmath>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::size_t kMaxColumns = 7;

struct Line {
  std::array<double, kMaxColumns> numbers{};
  std::size_t count = 0;          ///< number of values read
  std::string_view not_a_number;  ///< the word at which parsing stopped
  bool more = false;
};

Line numbers_of(std::string_view text) {
  Line line;
  // Files separated by commas or semicolons do not use them otherwise.
  const char also = text.find(';') != std::string_view::npos ? ';' : ',';
  for (std::string_view word = next_token(text, also); !word.empty(); word = next_token(text, also)) {
    if (word.front() == '#' || word.starts_with("//")) break;
    if (line.count == kMaxColumns) {
      line.more = true;
      break;
    }
    const auto number = parse_number<double>(word);
    if (!number) {
      line.not_a_number = word;
      break;
    }
    line.numbers[line.count++] = *number;
  }
  return line;
}

/// Meaning of the columns after x y z, from the first line that has them.
class Columns {
 public:
  Columns() = default;
  Columns(const Line& first, bool uos, CloudBuilder& builder) : count_(first.count) {
    for (const Column column : {Column::x, Column::y, Column::z}) builder.declare(column);
    if (uos) return;
    const auto are_bytes = [&first](std::size_t from) {
      return std::all_of(first.numbers.begin() + static_cast<std::ptrdiff_t>(from),
                         first.numbers.begin() + static_cast<std::ptrdiff_t>(from) + 3,
                         [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); });
    };
    const double length = std::hypot(first.numbers[3], first.numbers[4], first.numbers[5]);
    if (count_ == 6 && std::abs(length - 1) < 0.02) {
      normal_ = 3;
      for (const Column column : {Column::nx, Column::ny, Column::nz}) builder.declare(column);
    } else if ((count_ == 6 && are_bytes(3)) || (count_ == 7 && are_bytes(4))) {
      colour_ = count_ - 3;
      for (const Column column : {Column::red, Column::green, Column::blue}) {
        builder.declare(column, Scalar::u8);
      }
    } else if (count_ > 3) {
      builder.note("columns after x y z left out: neither colours (0 to 255) nor unit normals");
    }
  }

  std::size_t count() const { return count_; }
  void fill(const Line& line, Record& record) const {
    std::copy_n(line.numbers.begin(), 3, record.begin());
    if (normal_ != 0) std::copy_n(line.numbers.begin() + normal_, 3, record.begin() + 3);
    if (colour_ != 0) std::copy_n(line.numbers.begin() + colour_, 3, record.begin() + 6);
  }

 private:
  std::size_t count_ = 0;
  std::size_t normal_ = 0, colour_ = 0;  ///< index of the first of three; 0: none
};

}  // namespace

Result<ScanFile> parse_xyz(std::string_view bytes, CloudBuilder builder, bool uos) {
  LineCursor lines(bytes);
  if (uos) lines.next();
  Columns columns;
  Record record{};
  while (const auto text = lines.next()) {
    const Line line = numbers_of(*text);
    const bool heading = lines.number() == 1 && (line.count == 1 || !line.not_a_number.empty());
    if (heading || (line.count == 0 && line.not_a_number.empty())) continue;
    if (line.count < 3 || !line.not_a_number.empty()) {
      return error_at_line(
          builder.name(), lines.number(),
          "expected x y z as numbers, not " +
              (line.not_a_number.empty() ? "the end of the line" : in_quotes(line.not_a_number)));
    }
    if (columns.count() == 0) {
      columns = Columns(line, uos, builder);
      const auto rest = static_cast<std::uint64_t>(std::count(bytes.begin(), bytes.end(), '\n')) + 1;
      if (Status status = builder.reserve(rest); !status) return status.error();
    }
    if (line.count != columns.count()) {
      return error_at_line(builder.name(), lines.number(),
                           "expected " + std::to_string(columns.count()) + " numbers as before, not " +
                               std::to_string(line.count));
    }
    columns.fill(line, record);
    builder.add(record);
  }
  return builder.finish();
}

}  // namespace parhelion::cloud
