// Writes YAML that the readers of this folder read back to the same values.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocols/yaml/quantity.hpp"

namespace parhelion::yaml {

class Writer {
 public:
  void text(std::string_view key, std::string_view value) { line(key, quote(value)); }
  /// A list in one line; nothing if it is empty.
  void texts(std::string_view key, const std::vector<std::string>& values);
  void word(std::string_view key, std::string_view value) { line(key, value); }
  void flag(std::string_view key, bool value) { line(key, value ? "true" : "false"); }
  template <class Integer>
  void integer(std::string_view key, Integer value) {
    line(key, std::to_string(value));
  }
  template <class Number>
  void number(std::string_view key, Number value) {
    line(key, format_number(value));
  }
  template <class Number>
  void quantity(std::string_view key, Number value, Quantity quantity) {
    line(key, format_quantity(value, quantity));
  }
  /// Keys or items between open and close are indented one level deeper.
  void open(std::string_view key);
  void close() { --depth_; }
  /// The next line starts an item of a list; its keys are indented one level deeper until end_item.
  void begin_item();
  void end_item() { --depth_; }
  /// "key: value" with the value as YAML.
  void line(std::string_view key, std::string_view value);
  /// "key: tag |" and the text below it, in lines of `width` characters. Printable ASCII without spaces only;
  /// empty text is written as "".
  void block(std::string_view key, std::string_view tag, std::string_view text, std::size_t width);
  /// "- value" with the value as YAML.
  void item(std::string_view value);

  std::string take() { return std::move(text_); }

  /// Unquoted where that is safe, else in double quotes.
  static std::string quote(std::string_view text);

 private:
  void indent();
  std::string text_;
  int depth_ = 0;
  bool dash_ = false;
};

}  // namespace parhelion::yaml
