#include "protocols/yaml/writer.hpp"

#include <algorithm>
#include <cctype>

namespace parhelion::yaml {
namespace {

bool is_plain_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.' || c == '/' ||
         c == ' ';
}

/// Words that start with a letter and contain nothing that YAML could read as syntax, null or a number.
bool is_plain(std::string_view text) {
  if (text.empty() || std::isalpha(static_cast<unsigned char>(text[0])) == 0 || text.back() == ' ')
    return false;
  return text != "null" && std::all_of(text.begin(), text.end(), is_plain_character);
}

}  // namespace

std::string Writer::quote(std::string_view text) {
  if (is_plain(text)) return std::string(text);
  static constexpr char hex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (c == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7F) {
      out += {'\\', 'x', hex[byte >> 4U], hex[byte & 15U]};
    } else {
      out += c;
    }
  }
  return out + '"';
}

void Writer::indent() {
  if (dash_) {
    text_.append(2 * static_cast<std::size_t>(depth_ - 1), ' ');
    text_ += "- ";
    dash_ = false;
  } else {
    text_.append(2 * static_cast<std::size_t>(depth_), ' ');
  }
}

void Writer::open(std::string_view key) {
  indent();
  text_.append(key).append(":\n");
  ++depth_;
}

void Writer::begin_item() {
  ++depth_;
  dash_ = true;
}

void Writer::line(std::string_view key, std::string_view value) {
  indent();
  text_.append(key).append(": ").append(value) += '\n';
}

void Writer::texts(std::string_view key, const std::vector<std::string>& values) {
  if (values.empty()) return;
  std::string list;
  for (const std::string& value : values) list += (list.empty() ? "[" : ", ") + quote(value);
  line(key, list + "]");
}

void Writer::block(std::string_view key, std::string_view tag, std::string_view text, std::size_t width) {
  line(key, std::string(tag) + (text.empty() ? " \"\"" : " |"));
  for (std::size_t i = 0; i < text.size(); i += width) {
    text_.append(2 * static_cast<std::size_t>(depth_ + 1), ' ');
    text_.append(text.substr(i, width)) += '\n';
  }
}

void Writer::item(std::string_view value) {
  indent();
  text_.append("- ").append(value) += '\n';
}

}  // namespace parhelion::yaml
