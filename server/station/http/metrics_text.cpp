#include "server/station/http/metrics_text.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace parhelion::station {
namespace {

std::string escaped(const std::string& text, bool quoted) {
  std::string safe;
  for (const char c : text) {
    if (c == '\\') {
      safe += "\\\\";
    } else if (c == '\n') {
      safe += "\\n";
    } else if (c == '"' && quoted) {
      safe += "\\\"";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

}  // namespace

void MetricsText::gauge(const std::string& name, const std::string& help, double value,
                        const Labels& labels) {
  add(name, "gauge", help, value, labels);
}

void MetricsText::counter(const std::string& name, const std::string& help, double value,
                          const Labels& labels) {
  add(name, "counter", help, value, labels);
}

void MetricsText::add(const std::string& name, const char* kind, const std::string& help, double value,
                      const Labels& labels) {
  std::string& family = families_[name];
  if (family.empty()) {
    order_.push_back(name);
    family = "# HELP " + name + " " + escaped(help, false) + "\n# TYPE " + name + " " + kind + "\n";
  }
  family += name;
  const char* separator = "{";
  for (const auto& [key, label] : labels) {
    family += separator + key + "=\"" + escaped(label, true) + "\"";
    separator = ",";
  }
  family += (labels.empty() ? " " : "} ") + number(value) + "\n";
}

std::string MetricsText::text() const {
  std::string all;
  for (const std::string& name : order_) all += families_.at(name);
  return all;
}

}  // namespace parhelion::station
