#include "protocols/yaml/ranges.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include "protocols/hash.hpp"
#include "protocols/splitmix64.hpp"
#include "protocols/yaml/quantity.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

struct Measure {
  double number = 0;
  std::string unit;    ///< with the separator from the number
  bool whole = false;  ///< neither unit nor decimal point
};

std::optional<Measure> measure_of(const Node* node) {
  if (!node || node->kind != Node::Kind::scalar || node->quoted) return std::nullopt;
  const std::string& text = node->text;
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  Measure measure;
  const auto [end, fault] = std::from_chars(begin, text.data() + text.size(), measure.number);
  if (fault != std::errc{} || !std::isfinite(measure.number)) return std::nullopt;
  measure.unit = text.substr(static_cast<std::size_t>(end - text.data()));
  measure.whole = measure.unit.empty() && text.find_first_of(".eE") == std::string::npos;
  return measure;
}

/// In [0, 1): a function of the seed and the key alone.
double draw(std::uint64_t seed, const std::string& key) {
  return unit_interval(splitmix64(fnv1a(key) + (seed + 1) * kSplitMix64Increment));
}

bool is_range(const Node& node) {
  return node.kind == Node::Kind::map && node.keys.size() == 2 && node.find("from") && node.find("to");
}

class Drawing {
 public:
  Drawing(std::uint64_t seed, Problems& problems) : seed_(seed), problems_(problems) {}

  void visit(Node& node, const std::string& key) {
    if (is_range(node)) return replace(node, key);
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      const std::string part = node.kind == Node::Kind::map ? node.keys[i] : std::to_string(i);
      visit(node.items[i], key.empty() ? part : key + "." + part);
    }
  }
  std::vector<DrawnValue> take() { return std::move(drawn_); }

 private:
  void replace(Node& node, const std::string& key) {
    const auto from = measure_of(node.find("from")), to = measure_of(node.find("to"));
    if (!from || !to || from->unit != to->unit || !(from->number <= to->number)) {
      problems_.add(node.line,
                    "'" + printable(key) +
                        "': expected a range of two numbers with the same unit, the smaller first, "
                        "such as {from: 0.3 m/s, to: 0.8 m/s}");
      return;
    }
    const double u = draw(seed_, key);
    const bool whole = from->whole && to->whole;
    const double value = whole ? from->number + std::floor(u * (to->number - from->number + 1))
                               : from->number + u * (to->number - from->number);
    Node single;
    single.kind = Node::Kind::scalar;
    single.line = node.line;
    single.text = format_number(value) + from->unit;
    drawn_.push_back({key, node.find("from")->text, node.find("to")->text, single.text});
    node = std::move(single);
  }

  std::uint64_t seed_;
  Problems& problems_;
  std::vector<DrawnValue> drawn_;
};

}  // namespace

std::vector<DrawnValue> draw_ranges(Node& root, std::uint64_t seed, Problems& problems) {
  Drawing drawing(seed, problems);
  drawing.visit(root, "");
  return drawing.take();
}

}  // namespace parhelion::yaml
