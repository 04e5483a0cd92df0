#include <bit>
#include <limits>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"
#include "fusion/cloud/ply_header.hpp"

namespace parhelion::cloud {
namespace {

/// Body of a PLY file: skips the elements before the vertices and passes the vertices to the builder.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, const PlyHeader& header, CloudBuilder& builder)
      : bytes_(bytes), header_(header), builder_(builder), at_(header.body) {
    swap_ =
        (header.encoding == PlyHeader::Encoding::big_endian) == (std::endian::native == std::endian::little);
  }

  Status read_binary() {
    for (const PlyElement& element : header_.elements) {
      const bool vertices = &element == &header_.elements.back();
      const std::uint64_t min_bytes_each = element.min_bytes();
      if (min_bytes_each > 0 && element.count > (bytes_.size() - at_) / min_bytes_each)
        return too_many(element);
      if (vertices) {
        if (Status status = builder_.reserve(element.count); !status) return status;
      }
      if (!element.has_lists()) {
        if (vertices) add_fixed(element, min_bytes_each);
        at_ += element.count * min_bytes_each;
        continue;
      }
      for (std::uint64_t i = 0; i < element.count; ++i) {
        if (!take_record(element)) return cut(element, i);
        if (vertices) builder_.add(record_);
      }
    }
    return {};
  }

  Status read_ascii() {
    LineCursor lines(bytes_, header_.body, header_.lines);
    for (const PlyElement& element : header_.elements) {
      const bool vertices = &element == &header_.elements.back();
      if (element.properties.empty()) continue;
      // A record has at least a digit and a separator for each property; the last may lack its end of line.
      const std::uint64_t min_bytes_each = 2 * element.properties.size();
      if (element.count > (bytes_.size() - lines.offset() + 1) / min_bytes_each) return too_many(element);
      if (vertices) {
        if (Status status = builder_.reserve(element.count); !status) return status;
      }
      for (std::uint64_t i = 0; i < element.count; ++i) {
        std::optional<std::string_view> line = lines.next();
        while (line && line->find_first_not_of(" \t") == std::string_view::npos) line = lines.next();
        if (!line) return cut(element, i);
        if (const std::string wrong = read_values(element, *line); !wrong.empty()) {
          return error_at_line(builder_.name(), lines.number(), wrong);
        }
        if (vertices) builder_.add(record_);
      }
    }
    return {};
  }

 private:
  Error too_many(const PlyElement& element) const {
    return error_at_byte(builder_.name(), bytes_.size(),
                         "the file ends; its header declares " + std::to_string(element.count) +
                             " elements " + in_quotes(element.name) + " of at least " +
                             std::to_string(element.min_bytes()) + " bytes from byte " + std::to_string(at_));
  }
  Error cut(const PlyElement& element, std::uint64_t index) const {
    return error_at_byte(builder_.name(), bytes_.size(),
                         "the file ends in element " + in_quotes(element.name) + " number " +
                             std::to_string(index) + " of " + std::to_string(element.count));
  }

  /// Records of equal length, all inside the file.
  void add_fixed(const PlyElement& element, std::uint64_t stride) {
    struct Field {
      std::size_t offset, column;
      Scalar type;
    };
    std::vector<Field> fields;
    std::size_t offset = 0;
    for (const PlyProperty& property : element.properties) {
      if (property.column != Column::ignored) {
        fields.push_back({offset, static_cast<std::size_t>(property.column), property.type});
      }
      offset += size_of(property.type);
    }
    const char* record = bytes_.data() + at_;
    for (std::uint64_t i = 0; i < element.count; ++i, record += stride) {
      for (const Field& field : fields)
        record_[field.column] = load(record + field.offset, field.type, swap_);
      builder_.add(record_);
    }
  }

  /// One record with lists; false where the file ends or a length is negative.
  bool take_record(const PlyElement& element) {
    for (const PlyProperty& property : element.properties) {
      const std::size_t size = size_of(property.type);
      if (!property.count) {
        if (bytes_.size() - at_ < size) return false;
        if (property.column != Column::ignored) {
          record_[static_cast<std::size_t>(property.column)] =
              load(bytes_.data() + at_, property.type, swap_);
        }
        at_ += size;
        continue;
      }
      if (bytes_.size() - at_ < size_of(*property.count)) return false;
      const double length = load(bytes_.data() + at_, *property.count, swap_);
      at_ += size_of(*property.count);
      const std::size_t longest = (bytes_.size() - at_) / size;
      if (length < 0 || length > static_cast<double>(longest)) return false;
      at_ += static_cast<std::size_t>(length) * size;
    }
    return true;
  }

  /// One line; empty, or what was expected.
  std::string read_values(const PlyElement& element, std::string_view line) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      const std::string_view word = next_token(line);
      const auto number = parse_number<double>(word);
      if (!number) {
        return "expected a number for property " + std::to_string(i + 1) + " of " +
               std::to_string(element.properties.size()) + ", not " + in_quotes(word);
      }
      if (property.count) {
        // The length is bounded by the number of words present.
        double left = *number;
        while (left >= 1) {
          if (next_token(line).empty()) return "a list is shorter than its length of " + in_quotes(word);
          left -= 1;
        }
      } else if (property.column != Column::ignored) {
        record_[static_cast<std::size_t>(property.column)] = *number;
      }
    }
    return "";
  }

  std::string_view bytes_;
  const PlyHeader& header_;
  CloudBuilder& builder_;
  std::size_t at_;
  bool swap_ = false;
  Record record_{};
};

}  // namespace

Result<ScanFile> parse_ply(std::string_view bytes, CloudBuilder builder) {
  const auto header = parse_ply_header(bytes, builder.name());
  if (!header) return header.error();
  for (const PlyProperty& property : header->elements.back().properties) {
    builder.declare(property.column, property.type);
  }
  if (!builder.has(Column::x) || !builder.has(Column::y) || !builder.has(Column::z)) {
    return error_at_line(builder.name(), header->lines, "element vertex has no properties x, y and z");
  }
  for (const Eigen::Vector3d& viewpoint : header->viewpoints) builder.add_viewpoint(viewpoint);
  PlyBody body(bytes, *header, builder);
  const Status status =
      header->encoding == PlyHeader::Encoding::ascii ? body.read_ascii() : body.read_binary();
  if (!status) return status.error();
  return builder.finish();
}

}  // namespace parhelion::cloud
