// PCD files (Point Cloud Library, format 0.7 and similar).
#include <bit>
#include <limits>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"
#include "fusion/cloud/lzf.hpp"

namespace parhelion::cloud {
namespace {

struct PcdField {
  Column column = Column::ignored;
  std::uint64_t size = 4;
  char type = 'F';
  std::uint64_t count = 1;
  Scalar scalar = Scalar::f32;

  std::uint64_t bytes() const { return size * count; }
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::uint64_t width = 0, height = 1, points = 0;
  Eigen::Matrix<double, 7, 1> viewpoint = (Eigen::Matrix<double, 7, 1>() << 0, 0, 0, 1, 0, 0, 0).finished();
  std::string_view encoding;
  std::size_t body = 0;
  std::uint64_t lines = 0, stride = 0;
  bool has_width = false, has_points = false;
};

std::optional<Scalar> scalar_of(char type, std::uint64_t size) {
  switch (type) {
    case 'F':
      return size == 4 ? std::optional(Scalar::f32) : size == 8 ? std::optional(Scalar::f64) : std::nullopt;
    case 'I':
      switch (size) {
        case 1:
          return Scalar::i8;
        case 2:
          return Scalar::i16;
        case 4:
          return Scalar::i32;
        case 8:
          return Scalar::i64;
      }
      break;
    case 'U':
      switch (size) {
        case 1:
          return Scalar::u8;
        case 2:
          return Scalar::u16;
        case 4:
          return Scalar::u32;
        case 8:
          return Scalar::u64;
      }
      break;
  }
  return std::nullopt;
}

/// One word for each field; false where there are too few or `set` rejects one.
template <class Set>
bool each_field(PcdHeader& header, std::string_view words, Set set) {
  for (PcdField& field : header.fields) {
    if (!set(field, next_token(words))) return false;
  }
  return next_token(words).empty();
}

bool take_count(std::string_view word, std::uint64_t& count) {
  const auto number = parse_number<std::uint64_t>(word);
  if (number) count = *number;
  return number.has_value();
}

/// Empty where the line was parsed; else what was expected.
std::string take_header_line(PcdHeader& header, std::string_view line) {
  const std::string_view keyword = next_token(line);
  if (keyword.empty() || keyword.front() == '#' || keyword == "VERSION") return "";
  if (keyword == "FIELDS" || keyword == "COLUMNS") {
    header.fields.clear();
    for (std::string_view word = next_token(line); !word.empty(); word = next_token(line)) {
      header.fields.push_back({.column = column_named(word)});
    }
    return "";
  }
  if (keyword == "SIZE") {
    return each_field(header, line, [](PcdField& f, auto word) { return take_count(word, f.size); })
               ? ""
               : "expected a SIZE for each field";
  }
  if (keyword == "TYPE") {
    const auto set = [](PcdField& f, auto word) { return word.size() == 1 && ((f.type = word[0]), true); };
    return each_field(header, line, set) ? "" : "expected a TYPE (F, I or U) for each field";
  }
  if (keyword == "COUNT") {
    const auto set = [](PcdField& f, auto word) {
      return take_count(word, f.count) && f.count > 0 && f.count < 65536;
    };
    return each_field(header, line, set) ? "" : "expected a COUNT of 1 to 65535 for each field";
  }
  if (keyword == "WIDTH")
    return (header.has_width = take_count(next_token(line), header.width)) ? "" : "expected a WIDTH";
  if (keyword == "HEIGHT") return take_count(next_token(line), header.height) ? "" : "expected a HEIGHT";
  if (keyword == "POINTS") {
    return (header.has_points = take_count(next_token(line), header.points)) ? ""
                                                                             : "expected a number of POINTS";
  }
  if (keyword == "VIEWPOINT") {
    for (double& value : header.viewpoint) {
      const auto number = parse_number<double>(next_token(line));
      if (!number) return "expected seven numbers (tx ty tz qw qx qy qz) after VIEWPOINT";
      value = *number;
    }
    return header.viewpoint.allFinite() ? "" : "expected a finite VIEWPOINT";
  }
  if (keyword == "DATA") {
    header.encoding = next_token(line);
    return header.encoding == "ascii" || header.encoding == "binary" || header.encoding == "binary_compressed"
               ? ""
               : "expected DATA ascii, binary or binary_compressed, not " + in_quotes(header.encoding);
  }
  return "expected a line of a PCD header, not " + in_quotes(keyword);
}

/// Checks the header's lines against each other; empty where they are consistent.
std::string check_header(PcdHeader& header) {
  if (header.width != 0 && header.height > std::numeric_limits<std::uint64_t>::max() / header.width) {
    return "WIDTH times HEIGHT is not a valid number of points";
  }
  if (header.has_width && header.has_points && header.width * header.height != header.points) {
    return "POINTS " + std::to_string(header.points) + " is not WIDTH times HEIGHT, " +
           std::to_string(header.width) + " x " + std::to_string(header.height);
  }
  if (!header.has_width && !header.has_points) return "the header has neither WIDTH nor POINTS";
  if (!header.has_points) header.points = header.width * header.height;
  for (PcdField& field : header.fields) {
    const auto scalar = scalar_of(field.type, field.size);
    if (!scalar) {
      return "TYPE " + std::string(1, field.type) + " of SIZE " + std::to_string(field.size) +
             " is not supported: expected F 4 8, I or U 1 2 4 8";
    }
    // A colour is three bytes in an integer, whatever its declared type.
    field.scalar = field.column != Column::packed_colour ? *scalar : Scalar::u32;
    if (field.column == Column::packed_colour && field.size != 4) field.column = Column::ignored;
    if (field.count != 1) field.column = Column::ignored;
    header.stride += field.bytes();
  }
  return "";
}

Result<PcdHeader> parse_header(std::string_view bytes, const std::string& name) {
  PcdHeader header;
  LineCursor lines(bytes);
  while (header.encoding.empty()) {
    const auto line = lines.next();
    if (!line) return error_at_line(name, lines.number(), "the header ends without DATA");
    const std::string wrong = take_header_line(header, *line);
    if (!wrong.empty()) return error_at_line(name, lines.number(), wrong);
  }
  if (const std::string wrong = check_header(header); !wrong.empty()) {
    return error_at_line(name, lines.number(), wrong);
  }
  header.body = lines.offset();
  header.lines = lines.number();
  return header;
}

/// Point i of field f is at base[f] + i * step[f].
void add_binary(const PcdHeader& header, const char* data, bool by_field, CloudBuilder& builder) {
  struct Source {
    const char* at;
    std::uint64_t step;
    std::size_t column;
    Scalar scalar;
  };
  std::vector<Source> sources;
  for (const PcdField& field : header.fields) {
    if (field.column != Column::ignored) {
      const std::uint64_t step = by_field ? field.bytes() : header.stride;
      sources.push_back({data, step, static_cast<std::size_t>(field.column), field.scalar});
    }
    data += by_field ? field.bytes() * header.points : field.bytes();
  }
  constexpr bool swap = std::endian::native == std::endian::big;
  Record record{};
  for (std::uint64_t i = 0; i < header.points; ++i) {
    for (Source& source : sources) {
      record[source.column] = load(source.at, source.scalar, swap);
      source.at += source.step;
    }
    builder.add(record);
  }
}

Status read_binary(std::string_view bytes, const PcdHeader& header, CloudBuilder& builder) {
  if (header.points > (bytes.size() - header.body) / header.stride) {
    return error_at_byte(builder.name(), bytes.size(),
                         "the file ends; its header declares " + std::to_string(header.points) +
                             " points of " + std::to_string(header.stride) + " bytes from byte " +
                             std::to_string(header.body));
  }
  if (Status status = builder.reserve(header.points); !status) return status;
  add_binary(header, bytes.data() + header.body, false, builder);
  return {};
}

Status read_compressed(std::string_view bytes, const PcdHeader& header, CloudBuilder& builder) {
  const std::string& name = builder.name();
  const std::string_view body = bytes.substr(header.body);
  if (body.size() < 8)
    return error_at_byte(name, bytes.size(), "the file ends; expected two sizes of 4 bytes");
  constexpr bool swap = std::endian::native == std::endian::big;
  const auto packed = static_cast<std::uint64_t>(load(body.data(), Scalar::u32, swap));
  const auto unpacked = static_cast<std::uint64_t>(load(body.data() + 4, Scalar::u32, swap));
  if (packed > body.size() - 8) {
    return error_at_byte(name, header.body,
                         "the header declares a compressed block of " + std::to_string(packed) +
                             " bytes, the file has " + std::to_string(body.size() - 8) + " more");
  }
  if (unpacked / header.stride != header.points || unpacked % header.stride != 0) {
    return error_at_byte(name, header.body + 4,
                         "the block unpacks to " + std::to_string(unpacked) + " bytes, which are not " +
                             std::to_string(header.points) + " points of " + std::to_string(header.stride));
  }
  if (unpacked > packed * kLzfMaxRatio) {
    return error_at_byte(
        name, header.body + 4,
        "the block cannot unpack from " + std::to_string(packed) + " bytes to " + std::to_string(unpacked));
  }
  if (Status status = builder.reserve(header.points, unpacked); !status) return status;
  const auto block = lzf_decompress(body.substr(8, packed), unpacked);
  if (!block) return error_at_byte(name, header.body + 8, block.error().message);
  add_binary(header, block->data(), true, builder);
  return {};
}

/// A colour as text: an integer, or the float with the same bits.
std::optional<double> packed_colour(std::string_view word, char type) {
  if (type != 'F') return parse_number<double>(word);
  const auto number = parse_number<float>(word);
  return number ? std::optional<double>(std::bit_cast<std::uint32_t>(*number)) : std::nullopt;
}

std::string take_line(const PcdHeader& header, std::string_view line, Record& record) {
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const PcdField& field = header.fields[f];
    for (std::uint64_t i = 0; i < field.count; ++i) {
      const std::string_view word = next_token(line);
      const auto number = field.column == Column::packed_colour ? packed_colour(word, field.type)
                                                                : parse_number<double>(word);
      if (!number) return "expected a number for field " + std::to_string(f + 1) + ", not " + in_quotes(word);
      if (field.column != Column::ignored) record[static_cast<std::size_t>(field.column)] = *number;
    }
  }
  return "";
}

Status read_ascii(std::string_view bytes, const PcdHeader& header, CloudBuilder& builder) {
  std::uint64_t words = 0;
  for (const PcdField& field : header.fields) words += field.count;
  if (header.points > (bytes.size() - header.body + 1) / (2 * words)) {
    return error_at_byte(builder.name(), bytes.size(),
                         "the file ends; its header declares " + std::to_string(header.points) +
                             " lines of " + std::to_string(words) + " numbers from byte " +
                             std::to_string(header.body));
  }
  if (Status status = builder.reserve(header.points); !status) return status;
  LineCursor lines(bytes, header.body, header.lines);
  Record record{};
  for (std::uint64_t i = 0; i < header.points; ++i) {
    const auto line = lines.next();
    if (!line) {
      return error_at_byte(
          builder.name(), bytes.size(),
          "the file ends after " + std::to_string(i) + " of " + std::to_string(header.points) + " points");
    }
    const std::string wrong = take_line(header, *line, record);
    if (!wrong.empty()) return error_at_line(builder.name(), lines.number(), wrong);
    builder.add(record);
  }
  return {};
}

}  // namespace

Result<ScanFile> parse_pcd(std::string_view bytes, CloudBuilder builder) {
  const auto header = parse_header(bytes, builder.name());
  if (!header) return header.error();
  for (const PcdField& field : header->fields) builder.declare(field.column, field.scalar);
  if (!builder.has(Column::x) || !builder.has(Column::y) || !builder.has(Column::z)) {
    return error_at_line(builder.name(), header->lines, "FIELDS has no x, y and z");
  }
  const bool has_viewpoint = header->viewpoint != PcdHeader{}.viewpoint;
  if (has_viewpoint) builder.add_viewpoint(header->viewpoint.head<3>());
  const auto read = header->encoding == "ascii"    ? read_ascii
                    : header->encoding == "binary" ? read_binary
                                                   : read_compressed;
  if (Status status = read(bytes, *header, builder); !status) return status.error();
  return builder.finish();
}

}  // namespace parhelion::cloud
