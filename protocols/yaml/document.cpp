#include "protocols/yaml/document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <unordered_map>

#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{32} << 20U;
constexpr std::size_t kMaxNodes = 500'000;  // a model of 50,000 entities
constexpr std::size_t kMaxDepth = 32;

/// Carries a rejection out of yaml-cpp's parser; never leaves this file.
struct Refusal {
  int line;
  std::string words;
};

/// Builds the tree from yaml-cpp's events, which precede any expansion of aliases: an alias bomb is rejected
/// at its first anchor.
class TreeBuilder : public YAML::EventHandler {
 public:
  Node root;

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make(Node::Kind::null, mark, "", anchor));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { throw Refusal{line_of(mark), kNoAnchors}; }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    Node node = make(Node::Kind::scalar, mark, tag, anchor);
    node.text = value;
    node.quoted = tag == "!";
    const bool is_null = !node.quoted && !node.binary && (value.empty() || value == "~" || value == "null");
    if (is_null && !key_expected()) node.kind = Node::Kind::null;
    add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(make(Node::Kind::list, mark, tag, anchor));
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(make(Node::Kind::map, mark, tag, anchor));
  }
  void OnMapEnd() override { close(); }

 private:
  static constexpr const char* kNoAnchors =
      "anchors and aliases (&, *) are not used in these files: write the value out";

  static constexpr std::string_view kBinaryTag = "tag:yaml.org,2002:binary";

  static int line_of(const YAML::Mark& mark) { return mark.line + 1; }

  Node make(Node::Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    if (anchor != 0) throw Refusal{line_of(mark), kNoAnchors};
    if (++nodes_ > kMaxNodes)
      throw Refusal{line_of(mark),
                    "more than " + std::to_string(kMaxNodes) + " values: not a configuration file"};
    const bool binary = tag == kBinaryTag && kind == Node::Kind::scalar;
    if (!tag.empty() && tag != "?" && tag != "!" && !binary) {
      throw Refusal{line_of(mark), "tags (" + printable(tag) + ") are not used in these files"};
    }
    Node node;
    node.binary = binary;
    node.kind = kind;
    node.line = line_of(mark);
    return node;
  }

  bool key_expected() const {
    return !open_.empty() && open_.back().kind == Node::Kind::map &&
           open_.back().keys.size() == open_.back().items.size();
  }

  void add(Node node) {
    if (open_.empty()) {
      root = std::move(node);
      return;
    }
    Node& parent = open_.back();
    if (!key_expected()) {
      parent.items.push_back(std::move(node));
    } else if (node.kind == Node::Kind::scalar && !node.binary) {
      parent.key_lines.push_back(node.line);
      parent.keys.push_back(std::move(node.text));
    } else {
      throw Refusal{node.line, "a key must be plain text"};
    }
  }

  void open(Node node) {
    if (key_expected()) throw Refusal{node.line, "a key must be plain text"};
    if (open_.size() >= kMaxDepth) throw Refusal{node.line, "nested too deeply (more than 32 levels)"};
    open_.push_back(std::move(node));
  }

  void close() {
    Node node = std::move(open_.back());
    open_.pop_back();
    refuse_duplicates(node);
    add(std::move(node));
  }

  static void refuse_duplicates(const Node& map) {
    std::unordered_map<std::string_view, int> first;
    for (std::size_t i = 0; i < map.keys.size(); ++i) {
      const auto [known, inserted] = first.emplace(map.keys[i], map.key_lines[i]);
      if (!inserted) {
        throw Refusal{map.key_lines[i], "key '" + printable(map.keys[i]) +
                                            "' is a duplicate (first in line " +
                                            std::to_string(known->second) + ")"};
      }
    }
  }

  std::vector<Node> open_;
  std::size_t nodes_ = 0;
};

Error error_at(const std::string& origin, int line, const std::string& words) {
  Problems problems(origin);
  problems.add(line, words);
  return problems.error();
}

/// The first line, up to `last`, with a tab before its content; 0: none.
int line_with_tab(const std::string& text, int last) {
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; number <= last && std::getline(lines, line); ++number) {
    const std::size_t content = line.find_first_not_of(" -\t");
    if (content != std::string::npos && line.find('\t') < content) return number;
  }
  return 0;
}

template <class Container>
auto find_key(Container& node, std::string_view key) -> decltype(&node.items.front()) {
  const auto found = std::find(node.keys.begin(), node.keys.end(), key);
  return found == node.keys.end() ? nullptr
                                  : &node.items[static_cast<std::size_t>(found - node.keys.begin())];
}

}  // namespace

const Node* Node::find(std::string_view key) const { return find_key(*this, key); }
Node* Node::find(std::string_view key) { return find_key(*this, key); }

void Problems::add(int line, std::string words) { problems_.push_back({line, std::move(words)}); }

Error Problems::error() const {
  std::vector<Problem> sorted = problems_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Problem& a, const Problem& b) { return a.line < b.line; });
  constexpr std::size_t shown = 10;
  std::string message;
  for (std::size_t i = 0; i < std::min(sorted.size(), shown); ++i) {
    if (i > 0) message += '\n';
    message += origin_ + ':' + std::to_string(sorted[i].line) + ": " + sorted[i].words;
  }
  if (sorted.size() > shown) message += "\n... and " + std::to_string(sorted.size() - shown) + " more";
  return {message};
}

Status check_text(std::string_view text, const std::string& origin) {
  if (text.find('\0') == std::string_view::npos) return {};
  return Error{origin +
               (text.starts_with("\xED\xA1\xDA\x01")
                    ? ": an LCM log, expected a YAML file; `play`, `replay` and `topic --log` read logs"
                    : ": a binary file, expected a YAML file")};
}

Result<Node> read_document(const std::string& text, const std::string& origin) {
  if (text.size() > kMaxBytes) return error_at(origin, 1, "larger than 32 MiB: not a configuration file");
  if (const Status is_text = check_text(text, origin); !is_text) return is_text.error();
  if (const auto bad = find_invalid_utf8(text)) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(*bad), '\n');
    return error_at(origin, static_cast<int>(line),
                    "not UTF-8 text (byte " + std::to_string(*bad) + " of the file): save it as UTF-8");
  }
  TreeBuilder builder;
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) return error_at(origin, 1, "the file is empty");
    TreeBuilder rest;
    if (parser.HandleNextDocument(rest))
      return error_at(origin, rest.root.line, "a second document: one is expected");
  } catch (const Refusal& refusal) {
    return error_at(origin, refusal.line, refusal.words);
  } catch (const YAML::Exception& fault) {
    const int line = fault.mark.line + 1;
    if (const int tab = line_with_tab(text, line); tab > 0)
      return error_at(origin, tab, "not YAML: a tab before the content; indent with spaces");
    return error_at(origin, line,
                    "not YAML: " + fault.msg +
                        "; look here and in the line before for a missing ':', an open bracket or quote, or "
                        "another indentation");
  }
  return std::move(builder.root);
}

Result<std::string> read_text(const std::string& path) {
  // A pipe or a device could keep the reader waiting for ever.
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (std::filesystem::is_directory(status)) return Error{path + ": is a folder, expected a file"};
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return Error{path + ": is a pipe or a device, expected a file"};
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  std::string text;
  char block[1 << 16];
  while (file.read(block, sizeof block), file.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMaxBytes) return Error{path + ": larger than 32 MiB: not a configuration file"};
  }
  if (file.bad()) return Error{path + ": cannot be read: " + std::strerror(errno)};
  return text;
}

Status check_file(const std::string& path) {
  const auto text = read_text(path);
  if (!text) return text.error();
  const auto document = read_document(*text, path);
  return document ? Status() : Status(document.error());
}

}  // namespace parhelion::yaml
