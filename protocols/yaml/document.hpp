// A YAML document as a tree with line numbers. Only what configuration needs: one document, no anchors, no
// aliases.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::yaml {

struct Node {
  enum class Kind : std::uint8_t { null, scalar, list, map };
  Kind kind = Kind::null;
  bool quoted = false;  ///< a scalar in quotes: always text
  bool binary = false;  ///< a scalar tagged !!binary: base64
  int line = 0;         ///< from 1
  std::string text;     ///< of a scalar
  double number = 0;    ///< of a scalar that is a number in the schema; SI if it has a unit. Set by check()
  bool is_number = false;
  std::vector<Node> items;        ///< of a list; of a map, in file order
  std::vector<std::string> keys;  ///< of a map: one per item
  std::vector<int> key_lines;

  /// The value of a key, or nullptr.
  const Node* find(std::string_view key) const;
  Node* find(std::string_view key);
};

/// Problems of a document as text; the message of the Error has one "origin:line: text" for each.
class Problems {
 public:
  explicit Problems(std::string origin) : origin_(std::move(origin)) {}
  void add(int line, std::string words);
  bool empty() const { return problems_.empty(); }
  /// Sorted by line, at most ten.
  Error error() const;

 private:
  struct Problem {
    int line = 0;
    std::string words;
  };
  std::string origin_;
  std::vector<Problem> problems_;
};

/// Error: a zero byte, which no text has. Names an LCM log as what it is.
Status check_text(std::string_view text, const std::string& origin);

/// Reads one document. Rejected, with the line: invalid YAML or UTF-8, anchors and aliases, tags (except
/// !!binary), a duplicate key, a second document, more than 32 MiB or 500,000 values, nesting deeper than 32.
Result<Node> read_document(const std::string& text, const std::string& origin);

/// The text of a file, or why it cannot be read. Pipes and devices are refused.
Result<std::string> read_text(const std::string& path);

/// Why the file has no document, as of read_text() and read_document(). For files that a library parses,
/// whose errors name neither the file nor what was expected.
Status check_file(const std::string& path);

}  // namespace parhelion::yaml
