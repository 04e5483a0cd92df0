#include "fusion/cloud/ply_header.hpp"

#include <array>
#include <utility>

#include "fusion/cloud/cloud_text.hpp"

namespace parhelion::cloud {
namespace {

std::optional<Scalar> scalar_named(std::string_view name) {
  static constexpr std::pair<std::string_view, Scalar> names[] = {
      {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
      {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
      {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
      {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64}};
  for (const auto& [known, scalar] : names) {
    if (known == name) return scalar;
  }
  return std::nullopt;
}

/// Parses the lines of one header in order.
class HeaderLines {
 public:
  explicit HeaderLines(PlyHeader& header) : header_(header) {}

  /// Empty where the line was parsed; else what was expected.
  std::string take(std::string_view line) {
    const std::string_view keyword = next_token(line);
    if (keyword == "format") return format(line);
    if (keyword == "element") return element(line);
    if (keyword == "property") return property(line);
    if (keyword == "comment") return comment(line);
    if (keyword == "obj_info" || keyword.empty()) return "";
    return "expected format, element, property, comment or end_header, not " + in_quotes(keyword);
  }
  bool has_format() const { return has_format_; }

 private:
  std::string format(std::string_view words) {
    const std::string_view encoding = next_token(words);
    if (encoding == "ascii") {
      header_.encoding = PlyHeader::Encoding::ascii;
    } else if (encoding == "binary_little_endian") {
      header_.encoding = PlyHeader::Encoding::little_endian;
    } else if (encoding == "binary_big_endian") {
      header_.encoding = PlyHeader::Encoding::big_endian;
    } else {
      return "expected ascii, binary_little_endian or binary_big_endian, not " + in_quotes(encoding);
    }
    has_format_ = true;
    return "";
  }

  std::string element(std::string_view words) {
    PlyElement element;
    element.name = next_token(words);
    const std::string_view word = next_token(words);
    const auto count = parse_number<std::uint64_t>(word);
    if (!count)
      return "expected the number of elements " + in_quotes(element.name) + ", not " + in_quotes(word);
    element.count = *count;
    header_.elements.push_back(std::move(element));
    return "";
  }

  std::string property(std::string_view words) {
    if (header_.elements.empty()) return "property before the first element";
    PlyProperty property;
    std::string_view type = next_token(words);
    if (type == "list") {
      const std::string_view count = next_token(words);
      property.count = scalar_named(count);
      if (!property.count || *property.count >= Scalar::f32) {
        return "expected an integer type for the length of a list, not " + in_quotes(count);
      }
      type = next_token(words);
    }
    const auto scalar = scalar_named(type);
    if (!scalar) return "expected a type such as float or uchar, not " + in_quotes(type);
    property.type = *scalar;
    if (!property.count) property.column = column_named(next_token(words));
    if (property.column == Column::packed_colour) property.column = Column::ignored;
    header_.elements.back().properties.push_back(property);
    return "";
  }

  /// "comment viewpoint i x y z" as written by write_ply; other comments are ignored.
  std::string comment(std::string_view words) {
    if (next_token(words) != "viewpoint") return "";
    const auto index = parse_number<std::size_t>(next_token(words));
    std::array<std::optional<double>, 3> p;
    for (auto& coordinate : p) coordinate = parse_number<double>(next_token(words));
    if (index != header_.viewpoints.size() || !p[0] || !p[1] || !p[2]) return "";
    const Eigen::Vector3d viewpoint(*p[0], *p[1], *p[2]);
    if (viewpoint.allFinite()) header_.viewpoints.push_back(viewpoint);
    return "";
  }

  PlyHeader& header_;
  bool has_format_ = false;
};

}  // namespace

bool PlyElement::has_lists() const {
  for (const PlyProperty& property : properties) {
    if (property.count) return true;
  }
  return false;
}

std::uint64_t PlyElement::min_bytes() const {
  std::uint64_t bytes = 0;
  for (const PlyProperty& property : properties) bytes += size_of(property.count.value_or(property.type));
  return bytes;
}

Result<PlyHeader> parse_ply_header(std::string_view bytes, const std::string& name) {
  LineCursor lines(bytes);
  if (lines.next() != "ply") return error_at_line(name, 1, "expected \"ply\"");
  PlyHeader header;
  HeaderLines parsed(header);
  std::optional<std::string_view> line;
  while ((line = lines.next()) && *line != "end_header") {
    const std::string wrong = parsed.take(*line);
    if (!wrong.empty()) return error_at_line(name, lines.number(), wrong);
  }
  if (!line) return error_at_line(name, lines.number(), "the header ends without end_header");
  if (!parsed.has_format()) return error_at_line(name, lines.number(), "the header has no format");
  header.body = lines.offset();
  header.lines = lines.number();
  while (!header.elements.empty() && header.elements.back().name != "vertex") header.elements.pop_back();
  if (header.elements.empty()) return error_at_line(name, lines.number(), "the header has no element vertex");
  return header;
}

}  // namespace parhelion::cloud
